#include "recon/surf.h"

#include <dlib/array2d.h>
#include <dlib/image_keypoint.h>

namespace rugae {

std::vector<SurfPoint> surf_points(const cv::Mat& gray, int max_points) {
  constexpr double kThreshold = 5.0;  // of the Hessian's determinant: low, for faint mucosa
  dlib::array2d<unsigned char> image(gray.rows, gray.cols);
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x) image[y][x] = gray.at<unsigned char>(y, x);
  std::vector<SurfPoint> points;
  for (const dlib::surf_point& s : dlib::get_surf_points(image, max_points, kThreshold)) {
    SurfPoint point;
    point.pixel = Vec2(s.p.center.x() + 0.5, s.p.center.y() + 0.5);
    for (long i = 0; i < s.des.size(); ++i)
      point.descriptor.push_back(static_cast<float>(s.des(i)));
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace rugae
