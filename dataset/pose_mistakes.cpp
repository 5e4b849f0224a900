#include "dataset/pose_mistakes.h"

#include <fmt/format.h>

#include <cmath>

namespace rugae {
namespace {

// The pose with the signs of its camera's and its world's axes changed alike: M R M, M t. For a
// single flipped axis that is how a left-handed system looks from a right-handed one.
Rigid3 mirrored(const Rigid3& pose, const Vec3& signs) {
  const Mat3 m = signs.asDiagonal();
  return {Mat3(m * pose.rotation.toRotationMatrix() * m), Vec3(m * pose.translation)};
}

Rigid3 scaled(const Rigid3& pose, double factor) {
  return {pose.rotation, factor * pose.translation};
}

std::vector<PoseMistake> all_mistakes() {
  std::vector<PoseMistake> mistakes = {{"they are camera_from_world, expected world_from_camera",
                                        [](const Rigid3& p) { return p.inverse(); }},
                                       {"their rotations are transposed", [](const Rigid3& p) {
                                          return Rigid3(p.rotation.conjugate(), p.translation);
                                        }}};
  for (const double factor : {1000.0, 0.001, 100.0, 0.01, 10.0, 0.1})
    mistakes.push_back(
        {scale_mistake(factor), [factor](const Rigid3& p) { return scaled(p, factor); }, factor});
  const struct {
    const char* text;
    Vec3 signs;
  } kAxes[] = {
      {"their x axis is flipped: the axes are left-handed", {-1, 1, 1}},
      {"their y axis is flipped: the axes are left-handed", {1, -1, 1}},
      {"their z axis is flipped: the axes are left-handed", {1, 1, -1}},
      {"their axes are y up, z backward (OpenGL), expected y down, z forward", {1, -1, -1}},
      {"their x and z axes are flipped", {-1, 1, -1}},
      {"their x and y axes are flipped", {-1, -1, 1}},
      {"their translations are negated", {-1, -1, -1}}};
  for (const auto& [text, signs] : kAxes)
    mistakes.push_back({text, [signs = signs](const Rigid3& p) { return mirrored(p, signs); }});
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 signs = Vec3::Ones();
    signs[axis] = -1.0;
    mistakes.push_back(
        {fmt::format("{} of their translations is flipped", "xyz"[axis]), [signs](const Rigid3& p) {
           return Rigid3(p.rotation, Vec3(p.translation.cwiseProduct(signs)));
         }});
  }
  mistakes.push_back(
      {"their quaternions are written qw qx qy qz, expected qx qy qz qw", [](const Rigid3& p) {
         const Quat& q = p.rotation;  // as read: x y z w hold w x y z
         return Rigid3(Quat(q.x(), q.y(), q.z(), q.w()), p.translation);
       }});
  return mistakes;
}

}  // namespace

const std::vector<PoseMistake>& pose_mistakes() {
  static const std::vector<PoseMistake> mistakes = all_mistakes();
  return mistakes;
}

std::string scale_mistake(double factor) {
  const auto is = [factor](double unit) { return std::abs(factor / unit - 1.0) <= 0.02; };
  if (is(1000.0)) return "they are in metres where the depth is in millimetres (a factor 1000)";
  if (is(0.001)) return "they are in millimetres where the depth is in metres (a factor 1000)";
  if (is(10.0)) return "they are in centimetres where the depth is in millimetres (a factor 10)";
  if (is(0.1)) return "they are in millimetres where the depth is in centimetres (a factor 10)";
  return fmt::format(
      "their lengths are not in the unit of the depth (a factor {:.4g} between them)",
      factor >= 1.0 ? factor : 1.0 / factor);
}

}  // namespace rugae
