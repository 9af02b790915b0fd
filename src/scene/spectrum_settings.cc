#include "gamer/scene/spectrum_settings.h"

#include <algorithm>

#include "core/message.h"
#include "gamer/core/near.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_h0 = 1e4;

void check_planes(const ParameterSet& spectrum) {
  std::vector<double> sorted = spectrum.numbers("wavelengths");
  const SourceLocation where = spectrum.where("wavelengths");
  std::vector<std::string> bands = spectrum.texts("bands");
  if (sorted.empty() && bands.empty()) {
    throw InputError(where,
                     "wavelengths is empty; give one wavelength (Angstrom) or more, or bands");
  }
  std::ranges::sort(bands);
  const auto twice = std::adjacent_find(bands.begin(), bands.end());
  if (twice != bands.end()) {
    throw input_error(spectrum.where("bands"), "bands has {} twice", in_quotes(*twice));
  }
  std::ranges::sort(sorted);
  const auto repeated = std::adjacent_find(sorted.begin(), sorted.end());
  if (repeated != sorted.end()) throw input_error(where, "wavelengths has {} A twice", *repeated);
}

}  // namespace

ParameterSection SpectrumSettings::section() {
  return {
      "spectrum",
      "The wavelengths and bands of the image's planes.",
      {Parameter::numbers("wavelengths", "Angstrom", Interval::positive(),
                          std::vector<double>{5500}, "observed wavelengths, one plane each"),
       Parameter::texts("bands", std::vector<std::string>{},
                        "names or files of bandpasses in `bandpasses/`, one plane each, after the "
                        "wavelengths; if only bands are given, there are no other planes"),
       Parameter::integer("band_samples", "", Interval::closed(1, most_band_samples), std::nullopt,
                          "number of wavelengths in each band at which dust is evaluated; by "
                          "default chosen by sampling.tolerance"),
       Parameter::choice("igm", {"none", "madau95"}, "none",
                         "absorption by intergalactic hydrogen: Madau 1995")},
      {}};
}

SpectrumSettings SpectrumSettings::read(const ParameterSet& values) {
  check_planes(values);
  SpectrumSettings result;
  result.bands = values.texts("bands");
  result.bands_where = values.where("bands");
  // The default wavelength gives way to bands.
  if (result.bands.empty() || values.is_given("wavelengths")) {
    result.wavelengths = values.numbers("wavelengths");
  }
  result.wavelengths_where = values.where("wavelengths");
  result.band_samples = optional_integer(values, "band_samples");
  result.igm = values.text("igm") == "madau95" ? Igm::madau95 : Igm::none;
  return result;
}

ParameterSection PhotometrySettings::section() {
  return {
      "photometry",
      "The meaning of magnitudes, and the telescope.",
      {Parameter::text("reference_band", "sdss_r", "band of the scene's magnitudes"),
       Parameter::boolean("attenuated", std::nullopt,
                          "whether magnitudes include dimming by the galaxy's own dust; by default "
                          "apparent magnitudes do and absolute magnitudes do not"),
       Parameter::number("area", "m^2", Interval::positive(), std::nullopt,
                         "collecting area of the telescope, for electron/s"),
       Parameter::number(
           "throughput", "", Interval::left_open(0, 1), 1.0,
           "throughput of telescope and detector, besides that of the bandpass, for electron/s")},
      {}};
}

PhotometrySettings PhotometrySettings::read(const ParameterSet& values) {
  return {.reference_band = values.text("reference_band"),
          .reference_band_where = values.where("reference_band"),
          .attenuated = optional_boolean(values, "attenuated"),
          .area = optional_number(values, "area").value_or(0),
          .throughput = values.number("throughput")};
}

ParameterSection CosmologySettings::section() {
  return {"cosmology",
          "Flat Lambda-CDM.",
          {Parameter::number("H0", "km/s/Mpc", Interval::left_open(0, largest_h0), 70.0,
                             "Hubble constant"),
           Parameter::number("Omega_m", "", Interval::closed(0, 1), 0.3, "matter density")},
          {}};
}

Cosmology CosmologySettings::read(const ParameterSet& values) {
  return Cosmology(values.number("H0"), values.number("Omega_m"));
}

}  // namespace gamer
