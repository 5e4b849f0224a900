#include <pybind11/stl.h>

#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/check_dataset.h"
#include "dataset/estimate.h"
#include "dataset/export/export.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"
#include "dataset/truth.h"
#include "python/arrays.h"

namespace rugae::python {
namespace {

// A finished dataset: observations and truth together, which only tools beside reconstruction may
// hold.
struct Dataset {
  explicit Dataset(const std::string& folder)
      : root(folder), truth(Truth::open(folder)), layout{folder} {}

  int index(int i) const {  // counts from the end when negative, as Python does
    const int at = i < 0 ? i + truth.size() : i;
    if (at < 0 || at >= truth.size()) throw py::index_error("frame " + std::to_string(i));
    return at;
  }
  py::array image(int i) const {
    cv::Mat rgb;
    cv::cvtColor(read_image_bgr(layout.frame(index(i))), rgb, cv::COLOR_BGR2RGB);
    return to_array(rgb);
  }
  std::vector<double> times_s() const {
    std::vector<double> times;
    for (const TimedPose& pose : truth.track()) times.push_back(pose.time_s);
    return times;
  }
  py::array_t<double> poses() const {
    std::vector<Rigid3> all;
    for (const TimedPose& pose : truth.track()) all.push_back(pose.world_from_camera);
    return to_matrices(all);
  }

  std::string root;
  Truth truth;
  DatasetLayout layout;
};

// A label that not every dataset has.
py::object image_or_none(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return py::none();
  return to_array(read_exr(file));
}

struct ReadEstimate {
  explicit ReadEstimate(const std::string& folder)
      : layout{folder}, estimate(read_estimate(folder)) {}

  py::array_t<double> poses() const {
    std::vector<bool> known;
    for (const FrameState state : estimate.states) known.push_back(state != FrameState::lost);
    return to_matrices(estimate.world_from_camera, known);
  }
  py::object depth(int at) const {
    const int frames = static_cast<int>(estimate.times_s.size()), i = at < 0 ? at + frames : at;
    if (i < 0 || i >= frames) throw py::index_error("frame " + std::to_string(at));
    if (!std::filesystem::exists(layout.depth(i))) return py::none();
    return to_array(read_exr(layout.depth(i)));
  }

  EstimateLayout layout;
  Estimate estimate;
};

std::vector<std::string> state_names(const Estimate& estimate) {
  std::vector<std::string> names;
  for (const FrameState state : estimate.states)
    names.emplace_back(state == FrameState::lost       ? "lost"
                       : state == FrameState::keyframe ? "keyframe"
                                                       : "resected");
  return names;
}

py::array as_array(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

}  // namespace

void bind_datasets(py::module_& module) {
  using Type = py::class_<Dataset>;
  Type(module, "Dataset", "A finished dataset. Lengths in mm, times in s.")
      .def(py::init<const std::string&>(), py::arg("folder"))
      .def("__len__", [](const Dataset& d) { return d.truth.size(); })
      .def_readonly("folder", &Dataset::root)
      .def_property_readonly("camera", [](const Dataset& d) { return d.truth.camera(); })
      .def_property_readonly("lens", [](const Dataset& d) { return d.truth.camera().lens; })
      .def_property_readonly("times_s", [](const Dataset& d) { return as_array(d.times_s()); })
      .def_property_readonly("world_from_camera", &Dataset::poses, "Matrices (n, 4, 4), mm.")
      .def("image", &Dataset::image, py::arg("index"), "uint8 (rows, columns, 3), RGB.")
      .def(
          "depth_mm",
          [](const Dataset& d, int i) { return to_array(d.truth.depth_mm(d.index(i))); },
          py::arg("index"), "float32 z-depth; NaN where nothing was hit.")
      .def(
          "normal", [](const Dataset& d, int i) { return to_array(d.truth.normal(d.index(i))); },
          py::arg("index"), "float32 (rows, columns, 3), camera axes, facing the camera.")
      .def(
          "flow_px",
          [](const Dataset& d, int i) -> py::object {
            if (d.index(i) + 1 == d.truth.size()) return py::none();
            return to_array(d.truth.flow_px(d.index(i)));
          },
          py::arg("index"),
          "float32 (rows, columns, 2) to the next frame; NaN where not valid; None for the last.")
      .def(
          "backward_flow_px",
          [](const Dataset& d, int i) { return image_or_none(d.layout.backward_flow(d.index(i))); },
          py::arg("index"),
          "float32 (rows, columns, 2) to the frame before; NaN where not valid; None for the first "
          "frame and for datasets without.")
      .def(
          "triangles",
          [](const Dataset& d, int i) { return image_or_none(d.layout.triangles(d.index(i))); },
          py::arg("index"),
          "float32 (rows, columns, 3): triangle of the wall and the barycentric coordinates of its "
          "second and third corner; NaN where nothing was hit; None for datasets without.")
      .def(
          "label",
          [](const Dataset& d, const std::string& name, int i) -> py::object {
            const auto file = label_image(name).file(d.layout, d.index(i));
            if (!std::filesystem::exists(file)) return py::none();
            return to_array(d.truth.label(name, d.index(i)));
          },
          py::arg("name"), py::arg("index"),
          "Any label image by the name of its folder below truth/; None for datasets without.")
      .def(
          "tracks",
          [](const Dataset& d, int i) -> py::object {
            if (!std::filesystem::exists(d.layout.tracks(d.index(i)))) return py::none();
            std::vector<Eigen::Matrix<double, 5, 1>> rows;
            for (const TrackSample& s : d.truth.tracks(d.index(i)))
              rows.push_back(
                  {double(s.point), s.pixel.x(), s.pixel.y(), s.depth_mm, double(s.visible)});
            return to_array<5>(rows);
          },
          py::arg("index"),
          "(n, 5): point, x, y, depth in mm, 1 where visible, of the followed points in the image; "
          "None for datasets without.")
      .def(
          "row_poses",
          [](const Dataset& d, int i) -> py::object {
            const RowPoses rows = d.truth.row_poses(d.index(i));
            if (!rows.rolling()) return py::none();
            return to_matrices(rows.poses());
          },
          py::arg("index"),
          "Matrices (rows + 2, 4, 4) of world_from_camera of rows -1 to `rows`, each in the middle "
          "of its exposure; None for a global shutter.")
      .def(
          "wall_vertices_at_mm",
          [](const Dataset& d, int i) { return to_array<3>(d.truth.wall(d.index(i)).vertices); },
          py::arg("index"), "The wall's vertices at the frame's time.")
      .def(
          "masks", [](const Dataset& d, int i) { return to_array(d.truth.masks(d.index(i))); },
          py::arg("index"), "uint8, bits MASK_VALID, MASK_SPECULAR, ...")
      .def_property_readonly("wall_vertices_mm",
                             [](const Dataset& d) { return to_array<3>(d.truth.wall().vertices); })
      .def_property_readonly(
          "wall_triangles", [](const Dataset& d) { return to_array<3>(d.truth.wall().triangles); });
  module.attr("MASK_VALID") = static_cast<int>(kMaskValid);
  module.attr("MASK_SPECULAR") = static_cast<int>(kMaskSpecular);
  module.attr("MASK_SATURATED") = static_cast<int>(kMaskSaturated);
  module.attr("MASK_FLOW_VALID") = static_cast<int>(kMaskFlowValid);
  module.attr("MASK_FLOW_OCCLUDED") = static_cast<int>(kMaskFlowOccluded);
  module.attr("MASK_BACKWARD_FLOW_VALID") = static_cast<int>(kMaskBackwardFlowValid);
  module.attr("MASK_BACKWARD_FLOW_OCCLUDED") = static_cast<int>(kMaskBackwardFlowOccluded);

  py::class_<ReadEstimate>(module, "Estimate", "What a reconstruction left; lengths in map units.")
      .def(py::init<const std::string&>(), py::arg("folder"))
      .def("__len__", [](const ReadEstimate& e) { return e.estimate.times_s.size(); })
      .def_property_readonly("method", [](const ReadEstimate& e) { return e.estimate.method; })
      .def_property_readonly("lens", [](const ReadEstimate& e) { return e.estimate.lens; })
      .def_property_readonly("times_s",
                             [](const ReadEstimate& e) { return as_array(e.estimate.times_s); })
      .def_property_readonly("states",
                             [](const ReadEstimate& e) { return state_names(e.estimate); })
      .def_property_readonly("world_from_camera", &ReadEstimate::poses,
                             "Matrices (n, 4, 4); NaN for lost frames.")
      .def("depth", &ReadEstimate::depth, py::arg("index"), "float32, or None where not estimated.")
      .def_property_readonly("points",
                             [](const ReadEstimate& e) { return to_array<3>(e.estimate.points); })
      .def_property_readonly(
          "map_vertices",
          [](const ReadEstimate& e) { return to_array<3>(e.estimate.map.vertices); })
      .def_property_readonly(
          "map_triangles",
          [](const ReadEstimate& e) { return to_array<3>(e.estimate.map.triangles); })
      .def_property_readonly("numbers", [](const ReadEstimate& e) { return e.estimate.numbers; });

  module.def(
      "check",
      [](const std::string& folder) {
        py::gil_scoped_release others_may_run;
        return check_dataset(folder).problems;
      },
      py::arg("folder"), "The problems of a dataset, one line each; empty when it is sound.");

  module.def(
      "export",
      [](const std::string& folder, const std::string& format, const std::string& out,
         double depth_per_mm) {
        py::gil_scoped_release others_may_run;
        Progress quiet(Progress::Output::silent);
        return export_dataset(folder, {format, depth_per_mm}, out, quiet).notes;
      },
      py::arg("folder"), py::arg("format"), py::arg("out"), py::arg("depth_per_mm") = 0.0,
      "Writes a dataset as tum, colmap, nerfstudio or c3vd (docs/export.md); returns what its "
      "reader should know, one line each.");
}

}  // namespace rugae::python
