#pragma once
// Is a lens a plain pinhole, as that of undistorted frames is?

#include "cameras/camera.h"

namespace rugae {

inline bool is_pinhole(const Lens& lens) {
  return lens.model == LensModel::brown_conrady && lens.k1 == 0.0 && lens.k2 == 0.0 &&
         lens.k3 == 0.0 && lens.p1 == 0.0 && lens.p2 == 0.0;
}

}  // namespace rugae
