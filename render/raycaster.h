#pragma once
// Rays against the wall. The only place that knows the ray tracing library.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "render/exact_hit.h"

namespace rugae {

/// Safe to use from many threads at once.
class Raycaster {
 public:
  /// Keeps a reference: the mesh must outlive it. `device` is passed to the ray tracing library,
  /// such as "isa=sse4.2" to restrict its instruction set; no result depends on it.
  explicit Raycaster(const TriangleMesh& mesh, const std::string& device = {});
  ~Raycaster();
  Raycaster(Raycaster&&) noexcept;

  /// The nearest hit of each ray from one origin. Directions are unit vectors; a zero direction
  /// meets nothing. Neighbouring rays should be neighbours in the list.
  void intersect(const Vec3& origin, std::span<const Vec3> directions, std::span<Hit> hits) const;
  Hit intersect(const Vec3& origin, const Vec3& direction) const;

  /// hidden[i] is 1 where wall lies between `eye` and points[i], a point on the wall, and 0
  /// elsewhere. Points of which `wanted` is 0 are left out and give 0.
  void hidden_from(const Vec3& eye, std::span<const Vec3> points,
                   std::span<const std::uint8_t> wanted, std::span<std::uint8_t> hidden) const;

  const TriangleMesh& mesh() const;
  int packet_size() const;  // rays traced together: 4, 8 or 16

 private:
  struct Device;
  std::unique_ptr<Device> device_;
};

}  // namespace rugae
