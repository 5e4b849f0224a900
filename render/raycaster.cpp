#include "render/raycaster.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>

#include "core/check.h"

namespace rugae {
namespace {

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

// The ray tracing library's time of a beat.
float library_time(double beat) { return static_cast<float>(0.5 + 0.5 * beat); }

const Eye& eye_of(std::span<const Eye> eyes, std::size_t ray) {
  return eyes[eyes.size() == 1 ? 0 : ray];
}

template <typename Ray>
void set_ray(Ray& ray, int lane, const Vec3& origin, const Vec3& direction, double t_far,
             double beat) {
  ray.org_x[lane] = static_cast<float>(origin.x());
  ray.org_y[lane] = static_cast<float>(origin.y());
  ray.org_z[lane] = static_cast<float>(origin.z());
  ray.dir_x[lane] = static_cast<float>(direction.x());
  ray.dir_y[lane] = static_cast<float>(direction.y());
  ray.dir_z[lane] = static_cast<float>(direction.z());
  ray.tnear[lane] = 0.0f;
  ray.tfar[lane] = static_cast<float>(t_far);
  ray.time[lane] = library_time(beat);
  ray.mask[lane] = ~0u;
  ray.id[lane] = 0;
  ray.flags[lane] = 0;
}

// Even the robust traversal lets a ray slip through a corner at times. Rays a little beside it
// propose the triangles around the corner; the exact ray decides.
Hit beside(RTCScene scene, const ExactHit& exact, const Eye& eye, const Vec3& local_origin,
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
               library_time(eye.beat),
               std::numeric_limits<float>::infinity(),
               ~0u,
               0,
               0};
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
    const Hit hit =
        exact(eye.position_mm, direction, eye.beat, static_cast<int>(ray.hit.primID), true);
    if (hit.met()) return hit;
  }
  return {};
}

template <int N>
void intersect_packets(RTCScene scene, const ExactHit& exact, const Vec3& center,
                       std::span<const Eye> eyes, std::span<const Vec3> directions,
                       std::span<Hit> hits) {
  RTCIntersectContext context = coherent_context();
  for (std::size_t begin = 0; begin < directions.size(); begin += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, directions.size() - begin));
    alignas(64) typename Packet<N>::RayHit packet;
    alignas(64) int active[N];
    for (int lane = 0; lane < N; ++lane) {
      const std::size_t i = begin + (lane < count ? lane : 0);
      const Vec3 direction = lane < count ? directions[i] : Vec3::Zero();
      const Eye& eye = eye_of(eyes, i);
      active[lane] = direction.squaredNorm() > 0.0 ? -1 : 0;
      set_ray(packet.ray, lane, eye.position_mm - center, active[lane] ? direction : Vec3::UnitZ(),
              std::numeric_limits<float>::infinity(), eye.beat);
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    Packet<N>::intersect(active, scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane) {
      Hit& hit = hits[begin + lane];
      const Vec3& direction = directions[begin + lane];
      const Eye& eye = eye_of(eyes, begin + lane);
      if (!active[lane])
        hit = {};
      else if (packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
        hit = beside(scene, exact, eye, eye.position_mm - center, direction);
      else
        hit =
            exact(eye.position_mm, direction, eye.beat, static_cast<int>(packet.hit.primID[lane]));
    }
  }
}

template <int N>
void occlusion_packets(RTCScene scene, const Vec3& center, std::span<const Eye> eyes,
                       std::span<const Vec3> points, std::span<const std::uint8_t> wanted,
                       std::span<std::uint8_t> hidden) {
  RTCIntersectContext context = coherent_context();
  for (std::size_t begin = 0; begin < points.size(); begin += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, points.size() - begin));
    alignas(64) typename Packet<N>::Ray packet;
    alignas(64) int active[N];
    bool any = false;
    for (int lane = 0; lane < N; ++lane) {
      const std::size_t i = begin + (lane < count ? lane : 0);
      const Eye& eye = eye_of(eyes, i);
      active[lane] = lane < count && wanted[i] ? -1 : 0;
      any = any || active[lane];
      // The direction keeps its length, so the ray's parameter is the share of the distance.
      set_ray(packet, lane, eye.position_mm - center,
              active[lane] ? Vec3(points[i] - eye.position_mm) : Vec3::UnitZ(), Raycaster::kReach,
              eye.beat);
    }
    if (any) Packet<N>::occluded(active, scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane)
      hidden[begin + lane] = active[lane] && packet.tfar[lane] < 0.0f;
  }
}

// A hierarchy over the triangles; one or three lists of vertices, the latter for walls that move
// while rays are sent.
struct Hierarchy {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  std::array<float*, 3> vertices{};
  unsigned steps = 1;
};

void set_vertices(const Hierarchy& h, const std::array<const std::vector<Vec3>*, 3>& lists,
                  const Vec3& center) {
  for (unsigned step = 0; step < h.steps; ++step) {
    float* out = h.vertices[step];
    for (const Vec3& v : *lists[step])
      for (int k = 0; k < 3; ++k) *out++ = static_cast<float>(v[k] - center[k]);
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

// What is shared by all that was made from one mesh at rest.
struct Raycaster::Shared {
  Vec3 center;  // of the bounding box: single precision is finest around zero
  std::size_t vertex_count;
  const std::vector<Vec3i>* triangles;
  RTCDevice device = nullptr;
  int packet_size = 4;
  std::mutex mutex;  // of the list
  std::vector<Hierarchy> idle;

  explicit Shared(const TriangleMesh& m)
      : center(bounding_box(m).center()),
        vertex_count(m.vertices.size()),
        triangles(&m.triangles) {}
  ~Shared() {
    for (const Hierarchy& h : idle) rtcReleaseScene(h.scene);
    if (device) rtcReleaseDevice(device);
  }

  // A hierarchy without vertices yet.
  Hierarchy make(unsigned steps, bool refitted) const {
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
                                3 * sizeof(unsigned), triangles->size()));
    check(filled && indices != nullptr, "ray tracing: no memory for {} triangles",
          triangles->size());
    for (const Vec3i& t : *triangles)
      for (int k = 0; k < 3; ++k) *indices++ = static_cast<unsigned>(t[k]);
    rtcAttachGeometry(h.scene, h.geometry);
    rtcReleaseGeometry(h.geometry);  // the scene holds it
    return h;
  }
};

struct Raycaster::State {
  std::shared_ptr<Shared> shared;
  ExactHit exact;
  Hierarchy hierarchy;
  bool reusable = false;

  ~State() {
    if (!hierarchy.scene) return;
    if (reusable) {
      const std::lock_guard lock(shared->mutex);
      shared->idle.push_back(hierarchy);
    } else {
      rtcReleaseScene(hierarchy.scene);
    }
  }
};

Raycaster::Raycaster(const TriangleMesh& mesh, const std::string& device) {
  check_mesh(mesh, "raycaster");
  state_ = std::make_unique<State>(State{std::make_shared<Shared>(mesh), ExactHit(mesh), {}});
  Shared& shared = *state_->shared;
  shared.device = rtcNewDevice(device.c_str());
  check(shared.device != nullptr, "ray tracing: no device for '{}' (error {})", device,
        static_cast<int>(rtcGetDeviceError(nullptr)));
  if (rtcGetDeviceProperty(shared.device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
    shared.packet_size = 16;
  else if (rtcGetDeviceProperty(shared.device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
    shared.packet_size = 8;
  state_->hierarchy = shared.make(1, false);
  set_vertices(state_->hierarchy, {&mesh.vertices}, shared.center);
  commit(state_->hierarchy, mesh.triangles.size(), shared.device);
}

Raycaster::Raycaster(const Raycaster& rest, const VertexMotion& vertices)
    : state_(std::make_unique<State>(
          State{rest.state_->shared, ExactHit(rest.state_->exact, vertices), {}, true})) {
  Shared& shared = *state_->shared;
  check(vertices.now->size() == shared.vertex_count, "raycaster: {} moved vertices, expected {}",
        vertices.now->size(), shared.vertex_count);
  const unsigned steps = vertices.moves() ? 3 : 1;
  Hierarchy& h = state_->hierarchy;
  {
    const std::lock_guard lock(shared.mutex);
    const auto found = std::ranges::find(shared.idle, steps, &Hierarchy::steps);
    if (found != shared.idle.end()) {
      h = *found;
      shared.idle.erase(found);
    }
  }
  if (!h.scene) h = shared.make(steps, true);
  if (steps == 1)
    set_vertices(h, {vertices.now}, shared.center);
  else
    set_vertices(h, {vertices.before, vertices.now, vertices.after}, shared.center);
  for (unsigned step = 0; step < steps; ++step)
    rtcUpdateGeometryBuffer(h.geometry, RTC_BUFFER_TYPE_VERTEX, step);
  commit(h, shared.triangles->size(), shared.device);
}

Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;

int Raycaster::packet_size() const { return state_->shared->packet_size; }

void Raycaster::intersect(std::span<const Eye> eyes, std::span<const Vec3> directions,
                          std::span<Hit> hits) const {
  check(hits.size() == directions.size() && (eyes.size() == 1 || eyes.size() == directions.size()),
        "raycaster: {} eyes and {} hits for {} rays", eyes.size(), hits.size(), directions.size());
  const Vec3& center = state_->shared->center;
  const RTCScene scene = state_->hierarchy.scene;
  if (packet_size() == 16)
    intersect_packets<16>(scene, state_->exact, center, eyes, directions, hits);
  else if (packet_size() == 8)
    intersect_packets<8>(scene, state_->exact, center, eyes, directions, hits);
  else
    intersect_packets<4>(scene, state_->exact, center, eyes, directions, hits);
}

void Raycaster::intersect(const Vec3& origin, std::span<const Vec3> directions,
                          std::span<Hit> hits) const {
  const Eye eye{origin};
  intersect(std::span(&eye, 1), directions, hits);
}

Hit Raycaster::intersect(const Vec3& origin, const Vec3& direction) const {
  Hit hit;
  intersect(origin, {&direction, 1}, {&hit, 1});
  return hit;
}

void Raycaster::hidden_from(std::span<const Eye> eyes, std::span<const Vec3> points,
                            std::span<const std::uint8_t> wanted,
                            std::span<std::uint8_t> hidden) const {
  check(wanted.size() == points.size() && hidden.size() == points.size() &&
            (eyes.size() == 1 || eyes.size() == points.size()),
        "raycaster: {} eyes, {} flags and {} answers for {} points", eyes.size(), wanted.size(),
        hidden.size(), points.size());
  const Vec3& center = state_->shared->center;
  const RTCScene scene = state_->hierarchy.scene;
  if (packet_size() == 16)
    occlusion_packets<16>(scene, center, eyes, points, wanted, hidden);
  else if (packet_size() == 8)
    occlusion_packets<8>(scene, center, eyes, points, wanted, hidden);
  else
    occlusion_packets<4>(scene, center, eyes, points, wanted, hidden);
}

void Raycaster::hidden_from(const Vec3& eye, std::span<const Vec3> points,
                            std::span<const std::uint8_t> wanted,
                            std::span<std::uint8_t> hidden) const {
  const Eye from{eye};
  hidden_from(std::span(&from, 1), points, wanted, hidden);
}

}  // namespace rugae
