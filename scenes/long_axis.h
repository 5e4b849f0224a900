#pragma once
// The long axis of a closed wall of any origin.

#include "core/mesh.h"
#include "scenes/organ_axis.h"

namespace rugae {

/// Along the wall from end to end: the two vertices farthest apart along edges are its ends, the
/// middles of the bands of equal distance from one end are its nodes. The wider end comes first, as
/// the fundus does; the greater curvature is on the outside of the bend.
OrganAxis long_axis(const TriangleMesh& wall);

}  // namespace rugae
