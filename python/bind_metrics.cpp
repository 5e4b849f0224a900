#include <nlohmann/json.hpp>

#include "core/sim3.h"
#include "python/arrays.h"
#include "validate/evaluate.h"

namespace rugae::python {
namespace {

py::object fit(const Doubles& source, const Doubles& target, bool with_scale) {
  const auto from = to_vectors<3>(source, "source"), to = to_vectors<3>(target, "target");
  if (from.size() != to.size()) throw py::value_error("source and target must have as many points");
  const auto transform = umeyama(from, to, with_scale);
  if (!transform) return py::none();
  const Mat3 r = transform->rotation.toRotationMatrix();
  return py::make_tuple(transform->scale,
                        to_array<3>(std::vector<Vec3>{r.row(0), r.row(1), r.row(2)}),
                        py::array_t<double>(3, transform->translation.data()));
}

py::object metrics(const std::string& dataset, const std::string& estimate, const std::string& map,
                   const std::string& depth, double mm_per_unit, double depth_scale) {
  std::string text;
  {
    py::gil_scoped_release others_may_run;
    Progress silent(Progress::Output::silent);
    const EstimateFiles files{estimate, map, depth, mm_per_unit, depth_scale};
    text = evaluate(dataset, files, silent).dump();
  }
  return py::module_::import("json").attr("loads")(text);
}

}  // namespace

void bind_metrics(py::module_& module) {
  module.def(
      "umeyama", &fit, py::arg("source"), py::arg("target"), py::arg("with_scale") = true,
      "(scale, rotation (3, 3), translation (3,)) that brings source points (n, 3) to the "
      "target's: target = scale * rotation @ source + translation. None when not determined.");
  module.def("evaluate", &metrics, py::arg("dataset"), py::arg("estimate") = "",
             py::arg("map") = "", py::arg("depth") = "", py::arg("mm_per_unit") = 1.0,
             py::arg("depth_scale") = 1.0,
             "Every metric of an estimate against the truth, as nested dictionaries. The estimate "
             "is a folder of ours or another program's trajectory (TUM), which may have a map (a "
             "mesh) and depth (a folder); or depth alone. Lengths times mm_per_unit; depth files "
             "times depth_scale before.");
}

}  // namespace rugae::python
