#pragma once
// The wall around one frame's time: what rays meet, how it looks there, and where its points go.

#include <memory>
#include <string>
#include <vector>

#include "render/raycaster.h"
#include "render/surface.h"

namespace rugae {

using Positions = std::shared_ptr<const std::vector<Vec3>>;  // of the vertices, mm

class Wall {
 public:
  /// Keeps still. `device` is the Raycaster's; no result depends on it.
  explicit Wall(Surface surface, const std::string& device = {});
  /// The wall of `rest` (which must outlive it) with its vertices elsewhere. Between the moments
  /// `before`, `now` and `after`, a beat apart, they move as VertexMotion says; without the first
  /// and the last they stay at `now`. Normals for shading are those of `now`.
  Wall(const Wall& rest, Positions now, Positions before, Positions after);
  Wall(const Wall&) = delete;

  const Surface& surface() const { return surface_; }
  const Raycaster& raycaster() const { return raycaster_; }
  bool moves() const { return vertices_.moves(); }

  /// Unit normal of a triangle by its winding; zero for a triangle without area.
  Vec3 geometric_normal(int triangle, double beat) const;
  /// The place of a point of the wall given by its triangle.
  Vec3 point(const Hit& hit, double beat) const;

 private:
  TriangleMesh moved_;  // empty for a wall at rest
  Positions now_, before_, after_;
  VertexMotion vertices_;
  Surface surface_;
  Raycaster raycaster_;
};

}  // namespace rugae
