#include <pybind11/stl.h>

#include "cameras/camera.h"
#include "python/arrays.h"

namespace rugae::python {
namespace {

const Vec2 kNoPixel = Vec2::Constant(std::numeric_limits<double>::quiet_NaN());
const Vec3 kNoRay = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

py::array_t<double> project(const Lens& lens, const Doubles& points_cam) {
  const auto points = to_vectors<3>(points_cam, "points");
  const LensProjector projector(lens);
  std::vector<Vec2> pixels;
  pixels.reserve(points.size());
  for (const Vec3& point : points) pixels.push_back(projector.project(point).value_or(kNoPixel));
  return to_array<2>(pixels);
}

py::array_t<double> unproject(const Lens& lens, const Doubles& pixels) {
  const auto places = to_vectors<2>(pixels, "pixels");
  const LensProjector projector(lens);
  std::vector<Vec3> rays;
  rays.reserve(places.size());
  for (const Vec2& pixel : places) rays.push_back(projector.unproject(pixel).value_or(kNoRay));
  return to_array<3>(rays);
}

// Columns of camera_matrix as lists of rows: numpy.array(lens.matrix()) is 3 x 3.
py::array_t<double> matrix(const Lens& lens) {
  const Mat3 k = lens.matrix();
  return to_array<3>(std::vector<Vec3>{k.row(0), k.row(1), k.row(2)});
}

}  // namespace

void bind_cameras(py::module_& module) {
  py::enum_<LensModel>(module, "LensModel")
      .value("brown_conrady", LensModel::brown_conrady)
      .value("kannala_brandt", LensModel::kannala_brandt);
  py::class_<Lens>(module, "Lens",
                   "Where a ray lands. The centre of the first pixel is (0.5, 0.5); camera axes: x "
                   "right, y down, z forward.")
      .def(py::init<>())
      .def_readwrite("model", &Lens::model)
      .def_readwrite("width", &Lens::width)
      .def_readwrite("height", &Lens::height)
      .def_readwrite("fx", &Lens::fx)
      .def_readwrite("fy", &Lens::fy)
      .def_readwrite("cx", &Lens::cx)
      .def_readwrite("cy", &Lens::cy)
      .def_readwrite("k1", &Lens::k1)
      .def_readwrite("k2", &Lens::k2)
      .def_readwrite("k3", &Lens::k3)
      .def_readwrite("k4", &Lens::k4)
      .def_readwrite("p1", &Lens::p1)
      .def_readwrite("p2", &Lens::p2)
      .def("project", &project, py::arg("points"),
           "Pixels (n, 2) of points (n, 3) in camera coordinates; NaN where a point is not seen.")
      .def("unproject", &unproject, py::arg("pixels"),
           "Unit rays (n, 3) of pixels (n, 2); NaN where the lens has no inverse.")
      .def("matrix", &matrix, "The (3, 3) intrinsic matrix.")
      .def("pinhole", &Lens::pinhole, "The same lens without distortion.");
  py::class_<Camera>(module, "Camera")
      .def_readonly("name", &Camera::name)
      .def_readonly("lens", &Camera::lens)
      .def_readonly("diameter_mm", &Camera::diameter_mm)
      .def_property_readonly("fps", [](const Camera& camera) { return camera.sensor.fps; });
  module.def("load_camera", &load_camera, py::arg("name_or_path"), "A preset or a YAML file.");
  module.def(
      "load_lens", [](const std::string& file) { return load_lens(file); }, py::arg("file"),
      "A calibration file.");
}

}  // namespace rugae::python
