// Fuzzes spectra, bands and extinction curves with any text, and names of spectra with its first
// line.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "expectations.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/extinction.h"
#include "gamer/sed/photometry.h"
#include "gamer/sed/sed.h"

namespace {

bool is_proper(double value) { return std::isfinite(value) && value >= 0; }

template <class Function>
void check(gamer::Sed::Range range, Function value) {
  // Analytic spectra have no end of their range.
  constexpr double largest = 1e300;
  const double low = range.low, high = std::min(range.high, largest);
  for (const double wavelength :
       {low, 0.5 * low + 0.5 * high, std::sqrt(low) * std::sqrt(high), high}) {
    const double inside = std::clamp(wavelength, low, high);
    expect(is_proper(value(inside)), "finite and not negative");
  }
}

void check_sed(const gamer::Sed& sed) {
  check(sed.range(), [&](double wavelength) { return sed.flux(wavelength); });
  constexpr double tolerance = 1e-12;
  expect(std::abs(sed.flux(gamer::sed_reference_wavelength) - 1) < tolerance, "normalised");
}

void check_band(const gamer::Bandpass& band) {
  check(band.range(), [&](double wavelength) { return band.response(wavelength); });
  const gamer::Bandpass::Nodes nodes = band.nodes();
  for (const double weight : nodes.weight) expect(is_proper(weight), "proper weights");
  expect(band.pivot() > 0 && band.mean() > 0, "wavelengths of the band");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string label = "x.sed";
  expect_errors_only([&] { check_sed(*gamer::parse_sed(text, label, "x")); });
  expect_errors_only([&] { check_band(*gamer::parse_bandpass(text, label, "x")); });
  expect_errors_only([&] {
    const auto curve = gamer::parse_extinction(text, label);
    check(curve->range(), [&](double wavelength) { return curve->relative(wavelength); });
  });
  expect_errors_only([&] {
    gamer::Resources nothing = gamer::Resources::from_record({});
    check_sed(*gamer::find_sed(std::string(text.substr(0, text.find('\n'))), label, nothing));
  });
  return 0;
}
