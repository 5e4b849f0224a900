#pragma once
// Rays against the wall. This and render/hierarchy alone know the ray tracing library.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "render/exact_hit.h"

namespace rugae {

/// Where a ray starts or a look comes from, and when (see VertexMotion; 0 for walls that keep
/// still).
struct Eye {
  Vec3 position_mm = Vec3::Zero();
  double beat = 0.0;
};

/// How alike neighbours in a list of rays are: it changes the time they take, and no result.
enum class RayOrder { coherent, scattered };

/// Safe to use from many threads at once.
class Raycaster {
 public:
  /// Keeps a reference: the mesh must outlive it. `device` is passed to the ray tracing library,
  /// such as "isa=sse4.2" to restrict its instruction set; no result depends on it.
  explicit Raycaster(const TriangleMesh& mesh, const std::string& device = {});
  /// The triangles of `rest` (which must outlive it), with vertices that are elsewhere or move.
  /// Refits the hierarchy of a Raycaster made so before and destroyed since, if there is one.
  Raycaster(const Raycaster& rest, const VertexMotion& vertices);
  ~Raycaster();
  Raycaster(Raycaster&&) noexcept;

  /// The nearest hit of each ray; one eye for all of them or one for each. Directions are unit
  /// vectors; a zero direction meets nothing. Neighbouring rays should be neighbours in the list.
  void intersect(std::span<const Eye> eyes, std::span<const Vec3> directions, std::span<Hit> hits,
                 RayOrder order = RayOrder::coherent) const;
  void intersect(const Vec3& origin, std::span<const Vec3> directions, std::span<Hit> hits) const;
  Hit intersect(const Vec3& origin, const Vec3& direction) const;

  /// hidden[i] is 1 where wall lies between the eye (one for all, or one for each) and points[i], a
  /// point on the wall at the eye's time, nearer than kReach of the way, and 0 elsewhere. Points of
  /// which `wanted` is 0 are left out and give 0.
  void hidden_from(std::span<const Eye> eyes, std::span<const Vec3> points,
                   std::span<const std::uint8_t> wanted, std::span<std::uint8_t> hidden,
                   RayOrder order = RayOrder::coherent) const;
  void hidden_from(const Vec3& eye, std::span<const Vec3> points,
                   std::span<const std::uint8_t> wanted, std::span<std::uint8_t> hidden) const;

  /// A point on the wall is hidden when wall is met before this share of its distance from the eye:
  /// 20 um short of it at 20 mm, well above single precision and below the relief of the wall.
  static constexpr double kReach = 1.0 - 1e-3;

  int packet_size() const;  // rays traced together: 4, 8 or 16

 private:
  struct Shared;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rugae
