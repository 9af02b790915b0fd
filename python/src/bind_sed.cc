#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bindings.h"
#include "gamer/core/error.h"
#include "gamer/core/resources.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/cosmology.h"
#include "gamer/sed/photometry.h"
#include "gamer/sed/sed.h"

namespace gamer::python {
namespace {

namespace py = pybind11;
using Folders = std::vector<std::filesystem::path>;

double flux_of(const Sed& sed, double wavelength) {
  const auto [low, high] = sed.range();
  if (!(wavelength >= low && wavelength <= high)) {
    throw InputError("SED '" + sed.name() + "' is not known at " + std::to_string(wavelength) +
                     " Angstrom");
  }
  return sed.flux(wavelength);
}

void check_covers(const Sed& sed, const Bandpass& band, double redshift) {
  if (!(redshift >= 0)) throw InputError("a redshift is at least 0");
  if (covers(sed, band, redshift)) return;
  throw InputError("SED '" + sed.name() + "' at redshift " + std::to_string(redshift) +
                   " does not cover the band '" + band.name() + "'");
}

Igm igm_of(const std::string& name) {
  if (name == "none") return Igm::none;
  if (name == "madau95") return Igm::madau95;
  throw InputError("igm is \"none\" or \"madau95\", not \"" + name + "\"");
}

}  // namespace

void bind_sed(py::module_& module) {
  py::class_<Sed, std::shared_ptr<Sed>>(module, "Sed")
      .def(py::init([](const std::string& name, const Folders& folders) {
             Resources resources(folders);
             return std::const_pointer_cast<Sed>(find_sed(name, "", resources));
           }),
           py::arg("name"), py::arg("folders") = default_data_folders())
      .def_property_readonly("name", &Sed::name)
      .def_property_readonly(
          "range",
          [](const Sed& self) { return py::make_tuple(self.range().low, self.range().high); })
      .def(
          "flux",
          [](const Sed& self, const py::array_t<double>& wavelength) {
            return py::vectorize([&](double at) { return flux_of(self, at); })(wavelength);
          },
          py::arg("wavelength"));
  py::class_<Bandpass, std::shared_ptr<Bandpass>>(module, "Bandpass")
      .def(py::init([](const std::string& name, const Folders& folders) {
             Resources resources(folders);
             return std::const_pointer_cast<Bandpass>(find_bandpass(name, "", resources));
           }),
           py::arg("name"), py::arg("folders") = default_data_folders())
      .def_property_readonly("name", &Bandpass::name)
      .def_property_readonly("pivot", &Bandpass::pivot)
      .def_property_readonly(
          "range",
          [](const Bandpass& self) { return py::make_tuple(self.range().low, self.range().high); })
      .def(
          "response",
          [](const Bandpass& self, const py::array_t<double>& wavelength) {
            return py::vectorize([&](double at) { return self.response(at); })(wavelength);
          },
          py::arg("wavelength"));
  module.def(
      "band_flux",
      [](const Sed& sed, const Bandpass& band, double redshift, const std::string& igm) {
        check_covers(sed, band, redshift);
        return band_flux(sed, band, redshift, igm_of(igm));
      },
      py::arg("sed"), py::arg("band"), py::arg("redshift") = 0, py::arg("igm") = "none");
  module.def(
      "k_correction",
      [](const Sed& sed, const Bandpass& observed, const Bandpass& rest, double redshift) {
        check_covers(sed, observed, redshift);
        check_covers(sed, rest, 0);
        return k_correction(sed, observed, rest, redshift);
      },
      py::arg("sed"), py::arg("observed"), py::arg("rest"), py::arg("redshift"));
  module.def("distance_modulus", [](double redshift, double h0, double omega_m) {
    return Cosmology(h0, omega_m).distance_modulus(redshift);
  });
}

}  // namespace gamer::python
