#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/random.h"
#include "image/convolution/convolution.h"
#include "processing/detector.h"
#include "processing/geometry.h"
#include "processing/injection.h"
#include "processing/instrument_option.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/psf_options.h"
#include "processing/resample.h"
#include "processing/sky_place.h"

namespace gamer {
namespace {

/// Grids of pixels count as equal where no corner differs by more than this, in pixels.
constexpr double most_grid_error = 0.1;
/// Sides of pixels count as equal up to this share of a side.
constexpr double most_side_error = 0.01;
/// Rounding of a convolution by Fourier transforms, in units of the brightest pixel.
constexpr double convolution_rounding = 1e-14;

/// Zeros around a render that is shifted by a part of a pixel: the reach of the resampling.
constexpr int shift_margin = 4;
/// Smaller shifts are ignored, pixels.
constexpr double least_shift = 1e-6;

/// Place of the render on the science image: a box of whole pixels, and the shift that remains.
struct LightPlace {
  Area box;
  double x = 0, y = 0;  ///< remaining shift, pixels in [-0.5, 0.5]
};

/// Light on its way into a plane, with the box of the science image's pixels that it covers.
struct PlacedLight {
  PlanePtr plane;
  Area box;
};

std::optional<CelestialWcs> optional_wcs(const FitsHeader& header, const std::string& label) {
  if (!header.has("CTYPE1")) return std::nullopt;
  return celestial_wcs(header, label);
}

/// The difference between a number and the next multiple of `step`.
int to_multiple(int number, int step) {
  const int rest = number % step;
  return rest > 0 ? step - rest : -rest;
}

class InjectOperation {
 public:
  explicit InjectOperation(const OperationCall& call);
  void run();

 private:
  bool has(const char* name) const { return call_.parameters.has(name); }
  template <class... Values>
  [[noreturn]] void fail(fmt::format_string<Values...> message, Values&&... values) const {
    throw wrong(call_, message, std::forward<Values>(values)...);
  }
  void read_render();
  std::size_t science_hdu() const;
  const PlaneTask& light_of(const PlaneTask& science) const;
  CardValue zero_point(const PlaneTask& science, const PlaneTask& light) const;
  std::optional<CardValue> gain(const PlaneTask& science) const;
  double factor(const PlaneTask& science, const PlaneTask& light, double zero_point) const;
  LightPlace place(const PlaneTask& science, const PlaneTask& light) const;
  LightPlace place_by_grids(const PlaneTask& science, const PlaneTask& light) const;
  void check_sides(const PlaneTask& science, const PlaneTask& light,
                   const PixelPosition& middle) const;
  static PlacedLight shifted(const PlacedLight& light, const LightPlace& place);
  PlacedLight blurred(const PlaneTask& science, const PlaneTask& light, const Area& box) const;
  PlanePtr change(const PlaneTask& science);

  const OperationCall& call_;
  FitsInput science_, render_;
  InstrumentOption instrument_;
  std::optional<PsfOptions> psf_;
  std::optional<StampFile> psf_file_;
  std::vector<PlaneTask> lights_;
  /// Headers in which cards of the science image are looked for.
  std::vector<FitsHeader> headers_;
  std::map<std::string, int> labels_;
  std::vector<std::string> records_;  ///< one HISTORY card for each plane
};

InjectOperation::InjectOperation(const OperationCall& call)
    : call_(call), science_(call.inputs[0]), render_(call.inputs[1]) {
  if (has("at") && has("position")) fail("--at and --position both say where; give one");
  instrument_ = InstrumentOption(call);
  if (has("psf") || instrument_.is_given()) {
    psf_.emplace(call, has("psf") ? InstrumentOption() : instrument_);
    if (psf_->is_file()) {
      psf_file_.emplace(call.parameters.text("psf"), call.parameters.boolean("keep_missing_flux"));
    }
  } else {
    for (const Parameter& parameter : psf_parameters({})) {
      if (!call.parameters.is_given(parameter.name)) continue;
      fail("{} needs --psf or --instrument", option_name(parameter.name));
    }
  }
  if (call.parameters.boolean("no_noise")) {
    for (const char* name : {"gain", "seed"}) {
      if (!call.parameters.is_given(name)) continue;
      fail("{} is of the noise, and --no-noise leaves it out", option_name(name));
    }
  }
  read_render();
}

/// The planes of the render, or the one that --plane names.
void InjectOperation::read_render() {
  std::vector<PlaneTask> all;
  visit_planes(render_, call_.threads, [&](const PlaneTask& task) {
    if (task.info.role == PlaneRole::light) all.push_back(task);
  });
  if (!has("plane")) {
    lights_ = std::move(all);
    return;
  }
  const auto number = static_cast<std::size_t>(call_.parameters.integer("plane"));
  if (number > all.size()) {
    fail("--plane {}: {} has {} plane{}", number, render_.name(), all.size(),
         all.size() == 1 ? "" : "s");
  }
  lights_.push_back(all[number - 1]);
}

/// Index of the HDU that gets the light.
std::size_t InjectOperation::science_hdu() const {
  const std::string& text = call_.parameters.text("hdu");
  const std::vector<std::size_t> chosen = chosen_hdus("inject", science_, text);
  const FitsHdu& hdu = science_.hdus()[chosen.front()];
  if (chosen.size() > 1) {
    fail("--hdu {} names {} HDUs of {}; one is needed", text, chosen.size(), science_.name());
  }
  if (!hdu.is_image()) fail("HDU {} of {} is no image", hdu.number, science_.name());
  return chosen.front();
}

const PlaneTask& InjectOperation::light_of(const PlaneTask& science) const {
  if (lights_.size() != static_cast<std::size_t>(science.count)) {
    fail("{} has {} planes, {} has {}; as many are needed, or --plane", render_.name(),
         lights_.size(), science.label, science.count);
  }
  return lights_[static_cast<std::size_t>(science.index)];
}

/// AB magnitude of the value 1 of the science image.
CardValue InjectOperation::zero_point(const PlaneTask& science, const PlaneTask& light) const {
  if (has("zero_point")) return {plane_value(call_, "zero_point", science), "--zero-point"};
  const auto card =
      zero_point_of(headers_, science.info.plane, fmt::format("gutil inject: {}: ", science.label));
  if (card) return *card;
  if (instrument_.is_given()) {
    // Counts (ADU) of the whole exposure.
    const Instrument& own = instrument_.get();
    return {instrument_.band(light).zero_point + magnitudes_of(own.gain / own.exposure),
            "--instrument"};
  }
  fail("{} has no zero point ({}); give --zero-point (AB magnitude of the value 1)", science.label,
       fmt::join(zero_point_keys(), ", "));
}

std::optional<CardValue> InjectOperation::gain(const PlaneTask& science) const {
  if (call_.parameters.boolean("no_noise")) return std::nullopt;
  if (has("gain")) return CardValue{plane_value(call_, "gain", science), "--gain"};
  const auto card = gain_of(headers_, science.info.plane);
  if (card) return card;
  if (instrument_.is_given()) return CardValue{instrument_.get().gain, "--instrument"};
  fail("{} has no positive {}; give --gain (electrons per unit of the pixels), or --no-noise",
       science.label, fmt::join(gain_keys(), " or "));
}

/// Science value of a render's pixel of value 1.
double InjectOperation::factor(const PlaneTask& science, const PlaneTask& light,
                               double zero_point) const {
  if (!light.info.zero_point) {
    fail(
        "{} has no MAGZERO, so its light has no magnitude; render a scene with magnitudes, or set "
        "the card with gutil header --set MAGZERO=",
        light.label);
  }
  const double ratio = flux_ratio(*light.info.zero_point - zero_point);
  const double factor = ratio * calibrated_area(light.info.unit, light.header, light.label) /
                        calibrated_area(science.info.unit, science.header, science.label);
  if (!std::isnormal(factor)) {
    fail("a pixel of value 1 of {} would be {:.6g} in {}; check the zero points", light.label,
         factor, science.label);
  }
  return factor;
}

/// Checks that both images' pixels have one size and direction on the sky. Images without celestial
/// coordinates are not checked.
void InjectOperation::check_sides(const PlaneTask& science, const PlaneTask& light,
                                  const PixelPosition& middle) const {
  if (call_.parameters.boolean("ignore_wcs")) return;
  const auto large = optional_wcs(science.header, science.label);
  const auto small = optional_wcs(light.header, light.label);
  if (!large || !small) return;
  const PixelPosition own = {0.5 * (light.plane->width() + 1), 0.5 * (light.plane->height() + 1)};
  const double difference = grid_difference(*large, middle, *small, own);
  if (difference <= most_side_error) return;
  fail(
      "the sides of pixels of {} and {} differ by {:.3g} of a side on the sky; render with the "
      "science image's pixel_scale and rotation, or give --ignore-wcs",
      light.label, science.label, difference);
}

/// The place of the render on the science image by both images' coordinates. Without coordinates
/// both must have one size.
LightPlace InjectOperation::place_by_grids(const PlaneTask& science, const PlaneTask& light) const {
  const int width = light.plane->width(), height = light.plane->height();
  const bool is_ignored = call_.parameters.boolean("ignore_wcs");
  const auto large = is_ignored ? std::nullopt : optional_wcs(science.header, science.label);
  const auto small = is_ignored ? std::nullopt : optional_wcs(light.header, light.label);
  if (large && small) {
    const auto shift = grid_shift(*large, *small, width, height);
    const bool is_shifted = call_.parameters.boolean("subpixel");
    if (shift && (is_shifted ? shift->bend : shift->error) <= most_grid_error) {
      LightPlace place{{shift->x, shift->y, width, height}};
      if (is_shifted) place.x = shift->rest_x, place.y = shift->rest_y;
      return place;
    }
    fail(
        "the pixels of {} do not lie on those of {}{}; render with camera.header = the science "
        "image, give --subpixel, or place it with --at or --position",
        light.label, science.label,
        shift ? fmt::format(": a corner is {:.3g} pixels off", shift->error) : "");
  }
  if (width != science.plane->width() || height != science.plane->height()) {
    fail(
        "{} has {} x {} pixels, {} has {} x {}, and their coordinates do not say where it belongs; "
        "give --at or --position",
        light.label, width, height, science.label, science.plane->width(), science.plane->height());
  }
  return {{0, 0, width, height}};
}

/// The place of the render's pixels on the science image.
LightPlace InjectOperation::place(const PlaneTask& science, const PlaneTask& light) const {
  PixelPosition middle;
  if (has("at")) {
    const std::vector<double>& at = call_.parameters.numbers("at");
    middle = {at[0], at[1]};
  } else if (has("position")) {
    middle = pixel_within(call_, celestial_wcs(science.header, science.label), sky_position(call_),
                          science.plane->width(), science.plane->height(), science.label);
  } else {
    return place_by_grids(science, light);
  }
  check_sides(science, light, middle);
  const int width = light.plane->width(), height = light.plane->height();
  LightPlace place{box_about(middle, width, height)};
  if (call_.parameters.boolean("subpixel")) {
    place.x = middle.x - (place.box.x + 0.5 * (width + 1));
    place.y = middle.y - (place.box.y + 0.5 * (height + 1));
  }
  return place;
}

/// The light convolved with the PSF, on a box that is larger by half of the PSF's image or more.
PlacedLight InjectOperation::blurred(const PlaneTask& science, const PlaneTask& light,
                                     const Area& box) const {
  const PlanePtr plane = without_missing(light.plane);
  if (!psf_) return {plane, box};
  PlaneTask task = science;
  task.info.wavelength = light.info.wavelength;
  task.info.label = light.info.label;
  StampSource stamp;
  if (psf_file_) {
    const PixelPosition middle = {box.x + 0.5 * (box.width + 1), box.y + 0.5 * (box.height + 1)};
    stamp = psf_file_->source(*psf_, science.index, science.count, science.label, middle);
  } else {
    const Psf psf = psf_->psf(task);
    StampOptions options = psf_->stamp();
    if (options.size == 0) options.size = stamp_size(psf, options.energy);
    stamp = {options.size, options.size, [psf, options] { return make_stamp(psf, options); }};
  }
  Margins margins = {stamp.width / 2, stamp.width / 2, stamp.height / 2, stamp.height / 2};
  const auto blur = [&] {
    return convolved(pad(plane, margins, 0), stamp.width, stamp.height, stamp.make);
  };
  // The convolution's tiles begin where tiles of the science image begin, so that each is made
  // once.
  const PlanePtr first = blur();
  const Plane::Tile tile = first->tile();
  if (tile.width < first->width()) margins.left += to_multiple(margins.left - box.x, tile.width);
  if (tile.height < first->height()) {
    margins.bottom += to_multiple(margins.bottom - box.y, tile.height);
  }
  const PlanePtr result = blur();
  return {result,
          {box.x - margins.left, box.y - margins.bottom, result->width(), result->height()}};
}

/// The light moved by the remaining shift of its place.
PlacedLight InjectOperation::shifted(const PlacedLight& light, const LightPlace& place) {
  if (std::abs(place.x) < least_shift && std::abs(place.y) < least_shift) return light;
  constexpr int margin = shift_margin;
  const PlanePtr wide = pad(light.plane, {margin, margin, margin, margin}, 0);
  const ResampleGrid grid{wide->width(), wide->height(), 1, 1, -place.x, -place.y};
  return {resample(wide, grid, Kernel::lanczos3, PixelValues::flux),
          {light.box.x - margin, light.box.y - margin, wide->width(), wide->height()}};
}

PlanePtr InjectOperation::change(const PlaneTask& science) {
  const PlaneTask& light = light_of(science);
  refuse_magnitudes("inject", science.label, science.info.unit);
  refuse_magnitudes("inject", light.label, light.info.unit);
  const CardValue zero = zero_point(science, light);
  const std::optional<CardValue> electrons = gain(science);
  Injection injection;
  injection.factor = factor(science, light, zero.value);
  injection.has_noise = electrons.has_value();
  if (electrons) injection.gain = electrons->value;
  const auto seed = static_cast<std::uint64_t>(call_.parameters.integer("seed"));
  // The name differs from those of gutil noise, so that the noise of the two is independent.
  const std::string name = "inject " + light.info.label;
  injection.key = noise_key(seed, name, labels_[name]++);
  const LightPlace at = place(science, light);
  const Area& box = at.box;
  const PlacedLight placed = shifted(blurred(science, light, box), at);
  if (psf_) {
    injection.tile = placed.plane->tile();
    injection.least =
        convolution_rounding * largest_value(*without_missing(light.plane), call_.threads);
  }
  const int width = science.plane->width(), height = science.plane->height();
  const Area& all = placed.box;
  if (all.x >= width || all.y >= height || all.x + all.width <= 0 || all.y + all.height <= 0) {
    fail("{} would cover pixels {}:{},{}:{}, outside {}, which has {} x {} pixels", light.label,
         box.x + 1, box.x + box.width, box.y + 1, box.y + box.height, science.label, width, height);
  }
  records_.push_back(fmt::format(
      "gutil inject: plane {}: zero point {} mag ({}), {}, light on pixels {}:{},{}:{}",
      science.info.plane + 1, zero.value, zero.key,
      electrons ? fmt::format("gain {} ({})", electrons->value, electrons->key) : "no noise",
      box.x + 1, box.x + box.width, box.y + 1, box.y + box.height));
  const PlanePtr whole = window(placed.plane, {-all.x, -all.y, width, height}, 0);
  return injected(science.plane, whole, injection);
}

void InjectOperation::run() {
  const std::size_t chosen = science_hdu();
  const FitsHdu& image = science_.hdus()[chosen];
  headers_ = {image.header};
  const FitsHdu& primary = science_.hdus().front();
  if (primary.number == 0 && chosen != 0) headers_.push_back(primary.header);
  std::vector<PlanePtr> planes;
  for (int plane = 0; plane < image.planes; ++plane) {
    planes.push_back(
        change({science_.plane(chosen, plane), plane_info(science_, image, plane), image.header,
                hdu_label(science_, image), plane, image.planes, call_.threads}));
  }
  FitsOutput output({call_.output, call_.overwrite});
  for (std::size_t i = 0; i < science_.hdus().size(); ++i) {
    const FitsHdu& hdu = science_.hdus()[i];
    FitsHeader header = hdu.header;
    drop_record(header);
    if (i == chosen) {
      for (const char* key : {"DATAMIN", "DATAMAX"}) header.remove(key);
      header.set({"HISTORY", {}, call_.history});
      for (const std::string& record : records_) header.set({"HISTORY", {}, record});
      output.write(header, planes, output_bitpix(call_, hdu), call_.threads, hdu.further_axes);
    } else if (header.records().size() != hdu.header.records().size()) {
      output.copy(science_, i, header);
    } else if (!is_record(hdu)) {
      output.copy(science_, i);
    }
  }
  output.finish();
}

constexpr const char* inject_description =
    "inject SCIENCE RENDER OUT: a pixel of value v of the render adds v s to the pixel of the "
    "science image. The factor is s = 10^(-0.4 (MAGZERO - zero point)); surface brightnesses are "
    "multiplied by their pixel's arcsec^2. The zero point is the AB magnitude of the value 1 of "
    "the science image, per arcsec^2 where BUNIT is a surface brightness. Without --zero-point the "
    "value comes from a card of the image's HDU or the primary HDU: MAGZERO, PHOTZP, MAGZEROP, "
    "MAGZPT, MAGZP or ZEROPOINT. Without such a card BUNIT decides, if it is nJy, uJy, mJy or Jy. "
    "Cards of "
    "one header that disagree are an error. Give --zero-point where the card means 1 count/s or "
    "Vega magnitudes.\n\nThe added light has Poisson noise: the image gains N / gain with N = "
    "Poisson(v s gain). A negative v counts as 0. The gain is the number of electrons per unit of "
    "the pixels (--gain, or cards GAIN or EGAIN). For an image in electron/s the gain is the "
    "exposure time. Noise follows from the seed, the render's band or wavelength and the science "
    "image's pixel alone. --no-noise adds v s itself.\n\nThe world coordinates of both images say "
    "where the render belongs. Their pixels must agree to 0.1 pixel, as with camera.header in the "
    "render. Images without world coordinates must have equal sizes. --at and --position place the "
    "middle of the render, rounded to whole pixels. The pixels of both images must then agree in "
    "size and direction on the sky to 1 %. --ignore-wcs ignores the render's coordinates. "
    "--subpixel shifts the light to the exact place: it is resampled as by gutil resample --kernel "
    "lanczos3, after the convolution, which keeps its flux. Light that is sharper than the pixels "
    "gets negative values around it, which count as 0 where there is noise. Light beyond the edges "
    "is lost. The PSF options work as in convolve, with the pixels and position angles of the "
    "science image. A PSF of PSFEx is evaluated at the middle of the render. --instrument gives "
    "the PSF of the render's band without --psf. It also gives the zero point and the gain of "
    "counts (ADU) of the instrument's exposure, where neither an option nor the header "
    "does.\n\nPixels without added light keep their bits. Missing pixels stay missing, missing "
    "pixels of the render add nothing, and no pixel is clipped at SATURATE. 16-bit integers become "
    "32-bit floats and 32-bit integers become doubles, scaled by BSCALE and BZERO. The header "
    "stays, except that DATE is renewed and DATAMIN and DATAMAX are deleted. HISTORY tells zero "
    "point, gain and place. Weights, variances, masks, tables and other HDUs are copied unchanged.";

ParameterTable inject_parameters() {
  constexpr double farthest = 1e9, most_planes = 1e6;
  ParameterTable table = {
      Parameter::text("hdu", "first",
                      "name or number (from 0) of the science image; first: the first image"),
      Parameter::integer("plane", "", Interval::closed(1, most_planes), std::nullopt,
                         "plane of the render, from 1 (default: as many planes as the science "
                         "image)"),
      Parameter::numbers("zero_point", "mag", Interval::any(), std::nullopt,
                         "AB magnitude of the value 1 (default: from the header); or one per "
                         "plane"),
      Parameter::numbers("gain", "electron/unit", Interval::positive(), std::nullopt,
                         "electrons per unit of the pixels (default: from the header); or one per "
                         "plane"),
      Parameter::boolean("no_noise", false, "add the mean light, without Poisson noise"),
      Parameter::integer("seed", "", Interval::right_open(0, largest_seed), 1, "seed of the noise"),
      Parameter::vector2("at", "pixels", Interval::closed(-farthest, farthest), std::nullopt,
                         "middle of the render: x,y as FITS counts"),
      position_parameter("middle of the render: ra,dec, or h:m:s,d:m:s"),
      Parameter::boolean("subpixel", false,
                         "shift the light to the exact place, by resampling (lanczos3)"),
      InstrumentOption::parameter(),
      Parameter::boolean("ignore_wcs", false, "do not compare the coordinates of the images"),
      Parameter::text("psf", std::nullopt,
                      fmt::format("{}, or a FITS file (default: the render has it)",
                                  fmt::join(psf_models(), ", "))),
  };
  return table +
         psf_parameters({"unit of --fwhm; arcsec needs celestial coordinates of the science image",
                         "direction of the major axis, from North towards East; without celestial "
                         "coordinates from +y towards -x"});
}

}  // namespace

Operation inject_operation() {
  return {.name = "inject",
          .summary = "Add a render to a science image",
          .description = inject_description,
          .least_inputs = 2,
          .most_inputs = 2,
          .parameters = inject_parameters(),
          .example =
              "inject --gain 2 --zero-point 30 --psf gaussian --fwhm 3 in.fits in2.fits out.fits",
          .run = [](const OperationCall& call) {
            InjectOperation(call).run();
            return 0;
          }};
}

}  // namespace gamer
