#include "recon/dense/dense_options.h"

#include "core/fields.h"

namespace rugae {

void DenseOptions::check() const { check_fields(*this, "dense"); }

}  // namespace rugae
