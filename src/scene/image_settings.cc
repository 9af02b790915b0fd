#include "gamer/scene/image_settings.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/message.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_image_side = 1e6;

struct UnitName {
  PixelUnit unit;
  const char* name;
};

constexpr UnitName pixel_units[] = {
    {PixelUnit::relative, "relative"},
    {PixelUnit::nanojansky, "nJy"},
    {PixelUnit::megajansky_per_sr, "MJy/sr"},
    {PixelUnit::magnitude, "mag/arcsec^2"},
    {PixelUnit::flux_density, "erg/s/cm^2/A/arcsec^2"},
    {PixelUnit::electron_per_second, "electron/s"},
};

std::vector<std::string> unit_names() {
  std::vector<std::string> names = {"auto"};
  for (const UnitName& unit : pixel_units) names.emplace_back(unit.name);
  return names;
}

std::optional<PixelUnit> find_unit(const std::string& name) {
  for (const UnitName& unit : pixel_units) {
    if (name == unit.name) return unit.unit;
  }
  return std::nullopt;
}

/// The region that four whole numbers give; nothing where there are none.
std::optional<ImageRegion> read_region(const ParameterSet& values) {
  const std::vector<double>& numbers = values.numbers("region");
  if (numbers.empty()) return std::nullopt;
  constexpr std::size_t count = 4;
  if (numbers.size() != count) {
    throw input_error(values.where("region"),
                      "region has {} number{}, not 4: x, y of its lower left pixel, width, height",
                      numbers.size(), numbers.size() == 1 ? "" : "s");
  }
  for (const double number : numbers) {
    if (number == std::floor(number)) continue;
    throw input_error(values.where("region"), "region has {}, which is no whole number of pixels",
                      number);
  }
  return ImageRegion{static_cast<int>(numbers[0]) - 1, static_cast<int>(numbers[1]) - 1,
                     static_cast<int>(numbers[2]), static_cast<int>(numbers[3])};
}

}  // namespace

ParameterSection ImageSettings::section() {
  return {
      "image",
      "The image and its file.",
      {Parameter::size2("size", "pixels", Interval::closed(1, largest_image_side), 512,
                        "image size"),
       Parameter::numbers("region", "pixels", Interval::closed(1, largest_image_side),
                          std::vector<double>{},
                          "x, y, width and height of a window that is rendered instead of the "
                          "whole image; x, y is its lower left pixel, counted from 1"),
       Parameter::text("output", "gamer.fits",
                       "path; its suffix sets the format: `.fits`, `.fits.fz` (tile-compressed), "
                       "`.png`, `.bmp`; `-` is standard output, a FITS image"),
       Parameter::integer("bitpix", "", Interval::any(), -32, "FITS data type, -32 or -64"),
       Parameter::choice("layout", {"cube", "extensions", "files", "stamps"}, "cube",
                         "layout of several planes: one HDU, one HDU each, or one file each (named "
                         "with `_<label>`); stamps: a cube of each object alone"),
       Parameter::choice(
           "unit", unit_names(), "auto",
           "unit of the pixels; auto: nJy if the scene has magnitudes, otherwise relative"),
       Parameter::numbers("tone", "", Interval::any(), std::nullopt,
                          "eight numbers for the colours of a picture: black and factor of red, "
                          "green and blue, slope, scale; by default measured on the picture")},
      {}};
}

ImageSettings ImageSettings::read(const ParameterSet& values) {
  ImageSettings result;
  OutputOptions& output = result.output;
  output.path = values.text("output");
  output.bitpix = static_cast<int>(values.integer("bitpix"));
  if (output.bitpix != -32 && output.bitpix != -64) {
    throw input_error(values.where("bitpix"), "bitpix = {} is neither -32 nor -64", output.bitpix);
  }
  const std::string& layout = values.text("layout");
  output.layout = layout == "cube"         ? ImageLayout::cube
                  : layout == "extensions" ? ImageLayout::extensions
                  : layout == "files"      ? ImageLayout::files
                                           : ImageLayout::stamps;
  result.layout_where = values.where("layout");
  if (values.has("tone")) {
    const std::vector<double>& numbers = values.numbers("tone");
    output.tone.emplace();
    if (numbers.size() != output.tone->size()) {
      throw input_error(values.where("tone"), "tone has {} numbers, not {}", numbers.size(),
                        output.tone->size());
    }
    std::ranges::copy(numbers, output.tone->begin());
  }
  result.region = read_region(values);
  result.unit = find_unit(values.text("unit"));
  result.unit_where = values.where("unit");
  return result;
}

ParameterSection TruthSettings::section() {
  return {"truth",
          "Images of the scene's parts, written beside the image with --truth.",
          {Parameter::choice(
               "parts", {"none", "objects", "components"}, "none",
               "light of each object, or of each of its components, as seen in the image"),
           Parameter::boolean("dust_free", false, "the image without dust"),
           Parameter::boolean("optical_depth", false, "optical depth through all galaxies"),
           Parameter::boolean("segmentation", false,
                              "number of the object (row of the table, from 1) with most of a "
                              "pixel's light, and its share"),
           Parameter::text("output", std::nullopt,
                           "path; by default the image's path with _truth before the suffix")},
          {}};
}

TruthSettings TruthSettings::read(const ParameterSet& values) {
  const std::string& parts = values.text("parts");
  return {.parts = parts == "objects"      ? Parts::objects
                   : parts == "components" ? Parts::components
                                           : Parts::none,
          .dust_free = values.boolean("dust_free"),
          .optical_depth = values.boolean("optical_depth"),
          .segmentation = values.boolean("segmentation"),
          .path = text_or_empty(values, "output")};
}

}  // namespace gamer
