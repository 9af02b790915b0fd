#include "gamer/scene/spectrum_settings.h"

#include <algorithm>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/near.h"

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

BoundTable spectrum_keys(SpectrumSettings& p) {
  return {Parameter::numbers("wavelengths", "Angstrom", Interval::positive(),
                             std::vector<double>{5500}, "observed wavelengths, one plane each"),
          {p.bands, "bands",
           "names or files of bandpasses in `bandpasses/`, one plane each, after the "
           "wavelengths; if only bands are given, there are no other planes"},
          {p.band_samples, "band_samples", "", Interval::closed(1, most_band_samples),
           "number of wavelengths in each band at which dust is evaluated; by "
           "default chosen by sampling.tolerance"},
          choice(p.igm, "igm", {{"none", Igm::none}, {"madau95", Igm::madau95}},
                 "absorption by intergalactic hydrogen: Madau 1995")};
}

BoundTable photometry_keys(PhotometrySettings& p) {
  return {{p.reference_band, "reference_band", "band of the scene's magnitudes"},
          {p.attenuated, "attenuated",
           "whether magnitudes include dimming by the galaxy's own dust; by default "
           "apparent magnitudes do and absolute magnitudes do not"},
          without_default({p.area, "area", "m^2", Interval::positive(),
                           "collecting area of the telescope, for electron/s"}),
          {p.throughput, "throughput", "", Interval::left_open(0, 1),
           "throughput of telescope and detector, besides that of the bandpass, for electron/s"}};
}

}  // namespace

ParameterSection SpectrumSettings::section() {
  return {"spectrum", "The wavelengths and bands of the image's planes.",
          declarations(spectrum_keys)};
}

SpectrumSettings SpectrumSettings::read(const ParameterSet& values) {
  check_planes(values);
  SpectrumSettings result = read_object(values, spectrum_keys);
  result.bands_where = values.where("bands");
  // The default wavelength gives way to bands.
  if (result.bands.empty() || values.is_given("wavelengths")) {
    result.wavelengths = values.numbers("wavelengths");
  }
  result.wavelengths_where = values.where("wavelengths");
  return result;
}

ParameterSection PhotometrySettings::section() {
  return {"photometry", "The meaning of magnitudes, and the telescope.",
          declarations(photometry_keys)};
}

PhotometrySettings PhotometrySettings::read(const ParameterSet& values) {
  PhotometrySettings result = read_object(values, photometry_keys);
  result.reference_band_where = values.where("reference_band");
  return result;
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
