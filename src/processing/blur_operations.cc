#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/near.h"
#include "gamer/core/units.h"
#include "gamer/image/wcs.h"
#include "processing/aperture.h"
#include "processing/convolution.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/psf.h"

namespace gamer {
namespace {

/// In the order of PsfKind.
const std::vector<std::string> models = {"gaussian", "moffat", "airy", "kolmogorov"};
/// FWHM in pixels.
constexpr double least_fwhm = 0.1, largest_fwhm = 1000;
constexpr double angstrom = 1e-10;  // m

/// PSF options that both operations share.
class PsfOptions {
 public:
  /// Throws InputError for options that do not fit together.
  explicit PsfOptions(const OperationCall& call) : call_(call) {
    const std::string& name = call.parameters.text("psf");
    const auto model = std::find(models.begin(), models.end(), name);
    if (model == models.end()) {
      is_file_ = true;
      check_file_name(name);
      for (const char* option : {"fwhm", "unit", "beta", "obscuration", "diameter", "axis_ratio",
                                 "position_angle", "size", "energy", "sampling"}) {
        refuse(option, "is of models, not of a PSF from a file");
      }
      return;
    }
    kind_ = static_cast<PsfKind>(model - models.begin());
    if (kind_ != PsfKind::moffat) refuse("beta", "is of --psf moffat only");
    if (kind_ != PsfKind::airy) {
      refuse("obscuration", "is of --psf airy only");
      refuse("diameter", "is of --psf airy only");
    }
    const bool has_diameter = call.parameters.has("diameter");
    if (has_diameter) {
      refuse("fwhm", "follows from --diameter; give one of them");
      refuse("unit", "is of --fwhm, not of --diameter");
    } else if (!call.parameters.has("fwhm")) {
      fail(kind_ == PsfKind::airy ? "needs --fwhm, or --diameter" : "needs --fwhm");
    }
    if (call.parameters.has("size")) {
      refuse("energy", "chooses the size; give --size or --energy");
      if (const auto size = call.parameters.integer("size"); size % 2 == 0) {
        fail(fmt::format("--size is {}; only odd sizes have a middle pixel", size));
      }
    }
    if (call.parameters.number("axis_ratio") == 1) {
      refuse("position_angle", "needs an --axis-ratio below 1");
    }
  }

  bool is_file() const { return is_file_; }
  bool needs_scale() const {
    return call_.parameters.has("diameter") || call_.parameters.text("unit") == "arcsec";
  }

  Psf psf(const PlaneTask& task) const {
    PsfModel model;
    model.kind = kind_;
    model.beta = call_.parameters.number("beta");
    model.obscuration = call_.parameters.number("obscuration");
    model.axis_ratio = call_.parameters.number("axis_ratio");
    if (model.axis_ratio < 1) model.position_angle = position_angle(task);
    const bool has_diameter = call_.parameters.has("diameter");
    const double asked = has_diameter ? diffraction_fwhm(task) : plane_value(call_, "fwhm", task);
    model.fwhm = needs_scale() ? asked / pixel_scale(task.header, task.label) : asked;
    if (!(model.fwhm >= least_fwhm && model.fwhm <= largest_fwhm)) {
      fail(fmt::format("plane {}: a FWHM of {:.6g} pixels; [{}, {}] are possible", task.index + 1,
                       model.fwhm, least_fwhm, largest_fwhm));
    }
    return Psf(model);
  }

  StampOptions stamp() const {
    StampOptions options;
    if (call_.parameters.has("size")) {
      options.size = static_cast<int>(call_.parameters.integer("size"));
    }
    options.energy = call_.parameters.number("energy");
    options.integrated = call_.parameters.text("sampling") == "integrated";
    options.keep_missing_flux = call_.parameters.boolean("keep_missing_flux");
    return options;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("gutil {}: {}", call_.operation, what));
  }

 private:
  /// A word that names no file is a mistyped model name.
  void check_file_name(const std::string& name) const {
    const bool is_word = name.find_first_of("./[") == std::string::npos && name != "-";
    std::error_code error;
    if (!is_word || std::filesystem::exists(name, error)) return;
    fail(fmt::format("--psf is {}; a model ({}) or a FITS file is needed{}", in_quotes(name),
                     fmt::join(models, ", "), did_you_mean(name, models)));
  }

  void refuse(const char* option, const char* why) const {
    if (call_.parameters.is_given(option)) fail(fmt::format("{} {}", option_name(option), why));
  }

  /// Position angle of the major axis on the pixels, deg from +y towards -x.
  double position_angle(const PlaneTask& task) const {
    const double asked = call_.parameters.number("position_angle");
    const auto wcs = celestial_wcs(task);
    if (!wcs) return asked;
    const double x = (task.plane->width() - 1) / 2.0, y = (task.plane->height() - 1) / 2.0;
    try {
      return angle_on_pixels(*wcs, x, y, asked * degree) / degree - 90;
    } catch (const InputError& error) {
      fail(fmt::format("{}: --position-angle is from North, at the middle of the image, but {}",
                       task.label, error.what()));
    }
  }

  /// WCS of the planes to convolve, if they have one; in images of a PSF North is up.
  static std::optional<CelestialWcs> celestial_wcs(const PlaneTask& task) {
    if (!task.plane) return std::nullopt;
    try {
      return gamer::celestial_wcs(task.header, task.label);
    } catch (const InputError&) {
      return std::nullopt;
    }
  }

  /// FWHM of diffraction, arcsec.
  double diffraction_fwhm(const PlaneTask& task) const {
    if (!task.info.wavelength) {
      fail(
          fmt::format("{}: --diameter needs the wavelength of plane {}, which has no WAVELEN; "
                      "give --fwhm",
                      task.label, task.index + 1));
    }
    const double ratio = *task.info.wavelength * angstrom / call_.parameters.number("diameter");
    return airy_fwhm(call_.parameters.number("obscuration")) * ratio / arcsecond;
  }

  const OperationCall& call_;
  PsfKind kind_ = PsfKind::gaussian;
  bool is_file_ = false;
};

/// The stamps of a PSF file: one for all planes, or one per plane.
class StampFile {
 public:
  StampFile(const std::string& name, bool keep_flux) : input_(name), keep_flux_(keep_flux) {
    visit_planes(input_, 1, [&](const PlaneTask& task) {
      const std::string plane = task.count == 1 ? "" : fmt::format(", plane {}", task.index + 1);
      planes_.emplace_back(task.plane, task.label + plane);
    });
  }

  std::size_t count() const { return planes_.size(); }
  const Plane& plane(std::size_t index) const { return *planes_[index].first; }
  Stamp stamp(std::size_t index) const {
    return read_stamp(*planes_[index].first, planes_[index].second, keep_flux_);
  }

 private:
  FitsInput input_;
  bool keep_flux_;
  std::vector<std::pair<PlanePtr, std::string>> planes_;
};

EdgeMode edge_mode(const std::string& name) {
  if (name == "reflect") return EdgeMode::reflect;
  return name == "wrap" ? EdgeMode::wrap : EdgeMode::zero;
}

int run_convolve(const OperationCall& call) {
  const PsfOptions options(call);
  ConvolutionOptions convolution;
  convolution.edge = edge_mode(call.parameters.text("edge"));
  convolution.is_single = call.parameters.text("precision") == "single";
  if (!options.is_file()) {
    const StampOptions stamp_options = options.stamp();
    change_planes(call, [&](const PlaneTask& task) {
      const Psf psf = options.psf(task);
      StampOptions sized = stamp_options;
      if (sized.size == 0) sized.size = stamp_size(psf, sized.energy);
      return convolved(
          task.plane, sized.size, sized.size, [psf, sized] { return make_stamp(psf, sized); },
          convolution);
    });
    return 0;
  }
  const std::string& name = call.parameters.text("psf");
  const auto file =
      std::make_shared<const StampFile>(name, call.parameters.boolean("keep_missing_flux"));
  change_planes(call, [&](const PlaneTask& task) {
    if (file->count() != 1 && file->count() != static_cast<std::size_t>(task.count)) {
      options.fail(
          fmt::format("the PSF {} has {} planes, {} has {}; one, or one for each is needed", name,
                      file->count(), call.inputs.front(), task.count));
    }
    const auto index = file->count() == 1 ? std::size_t{0} : static_cast<std::size_t>(task.index);
    // Read now to find errors, and again when it is used.
    if (static_cast<std::size_t>(task.index) == index) file->stamp(index);
    const Plane& plane = file->plane(index);
    return convolved(
        task.plane, plane.width(), plane.height(), [file, index] { return file->stamp(index); },
        convolution);
  });
  return 0;
}

/// A stamp that is made when it is written.
class StampPlane final : public Plane {
 public:
  StampPlane(Psf psf, const StampOptions& options)
      : Plane(options.size, options.size), psf_(std::move(psf)), options_(options) {}

  Tile tile() const override { return {width(), height()}; }
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const Stamp stamp = make_stamp(psf_, options_);
    const int half = options_.size / 2;
    for (int y = 0; y < area.height; ++y) {
      for (int x = 0; x < area.width; ++x) {
        out[y * stride + x] = stamp.at(area.x + x - half, area.y + y - half);
      }
    }
  }

 private:
  Psf psf_;
  StampOptions options_;
};

/// Sets a tangential projection with the middle pixel at (0, 0).
void set_scale(FitsHeader& header, double arcsec) {
  constexpr double arcsec_per_degree = 3600;
  header.set("CTYPE1", std::string("RA---TAN"));
  header.set("CTYPE2", std::string("DEC--TAN"));
  header.set("CUNIT1", std::string("deg"));
  header.set("CUNIT2", std::string("deg"));
  header.set("CRVAL1", 0.0);
  header.set("CRVAL2", 0.0);
  header.set("CDELT1", -arcsec / arcsec_per_degree);
  header.set("CDELT2", arcsec / arcsec_per_degree);
}

int run_psf(const OperationCall& call) {
  const PsfOptions options(call);
  const ParameterSet& parameters = call.parameters;
  const bool has_scale = parameters.has("pixel_scale");
  if (options.needs_scale() && !has_scale) {
    options.fail(fmt::format("{} needs --pixel-scale",
                             parameters.has("diameter") ? "--diameter" : "--unit arcsec"));
  }
  if (parameters.has("diameter") && !parameters.has("wavelength")) {
    options.fail("--diameter needs --wavelength");
  }
  std::size_t count = 1;
  for (const char* list : {"fwhm", "wavelength"}) {
    if (parameters.has(list)) count = std::max(count, parameters.numbers(list).size());
  }

  FitsHeader header;
  if (has_scale) {
    set_scale(header, parameters.number("pixel_scale"));
    // The scale is measured at this pixel; the middle pixel is known only later.
    header.set("CRPIX1", 1.0);
    header.set("CRPIX2", 1.0);
  }
  std::vector<Psf> psfs;
  std::vector<double> wavelengths;
  StampOptions stamp = options.stamp();
  int size = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string number = count == 1 ? "" : std::to_string(i + 1);
    PlaneTask task{
        nullptr,     {}, header, call.output, static_cast<int>(i), static_cast<int>(count),
        call.threads};
    if (parameters.has("wavelength")) {
      task.info.wavelength = plane_value(call, "wavelength", task);
    }
    psfs.push_back(options.psf(task));
    size = std::max(size, stamp.size == 0 ? stamp_size(psfs.back(), stamp.energy) : stamp.size);
    if (task.info.wavelength) wavelengths.push_back(*task.info.wavelength);
    header.set({"FWHM" + number, psfs.back().model().fwhm, "[pixel] full width at half maximum"});
  }
  stamp.size = size;
  header.set({"PSF", parameters.text("psf"), "model of the point-spread function"});
  if (has_scale) {
    const double middle = size / 2 + 1;
    header.set("CRPIX1", middle);
    header.set("CRPIX2", middle);
  }
  header.set({"HISTORY", {}, call.history});
  std::vector<PlanePtr> planes;
  for (const Psf& psf : psfs) planes.push_back(std::make_shared<StampPlane>(psf, stamp));
  FitsOutput output({call.output, call.overwrite});
  constexpr int double_bitpix = -64;
  output.write_cube(header, planes, wavelengths, call.bitpix == 0 ? double_bitpix : call.bitpix,
                    call.threads);
  output.finish();
  return 0;
}

/// Texts that differ between the operations.
struct ModelTexts {
  std::string unit, position_angle;
};

/// Parameters that both operations have after --psf.
ParameterTable model_parameters(const ModelTexts& texts) {
  const Interval positive = Interval::open(0, std::numeric_limits<double>::infinity());
  return {
      Parameter::numbers("fwhm", "pixels or arcsec", positive, std::nullopt,
                         "full width at half maximum of models; one value, or one for each plane"),
      Parameter::choice("unit", {"pixel", "arcsec"}, "pixel", texts.unit),
      Parameter::number("beta", "", Interval::left_open(1, 100), 3.0,
                        "exponent of the Moffat profile"),
      Parameter::number("obscuration", "", Interval::closed(0, 0.95), 0.0,
                        "central obscuration of the Airy pattern, inner over outer diameter"),
      Parameter::number(
          "diameter", "m", positive, std::nullopt,
          "aperture of the Airy pattern: its width follows from the planes' wavelengths"),
      Parameter::number("axis_ratio", "", Interval::closed(0.1, 1), 1.0,
                        "minor over major axis; the area stays that of the FWHM"),
      Parameter::number("position_angle", "deg", Interval::any(), 0.0, texts.position_angle),
      Parameter::integer("size", "pixels", Interval::closed(1, largest_stamp), std::nullopt,
                         "side of the PSF's image, odd (default: by --energy)"),
      Parameter::number(
          "energy", "", Interval::open(0, 1), StampOptions().energy,
          fmt::format("share of the flux within the PSF's image, which is at most {0} x {0} pixels",
                      largest_chosen_stamp)),
      Parameter::choice("sampling", {"integrated", "point"}, "integrated",
                        "over the pixels, or at their centres"),
      Parameter::boolean("keep_missing_flux", false, "do not scale the PSF's sum to 1")};
}

constexpr const char* model_text =
    "Models, with the radius r and the FWHM w: gaussian exp(-4 ln2 r^2/w^2); moffat "
    "(1 + r^2/a^2)^-beta, w = 2 a sqrt(2^(1/beta) - 1); airy [(2 J1(x)/x - e^2 2 J1(e x)/(e x)) / "
    "(1 - e^2)]^2, x = pi r D/lambda, with the obscuration e; kolmogorov, the transform of "
    "exp(-3.4419 (f/r0)^(5/3)), w = 0.97586/r0. With an axis ratio q, r^2 = q u^2 + v^2/q, u along "
    "the major axis. ";

Operation convolve_operation() {
  Operation convolve;
  convolve.name = "convolve";
  convolve.group = "Blur";
  convolve.summary = "Convolve with a point-spread function";
  convolve.description =
      std::string("out(x, y) = sum over (i, j) of psf(i, j) in(x - i, y - j). ") + model_text +
      "The PSF's sum is 1, so that flux is kept, but for what leaves the image with --edge zero.\n"
      "\n"
      "Any other text of --psf is a FITS file (extended names too) with odd sides, centred on its "
      "middle pixel, of one plane, or one for each plane of the input.\n"
      "\n"
      "--position-angle is on the sky, from North towards East, by the coordinates at the middle "
      "of "
      "the image; without celestial coordinates it is from +y towards -x.\n"
      "\n"
      "Missing pixels, as NaN and infinities both are here (rotate, resample and bin let "
      "infinities "
      "spread), are NaN in the output and spread no further: where the PSF covers some of them, "
      "the "
      "others count for all. Single precision is quicker and good to about 1e-7 of the brightest "
      "pixel around. The header stays, with one HISTORY card more.";
  convolve.parameters = {required(Parameter::text(
      "psf", std::nullopt, fmt::format("{}, or a FITS file", fmt::join(models, ", "))))};
  for (Parameter& parameter :
       model_parameters({"of --fwhm; arcsec through the celestial coordinates",
                         "of the major axis, from North towards East; without celestial "
                         "coordinates from +y towards -x"})) {
    convolve.parameters.push_back(std::move(parameter));
  }
  convolve.parameters.push_back(
      Parameter::choice("edge", {"zero", "reflect", "wrap"}, "zero",
                        "beyond the edges: nothing, the image mirrored, or the image again"));
  convolve.parameters.push_back(
      Parameter::choice("precision", {"double", "single"}, "double", "of the computation"));
  convolve.example = "convolve --psf moffat --fwhm 3.5 --beta 3 in.fits out.fits";
  convolve.run = run_convolve;
  return convolve;
}

Operation psf_operation() {
  Operation psf;
  psf.name = "psf";
  psf.group = "Blur";
  psf.summary = "Write the image of a point-spread function";
  psf.description =
      std::string(model_text) +
      "The image has odd sides, the PSF's centre on the middle pixel, and the sum 1. Several "
      "widths or wavelengths make a cube, whose third axis is evenly spaced wavelengths or the "
      "number of the plane. The header "
      "holds FWHM in pixels (FWHMn of plane n), WAVELENn where --wavelength is given, and with "
      "--pixel-scale celestial coordinates of that scale, North upwards and East to the left.";
  psf.least_inputs = 0;
  psf.most_inputs = 0;
  psf.parameters = {required(Parameter::choice("psf", models, std::nullopt, "model"))};
  for (Parameter& parameter :
       model_parameters({"of --fwhm; arcsec needs --pixel-scale",
                         "of the major axis, from +y towards -x: from North towards East with "
                         "--pixel-scale"})) {
    psf.parameters.push_back(std::move(parameter));
  }
  const Interval positive = Interval::open(0, std::numeric_limits<double>::infinity());
  psf.parameters.push_back(Parameter::number("pixel_scale", "arcsec", Interval::left_open(0, 3600),
                                             std::nullopt, "side of a pixel"));
  psf.parameters.push_back(Parameter::numbers("wavelength", "Angstrom", positive, std::nullopt,
                                              "for --diameter; one value, or one for each plane"));
  psf.example = "psf --psf airy --fwhm 3 --obscuration 0.33 --size 65 out.fits";
  psf.run = run_psf;
  return psf;
}

}  // namespace

std::vector<Operation> blur_operations() { return {convolve_operation(), psf_operation()}; }

}  // namespace gamer
