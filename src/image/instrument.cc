#include "gamer/image/instrument.h"

#include <fmt/ranges.h>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/config.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr double most_exposures = 1e6;

BoundTable instrument_keys(Instrument& p) {
  return {required({p.name, "name", "name of the telescope and the camera"}),
          {p.description, "description", "one line"},
          required({p.pixel_scale, "pixel_scale", "arcsec", Interval::positive(),
                    "side of a pixel on the sky"}),
          required({p.exposure, "exposure", "s", Interval::positive(),
                    "usual exposure time, of all exposures together"}),
          {p.exposures, "exposures", "", Interval::closed(1, most_exposures),
           "exposures that are added up"},
          required({p.read_noise, "read_noise", "electron", Interval::at_least(0),
                    "rms of a pixel, of one exposure"}),
          {p.dark, "dark", "electron/s", Interval::at_least(0), "dark current of a pixel"},
          {p.gain, "gain", "electron/ADU", Interval::positive(), "electrons of 1 ADU"},
          {p.full_well, "full_well", "electron", Interval::positive(),
           "most electrons of a pixel, of one exposure"},
          choice(p.is_moffat, "psf", {{"gaussian", false}, {"moffat", true}}, "profile of the PSF"),
          {p.beta, "beta", "", Interval::left_open(1, 100), "exponent of the Moffat profile"}};
}

BoundTable band_keys(Instrument::Band& p) {
  return {required(Parameter::text("name", std::nullopt, "name of its bandpass in `bandpasses/`")),
          required({p.zero_point, "zero_point", "mag", Interval::any(),
                    "AB magnitude that gives 1 electron/s"}),
          {p.sky, "sky", "mag/arcsec^2", Interval::any(), "usual AB surface brightness of the sky"},
          required({p.fwhm, "fwhm", "arcsec", Interval::positive(), "usual FWHM of the PSF"})};
}

}  // namespace

ParameterTable Instrument::table() { return declarations(instrument_keys); }

ParameterTable Instrument::band_table() { return declarations(band_keys); }

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
  Instrument result = read_object(values, instrument_keys);
  for (const ConfigNode& node : list->array()) {
    const ParameterSet band = ParameterSet::read(band_table(), node, "", "in [[band]]");
    Band made = read_object(band, band_keys);
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
