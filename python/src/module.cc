// The module gamer._core: the library's functions for Python. The package's own files build its
// interface on them.

#include <pybind11/pybind11.h>

#include "bindings.h"
#include "gamer/core/cancellation.h"
#include "gamer/core/error.h"
#include "gamer/core/version.h"

namespace py = pybind11;

PYBIND11_MODULE(_core, module) {
  module.doc() = "The library of gamer; use the package gamer.";
  module.attr("__version__") = gamer::version();
  py::register_exception<gamer::InputError>(module, "InputError", PyExc_ValueError);
  py::register_exception<gamer::RunError>(module, "RunError", PyExc_RuntimeError);
  py::register_exception<gamer::Cancelled>(module, "Cancelled", PyExc_RuntimeError);
  gamer::python::bind_parameters(module);
  gamer::python::bind_render(module);
  gamer::python::bind_process(module);
  gamer::python::bind_noise(module);
  gamer::python::bind_sed(module);
}
