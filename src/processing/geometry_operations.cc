#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "processing/arithmetic.h"
#include "processing/geometry.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/resample.h"
#include "processing/rotate.h"
#include "processing/sky_place.h"

namespace gamer {
namespace {

/// Larger images are taken for typing errors.
constexpr int longest_side = 1 << 18;
constexpr double least_factor = 1e-6, most_factor = 1e4;
constexpr double largest_scale = 1e6;  // arcsec

constexpr const char* wcs_text =
    "All world coordinates of the header follow (CRPIXi; CDi_j, PCi_j, CDELTi, CROTAi; SIP "
    "polynomials; LTVi, LTMi_j). Further axes and other cards stay. Distortions in tables (CPDISi, "
    "CQDISi, D2IMDISi) cannot follow and are an error. Variances (EXTNAME VARIANCE, ..._VARIANCE) "
    "follow where pixels move or are joined. Variances of pixels that would be interpolated are an "
    "error. Tables in other HDUs are copied unchanged, with any pixel positions in them.";

constexpr const char* missing_text =
    "An output pixel is missing (NaN) where missing pixels carry a quarter or more of its weights "
    "(absolute values). Otherwise the weights of the present pixels are scaled up.";

/// The map of pixels that an operation applies to an image of some size.
using MapOf = std::function<PixelMap(const FitsHeader& header, int width, int height)>;

/// `change_variance` makes the planes of variances; if it is empty, variances are refused.
int change_geometry(const OperationCall& call, const PlaneChange& change, const MapOf& map_of,
                    const PlaneChange& change_variance = {}) {
  const HeaderChange edit = [&](FitsHeader& header, int width, int height, int) {
    map_pixels(header, map_of(header, width, height), call.inputs.front());
  };
  change_planes(call, change, edit, {}, {change_variance, edit});
  return 0;
}

int checked_side(const OperationCall& call, double side) {
  if (side > longest_side) {
    throw wrong(call, "the image becomes {:.0f} pixels long; at most {}", side, longest_side);
  }
  return static_cast<int>(side);
}

/// The value of --fill, or of another option of that kind: a number or nan.
double fill_of(const OperationCall& call, const char* name = "fill") {
  const std::string& text = call.parameters.text(name);
  const std::optional<double> value = number_of<double>(text);
  if (!value || std::isinf(*value)) {
    throw wrong(call, "{} {}: expected a number, or nan", option_name(name), in_quotes(text));
  }
  return *value;
}

Parameter fill_parameter(const char* description) {
  return {"fill",          ParameterType::text, "unit of the pixels",
          Interval::any(), std::string("0"),    description};
}

/// The numbers of an option, which must be whole.
std::vector<int> whole_numbers(const OperationCall& call, const char* name) {
  std::vector<int> result;
  for (const double value : call.parameters.numbers(name)) {
    if (value != std::round(value)) throw wrong(call, "--{}: {} is no whole number", name, value);
    result.push_back(static_cast<int>(value));
  }
  return result;
}

/// Whether the pixels are gamer's relative unit, a brightness without BUNIT.
bool is_relative(const PlaneTask& task) {
  return task.info.unit.empty() && !task.info.zero_point &&
         task.header.text("CREATOR").value_or("").starts_with("gamer ");
}

/// Flux or brightness: the value of --values, else by the header.
PixelValues flux_or_brightness(const OperationCall& call, const PlaneTask& task) {
  if (call.parameters.has("values")) {
    return call.parameters.text("values") == "flux" ? PixelValues::flux : PixelValues::brightness;
  }
  return is_brightness(task.info.unit) || is_relative(task) ? PixelValues::brightness
                                                            : PixelValues::flux;
}

Parameter values_parameter() {
  return Parameter::choice("values", {"flux", "brightness"}, std::nullopt,
                           "flux adds up, brightness averages (default: brightness where BUNIT is "
                           "per solid angle, and in gamer's relative images, which have no BUNIT)");
}

// ---- rotate ------------------------------------------------------------------------------------

constexpr double quarter_turn = 90;  // deg

int rotate_file(const OperationCall& call) {
  const Rotation rotation = {call.parameters.number("angle"),
                             kernel_of(call.parameters.text("kernel")),
                             call.parameters.text("canvas") == "full", fill_of(call)};
  const PlaneChange turn = [&](const PlaneTask& task) { return rotate(task.plane, rotation); };
  return change_geometry(
      call, turn,
      [&](const FitsHeader&, int width, int height) {
        return rotation_map(width, height, rotation);
      },
      std::fmod(rotation.angle, quarter_turn) == 0 ? turn : PlaneChange());
}

Operation rotate_operation() {
  std::vector<std::string> kernels;
  for (const std::string& name : kernel_names()) {
    if (kernel_of(name) != Kernel::area) kernels.push_back(name);
  }
  return {
      .name = "rotate",
      .summary = "Turn by any angle",
      .description = fmt::format(
          "Turns about the middle of the image, counter-clockwise with the first row at the "
          "bottom. A pixel is sum k(x - i) k(y - j) v_ij divided by the sum of its weights; (x, y) "
          "is the place of its centre in the input. The total flux of well-sampled images is kept, "
          "to 1e-4 for Lanczos kernels and Gaussians of sigma 1.6 pixels or more. Multiples of 90 "
          "degrees copy the pixels and swap the sides, whatever --canvas says. {} {}",
          missing_text, wcs_text),
      .parameters =
          {
              required(Parameter::number("angle", "deg", Interval::any(), std::nullopt,
                                         "angle, counter-clockwise")),
              Parameter::choice("kernel", kernels, "lanczos3", "interpolation between pixels"),
              Parameter::choice("canvas", {"same", "full"}, "same",
                                "keep the size, or grow to hold the whole turned image"),
              fill_parameter("value outside the input, or nan"),
          },
      .example = "rotate --angle 30 --canvas full in.fits out.fits",
      .run = rotate_file};
}

// ---- flip --------------------------------------------------------------------------------------

int flip_file(const OperationCall& call) {
  const std::string& name = call.parameters.text("axis");
  const FlipAxis axis = name == "x" ? FlipAxis::x : name == "y" ? FlipAxis::y : FlipAxis::both;
  const PlaneChange mirror = [&](const PlaneTask& task) { return flip(task.plane, axis); };
  return change_geometry(
      call, mirror,
      [&](const FitsHeader&, int width, int height) { return flip_map(width, height, axis); },
      mirror);
}

Operation flip_operation() {
  return {.name = "flip",
          .summary = "Mirror",
          .description = fmt::format("Copies pixels in reverse order along an axis. {}", wcs_text),
          .parameters = {Parameter::choice("axis", {"x", "y", "both"}, "x",
                                           "x: left becomes right; y: bottom becomes top")},
          .example = "flip --axis y in.fits out.fits",
          .run = flip_file};
}

// ---- crop --------------------------------------------------------------------------------------

/// The box that --box gives.
Area box_of_ends(const OperationCall& call) {
  const std::vector<int> ends = whole_numbers(call, "box");
  constexpr std::size_t end_count = 4;
  if (ends.size() != end_count) {
    throw wrong(call, "--box has {} numbers; expected x1,x2,y1,y2", ends.size());
  }
  if (ends[0] > ends[1] || ends[2] > ends[3]) {
    throw wrong(call, "--box {}: expected x1,x2,y1,y2 with x1 <= x2 and y1 <= y2",
                fmt::join(ends, ","));
  }
  return {ends[0] - 1, ends[2] - 1, ends[1] - ends[0] + 1, ends[3] - ends[2] + 1};
}

/// The boxes that a call of crop cuts out of its images.
class CropBoxes {
 public:
  explicit CropBoxes(const OperationCall& call) : call_(call) {
    const ParameterSet& parameters = call.parameters;
    const bool has_center = parameters.has("center"), has_position = parameters.has("position");
    const bool by_middle = has_center || has_position || parameters.has("size");
    if (parameters.has("box") == by_middle || (has_center && has_position)) {
      throw wrong(
          call,
          "give either --box x1,x2,y1,y2, or --center x,y or --position ra,dec with --size w,h");
    }
    if (by_middle) {
      if (!(has_center || has_position) || !parameters.has("size")) {
        throw wrong(call, "{}",
                    has_position ? "--position ra,dec and --size w,h go together"
                                 : "--center x,y and --size w,h go together");
      }
      size_ = whole_numbers(call, "size");
    }
    if (has_position) {
      sky_ = sky_position(call);
    } else if (has_center) {
      const std::vector<double>& center = parameters.numbers("center");
      box_ = box_about({center[0], center[1]}, size_[0], size_[1]);
    } else {
      box_ = box_of_ends(call);
    }
    is_padded_ = has_position || parameters.has("pad");
    if (parameters.has("pad")) fill_ = fill_of(call, "pad");
  }

  double fill() const { return fill_; }

  /// The box in an image of that header and size. An image without world coordinates has the box of
  /// the last image of its size that has them.
  Area box(const FitsHeader& header, int width, int height, const std::string& label) {
    if (!sky_) return box_;
    const bool is_plain = !header.has("CTYPE1") && !header.has("CTYPE2");
    if (is_plain && width == known_width_ && height == known_height_) return box_;
    const CelestialWcs wcs = celestial_wcs(header, label);
    box_ = box_about(pixel_within(call_, wcs, *sky_, width, height, label), size_[0], size_[1]);
    known_width_ = width;
    known_height_ = height;
    return box_;
  }

  PlanePtr cut(const PlaneTask& task, double fill) {
    const Plane& plane = *task.plane;
    const Area area = box(task.header, plane.width(), plane.height(), task.label);
    const auto reaches = [](int first, int length, int side) {
      return first < 0 || first + length > side;
    };
    const auto is_beyond = [](int first, int length, int side) {
      return first >= side || first + length <= 0;
    };
    const bool is_outside =
        reaches(area.x, area.width, plane.width()) || reaches(area.y, area.height, plane.height());
    const bool is_all_outside = is_beyond(area.x, area.width, plane.width()) ||
                                is_beyond(area.y, area.height, plane.height());
    if (is_all_outside || (is_outside && !is_padded_)) {
      throw wrong(call_, "the box {},{},{},{} {} {}, which has {} x {} pixels", area.x + 1,
                  area.x + area.width, area.y + 1, area.y + area.height,
                  is_padded_ ? "lies outside" : "reaches outside", task.label, plane.width(),
                  plane.height());
    }
    checked_side(call_, area.width);
    checked_side(call_, area.height);
    return window(task.plane, area, fill);
  }

 private:
  const OperationCall& call_;
  std::vector<int> size_;
  std::optional<SkyPosition> sky_;
  bool is_padded_ = false;
  double fill_ = no_value;
  Area box_;
  int known_width_ = 0, known_height_ = 0;  ///< of the last image with world coordinates
};

int crop_file(const OperationCall& call) {
  CropBoxes boxes(call);
  CropBoxes edited = boxes;
  const double fill = boxes.fill();
  return change_geometry(
      call, [&](const PlaneTask& task) { return boxes.cut(task, fill); },
      [&](const FitsHeader& header, int width, int height) {
        return crop_map(edited.box(header, width, height, call.inputs.front()));
      },
      // The fill value has no variance.
      [&](const PlaneTask& task) { return boxes.cut(task, std::isnan(fill) ? fill : 0); });
}

Operation crop_operation() {
  constexpr double farthest = 1e9;
  const Interval pixel = Interval::closed(-farthest, farthest);
  Parameter fill = Parameter::text(
      "pad", std::nullopt, "value outside the image, or nan (default with --position: nan)");
  fill.unit = "unit of the pixels";
  return {
      .name = "crop",
      .summary = "Cut out a box",
      .description = fmt::format(
          "Cuts out a box given in FITS pixels (the first is 1, ends are included), or by its size "
          "about a pixel or a sky position. The position's pixel follows from each image's own "
          "world coordinates, in their frame. An image without world coordinates uses the box of "
          "the image before, if their sizes agree. A position outside an image is an error.\n\nA "
          "box about a position may reach over the edges: pixels outside the image are missing "
          "(NaN), or have the value of --pad. Other boxes must lie within the image unless --pad "
          "is given. {}",
          wcs_text),
      .parameters =
          {
              Parameter::numbers("box", "pixels", pixel, std::nullopt, "x1,x2,y1,y2"),
              Parameter::vector2("center", "pixels", pixel, std::nullopt, "middle of the box: x,y"),
              position_parameter("middle of the box: ra,dec, or h:m:s,d:m:s"),
              Parameter::size2("size", "pixels", Interval::closed(1, longest_side), std::nullopt,
                               "size of the box: n, or width,height"),
              fill,
          },
      .example = "crop --box 2,9,3,8 in.fits out.fits",
      .run = crop_file};
}

// ---- pad ---------------------------------------------------------------------------------------

Margins margins_of(const OperationCall& call, int width, int height) {
  const ParameterSet& parameters = call.parameters;
  if (parameters.has("margin") == parameters.has("size")) {
    throw wrong(call, "give either --margin n (or left,right,bottom,top) or --size w,h");
  }
  if (parameters.has("margin")) {
    const std::vector<int> margin = whole_numbers(call, "margin");
    if (margin.size() == 1) return {margin[0], margin[0], margin[0], margin[0]};
    constexpr std::size_t side_count = 4;
    if (margin.size() != side_count) {
      throw wrong(call, "--margin has {} numbers; expected one, or left,right,bottom,top",
                  margin.size());
    }
    return {margin[0], margin[1], margin[2], margin[3]};
  }
  const std::vector<int> size = whole_numbers(call, "size");
  if (size[0] < width || size[1] < height) {
    throw wrong(call, "--size {},{} is less than the image's {} x {} pixels (crop cuts)", size[0],
                size[1], width, height);
  }
  const int left = (size[0] - width) / 2, bottom = (size[1] - height) / 2;
  return {left, size[0] - width - left, bottom, size[1] - height - bottom};
}

int pad_file(const OperationCall& call) {
  const double fill = fill_of(call);
  const auto padded = [&](const PlaneTask& task, double value) {
    const int width = task.plane->width(), height = task.plane->height();
    const Margins margins = margins_of(call, width, height);
    checked_side(call, static_cast<double>(width) + margins.left + margins.right);
    checked_side(call, static_cast<double>(height) + margins.bottom + margins.top);
    return pad(task.plane, margins, value);
  };
  return change_geometry(
      call, [&](const PlaneTask& task) { return padded(task, fill); },
      [&](const FitsHeader&, int width, int height) {
        return pad_map(margins_of(call, width, height));
      },
      // The fill value has no variance.
      [&](const PlaneTask& task) { return padded(task, std::isnan(fill) ? fill : 0); });
}

Operation pad_operation() {
  return {.name = "pad",
          .summary = "Add a margin",
          .description = fmt::format("Surrounds the image with pixels of one value. With --size "
                                     "the image stands in the middle; an odd pixel is added at the "
                                     "right and at the top. {}",
                                     wcs_text),
          .parameters =
              {
                  Parameter::numbers("margin", "pixels", Interval::closed(0, longest_side),
                                     std::nullopt, "width for all sides, or left,right,bottom,top"),
                  Parameter::size2("size", "pixels", Interval::closed(1, longest_side),
                                   std::nullopt, "size of the output: n, or width,height"),
                  fill_parameter("value of the margin, or nan"),
              },
          .example = "pad --margin 5,5,2,3 --fill nan in.fits out.fits",
          .run = pad_file};
}

// ---- bin ---------------------------------------------------------------------------------------

int bin_file(const OperationCall& call) {
  const std::vector<int> n = whole_numbers(call, "factor");
  const bool trim = call.parameters.boolean("trim");
  const auto checked = [&](const PlaneTask& task) {
    const int width = task.plane->width(), height = task.plane->height();
    const std::string what =
        fmt::format("--factor {},{}: {} has {} x {} pixels", n[0], n[1], task.label, width, height);
    if (n[0] > width || n[1] > height) throw wrong(call, "{}", what);
    if (!trim && (width % n[0] != 0 || height % n[1] != 0)) {
      throw wrong(call, "{}, no multiple of it; --trim leaves the rest out", what);
    }
    return task.plane;
  };
  return change_geometry(
      call,
      [&](const PlaneTask& task) {
        refuse_magnitudes(call.operation, task.label, task.info.unit);
        return bin(checked(task), n[0], n[1], flux_or_brightness(call, task));
      },
      [&](const FitsHeader&, int, int) { return bin_map(n[0], n[1]); },
      [&](const PlaneTask& task) {
        const PlanePtr sum = bin(checked(task), n[0], n[1], PixelValues::flux);
        if (flux_or_brightness(call, task) == PixelValues::flux) return sum;
        const double count = static_cast<double>(n[0]) * n[1];
        return scaled(sum, 1 / (count * count), 0);
      });
}

Operation bin_operation() {
  return {.name = "bin",
          .summary = "Join blocks of pixels",
          .description = fmt::format(
              "Each block of nx x ny pixels becomes one pixel: the sum of fluxes, or the mean of "
              "brightnesses. The variance of a sum is the sum of the variances; the variance of a "
              "mean is their sum / (nx ny)^2. {} {}",
              missing_text, wcs_text),
          .parameters =
              {
                  required(Parameter::size2("factor", "pixels", Interval::closed(1, longest_side),
                                            std::nullopt, "side of a block: n, or nx,ny")),
                  Parameter::boolean("trim", false,
                                     "leave out pixels at the right and top that fill no block"),
                  values_parameter(),
              },
          .example = "bin --factor 2 --trim in.fits out.fits",
          .run = bin_file};
}

// ---- resample ----------------------------------------------------------------------------------

ResampleGrid grid_of(const OperationCall& call, const FitsHeader& header, int width, int height) {
  const ParameterSet& parameters = call.parameters;
  if (parameters.has("size")) {
    const std::vector<int> size = whole_numbers(call, "size");
    return grid_of_size(width, height, size[0], size[1]);
  }
  double factor = 0;
  if (parameters.has("factor")) {
    factor = parameters.number("factor");
  } else {
    const double old_scale = pixel_scale(header, call.inputs.front());
    const double scale = parameters.number("scale");
    factor = old_scale / scale;
    if (!(factor >= least_factor && factor <= most_factor)) {
      throw wrong(call, "--scale {}: the input has pixels of {:.6g} arcsec", scale, old_scale);
    }
  }
  checked_side(call, width * factor);
  checked_side(call, height * factor);
  return grid_of_factor(width, height, factor);
}

int resample_file(const OperationCall& call) {
  int ways = 0;
  for (const char* name : {"factor", "scale", "size"}) ways += call.parameters.has(name) ? 1 : 0;
  if (ways != 1) throw wrong(call, "give one of --factor, --scale and --size");
  const Kernel kernel = kernel_of(call.parameters.text("kernel"));
  return change_geometry(
      call,
      [&](const PlaneTask& task) {
        refuse_magnitudes(call.operation, task.label, task.info.unit);
        const ResampleGrid grid =
            grid_of(call, task.header, task.plane->width(), task.plane->height());
        return resample(task.plane, grid, kernel, flux_or_brightness(call, task));
      },
      [&](const FitsHeader& header, int width, int height) {
        return resample_map(grid_of(call, header, width, height));
      });
}

Operation resample_operation() {
  return {
      .name = "resample",
      .summary = "Pixels of another size",
      .description = fmt::format(
          "The kernel interpolates the running sum of the input pixels, along x and then along y. "
          "An output pixel is the difference of that sum between the pixel's edges. The flux of "
          "every pixel is kept exactly, and a uniform image stays uniform. area: exact overlap. "
          "bilinear: the integral of the surface between pixel centres. bicubic and lanczos widen "
          "when pixels become larger, so that nothing aliases. nearest copies pixels, and keeps "
          "flux on average only. With --factor and --scale the middle stays in place. The "
          "outermost pixels may reach over the edges and hold the flux up to them. {} {}",
          missing_text, wcs_text),
      .parameters =
          {
              Parameter::number("factor", "", Interval::closed(least_factor, most_factor),
                                std::nullopt,
                                "pixels of the output per pixel of the input, along a side"),
              Parameter::number("scale", "arcsec", Interval::left_open(0, largest_scale),
                                std::nullopt,
                                "side of an output pixel (needs celestial coordinates)"),
              Parameter::size2(
                  "size", "pixels", Interval::closed(1, longest_side), std::nullopt,
                  "size of the output, which covers the whole input: n, or width,height"),
              Parameter::choice("kernel", kernel_names(), "lanczos3",
                                "interpolation of the running sum"),
              values_parameter(),
          },
      .example = "resample --factor 1.5 --kernel area in.fits out.fits",
      .run = resample_file};
}

}  // namespace

std::vector<Operation> geometry_operations() {
  return {rotate_operation(), flip_operation(), crop_operation(),
          pad_operation(),    bin_operation(),  resample_operation()};
}

}  // namespace gamer
