#include "recon/options.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/check.h"
#include "recon/motion.h"

namespace rugae {
namespace {

template <typename Run>
std::string message(const Run& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

ReconOptions read(const std::string& text) {
  ReconOptions options;
  read_options(YamlReader::from_text(text, "study.yaml"), options);
  return options;
}

TEST(ReconOptionsTest, DefaultsHold) {
  EXPECT_EQ(message([] { ReconOptions().check(); }), "");
}

TEST(ReconOptionsTest, YamlSetsWhatItNamesAndKeepsTheRest) {
  const ReconOptions options = read(
      "preprocess:\n  reflections:\n    inpainting: navier_stokes\n  devignette: false\n"
      "mosaic:\n  max_view_angle_deg: 30\nseed: 9\n");
  EXPECT_EQ(options.preprocess.reflections.inpainting, Inpainting::navier_stokes);
  EXPECT_FALSE(options.preprocess.devignette);
  EXPECT_TRUE(options.preprocess.undistort);
  EXPECT_NEAR(options.mosaic.max_view_angle_rad, 0.5235987755982988, 1e-15);
  EXPECT_EQ(options.seed, 9u);
  EXPECT_EQ(options.align.grid_px, AlignOptions().grid_px);
}

// What only the map looks at leaves the motion as it is; everything else may change it.
TEST(ReconOptionsTest, TheMotionDependsOnAllButTheMap) {
  const auto motion_of = [](const std::string& text) {
    return to_json_text(motion_options(read(text)));
  };
  const std::string plain = to_json_text(motion_options({}));
  for (const char* same :
       {"mosaic: {bands: 2}", "shading: {iterations: 3}", "map: {voxel_share: 0.1}",
        "pictures: false", "preprocess: {reflections: {suppress_for_map: false}}",
        "preprocess: {reflections: {inpainting: navier_stokes, inpaint_radius_px: 5}}"})
    EXPECT_EQ(motion_of(same), plain) << same;
  for (const char* other :
       {"preprocess: {undistort: false}", "preprocess: {devignette: false}",
        "preprocess: {reflections: {suppress_for_pose: true}}",
        "preprocess: {reflections: {closing_px: 5}}", "keyframes: {mean_flow_px: 20}",
        "align: {grid_px: 10}", "tracks: {spacing_px: 20}", "bundle: {huber_px: 2}", "seed: 2"})
    EXPECT_NE(motion_of(other), plain) << other;
  const std::string painted = "preprocess: {reflections: {suppress_for_pose: true}}";
  EXPECT_NE(motion_of("preprocess: {reflections: {suppress_for_pose: true, inpainting: "
                      "navier_stokes}}"),
            motion_of(painted));
}

TEST(ReconOptionsTest, BrokenValuesAreNamedWithTheirPlace) {
  EXPECT_EQ(message([] { read("align:\n  grid_px: 1\n"); }),
            "study.yaml:2:12: grid_px is 1, expected 2 to 64");
  EXPECT_NE(message([] { read("align:\n  grid_pix: 8\n"); }).find("grid_px"), std::string::npos);
  EXPECT_EQ(message([] { read("method: papper\n"); }),
            "study.yaml:1:9: method 'papper' is not known, expected paper or dense; did you mean "
            "'paper'?");
  KeyframeOptions keyframes;
  keyframes.mean_flow_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message([&] { keyframes.check(); }),
            "keyframes: mean_flow_px is nan, expected 0.1 to 1000");
}

TEST(ReconOptionsTest, JsonHoldsEveryGroup) {
  const std::string text = to_json_text({});
  for (const char* key : {"\"method\"", "\"suppress_for_map\"", "\"mean_flow_px\"", "\"stop_mse\"",
                          "\"huber_px\"", "\"max_view_angle_rad\"", "\"w_n\"", "\"voxel_share\""})
    EXPECT_NE(text.find(key), std::string::npos) << key;
}

}  // namespace
}  // namespace rugae
