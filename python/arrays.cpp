#include "python/arrays.h"

#include <cstring>

namespace rugae::python {

py::array_t<double> to_matrices(const std::vector<Rigid3>& poses, const std::vector<bool>& known) {
  py::array_t<double> array(
      {static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  auto view = array.mutable_unchecked<3>();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Mat4 m = Mat4::Identity();
    m.topRows<3>() = poses[i].matrix3x4();
    if (!known.empty() && !known[i]) m.setConstant(std::numeric_limits<double>::quiet_NaN());
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) view(static_cast<py::ssize_t>(i), r, c) = m(r, c);
  }
  return array;
}

py::array to_array(const cv::Mat& image) {
  std::vector<py::ssize_t> shape{image.rows, image.cols};
  if (image.channels() > 1) shape.push_back(image.channels());
  const py::dtype type = image.depth() == CV_8U    ? py::dtype::of<std::uint8_t>()
                         : image.depth() == CV_16U ? py::dtype::of<std::uint16_t>()
                                                   : py::dtype::of<float>();
  py::array array(type, shape);
  const cv::Mat whole = image.isContinuous() ? image : image.clone();
  std::memcpy(array.mutable_data(), whole.data, whole.total() * whole.elemSize());
  return array;
}

}  // namespace rugae::python
