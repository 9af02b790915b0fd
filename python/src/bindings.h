#pragma once

#include <pybind11/pybind11.h>

#include "gamer/core/parameter.h"

namespace gamer::python {

/// Each adds its classes and functions to the module.
void bind_parameters(pybind11::module_& module);
void bind_render(pybind11::module_& module);
void bind_process(pybind11::module_& module);
void bind_noise(pybind11::module_& module);
void bind_sed(pybind11::module_& module);

/// A declaration as a dictionary.
pybind11::dict describe(const Parameter& parameter);
pybind11::list describe(const ParameterTable& table);

}  // namespace gamer::python
