#include "render/hierarchy.h"

#include <tbb/task_arena.h>

#include "core/check.h"

namespace rugae {
namespace {

std::vector<Vec3f> swelling(const std::vector<Vec3>& vertices, const std::vector<Vec3i>& triangles,
                            double swell_mm) {
  std::vector<Vec3f> swell(vertices.size(), Vec3f::Zero());
  for (const Vec3i& t : triangles) {
    const Vec3& a = vertices[t[0]];
    const Vec3f out = (vertices[t[1]] - a).cross(vertices[t[2]] - a).cast<float>();
    for (int k = 0; k < 3; ++k) swell[t[k]] -= out;
  }
  for (Vec3f& s : swell) {
    const float norm = s.norm();
    s *= norm > 0.0f ? static_cast<float>(swell_mm) / norm : 0.0f;
  }
  return swell;
}

void set_vertices(const Hierarchy& h, const VertexLists& lists, const std::vector<Vec3f>& swell,
                  const Vec3& center) {
  for (unsigned step = 0; step < h.steps; ++step) {
    float* out = h.vertices[step];
    for (std::size_t v = 0; v < lists[step]->size(); ++v)
      for (int k = 0; k < 3; ++k)
        *out++ = static_cast<float>((*lists[step])[v][k] - center[k] + swell[v][k]);
  }
}

void commit(const Hierarchy& h, std::size_t triangles, RTCDevice device) {
  // The library's tasks run in the caller's threads; these are not to take up other frames' tasks.
  tbb::this_task_arena::isolate([&] {
    rtcCommitGeometry(h.geometry);
    rtcCommitScene(h.scene);
  });
  const RTCError error = rtcGetDeviceError(device);
  check(error == RTC_ERROR_NONE, "ray tracing: building over {} triangles failed (error {})",
        triangles, static_cast<int>(error));
}

}  // namespace

Hierarchy make_hierarchy(RTCDevice device, const std::vector<Vec3i>& triangles,
                         std::size_t vertex_count, unsigned steps, bool refitted) {
  Hierarchy h;
  h.steps = steps;
  h.scene = rtcNewScene(device);
  rtcSetSceneFlags(
      h.scene, refitted ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(h.scene, steps > 1 ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
  h.geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (refitted) rtcSetGeometryBuildQuality(h.geometry, RTC_BUILD_QUALITY_REFIT);
  rtcSetGeometryTimeStepCount(h.geometry, steps);
  bool filled = true;
  for (unsigned step = 0; step < steps; ++step) {
    h.vertices[step] = static_cast<float*>(
        rtcSetNewGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), vertex_count));
    filled = filled && h.vertices[step];
  }
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), triangles.size()));
  check(filled && indices != nullptr, "ray tracing: no memory for {} triangles", triangles.size());
  for (const Vec3i& t : triangles)
    for (int k = 0; k < 3; ++k) *indices++ = static_cast<unsigned>(t[k]);
  rtcAttachGeometry(h.scene, h.geometry);
  rtcReleaseGeometry(h.geometry);  // the scene holds it
  return h;
}

void place_vertices(const Hierarchy& hierarchy, RTCDevice device, const VertexLists& lists,
                    const std::vector<Vec3i>& triangles, const Vec3& center, double swell_mm) {
  const std::vector<Vec3>& now = *lists[hierarchy.steps / 2];
  set_vertices(hierarchy, lists, swelling(now, triangles, swell_mm), center);
  for (unsigned step = 0; step < hierarchy.steps; ++step)
    rtcUpdateGeometryBuffer(hierarchy.geometry, RTC_BUFFER_TYPE_VERTEX, step);
  commit(hierarchy, triangles.size(), device);
}

}  // namespace rugae
