#include "render/raycaster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "core/check.h"
#include "render/hierarchy.h"

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

RTCIntersectContext context_for(RayOrder order) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = order == RayOrder::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                              : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
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

constexpr double kSwell = 1e-6;  // of the wall's diameter: 16 roundings of the traversal

// What a ray is traced against.
struct Target {
  RTCScene scene;
  const ExactHit& exact;
  const Vec3& center;
};

// The nearest triangle that the traversal finds on a ray beyond t_near, and where; -1 for none.
struct Proposal {
  int triangle;
  float t;
};
Proposal propose(const Target& target, const Eye& eye, const Vec3& direction, float t_near,
                 float t_far) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const Vec3f origin = (eye.position_mm - target.center).cast<float>(), d = direction.cast<float>();
  RTCRayHit ray{};
  ray.ray = {origin.x(), origin.y(), origin.z(), t_near,
             d.x(),      d.y(),      d.z(),      library_time(eye.beat),
             t_far,      ~0u,        0,          0};
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(target.scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {-1, 0.0f};
  return {static_cast<int>(ray.hit.primID), ray.ray.tfar};
}

// For the few rays whose first proposal is none: one by one through all that the traversal
// proposes along the ray. Even its robust mode lets a ray slip through a corner at times; then rays
// a little beside it propose the triangles around the corner. The exact ray decides.
Hit search(const Target& target, const Eye& eye, const Vec3& direction, double t_far) {
  constexpr int kMostProposals = 256;
  constexpr double kBeside = 4e-6;  // rad: some roundings of single precision
  const Vec3 across = direction.norm() * direction.unitOrthogonal();
  for (const double side : {0.0, kBeside, -kBeside}) {
    float t_near = 0.0f;
    for (int i = 0; i < kMostProposals; ++i) {
      const Proposal proposal =
          propose(target, eye, direction + side * across, t_near, static_cast<float>(t_far));
      if (proposal.triangle < 0) break;
      const Hit hit = target.exact(eye.position_mm, direction, eye.beat, proposal.triangle);
      if (hit.met()) return hit;
      t_near = std::nextafter(std::max(t_near, proposal.t), std::numeric_limits<float>::infinity());
    }
  }
  return {};
}

template <int N>
void intersect_packets(const Target& target, std::span<const Eye> eyes,
                       std::span<const Vec3> directions, std::span<Hit> hits, RayOrder order) {
  RTCIntersectContext context = context_for(order);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  for (std::size_t begin = 0; begin < directions.size(); begin += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, directions.size() - begin));
    alignas(64) typename Packet<N>::RayHit packet;
    alignas(64) int active[N];
    for (int lane = 0; lane < N; ++lane) {
      const std::size_t i = begin + (lane < count ? lane : 0);
      const Vec3 direction = lane < count ? directions[i] : Vec3::Zero();
      const Eye& eye = eye_of(eyes, i);
      active[lane] = direction.squaredNorm() > 0.0 ? -1 : 0;
      set_ray(packet.ray, lane, eye.position_mm - target.center,
              active[lane] ? direction : Vec3::UnitZ(), kFar, eye.beat);
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    Packet<N>::intersect(active, target.scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane) {
      Hit& hit = hits[begin + lane];
      hit = {};
      if (!active[lane]) continue;
      const Vec3& direction = directions[begin + lane];
      const Eye& eye = eye_of(eyes, begin + lane);
      if (packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID)
        hit = target.exact(eye.position_mm, direction, eye.beat,
                           static_cast<int>(packet.hit.primID[lane]));
      if (!hit.met()) hit = search(target, eye, direction, kFar);
    }
  }
}

// The slack makes the traversal's no certain; where it says yes, the exact ray decides.
template <int N>
void occlusion_packets(const Target& target, std::span<const Eye> eyes,
                       std::span<const Vec3> points, std::span<const std::uint8_t> wanted,
                       std::span<std::uint8_t> hidden, RayOrder order) {
  RTCIntersectContext context = context_for(order);
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
      set_ray(packet, lane, eye.position_mm - target.center,
              active[lane] ? Vec3(points[i] - eye.position_mm) : Vec3::UnitZ(), Raycaster::kReach,
              eye.beat);
    }
    if (any) Packet<N>::occluded(active, target.scene, &context, &packet);
    for (int lane = 0; lane < count; ++lane) {
      const std::size_t i = begin + lane;
      hidden[i] = 0;
      if (!(active[lane] && packet.tfar[lane] < 0.0f)) continue;
      const Eye& eye = eye_of(eyes, i);
      const Hit hit = search(target, eye, points[i] - eye.position_mm, Raycaster::kReach);
      hidden[i] = hit.met() && hit.range_mm < Raycaster::kReach;
    }
  }
}

}  // namespace

// What is shared by all that was made from one mesh at rest.
struct Raycaster::Shared {
  Vec3 center;  // of the bounding box: single precision is finest around zero
  double swell_mm;
  std::size_t vertex_count;
  const std::vector<Vec3i>* triangles;
  RTCDevice device = nullptr;
  int packet_size = 4;
  std::mutex mutex;  // of the list
  std::vector<Hierarchy> idle;

  explicit Shared(const TriangleMesh& m)
      : center(bounding_box(m).center()),
        swell_mm(kSwell * bounding_box(m).diagonal().norm()),
        vertex_count(m.vertices.size()),
        triangles(&m.triangles) {}
  ~Shared() {
    for (const Hierarchy& h : idle) rtcReleaseScene(h.scene);
    if (device) rtcReleaseDevice(device);
  }

  Hierarchy make(unsigned steps, bool refitted) const {
    return make_hierarchy(device, *triangles, vertex_count, steps, refitted);
  }
  void place(const Hierarchy& h, const VertexLists& lists) const {
    place_vertices(h, device, lists, *triangles, center, swell_mm);
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
  auto made = std::make_shared<Shared>(mesh);
  Shared& shared = *made;
  state_ = std::make_unique<State>(State{std::move(made), ExactHit(mesh, shared.swell_mm), {}});
  shared.device = rtcNewDevice(device.c_str());
  check(shared.device != nullptr, "ray tracing: no device for '{}' (error {})", device,
        static_cast<int>(rtcGetDeviceError(nullptr)));
  if (rtcGetDeviceProperty(shared.device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
    shared.packet_size = 16;
  else if (rtcGetDeviceProperty(shared.device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
    shared.packet_size = 8;
  state_->hierarchy = shared.make(1, false);
  shared.place(state_->hierarchy, {&mesh.vertices});
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
    shared.place(h, {vertices.now});
  else
    shared.place(h, {vertices.before, vertices.now, vertices.after});
}

Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;

int Raycaster::packet_size() const { return state_->shared->packet_size; }

void Raycaster::intersect(std::span<const Eye> eyes, std::span<const Vec3> directions,
                          std::span<Hit> hits, RayOrder order) const {
  check(hits.size() == directions.size() && (eyes.size() == 1 || eyes.size() == directions.size()),
        "raycaster: {} eyes and {} hits for {} rays", eyes.size(), hits.size(), directions.size());
  const Target target{state_->hierarchy.scene, state_->exact, state_->shared->center};
  if (packet_size() == 16)
    intersect_packets<16>(target, eyes, directions, hits, order);
  else if (packet_size() == 8)
    intersect_packets<8>(target, eyes, directions, hits, order);
  else
    intersect_packets<4>(target, eyes, directions, hits, order);
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
                            std::span<const std::uint8_t> wanted, std::span<std::uint8_t> hidden,
                            RayOrder order) const {
  check(wanted.size() == points.size() && hidden.size() == points.size() &&
            (eyes.size() == 1 || eyes.size() == points.size()),
        "raycaster: {} eyes, {} flags and {} answers for {} points", eyes.size(), wanted.size(),
        hidden.size(), points.size());
  const Target target{state_->hierarchy.scene, state_->exact, state_->shared->center};
  if (packet_size() == 16)
    occlusion_packets<16>(target, eyes, points, wanted, hidden, order);
  else if (packet_size() == 8)
    occlusion_packets<8>(target, eyes, points, wanted, hidden, order);
  else
    occlusion_packets<4>(target, eyes, points, wanted, hidden, order);
}

void Raycaster::hidden_from(const Vec3& eye, std::span<const Vec3> points,
                            std::span<const std::uint8_t> wanted,
                            std::span<std::uint8_t> hidden) const {
  const Eye from{eye};
  hidden_from(std::span(&from, 1), points, wanted, hidden);
}

}  // namespace rugae
