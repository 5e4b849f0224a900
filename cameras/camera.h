#pragma once
// A camera: its lens (where a ray lands), its light fall-off, its sensor, its lights. Presets:
// cameras/presets/*.yaml.

#include <filesystem>
#include <optional>
#include <string>

#include "cameras/emitter.h"
#include "cameras/field_stop.h"
#include "core/types.h"

namespace rugae {

enum class LensModel { brown_conrady, kannala_brandt };

/// Where a ray lands. Pixels: the centre of the first pixel is (0.5, 0.5). Camera axes: x right, y
/// down, z forward. Brown-Conrady: x' = x/z, radial 1 + k1 r^2 + k2 r^4 + k3 r^6, tangential p1 p2
/// (Brown 1966; OpenCV's order of p1 and p2). Kannala-Brandt: theta_d = theta (1 + k1 theta^2 + k2
/// theta^4 + k3 theta^6 + k4 theta^8), doi:10.1109/TPAMI.2006.153.
struct Lens {
  LensModel model = LensModel::brown_conrady;
  int width = 0, height = 0;                      // px
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // px
  double k1 = 0.0, k2 = 0.0, k3 = 0.0;
  double p1 = 0.0, p2 = 0.0;  // Brown-Conrady only
  double k4 = 0.0;            // Kannala-Brandt only
  FieldStop stop;

  /// Pixel of a point in camera coordinates; empty when the model does not see it: at or behind the
  /// centre's plane (Brown-Conrady), beyond the angle to which the model is monotonic, or not
  /// finite. The image borders do not matter.
  std::optional<Vec2> project(const Vec3& p_cam) const;

  /// Unit ray through a pixel: the exact inverse of project, by Newton's method to 1e-12 in
  /// normalised coordinates; empty where the model has no inverse (beyond its turning point).
  std::optional<Vec3> unproject(const Vec2& pixel) const;

  /// Within the image and the field stop.
  bool contains(const Vec2& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width && pixel.y() < height &&
           passes_stop(pixel);
  }
  bool passes_stop(const Vec2& pixel) const {
    return stop.passes({pixel.x() - cx, pixel.y() - cy}, 0.5 * (width < height ? width : height));
  }
  /// The intrinsic matrix in this convention (first pixel centre at 0.5).
  Mat3 matrix() const;
  /// The same lens without distortion (an undistorted image's lens): same matrix and size,
  /// Brown-Conrady, all k and p zero, no field stop (its outline would be bent).
  Lens pinhole() const;
  /// Largest angle from the axis, rad, to which the model is monotonic and may be used (pi/2 at
  /// most for Brown-Conrady).
  double max_angle_rad() const;
  /// Throws Error naming `where` and the field: size, focal length, finite values, and that all
  /// four corners have an inverse.
  void check(const std::string& where) const;
};

/// project and unproject for many points: the search for the model's limit is paid once.
class LensProjector {
 public:
  explicit LensProjector(const Lens& lens);
  std::optional<Vec2> project(const Vec3& p_cam) const;
  std::optional<Vec3> unproject(const Vec2& pixel) const;
  bool contains(const Vec2& pixel) const { return lens_.contains(pixel); }

 private:
  Lens lens_;
  double limit_;  // of the radial mapping's argument
  double cos_limit_;
};

/// Light fall-off at angle theta and radius r (distance from the principal point over half the
/// image diagonal): cos^4(theta)^(c) (1 + v1 r^2 + v2 r^4 + v3 r^6), c being 1 or 0.
struct Vignetting {
  bool cos4 = true;
  double v1 = 0.0, v2 = 0.0, v3 = 0.0;
};
/// Relative light at a pixel, 1 on the axis.
double vignette_at(const Vignetting& vignetting, const Lens& lens, const Vec2& pixel);
/// The same where the pixel's unit ray is known already.
double vignette_at(const Vignetting& vignetting, const Lens& lens, const Vec2& pixel,
                   const Vec3& ray);

enum class Shutter { global, rolling };

struct Sensor {
  double pixel_pitch_um = 0.0;
  double fps = 0.0;
  int bit_depth = 10;
  double full_well_e = 0.0;   // electrons at saturation
  double read_noise_e = 0.0;  // standard deviation, electrons
  Shutter shutter = Shutter::global;
  double row_time_us = 0.0;  // from a row to the next below; 0 for a global shutter
  double prnu = 0.0;         // standard deviation of the pixels' gains, as a share
  double dsnu_e = 0.0;       // standard deviation of the pixels' offsets, electrons
  int black_level = 0;       // the converter's number of no light
};

/// A thin lens of fixed focus.
struct Focus {
  double f_number = 0.0;     // focal length over the aperture's diameter; 0: not known
  double distance_mm = 0.0;  // along the axis, of what is sharp
};

struct Camera {
  std::string name;
  Lens lens;
  Focus focus;
  Vignetting vignetting;
  Sensor sensor;
  std::vector<Emitter> lights = {Emitter{}};
  int frames_in_paper = 0;   // of all six trajectories together
  double diameter_mm = 0.0;  // of the housing: a path keeps half of it clear at least
};

/// Radius of the aperture, mm: fx times the pixel pitch is the focal length. 0 without an f-number.
double aperture_radius_mm(const Camera& camera);

/// A preset name or a YAML file.
Camera load_camera(const std::string& name_or_path);

/// The camera as YAML that load_camera reads back to the same values.
std::string camera_yaml(const Camera& camera);

/// Frames of trajectory 1 to 6 for this camera: the paper's total split evenly, earlier
/// trajectories take the remainder.
int frames_of_trajectory(const Camera& camera, int trajectory);

/// What a calibration file holds: what a user gets from `rugae calibrate` and what reconstruction
/// reads.
struct Calibration {
  Lens lens;
  /// From a row to the next below, key row_time_us, which a sensor's data sheet states; empty where
  /// the file does not say, 0 for a global shutter.
  std::optional<double> row_time_us;
  /// Key lights, which a capsule's drawing states; empty where the file does not say.
  std::optional<std::vector<Emitter>> lights;
};
Calibration load_calibration(const std::filesystem::path& file);
/// What load_calibration reads back to the same values.
std::string calibration_yaml(const Calibration& calibration, const std::string& comment);
/// The lens alone.
Lens load_lens(const std::filesystem::path& file);
std::string lens_yaml(const Lens& lens, const std::string& comment);

}  // namespace rugae
