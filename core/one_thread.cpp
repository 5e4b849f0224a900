#include "core/one_thread.h"

#include <omp.h>

namespace rugae {

OneOpenMpThread::OneOpenMpThread() : levels_before_(omp_get_max_active_levels()) {
  omp_set_max_active_levels(0);
}
OneOpenMpThread::~OneOpenMpThread() { omp_set_max_active_levels(levels_before_); }

}  // namespace rugae
