#pragma once
// Between numpy arrays and our vectors and images. Everything is copied.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <limits>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/pose_track.h"

namespace rugae::python {

namespace py = pybind11;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Rows of an (n, N) array; throws ValueError naming `what` for another shape.
template <int N>
std::vector<Eigen::Matrix<double, N, 1>> to_vectors(const Doubles& array, const char* what) {
  if (array.ndim() != 2 || array.shape(1) != N)
    throw py::value_error(std::string(what) + " must be an array of shape (n, " +
                          std::to_string(N) + ")");
  std::vector<Eigen::Matrix<double, N, 1>> rows(static_cast<std::size_t>(array.shape(0)));
  const auto view = array.unchecked<2>();
  for (py::ssize_t i = 0; i < array.shape(0); ++i)
    for (int k = 0; k < N; ++k) rows[static_cast<std::size_t>(i)][k] = view(i, k);
  return rows;
}

/// An (n, N) array of vectors of T.
template <int N, typename T>
py::array_t<T> to_array(const std::vector<Eigen::Matrix<T, N, 1>>& rows) {
  py::array_t<T> array({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(N)});
  auto view = array.template mutable_unchecked<2>();
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (int k = 0; k < N; ++k) view(static_cast<py::ssize_t>(i), k) = rows[i][k];
  return array;
}

/// (n, 4, 4) matrices; NaN where `known` is false (every pose is known when it is empty).
py::array_t<double> to_matrices(const std::vector<Rigid3>& poses,
                                const std::vector<bool>& known = {});

/// (rows, columns) or (rows, columns, channels), of the image's own type; channels keep their
/// order.
py::array to_array(const cv::Mat& image);

void bind_cameras(py::module_& module);
void bind_datasets(py::module_& module);
void bind_metrics(py::module_& module);
void bind_reconstruction(py::module_& module);

}  // namespace rugae::python
