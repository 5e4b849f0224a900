#pragma once
// Where everything in a dataset lies. Observations and truth never share a folder. Encodings:
// docs/dataset.md.
//
//   DATASET/
//     dataset.json              what made it: scene, camera, trajectory, seed, options, units, axes
//     manifest.sha256           "hash  path" a line, as sha256sum prints and checks; written last:
//                               its presence says complete
//     observations/             what a real capsule would give
//       calibration.yaml        the lens (cameras/camera.h); vignetting is not in it
//       frames.csv              index,time_s,exposure_s,gain
//       frames/000000.png       8-bit sRGB (or .jpg)
//       adc/000000.png          on request: the converter's numbers, 16-bit
//       mosaic/000000.png       on request: the same, one a photosite
//     truth/
//       camera.yaml             everything about the camera
//       trajectory.txt          TUM, world_from_camera, mm
//       wall.ply                the wall, double precision
//       depth/000000.exr        z-depth in mm, float32, NaN where nothing was hit
//       normals/000000.png      unit geometric normal in camera axes, facing the camera, 16-bit
//       flow/000000.exr         channels x y: float32 px from frame t to t+1 (absent for the last
//                               frame), NaN where not kMaskFlowValid
//       masks/000000.png        bits: see FrameMask
//       radiance/000000.exr     on request: channels R G B, linear, 1 = full scale
//       clean/000000.png        on request: the frame from a sensor without faults
//                               and where asked for, or where there is something to say:
//       backward_flow/000001.exr  as flow, from frame t to t-1 (absent for the first frame)
//       triangles/000000.exr    channels x y z: triangle of the wall, barycentric coordinates of
//                               its second and third corner
//       range/ shading_normals/ albedo/ diffuse/ specular/ indirect/ regions/ instances/
//                               one image a frame each, see dataset/label_images.h
//       scene.yaml              the scene with every default and draw filled in
//       regions.csv             region,name
//       instances.csv           lesions and objects on the wall
//       row_poses/000000.txt    rolling shutter: TUM, poses of rows -1 to height
//       wall_motion/000000.ply  moving wall: what to add to the vertices of wall.ply
//       track_points.csv        point,triangle,b1,b2
//       tracks/000000.csv       point,x,y,depth_mm,visible
//       coverage.csv            triangle,frames

#include <filesystem>
#include <string>

namespace rugae {

/// Bits of truth/masks: 8-bit single channel PNG.
enum FrameMask : unsigned char {
  kMaskValid = 1,          // the ray met the wall; all labels hold
  kMaskSpecular = 2,       // wet-layer reflection adds more than a fixed share of the pixel's light
  kMaskSaturated = 4,      // a channel reached the top of the ADC
  kMaskFlowValid = 8,      // the wall point projects into frame t+1's image
  kMaskFlowOccluded = 16,  // ... but is hidden there by other wall
  kMaskBackwardFlowValid = 32,     // the wall point projects into frame t-1's image
  kMaskBackwardFlowOccluded = 64,  // ... but was hidden there by other wall
};

struct DatasetLayout {
  std::filesystem::path root;

  std::filesystem::path info() const { return root / "dataset.json"; }
  std::filesystem::path manifest() const { return root / "manifest.sha256"; }
  std::filesystem::path observations() const { return root / "observations"; }
  std::filesystem::path calibration() const { return observations() / "calibration.yaml"; }
  std::filesystem::path frame_list() const { return observations() / "frames.csv"; }
  std::filesystem::path frames() const { return observations() / "frames"; }
  /// The frame as it is there: JPEG where there is one, else PNG.
  std::filesystem::path frame(int index) const;
  std::filesystem::path png_frame(int index) const;
  std::filesystem::path jpeg_frame(int index) const;
  std::filesystem::path adc(int index) const;
  std::filesystem::path mosaic(int index) const;
  std::filesystem::path truth() const { return root / "truth"; }
  std::filesystem::path camera() const { return truth() / "camera.yaml"; }
  std::filesystem::path trajectory() const { return truth() / "trajectory.txt"; }
  std::filesystem::path wall() const { return truth() / "wall.ply"; }
  std::filesystem::path depth(int index) const;
  std::filesystem::path normals(int index) const;
  std::filesystem::path flow(int index) const;
  std::filesystem::path masks(int index) const;
  std::filesystem::path radiance(int index) const;
  std::filesystem::path clean(int index) const;
  // Where the dataset has them (further label images: dataset/label_images.h):
  std::filesystem::path backward_flow(int index) const;
  std::filesystem::path triangles(int index) const;
  std::filesystem::path row_poses(int index) const;
  std::filesystem::path wall_motion(int index) const;
  std::filesystem::path regions() const { return truth() / "regions.csv"; }
  std::filesystem::path instances() const { return truth() / "instances.csv"; }
  std::filesystem::path track_points() const { return truth() / "track_points.csv"; }
  std::filesystem::path tracks(int index) const;
  std::filesystem::path coverage() const { return truth() / "coverage.csv"; }
};

}  // namespace rugae
