#include "render/raycaster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "core/check.h"

namespace rugae {
namespace {

// A point on the wall is hidden when wall is met before this share of its distance from the eye:
// 20 um short of it at 20 mm, well above single precision and below the relief of the wall.
constexpr double kReach = 1.0 - 1e-3;

template <int N>
struct Packet;
template <>
struct Packet<4> {
  using RayHit = RTCRayHit4;
  using Ray = RTCRay4;
  static constexpr auto intersect = rtcIntersect4;
  static constexpr auto occluded = rtcOccluded4;
};
template <>
struct Packet<8> {
  using RayHit = RTCRayHit8;
  using Ray = RTCRay8;
  static constexpr auto intersect = rtcIntersect8;
  static constexpr auto occluded = rtcOccluded8;
};
template <>
struct Packet<16> {
  using RayHit = RTCRayHit16;
  using Ray = RTCRay16;
  static constexpr auto intersect = rtcIntersect16;
  static constexpr auto occluded = rtcOccluded16;
};

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

template <typename Ray>
void set_ray(Ray& ray, int lane, const Vec3& origin, const Vec3& direction, double t_far) {
  ray.org_x[lane] = static_cast<float>(origin.x());
  ray.org_y[lane] = static_cast<float>(origin.y());
  ray.org_z[lane] = static_cast<float>(origin.z());
  ray.dir_x[lane] = static_cast<float>(direction.x());
  ray.dir_y[lane] = static_cast<float>(direction.y());
  ray.dir_z[lane] = static_cast<float>(direction.z());
  ray.tnear[lane] = 0.0f;
  ray.tfar[lane] = static_cast<float>(t_far);
  ray.time[lane] = 0.0f;
  ray.mask[lane] = ~0u;
  ray.id[lane] = 0;
  ray.flags[lane] = 0;
}

// Even the robust traversal lets a ray slip through a corner at times. Rays a little beside it
// propose the triangles around the corner; the exact ray decides.
Hit beside(RTCScene scene, const ExactHit& exact, const Vec3& origin, const Vec3& local_origin,
           const Vec3& direction) {
  constexpr double kBeside = 4e-6;  // rad: some roundings of single precision
  const Vec3 across = direction.unitOrthogonal();
  for (double side : {kBeside, -kBeside}) {
    const Vec3 d = direction + side * across;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit ray{};
    ray.ray = {static_cast<float>(local_origin.x()),
               static_cast<float>(local_origin.y()),
               static_cast<float>(local_origin.z()),
               0.0f,
               static_cast<float>(d.x()),
               static_cast<float>(d.y()),
               static_cast<float>(d.z()),
               0.0f,
               std::numeric_limits<float>::infinity(),
               ~0u,
               0,
               0};
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
    const Hit hit = exact(origin, direction, static_cast<int>(ray.hit.primID), true);
    if (hit.met()) return hit;
  }
  return {};
}

template <int N>
void intersect_packets(RTCScene scene, const ExactHit& exact, const Vec3& origin,
                       const Vec3& local_origin, std::span<const Vec3> directions,
                       std::span<Hit> hits) {
  RTCIntersectContext context = coherent_context();
  for (std::size_t begin = 0; begin < directions.size(); begin += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, directions.size() - begin));
    alignas(64) typename Packet<N>::RayHit packet;
    alignas(64) int active[N];
    for (int lane = 0; lane < N; ++lane) {
      const Vec3 direction = lane < count ? directions[begin + lane] : Vec3::Zero();
      active[lane] = direction.squaredNorm() > 0.0 ? -1 : 0;
      set_ray(packet.ray, lane, local_origin, active[lane] ? direction : Vec3::UnitZ(),
              std::numeric_limits<float>::infinity());
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    Packet<N>::intersect(active, scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane) {
      Hit& hit = hits[begin + lane];
      const Vec3& direction = directions[begin + lane];
      if (!active[lane])
        hit = {};
      else if (packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
        hit = beside(scene, exact, origin, local_origin, direction);
      else
        hit = exact(origin, direction, static_cast<int>(packet.hit.primID[lane]));
    }
  }
}

template <int N>
void occlusion_packets(RTCScene scene, const Vec3& eye, const Vec3& local_eye,
                       std::span<const Vec3> points, std::span<const std::uint8_t> wanted,
                       std::span<std::uint8_t> hidden) {
  RTCIntersectContext context = coherent_context();
  for (std::size_t begin = 0; begin < points.size(); begin += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, points.size() - begin));
    alignas(64) typename Packet<N>::Ray packet;
    alignas(64) int active[N];
    bool any = false;
    for (int lane = 0; lane < N; ++lane) {
      active[lane] = lane < count && wanted[begin + lane] ? -1 : 0;
      any = any || active[lane];
      // The direction keeps its length, so the ray's parameter is the share of the distance.
      set_ray(packet, lane, local_eye,
              active[lane] ? Vec3(points[begin + lane] - eye) : Vec3::UnitZ(), kReach);
    }
    if (any) Packet<N>::occluded(active, scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane)
      hidden[begin + lane] = active[lane] && packet.tfar[lane] < 0.0f;
  }
}

}  // namespace

struct Raycaster::Device {
  const TriangleMesh* mesh;
  ExactHit exact;
  Vec3 center;  // of the bounding box: single precision is finest around zero
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  int packet_size = 4;

  explicit Device(const TriangleMesh& m) : mesh(&m), exact(m), center(bounding_box(m).center()) {}
  ~Device() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

Raycaster::Raycaster(const TriangleMesh& mesh, const std::string& device) {
  check_mesh(mesh, "raycaster");
  device_ = std::make_unique<Device>(mesh);
  Device& d = *device_;
  d.device = rtcNewDevice(device.c_str());
  check(d.device != nullptr, "ray tracing: no device for '{}' (error {})", device,
        static_cast<int>(rtcGetDeviceError(nullptr)));
  if (rtcGetDeviceProperty(d.device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
    d.packet_size = 16;
  else if (rtcGetDeviceProperty(d.device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
    d.packet_size = 8;

  d.scene = rtcNewScene(d.device);
  rtcSetSceneFlags(d.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(d.scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(d.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.triangles.size()));
  check(vertices != nullptr && indices != nullptr, "ray tracing: no memory for {} triangles",
        mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    for (int k = 0; k < 3; ++k)
      vertices[3 * i + k] = static_cast<float>(mesh.vertices[i][k] - d.center[k]);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) indices[3 * i + k] = static_cast<unsigned>(mesh.triangles[i][k]);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(d.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(d.scene);
  const RTCError error = rtcGetDeviceError(d.device);
  check(error == RTC_ERROR_NONE, "ray tracing: building over {} triangles failed (error {})",
        mesh.triangles.size(), static_cast<int>(error));
}

Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;

const TriangleMesh& Raycaster::mesh() const { return *device_->mesh; }
int Raycaster::packet_size() const { return device_->packet_size; }

void Raycaster::intersect(const Vec3& origin, std::span<const Vec3> directions,
                          std::span<Hit> hits) const {
  check(hits.size() == directions.size(), "raycaster: {} hits for {} rays", hits.size(),
        directions.size());
  const Device& d = *device_;
  const Vec3 local = origin - d.center;
  if (d.packet_size == 16)
    intersect_packets<16>(d.scene, d.exact, origin, local, directions, hits);
  else if (d.packet_size == 8)
    intersect_packets<8>(d.scene, d.exact, origin, local, directions, hits);
  else
    intersect_packets<4>(d.scene, d.exact, origin, local, directions, hits);
}

Hit Raycaster::intersect(const Vec3& origin, const Vec3& direction) const {
  Hit hit;
  intersect(origin, {&direction, 1}, {&hit, 1});
  return hit;
}

void Raycaster::hidden_from(const Vec3& eye, std::span<const Vec3> points,
                            std::span<const std::uint8_t> wanted,
                            std::span<std::uint8_t> hidden) const {
  check(wanted.size() == points.size() && hidden.size() == points.size(),
        "raycaster: {} flags and {} answers for {} points", wanted.size(), hidden.size(),
        points.size());
  const Device& d = *device_;
  const Vec3 local = eye - d.center;
  if (d.packet_size == 16)
    occlusion_packets<16>(d.scene, eye, local, points, wanted, hidden);
  else if (d.packet_size == 8)
    occlusion_packets<8>(d.scene, eye, local, points, wanted, hidden);
  else
    occlusion_packets<4>(d.scene, eye, local, points, wanted, hidden);
}

}  // namespace rugae
