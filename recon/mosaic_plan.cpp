#include "recon/mosaic_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"

namespace rugae {
namespace {

/// Side of the canvas over the frame's: a wider plane stretches what lies far off the axis.
constexpr double kCanvasOverFrame = 1.6;
/// Within these factors a homography of neighbouring views stays (assumed).
constexpr double kMaxAreaRatio = 4.0;
constexpr double kMaxAnisotropy = 4.0;
constexpr double kMinShareOnCanvas = 0.5;
/// Blending cost grows with members; nearer ones (in links) come first.
constexpr std::size_t kMaxMembers = 16;
/// Bundle-adjusted points needed before they replace the chain (four fix a homography).
constexpr std::size_t kMinRefinePoints = 24;
constexpr double kRefineInlierPx = 6.0;  // parallax of a curved wall, not noise

struct Link {
  int to = -1;
  Mat3 from_to;  // homography: pixels of `to` into the node this link belongs to
  int inliers = 0;
};
using Graph = std::vector<std::vector<Link>>;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

double polygon_area(const std::vector<Vec2>& polygon) {
  double area = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    area += 0.5 * cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return area;
}

/// Sutherland and Hodgman's clipping (CACM 1974, doi:10.1145/360767.360802) by a box.
std::vector<Vec2> clipped(std::vector<Vec2> polygon, const Eigen::AlignedBox2d& box) {
  for (int side = 0; side < 4; ++side) {
    const int axis = side / 2;
    const double sign = side % 2 == 0 ? 1.0 : -1.0;
    const double bound = side % 2 == 0 ? box.min()[axis] : box.max()[axis];
    std::vector<Vec2> out;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const double da = sign * (a[axis] - bound), db = sign * (b[axis] - bound);
      if (da >= 0.0) out.push_back(a);
      if ((da >= 0.0) != (db >= 0.0)) out.push_back(a + (b - a) * (da / (da - db)));
    }
    polygon = std::move(out);
  }
  return polygon;
}

Graph link_graph(const Structure& structure, const std::vector<PairAlignment>& pairs) {
  std::map<int, int> position;
  for (std::size_t k = 0; k < structure.frames.size(); ++k)
    position[structure.frames[k]] = static_cast<int>(k);
  Graph graph(structure.frames.size());
  for (const PairAlignment& pair : pairs) {
    const auto reference = position.find(pair.reference), moving = position.find(pair.moving);
    if (reference == position.end() || moving == position.end()) continue;
    const int r = reference->second, m = moving->second;
    if (!structure.placed[r] || !structure.placed[m]) continue;
    const Mat3& h = pair.ref_from_mov_homography;
    if (!h.allFinite() || std::abs(h.determinant()) < 1e-12) continue;
    graph[r].push_back({m, h, pair.inliers});
    graph[m].push_back({r, h.inverse(), pair.inliers});
  }
  for (auto& links : graph)
    std::stable_sort(links.begin(), links.end(),
                     [](const Link& a, const Link& b) { return a.inliers > b.inliers; });
  return graph;
}

/// Breadth first from the anchor: members in order of links.
std::vector<MosaicMember> reachable(const Structure& structure, const Graph& graph, int anchor,
                                    const Lens& lens, const MosaicOptions& options) {
  std::vector<MosaicMember> members = {{anchor, Mat3::Identity()}};
  std::vector<bool> seen(structure.frames.size(), false);
  seen[anchor] = true;
  const auto view = [&](int k) -> Vec3 {
    return structure.cam_from_world[k].rotation.conjugate() * Vec3::UnitZ();
  };
  const Vec3 anchor_view = view(anchor);
  for (std::size_t next = 0; next < members.size(); ++next) {
    const MosaicMember from = members[next];
    for (const Link& link : graph[from.keyframe]) {
      if (members.size() >= kMaxMembers) return members;
      if (seen[link.to]) continue;
      const double angle = std::acos(std::clamp(anchor_view.dot(view(link.to)), -1.0, 1.0));
      if (!(angle <= options.max_view_angle_rad)) continue;
      Mat3 h = from.anchor_from_member * link.from_to;
      h /= h(2, 2);
      if (!outline_on_anchor(h, lens)) continue;
      seen[link.to] = true;
      members.push_back({link.to, h});
    }
  }
  return members;
}

/// After bundle adjustment the wall points a member sees are known, and so is where the anchor sees
/// them: the homography that takes the first to the second replaces the chain, which drifts.
void refine(const Structure& structure, const Lens& lens, MosaicPlan& plan) {
  const Rigid3& anchor_from_world = structure.cam_from_world[plan.anchor];
  const Eigen::AlignedBox2d bounds = mosaic_bounds(lens);
  const LensProjector projector(lens);
  std::vector<std::vector<cv::Point2d>> from(plan.members.size()), to(plan.members.size());
  std::map<int, std::size_t> slot;
  for (std::size_t m = 1; m < plan.members.size(); ++m) slot[plan.members[m].keyframe] = m;
  for (const Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    const auto pixel = projector.project(anchor_from_world * track.point);
    if (!pixel || !bounds.contains(*pixel)) continue;
    for (const Track::Observation& seen : track.observations) {
      const auto found = slot.find(seen.keyframe);
      if (found == slot.end()) continue;
      from[found->second].emplace_back(seen.pixel.x(), seen.pixel.y());
      to[found->second].emplace_back(pixel->x(), pixel->y());
    }
  }
  for (std::size_t m = 1; m < plan.members.size(); ++m) {
    if (from[m].size() < kMinRefinePoints) continue;
    // RANSAC with OpenCV's fixed seed, then least squares on the inliers.
    const cv::Mat h = cv::findHomography(from[m], to[m], cv::RANSAC, kRefineInlierPx);
    if (h.empty()) continue;
    Mat3 refined;
    for (int i = 0; i < 9; ++i) refined(i / 3, i % 3) = h.at<double>(i / 3, i % 3);
    if (outline_on_anchor(refined, lens)) plan.members[m].anchor_from_member = refined;
  }
}

}  // namespace

Eigen::AlignedBox2d mosaic_bounds(const Lens& lens) {
  const Vec2 size(lens.width, lens.height);
  const Vec2 margin = 0.5 * (kCanvasOverFrame - 1.0) * size;
  return {Vec2(-margin), Vec2(size + margin)};
}

std::optional<std::vector<Vec2>> outline_on_anchor(const Mat3& h, const Lens& lens) {
  if (!h.allFinite()) return std::nullopt;
  const double width = lens.width, height = lens.height;
  std::vector<Vec2> outline;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(width, 0), Vec2(width, height), Vec2(0, height)}) {
    const Vec3 mapped = h * corner.homogeneous();
    if (!(mapped.z() > 0.0)) return std::nullopt;  // crosses the line at infinity
    const Vec2 pixel = mapped.hnormalized();
    // The Jacobian of the homography: (H_23 - pixel * h_3) / w.
    const Mat2 jacobian =
        (h.topLeftCorner<2, 2>() - pixel * h.bottomLeftCorner<1, 2>()) / mapped.z();
    if (!(jacobian.determinant() > 0.0)) return std::nullopt;
    const Vec2 stretch = jacobian.jacobiSvd().singularValues();
    if (!(stretch[0] <= kMaxAnisotropy * stretch[1])) return std::nullopt;
    outline.push_back(pixel);
  }
  const double area = polygon_area(outline), frame_area = width * height;
  if (!(area <= kMaxAreaRatio * frame_area && area * kMaxAreaRatio >= frame_area))
    return std::nullopt;
  const double inside = polygon_area(clipped(outline, mosaic_bounds(lens)));
  if (!(inside >= kMinShareOnCanvas * area)) return std::nullopt;
  return outline;
}

std::vector<MosaicPlan> plan_mosaics(const Structure& structure,
                                     const std::vector<PairAlignment>& pairs, const Lens& lens,
                                     const MosaicOptions& options) {
  const int count = static_cast<int>(structure.frames.size());
  check(structure.placed.size() == structure.frames.size() &&
            structure.cam_from_world.size() == structure.frames.size(),
        "mosaic: {} key frames, {} placed flags, {} poses", count, structure.placed.size(),
        structure.cam_from_world.size());
  const Graph graph = link_graph(structure, pairs);
  std::vector<std::vector<MosaicMember>> candidates(count);
  std::vector<bool> covered(count, true);
  for (int k = 0; k < count; ++k) {
    if (!structure.placed[k]) continue;
    covered[k] = false;
    candidates[k] = reachable(structure, graph, k, lens, options);
  }
  // Of anchors that bring equally many, the most central one: its members turn least in total.
  const auto total_turn = [&](int anchor) {
    double total = 0.0;
    for (const MosaicMember& member : candidates[anchor])
      total += angle_between_rad(structure.cam_from_world[anchor].rotation,
                                 structure.cam_from_world[member.keyframe].rotation);
    return total;
  };
  std::vector<MosaicPlan> plans;
  while (true) {
    int best = -1, best_gain = 0;
    double best_turn = 0.0;
    for (int k = 0; k < count; ++k) {
      int gain = 0;
      for (const MosaicMember& member : candidates[k]) gain += covered[member.keyframe] ? 0 : 1;
      if (gain == 0 || gain < best_gain) continue;
      const double turn = total_turn(k);
      if (gain > best_gain || turn < best_turn) best = k, best_gain = gain, best_turn = turn;
    }
    if (best < 0) return plans;
    MosaicPlan plan{best, candidates[best]};
    refine(structure, lens, plan);
    for (const MosaicMember& member : plan.members) covered[member.keyframe] = true;
    plans.push_back(std::move(plan));
  }
}

}  // namespace rugae
