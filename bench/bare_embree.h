#pragma once
// The peer of our geometry pass: the same rays through Embree alone, as its tutorials do it.

#include <memory>
#include <span>

#include "core/mesh.h"

namespace rugae::bench {

/// Single precision, coherent packets of the widest kind the device has, prepared before the clock
/// starts; nothing but the nearest triangle is asked for.
class BareEmbree {
 public:
  BareEmbree(const TriangleMesh& mesh, const Vec3& origin, std::span<const Vec3> directions);
  ~BareEmbree();
  /// Traces all rays anew; returns how many met the mesh.
  long trace();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rugae::bench
