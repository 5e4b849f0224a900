#include "core/one_thread.h"

#include <gtest/gtest.h>
#include <omp.h>

namespace rugae {
namespace {

int threads_of_a_region() {
  int threads = 0;
#pragma omp parallel num_threads(4)
#pragma omp single
  threads = omp_get_num_threads();
  return threads;
}

TEST(OneOpenMpThread, HoldsWhateverIsAskedForAndIsPutBack) {
  ASSERT_EQ(threads_of_a_region(), 4);
  {
    const OneOpenMpThread one;
    EXPECT_EQ(threads_of_a_region(), 1);
  }
  EXPECT_EQ(threads_of_a_region(), 4);
}

}  // namespace
}  // namespace rugae
