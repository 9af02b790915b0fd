#include "gamer/scene/image_settings.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"

namespace gamer {
namespace {

constexpr double largest_image_side = 1e6;

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

BoundTable image_keys(ImageSettings& p) {
  return {
      Parameter::size2("size", "pixels", Interval::closed(1, largest_image_side), 512,
                       "image size"),
      Parameter::numbers("region", "pixels", Interval::closed(1, largest_image_side),
                         std::vector<double>{},
                         "x, y, width and height of a window that is rendered instead of the "
                         "whole image; x, y is its lower left pixel, counted from 1"),
      Parameter::text("output", "gamer.fits",
                      "path; its suffix sets the format: `.fits`, `.fits.fz` (tile-compressed), "
                      "`.png`, `.bmp`; `-` is standard output, a FITS image"),
      {p.output.bitpix, "bitpix", "", Interval::any(), "FITS data type, -32 or -64"},
      choice(p.output.layout, "layout",
             {{"cube", ImageLayout::cube},
              {"extensions", ImageLayout::extensions},
              {"files", ImageLayout::files},
              {"stamps", ImageLayout::stamps}},
             "layout of several planes: one HDU, one HDU each, or one file each (named "
             "with `_<label>`); stamps: a cube of each object alone"),
      choice(p.unit, "unit",
             {{"auto", std::nullopt},
              {"relative", PixelUnit::relative},
              {"nJy", PixelUnit::nanojansky},
              {"MJy/sr", PixelUnit::megajansky_per_sr},
              {"mag/arcsec^2", PixelUnit::magnitude},
              {"erg/s/cm^2/A/arcsec^2", PixelUnit::flux_density},
              {"electron/s", PixelUnit::electron_per_second}},
             "unit of the pixels; auto: nJy if the scene has magnitudes, otherwise relative"),
      Parameter::numbers("tone", "", Interval::any(), std::nullopt,
                         "eight numbers for the colours of a picture: black and factor of red, "
                         "green and blue, slope, scale; by default measured on the picture"),
      {p.output.style.brightness, "brightness", "", PictureStyle::factors(),
       "factor on the slope of a picture's stretch; white stays white, and values above 1 show "
       "fainter light"},
      {p.output.style.contrast, "contrast", "", PictureStyle::factors(),
       "divides the slope of a picture's stretch; the level 0.28 stays, and with values above 1 "
       "the brightest parts are overexposed, and become white"},
      {p.output.style.saturation, "saturation", "", Interval::closed(0, 10),
       "colours of a picture: 0 is grey, 1 keeps them, larger values strengthen them"},
      {p.output.style.seeing, "seeing", "", Interval::closed(0, PictureStyle::most_seeing),
       "width of a point in a picture (FWHM of a Moffat profile), pixels, as a telescope shows it, "
       "at least 0.1; stars then are points, unless stars.discs or stars.white_point is given; 0: "
       "pixels as they are"},
      {p.output.style.sky, "sky", "", Interval::closed(0, 0.5),
       "level of a picture's pixels without light, where white is 1"},
      {p.output.style.grain, "grain", "", Interval::closed(0, 0.5),
       "standard deviation of the noise of a picture's pixels without light, where white is 1; "
       "light has more, as photons have; noise is cut off at black, which matters where `sky` is "
       "below three times `grain`"},
      {p.output.style.grain_seed, "grain_seed", "",
       Interval::closed(0, PictureStyle::most_grain_seed),
       "seed of the noise; frame n of a film has grain_seed + n - 1"}};
}

BoundTable truth_keys(TruthSettings& p) {
  return {choice(p.parts, "parts",
                 {{"none", TruthSettings::Parts::none},
                  {"objects", TruthSettings::Parts::objects},
                  {"components", TruthSettings::Parts::components}},
                 "light of each object, or of each of its components, as seen in the image"),
          {p.dust_free, "dust_free", "the image without dust"},
          {p.optical_depth, "optical_depth", "optical depth through all galaxies"},
          {p.segmentation, "segmentation",
           "number of the object (row of the table, from 1) with most of a "
           "pixel's light, and its share"},
          Parameter::text("output", std::nullopt,
                          "path; by default the image's path with _truth before the suffix")};
}

}  // namespace

ParameterSection ImageSettings::section() {
  return {"image", "The image and its file.", declarations(image_keys)};
}

ImageSettings ImageSettings::read(const ParameterSet& values) {
  ImageSettings result;
  OutputOptions& output = result.output;
  put_values(values, image_keys(result));
  output.path = values.text("output");
  if (output.bitpix != -32 && output.bitpix != -64) {
    throw input_error(values.where("bitpix"), "bitpix = {} is neither -32 nor -64", output.bitpix);
  }
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
  result.unit_where = values.where("unit");
  return result;
}

ParameterSection TruthSettings::section() {
  return {"truth", "Images of the scene's parts, written beside the image with --truth.",
          declarations(truth_keys)};
}

TruthSettings TruthSettings::read(const ParameterSet& values) {
  TruthSettings result = read_object(values, truth_keys);
  if (values.has("output")) result.path = values.text("output");
  return result;
}

}  // namespace gamer
