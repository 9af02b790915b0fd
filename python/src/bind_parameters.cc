#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <string>
#include <vector>

#include "bindings.h"
#include "gamer/core/error.h"
#include "gamer/core/resources.h"
#include "gamer/core/type_name.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/job/listing.h"
#include "gamer/noise/noise.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"
#include "gamer/sed/bandpass.h"

namespace gamer::python {
namespace {

namespace py = pybind11;

py::object to_python(const ParameterValue& value) {
  return std::visit(
      [](const auto& held) -> py::object {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::monostate>) {
          return py::none();
        } else {
          return py::cast(held);
        }
      },
      value);
}

/// A value of the declared type; whole numbers serve as numbers. Throws InputError.
ParameterValue from_python(const Parameter& parameter, const py::object& value) {
  const auto fail = [&] {
    throw InputError(parameter.name + " must be " + parameter.type_text() + ", not " +
                     std::string(py::str(py::repr(value))));
  };
  const bool is_flag = py::isinstance<py::bool_>(value);
  if (value.is_none()) return std::monostate();
  try {
    switch (parameter.type) {
      case ParameterType::boolean:
        if (!is_flag) fail();
        return value.cast<bool>();
      case ParameterType::integer:
        if (is_flag || py::isinstance<py::float_>(value) || py::isinstance<py::str>(value)) fail();
        return value.cast<std::int64_t>();
      case ParameterType::number:
        if (is_flag || py::isinstance<py::str>(value)) fail();
        return value.cast<double>();
      case ParameterType::text:
      case ParameterType::choice:
        if (!py::isinstance<py::str>(value)) fail();
        return value.cast<std::string>();
      case ParameterType::texts:
        if (py::isinstance<py::str>(value)) fail();
        return value.cast<std::vector<std::string>>();
      case ParameterType::size2:
        if (py::isinstance<py::int_>(value) && !is_flag) {
          const auto side = value.cast<double>();
          return std::vector<double>{side, side};
        }
        return value.cast<std::vector<double>>();
      case ParameterType::vector2:
      case ParameterType::vector3:
      case ParameterType::numbers: return value.cast<std::vector<double>>();
      case ParameterType::noise: break;
    }
  } catch (const py::cast_error&) {
    fail();
  } catch (const py::error_already_set&) {
    fail();
  }
  return std::monostate();
}

/// The declarations of a group and name, as declarations() takes them.
ParameterTable find_table(const std::string& group, const std::string& name) {
  if (group == "section") {
    for (const ParameterSection& section : render_parameter_sections()) {
      if (section.name == name) return section.table;
    }
  }
  if (group == "galaxy") return Galaxy::table();
  if (group == "arms") return ArmPattern::table();
  if (group == "arm") return ArmPattern::arm_table();
  if (group == "columns") return scene_columns();
  if (group == "component") {
    const ComponentKind& kind = find_component_kind(name, {});
    if (!kind.noise) return kind.parameters;
    return kind.parameters + ParameterTable{Parameter::noise("noise", "the texture, or False")};
  }
  if (group == "noise") {
    const ComponentKind& kind = find_component_kind(name, {});
    if (!kind.noise) throw InputError("a component of class '" + name + "' has no noise");
    return kind.noise->table();
  }
  throw InputError("there are no parameters of " + group + " " + name);
}

py::list sections() {
  py::list result;
  for (const ParameterSection& section : render_parameter_sections()) {
    result.append(py::make_tuple(section.name, section.description));
  }
  return result;
}

py::list kinds() {
  py::list result;
  for (const ComponentKind& kind : component_kinds()) {
    py::dict one;
    one["name"] = kind.name;
    one["description"] = kind.description;
    one["emits"] = kind.traits.emits;
    one["absorbs"] = kind.traits.absorbs;
    one["has_noise"] = kind.noise.has_value();
    result.append(one);
  }
  return result;
}

/// Throws InputError for a value that its declaration does not allow.
void check_value(const std::string& group, const std::string& name, const std::string& key,
                 const py::object& value) {
  const ParameterTable table = find_table(group, name);
  for (const Parameter& parameter : table) {
    if (parameter.name != key || parameter.type == ParameterType::noise) continue;
    ParameterSet(table).set(key, from_python(parameter, value));
  }
}

/// Throws InputError unless the text is that of a galaxy.
void check_galaxy(const std::string& text, const std::string& label,
                  const std::vector<std::filesystem::path>& folders) {
  Resources resources(folders);
  GalaxySettings settings;
  settings.noise_kind = RenderParameters().noise.kind;
  Galaxy::read(parse_toml(text, label), settings, resources);
}

std::string galaxy_text(const std::string& name,
                        const std::vector<std::filesystem::path>& folders) {
  return Resources(folders).find("galaxies", name, "", galaxy_suffixes()).content.str();
}

std::vector<std::string> names(const std::string& kind,
                               const std::vector<std::filesystem::path>& folders) {
  const Resources resources(folders);
  if (kind == "galaxies") return resources.names(kind, galaxy_suffixes());
  if (kind == "bandpasses") return resources.names(kind, bandpass_suffixes());
  if (kind == "seds") return resources.names(kind, sed_suffixes());
  throw InputError("there are no names of " + kind);
}

}  // namespace

py::dict describe(const Parameter& parameter) {
  py::dict result;
  result["name"] = parameter.name;
  result["type"] = type_name(parameter.type);
  result["unit"] = parameter.unit;
  result["interval"] = py::make_tuple(parameter.interval.low, parameter.interval.high,
                                      parameter.interval.low_open, parameter.interval.high_open);
  result["type_text"] = parameter.type_text();
  result["default"] = to_python(parameter.default_value);
  result["description"] = parameter.description;
  result["choices"] = parameter.choices;
  result["required"] = parameter.required;
  return result;
}

py::list describe(const ParameterTable& table) {
  py::list result;
  for (const Parameter& parameter : table) result.append(describe(parameter));
  return result;
}

void bind_parameters(py::module_& module) {
  module.def("sections", &sections, "Names and descriptions of the sections of parameter files.");
  module.def("kinds", &kinds, "The kinds of components.");
  module.def(
      "table",
      [](const std::string& group, const std::string& name) {
        return describe(find_table(group, name));
      },
      py::arg("group"), py::arg("name") = "", "The declarations of a group of parameters.");
  module.def("check_value", &check_value, py::arg("group"), py::arg("name"), py::arg("key"),
             py::arg("value"));
  module.def("check_galaxy", &check_galaxy, py::arg("text"), py::arg("label"), py::arg("folders"));
  module.def("galaxy_text", &galaxy_text, py::arg("name"), py::arg("folders"));
  module.def("names", &names, py::arg("kind"), py::arg("folders"));
  module.def("toml_string", [](const std::string& text) { return toml_string(text); });
  module.def("is_bare_key", [](const std::string& key) { return is_bare_key(key); });
  module.def("default_folders", &default_data_folders);
}

}  // namespace gamer::python
