#include "bare_embree.h"

#include <embree3/rtcore.h>

#include <limits>
#include <vector>

namespace rugae::bench {

struct BareEmbree::State {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  int packet_size = 4;
  std::size_t rays = 0;
  std::vector<RTCRayHit16> packets16;
  std::vector<RTCRayHit8> packets8;
  std::vector<RTCRayHit4> packets4;

  ~State() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  template <typename Packet>
  void prepare(std::vector<Packet>& packets, std::size_t lanes, const Vec3& origin,
               std::span<const Vec3> directions) {
    packets.resize((directions.size() + lanes - 1) / lanes);
    for (std::size_t i = 0; i < packets.size() * lanes; ++i) {
      const Vec3& d = directions[std::min(i, directions.size() - 1)];
      auto& ray = packets[i / lanes].ray;
      const std::size_t k = i % lanes;
      ray.org_x[k] = static_cast<float>(origin.x());
      ray.org_y[k] = static_cast<float>(origin.y());
      ray.org_z[k] = static_cast<float>(origin.z());
      ray.dir_x[k] = static_cast<float>(d.x());
      ray.dir_y[k] = static_cast<float>(d.y());
      ray.dir_z[k] = static_cast<float>(d.z());
      ray.tnear[k] = 0.0f;
      ray.time[k] = 0.0f;
      ray.mask[k] = ~0u;
      ray.id[k] = ray.flags[k] = 0;
    }
  }

  template <typename Packet, typename Intersect>
  long trace(std::vector<Packet>& packets, std::size_t lanes, Intersect intersect) {
    alignas(64) int active[16];
    std::fill_n(active, 16, -1);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    long met = 0;
    for (Packet& packet : packets) {
      for (std::size_t k = 0; k < lanes; ++k) {
        packet.ray.tfar[k] = std::numeric_limits<float>::infinity();
        packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      }
      intersect(active, scene, &context, &packet);
      for (std::size_t k = 0; k < lanes; ++k)
        met += packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
    }
    return met;
  }
};

BareEmbree::BareEmbree(const TriangleMesh& mesh, const Vec3& origin,
                       std::span<const Vec3> directions)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  rtcSetSceneBuildQuality(s.scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.triangles.size()));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    for (int k = 0; k < 3; ++k) vertices[3 * i + k] = static_cast<float>(mesh.vertices[i][k]);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) indices[3 * i + k] = static_cast<unsigned>(mesh.triangles[i][k]);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(s.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(s.scene);

  if (rtcGetDeviceProperty(s.device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) {
    s.packet_size = 16;
    s.prepare(s.packets16, 16, origin, directions);
  } else if (rtcGetDeviceProperty(s.device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) {
    s.packet_size = 8;
    s.prepare(s.packets8, 8, origin, directions);
  } else {
    s.prepare(s.packets4, 4, origin, directions);
  }
}

BareEmbree::~BareEmbree() = default;

long BareEmbree::trace() {
  State& s = *state_;
  if (s.packet_size == 16) return s.trace(s.packets16, 16, rtcIntersect16);
  if (s.packet_size == 8) return s.trace(s.packets8, 8, rtcIntersect8);
  return s.trace(s.packets4, 4, rtcIntersect4);
}

}  // namespace rugae::bench
