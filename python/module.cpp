// The Python module `rugae`: lenses, datasets and estimates as numpy arrays, the metrics, and live
// reconstruction.
#include "core/check.h"
#include "python/arrays.h"

PYBIND11_MODULE(rugae, module) {
  module.doc() =
      "Labelled frames from inside a simulated stomach, reconstructions of it, and their errors.";
  // Broken input: the text names the file and what was expected.
  pybind11::register_exception<rugae::Error>(module, "Error", PyExc_ValueError);
  rugae::python::bind_cameras(module);
  rugae::python::bind_datasets(module);
  rugae::python::bind_metrics(module);
  rugae::python::bind_reconstruction(module);
}
