// Live reconstruction: frames from anywhere, one at a time.
#include <pybind11/stl.h>

#include <opencv2/imgproc.hpp>

#include "core/yaml.h"
#include "python/arrays.h"
#include "recon/reconstruction.h"

namespace rugae::python {
namespace {

using Picture = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

std::unique_ptr<Reconstruction> begin(const std::string& folder, const std::string& calibration,
                                      const std::string& method, const std::string& options_file) {
  ReconOptions options;
  if (!options_file.empty()) read_options(YamlReader::from_file(options_file), options);
  options.method = method;
  return std::make_unique<Reconstruction>(folder, load_calibration(calibration), options);
}

void add(Reconstruction& reconstruction, const Picture& rgb, double time_s) {
  if (rgb.ndim() != 3 || rgb.shape(2) != 3)
    throw py::value_error("rgb must be an array of shape (rows, columns, 3)");
  // cv::Mat has no view of what must not be written to; it is only read.
  const cv::Mat view(static_cast<int>(rgb.shape(0)), static_cast<int>(rgb.shape(1)), CV_8UC3,
                     const_cast<std::uint8_t*>(rgb.data()));
  py::gil_scoped_release others_may_run;
  cv::Mat bgr;
  cv::cvtColor(view, bgr, cv::COLOR_RGB2BGR);
  reconstruction.add(bgr, time_s);
}

py::object pose(Reconstruction& reconstruction) {
  std::optional<Rigid3> found;
  {
    py::gil_scoped_release others_may_run;
    found = reconstruction.pose();
  }
  if (!found) return py::none();
  return to_matrices({*found})[py::int_(0)];
}

py::array points(Reconstruction& reconstruction) {
  std::vector<Vec3> known;
  for (const Track& track : reconstruction.structure().tracks)
    if (track.triangulated) known.push_back(track.point);
  return to_array<3>(known);
}

py::tuple map(Reconstruction& reconstruction) {
  TriangleMesh mesh;
  {
    py::gil_scoped_release others_may_run;
    mesh = reconstruction.map();
  }
  return py::make_tuple(to_array<3>(mesh.vertices), to_array<3>(mesh.triangles));
}

py::object finish(Reconstruction& reconstruction, const std::string& out) {
  {
    py::gil_scoped_release others_may_run;
    Progress progress(Progress::Output::silent);
    reconstruction.finish(out, progress);
  }
  return py::module_::import("rugae").attr("Estimate")(out);
}

}  // namespace

void bind_reconstruction(py::module_& module) {
  py::class_<Reconstruction>(
      module, "Reconstruction",
      "Frames one at a time. They are kept in `folder`, an observations folder afterwards.")
      .def(py::init(&begin), py::arg("folder"), py::arg("calibration"), py::arg("method") = "dense",
           py::arg("options") = "",
           "`calibration` and `options` are YAML files, as of `rugae reconstruct`.")
      .def("__len__", &Reconstruction::size)
      .def("add", &add, py::arg("rgb"), py::arg("time_s"),
           "uint8 (rows, columns, 3), RGB, of the lens' size; times ascend.")
      .def("pose", &pose,
           "world_from_camera (4, 4) of the latest frame, so far; None where it is not known.")
      .def("points", &points, "Sparse points so far, (n, 3), in the world of pose().")
      .def("map", &map,
           "The wall so far in the world of pose(): vertices (n, 3), triangles (m, 3).")
      .def("finish", &finish, py::arg("out"),
           "Writes the estimate of all frames and returns it; nothing can be added afterwards.");
}

}  // namespace rugae::python
