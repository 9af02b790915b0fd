#include "gamer/image/instrument.h"

#include <fmt/ranges.h>

#include "core/message.h"
#include "gamer/core/config.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr double most_exposures = 1e6;

std::optional<double> optional_number(const ParameterSet& values, std::string_view key) {
  if (!values.has(key)) return std::nullopt;
  return values.number(key);
}

}  // namespace

ParameterTable Instrument::table() {
  return {
      required(Parameter::text("name", std::nullopt, "name of the telescope and the camera")),
      Parameter::text("description", "", "one line"),
      required(Parameter::number("pixel_scale", "arcsec", Interval::positive(), std::nullopt,
                                 "side of a pixel on the sky")),
      required(Parameter::number("exposure", "s", Interval::positive(), std::nullopt,
                                 "usual exposure time, of all exposures together")),
      Parameter::integer("exposures", "", Interval::closed(1, most_exposures), 1,
                         "exposures that are added up"),
      required(Parameter::number("read_noise", "electron", Interval::at_least(0), std::nullopt,
                                 "rms of a pixel, of one exposure")),
      Parameter::number("dark", "electron/s", Interval::at_least(0), 0.0,
                        "dark current of a pixel"),
      Parameter::number("gain", "electron/ADU", Interval::positive(), 1.0, "electrons of 1 ADU"),
      Parameter::number("full_well", "electron", Interval::positive(), std::nullopt,
                        "most electrons of a pixel, of one exposure"),
      Parameter::choice("psf", {"gaussian", "moffat"}, "gaussian", "profile of the PSF"),
      Parameter::number("beta", "", Interval::left_open(1, 100), 3.0,
                        "exponent of the Moffat profile"),
  };
}

ParameterTable Instrument::band_table() {
  return {
      required(Parameter::text("name", std::nullopt, "name of its bandpass in `bandpasses/`")),
      required(Parameter::number("zero_point", "mag", Interval::any(), std::nullopt,
                                 "AB magnitude that gives 1 electron/s")),
      Parameter::number("sky", "mag/arcsec^2", Interval::any(), std::nullopt,
                        "usual AB surface brightness of the sky"),
      required(Parameter::number("fwhm", "arcsec", Interval::positive(), std::nullopt,
                                 "usual FWHM of the PSF")),
  };
}

Instrument Instrument::parse(std::string_view text, const std::string& label) {
  const ConfigNode root = parse_toml(text, label);
  const std::vector<std::string> sections = {"instrument", "band"};
  for (const auto& [key, node] : root.table()) {
    if (key == sections[0] || key == sections[1]) continue;
    throw input_error(node.key_where, "unknown section {} in an instrument{}", in_quotes(key),
                      did_you_mean(key, sections));
  }
  const ConfigNode* section = root.find("instrument");
  const ConfigNode* list = root.find("band");
  if (section == nullptr) throw InputError({label, 0, 0}, "an instrument needs [instrument]");
  if (list == nullptr || !list->is_array()) {
    throw InputError({label, 0, 0}, "an instrument needs [[band]] with name, zero_point and fwhm");
  }
  const ParameterSet values = ParameterSet::read(table(), *section, "", "in [instrument]");
  Instrument result;
  result.name = values.text("name");
  result.description = values.text("description");
  result.pixel_scale = values.number("pixel_scale");
  result.exposure = values.number("exposure");
  result.exposures = static_cast<int>(values.integer("exposures"));
  result.read_noise = values.number("read_noise");
  result.dark = values.number("dark");
  result.gain = values.number("gain");
  result.full_well = optional_number(values, "full_well");
  result.is_moffat = values.text("psf") == "moffat";
  result.beta = values.number("beta");
  for (const ConfigNode& node : list->array()) {
    const ParameterSet band = ParameterSet::read(band_table(), node, "", "in [[band]]");
    const Band made{band.number("zero_point"), optional_number(band, "sky"), band.number("fwhm")};
    if (!result.bands.emplace(band.text("name"), made).second) {
      throw input_error(band.where("name"), "band '{}' stands twice", band.text("name"));
    }
  }
  return result;
}

const Instrument::Band& Instrument::band(const std::string& band_name) const {
  const auto found = bands.find(band_name);
  if (found != bands.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [own, band] : bands) known.push_back(own);
  throw input_error("{} has no band {}; it has {}{}", name, in_quotes(band_name),
                    fmt::join(known, ", "), did_you_mean(band_name, known));
}

const std::vector<std::string>& instrument_suffixes() {
  static const std::vector<std::string> suffixes = {".toml"};
  return suffixes;
}

Instrument find_instrument(const std::string& name, const std::string& beside,
                           Resources& resources) {
  const Resources::Text& text = resources.find("instruments", name, beside, instrument_suffixes());
  return Instrument::parse(text.content, text.label);
}

}  // namespace gamer
