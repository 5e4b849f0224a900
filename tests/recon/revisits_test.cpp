// Wall seen again: what geometry foretells of a patch, and the drift that revisits take out.

#include "recon/dense/revisits.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "recon/dense/frame_poses.h"
#include "recon/dense/rejoin.h"
#include "synthetic.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// A camera that goes there and comes back: no track lives to see the same wall twice.
// Of the path's size, what one more adjustment may move a camera: a drafted one leaves three times
// as much.
constexpr double kEndShare = 2e-6;
// Where a world lies changes no more than rounding does to what is found to a tenth of a pixel.
constexpr double kMovedShare = 1e-4;
// Of the path's extent, a segment placed by a few dozen patches a key frame, before it is linked.
constexpr double kJoinedShare = 0.02;

class Revisits : public testing::Test {
 protected:
  static constexpr int kThere = 9, kCameras = 18;
  static synthetic::Options path() {
    return {.cameras = kCameras,
            .step_rad = 0.12,
            .turn_at = kThere,
            .width = 320,
            .points = 1200,
            .max_run = 5,
            .noise_px = 0.3};
  }

  static void SetUpTestSuite() {
    root_ = fs::path(testing::TempDir()) / fmt::format("rugae_revisits_{}", getpid());
    fs::remove_all(root_);
    std::vector<Rigid3> poses;
    for (int k = 0; k < kCameras; ++k)
      poses.push_back(synthetic::world_from_camera(synthetic::angle_of(path(), k)));
    recording_ = synthetic::record(root_, synthetic::lens_of(320, 240), poses, 1.0);
    world_ = synthetic::make_world(path());
    for (int first = 2; first + 2 < kCameras; first += 2) {
      synthetic::Options later = path();
      later.first_camera = first;
      later.seed = static_cast<std::uint64_t>(first);
      const synthetic::World more = synthetic::make_world(later);
      world_.tracks.insert(world_.tracks.end(), more.tracks.begin(), more.tracks.end());
    }
    Progress progress(Progress::Output::silent);
    chain_ = build_structure(world_.frames, world_.tracks, world_.lens, BundleOptions{},
                             kFinalAdjustment, progress);
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static FrameSource frames() {
    PreprocessOptions options;
    options.devignette = false;
    return {Observations::open(recording_.images, recording_.calibration), options};
  }
  static Structure linked() {
    Progress progress(Progress::Output::silent);
    Structure structure = chain_;
    link_revisits(frames(), RevisitOptions{}, BundleOptions{}, structure, progress);
    return structure;
  }

  // Two segments: no track leads across from key frames before `end` to those from `begin` on, and
  // none to what lies between.
  static std::vector<Structure> broken(int end, int begin) {
    std::vector<Track> tracks;
    for (const Track& track : world_.tracks)
      for (const bool behind : {false, true}) {
        Track part = track;
        std::erase_if(part.observations, [&](const Track::Observation& o) {
          return behind ? o.keyframe < begin : o.keyframe >= end;
        });
        if (part.observations.size() >= 2) tracks.push_back(std::move(part));
      }
    Progress progress(Progress::Output::silent);
    auto segments = build_segments(world_.frames, tracks, world_.lens, BundleOptions{}, progress);
    for (Structure& segment : segments)
      finish_structure(segment, world_.lens, BundleOptions{}, kFinalAdjustment, progress);
    return segments;
  }

  static fs::path root_;
  static synthetic::Recording recording_;
  static synthetic::World world_;
  static Structure chain_;
};
fs::path Revisits::root_;
synthetic::Recording Revisits::recording_;
synthetic::World Revisits::world_;
Structure Revisits::chain_;

// Patches made in the true structure land where the wall is: their centres to rounding, their
// derivatives to what a tangent plane from points 2 mm apart on folds can be.
TEST_F(Revisits, PatchesAreForetoldWhereTheirWallIsSeen) {
  const auto patches = make_patches(frames(), chain_);
  ASSERT_GT(patches.size(), chain_.tracks.size() / 2);
  const RollingShutter shutter(world_.lens, world_.lens, 0.0);
  int sights = 0;
  double sum = 0.0;
  for (const WallPatch& patch : patches) {
    const Track& track = chain_.tracks[static_cast<std::size_t>(patch.track)];
    for (const auto& o : track.observations) {
      const auto sight = foretell(patch, {chain_.cam_from_world[o.keyframe], {}}, shutter);
      if (!sight) continue;
      EXPECT_LT((sight->pixel - o.pixel).norm(), 3.5);  // what the adjustment let pass, 3 px
      if (o.keyframe == patch.anchor) {
        EXPECT_LT((sight->linear - Mat2::Identity()).norm(), 1e-2);
      }
      ++sights;
      sum += (sight->pixel - o.pixel).norm();
    }
  }
  EXPECT_GT(sights, 4000);
  EXPECT_LT(sum / sights, 1.0);
}

TEST_F(Revisits, TakeOutTheDrift) {
  ASSERT_EQ(chain_.placed_count(), kCameras);
  const Structure s = linked();
  ASSERT_EQ(s.placed_count(), kCameras);
  const double before = synthetic::path_error(chain_, world_).rmse;
  const double after = synthetic::path_error(s, world_).rmse;
  std::printf("path error %.4f mm in a chain, %.4f mm linked\n", before, after);
  EXPECT_TRUE(after <= 0.5 * before) << before << " " << after;
  // Tracks that were begun on the way there are seen on the way back.
  int both = 0;
  for (const Track& track : s.tracks)
    both += track.observations.front().keyframe < kThere - 4 &&
            track.observations.back().keyframe > kThere + 4;
  EXPECT_GT(both, 50);
}

// The last round is adjusted to its end: what follows moves nothing.
TEST_F(Revisits, EndWhereAdjustingEnds) {
  const Structure s = linked();
  Structure again = s;
  Progress progress(Progress::Output::silent);
  finish_structure(again, world_.lens, BundleOptions{}, kFinalAdjustment, progress);
  double moved = 0.0, size = 0.0;
  for (int k = 0; k < kCameras; ++k) {
    const Vec3 centre = s.cam_from_world[k].inverse().translation;
    moved = std::max(moved, (again.cam_from_world[k].inverse().translation - centre).norm());
    size = std::max(size, centre.norm());
  }
  EXPECT_LE(moved, kEndShare * size) << moved / size;
}

// A camera that is thought to look elsewhere, by 70 degrees, finds nothing of what it should see.
TEST_F(Revisits, WrongSightsAreNotAccepted) {
  Structure astray = chain_;
  for (int k = kThere; k < kCameras; ++k)
    astray.cam_from_world[k] = Rigid3(Quat(Eigen::AngleAxisd(1.22, Vec3::UnitY())), Vec3::Zero()) *
                               astray.cam_from_world[k];
  const auto patches = make_patches(frames(), chain_);
  Progress progress(Progress::Output::silent);
  const auto seen_on_the_way_back = [](const Structure& structure) {
    std::ptrdiff_t count = 0;
    for (const Track& track : structure.tracks)
      count += std::ranges::count_if(track.observations,
                                     [](const auto& o) { return o.keyframe >= kThere; });
    return count;
  };
  Structure right = chain_;
  observe_again(frames(), patches, {}, {}, right, progress);
  observe_again(frames(), patches, {}, {}, astray, progress);
  const std::ptrdiff_t chain = seen_on_the_way_back(chain_);
  const std::ptrdiff_t found = seen_on_the_way_back(right) - chain;
  const std::ptrdiff_t wrong = seen_on_the_way_back(astray) - chain;
  EXPECT_GT(found, 500);
  EXPECT_LT(20 * wrong, found) << wrong;
}

// Every second key frame but the last is taken out of the map and found in it again as a frame
// between others.
TEST_F(Revisits, FramesBetweenArePlacedInTheMap) {
  const Structure whole = linked();
  const Structure half = synthetic::every_other_keyframe(whole);
  Progress progress(Progress::Output::silent);
  const FrameSource source = frames();
  const auto poses = place_frames(source, half, make_patches(source, half), {}, progress);
  std::vector<Rigid3> estimated, truth;
  for (int k = 0; k < kCameras; ++k) {
    ASSERT_TRUE(poses[k].has_value()) << k;
    estimated.push_back(poses[k]->inverse());
    truth.push_back(world_.cam_from_world[k].inverse());
  }
  // Patches of 12 px found to a tenth of one, by the dozen: as good as the key frames themselves.
  const double error = synthetic::path_error(estimated, truth).rmse;
  EXPECT_TRUE(error <= 2.0 * synthetic::path_error(whole, world_).rmse) << error;
}

// Between two key frames the camera went on and came back: neither they nor the way between them
// tell where it was at the turn, the frames beside do.
TEST_F(Revisits, FramesLeadToThoseBesideThem) {
  constexpr int kAround = 4;
  const Structure whole = linked();
  Structure sparse = whole;
  for (int k = kThere - kAround; k < kThere + kAround; ++k) sparse.placed[k] = false;
  for (Track& track : sparse.tracks)
    std::erase_if(track.observations, [&](const auto& o) { return !sparse.placed[o.keyframe]; });
  std::erase_if(sparse.tracks, [](const Track& track) { return track.observations.size() < 2; });
  Progress progress(Progress::Output::silent);
  const FrameSource source = frames();
  const auto poses = place_frames(source, sparse, make_patches(source, sparse), {}, progress);
  std::vector<Rigid3> estimated, truth;
  for (int k = 0; k < kCameras; ++k) {
    ASSERT_TRUE(poses[k].has_value()) << k;
    estimated.push_back(poses[k]->inverse());
    truth.push_back(world_.cam_from_world[k].inverse());
  }
  // They have the patches of both key frames alone, up to four steps away.
  constexpr double kShareOfStep = 0.02;
  const double step_mm = (truth[1].translation - truth[0].translation).norm();
  const double error = synthetic::path_error(estimated, truth).rmse;
  EXPECT_TRUE(error <= kShareOfStep * step_mm) << error << " " << step_mm;
}

// The chain broke on the way back, where the camera turned around unseen, which no motion
// foretells, and on the way there over three lost frames, which nothing but the motion bridges:
// both segments are one map afterwards, as good as if it had not.
TEST_F(Revisits, SegmentsFindTheirPlaceInTheMap) {
  for (const auto& [end, begin] :
       {std::pair(12, 12), std::pair(kThere, kThere + 1), std::pair(4, 7)}) {
    std::vector<Structure> segments = broken(end, begin);
    ASSERT_EQ(segments.size(), 2u) << begin;
    Structure map = segments[0], segment = segments[1];
    const auto found = map_from_segment(frames(), map, make_patches(frames(), map), segment,
                                        RevisitOptions{}, BundleOptions{});
    ASSERT_TRUE(found) << begin;

    // The segment's own world, wherever it is, does not matter.
    const Sim3 moved{7.0, Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized())), Vec3(4, 5, 6)};
    for (Rigid3& pose : segment.cam_from_world) pose = (moved * pose.inverse()).inverse();
    for (Track& track : segment.tracks) track.point = moved * track.point;
    const auto again = map_from_segment(frames(), map, make_patches(frames(), map), segment,
                                        RevisitOptions{}, BundleOptions{});
    ASSERT_TRUE(again) << begin;
    EXPECT_NEAR(again->scale * moved.scale / found->scale, 1.0, kMovedShare);
    EXPECT_LT(angle_between_rad((*again * moved).rotation, found->rotation), kMovedShare);

    Progress progress(Progress::Output::silent);
    ASSERT_EQ(rejoin(frames(), {segment}, RevisitOptions{}, BundleOptions{}, map, progress), 1);
    EXPECT_EQ(map.placed_count(), kCameras - (begin - end));
    const double before = synthetic::path_error(map, world_).rmse;
    link_revisits(frames(), RevisitOptions{}, BundleOptions{}, map, progress);
    EXPECT_EQ(map.placed_count(), kCameras - (begin - end));
    const double after = synthetic::path_error(map, world_).rmse;
    const double whole = synthetic::path_error(linked(), world_).rmse;
    std::printf("path error %.4f mm joined, %.4f mm linked, %.4f mm unbroken\n", before, after,
                whole);
    EXPECT_TRUE(before <= kJoinedShare * synthetic::path_error(map, world_).path_extent) << before;
    EXPECT_TRUE(after <= 2.0 * whole) << after;
  }
}

// Pictures of other wall than the map's: the segment stays out of it.
TEST_F(Revisits, SegmentsOfOtherWallStayOut) {
  std::vector<Structure> segments = broken(5, 13);
  ASSERT_EQ(segments.size(), 2u);
  Structure& map = segments[segments[0].placed[0] ? 0 : 1];
  Structure& segment = segments[segments[0].placed[0] ? 1 : 0];
  const auto patches = make_patches(frames(), map);
  EXPECT_TRUE(map_from_segment(frames(), map, patches, segment, RevisitOptions{}, BundleOptions{}));
  for (int k = 13; k < kCameras; ++k) segment.frames[k] = kThere - 1 + k % 2;  // the far end
  EXPECT_FALSE(
      map_from_segment(frames(), map, patches, segment, RevisitOptions{}, BundleOptions{}));
}

// What two key frames agree on may be chance.
TEST_F(Revisits, TwoKeyframesAreNoSegment) {
  std::vector<Structure> segments = broken(12, 12);
  ASSERT_EQ(segments.size(), 2u);
  Structure& segment = segments[1];
  const auto patches = make_patches(frames(), segments[0]);
  for (int k = 14; k < kCameras; ++k) segment.placed[k] = false;
  remove_outliers(segment);
  ASSERT_EQ(segment.placed_count(), 2);
  EXPECT_FALSE(
      map_from_segment(frames(), segments[0], patches, segment, RevisitOptions{}, BundleOptions{}));
  segments = broken(12, 12);
  EXPECT_TRUE(map_from_segment(frames(), segments[0], patches, segments[1], RevisitOptions{},
                               BundleOptions{}));
}

TEST_F(Revisits, TheNumberOfThreadsChangesNothing) {
  const Structure two = linked();
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  const Structure one = linked();
  ASSERT_EQ(one.tracks.size(), two.tracks.size());
  for (std::size_t t = 0; t < one.tracks.size(); ++t)
    EXPECT_EQ(one.tracks[t].point, two.tracks[t].point);
  for (int k = 0; k < kCameras; ++k)
    EXPECT_EQ(one.cam_from_world[k].translation, two.cam_from_world[k].translation);
}

}  // namespace
}  // namespace rugae
