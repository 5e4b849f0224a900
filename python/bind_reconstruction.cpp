// Live reconstruction: frames from anywhere, one at a time.
#include <pybind11/stl.h>

#include <mutex>
#include <opencv2/imgproc.hpp>

#include "core/yaml.h"
#include "python/arrays.h"
#include "recon/reconstruction.h"

namespace rugae::python {
namespace {

// One call at a time, whatever thread it comes from: a capsule's thread may add frames while
// another asks for poses. Whoever waits for the lock has let Python go on, so that who holds it
// can.
class Live {
 public:
  Live(const std::string& folder, const Calibration& calibration, const ReconOptions& options)
      : reconstruction_(folder, calibration, options) {}

  template <typename F>
  auto alone(F f) {
    const py::gil_scoped_release others_may_run;
    const std::lock_guard lock(mutex_);
    return f(reconstruction_);
  }

 private:
  std::mutex mutex_;
  Reconstruction reconstruction_;
};

std::unique_ptr<Live> begin(const std::string& folder, const std::string& calibration,
                            const std::string& method, const std::string& options_file) {
  ReconOptions options;
  if (!options_file.empty()) read_options(YamlReader::from_file(options_file), options);
  options.method = method;
  return std::make_unique<Live>(folder, load_calibration(calibration), options);
}

void add(Live& live, const py::array& rgb, double time_s) {
  // Conversion would make black pictures of floats from 0 to 1, and wrap 16 bits.
  if (rgb.dtype().kind() != 'u' || rgb.dtype().itemsize() != 1)
    throw py::type_error("rgb is an array of " + std::string(py::str(rgb.dtype())) +
                         ", expected uint8");
  if (rgb.ndim() != 3 || rgb.shape(2) != 3)
    throw py::value_error("rgb must be an array of shape (rows, columns, 3)");
  const py::array_t<std::uint8_t, py::array::c_style> rows(rgb);
  // cv::Mat has no view of what must not be written to; it is only read.
  const cv::Mat view(static_cast<int>(rows.shape(0)), static_cast<int>(rows.shape(1)), CV_8UC3,
                     const_cast<std::uint8_t*>(rows.data()));
  live.alone([&](Reconstruction& reconstruction) {
    cv::Mat bgr;
    cv::cvtColor(view, bgr, cv::COLOR_RGB2BGR);
    reconstruction.add(bgr, time_s);
  });
}

int size(Live& live) {
  return live.alone([](const Reconstruction& reconstruction) { return reconstruction.size(); });
}

py::object pose(Live& live) {
  const auto found =
      live.alone([](Reconstruction& reconstruction) { return reconstruction.pose(); });
  if (!found) return py::none();
  return to_matrices({*found})[py::int_(0)];
}

py::array points(Live& live) {
  return to_array<3>(live.alone([](Reconstruction& reconstruction) {
    std::vector<Vec3> known;
    for (const Track& track : reconstruction.structure().tracks)
      if (track.triangulated) known.push_back(track.point);
    return known;
  }));
}

py::tuple map(Live& live) {
  const TriangleMesh mesh =
      live.alone([](Reconstruction& reconstruction) { return reconstruction.map(); });
  return py::make_tuple(to_array<3>(mesh.vertices), to_array<3>(mesh.triangles));
}

py::object finish(Live& live, const std::string& out) {
  live.alone([&](Reconstruction& reconstruction) {
    Progress progress(Progress::Output::silent);
    reconstruction.finish(out, progress);
  });
  return py::module_::import("rugae").attr("Estimate")(out);
}

}  // namespace

void bind_reconstruction(py::module_& module) {
  py::class_<Live>(
      module, "Reconstruction",
      "Frames one at a time. They are kept in `folder`, an observations folder afterwards. Threads "
      "may share it: calls wait for each other.")
      .def(py::init(&begin), py::arg("folder"), py::arg("calibration"), py::arg("method") = "dense",
           py::arg("options") = "",
           "`calibration` and `options` are YAML files, as of `rugae reconstruct`.")
      .def("__len__", &size)
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
