#include "processing/psf_options.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/near.h"
#include "gamer/core/units.h"
#include "processing/aperture.h"

namespace gamer {
namespace {

/// FWHM in pixels.
constexpr double least_fwhm = 0.1, largest_fwhm = 1000;
constexpr double angstrom = 1e-10;  // m

BoundTable stamp_keys(StampOptions& p) {
  return {
      without_default({p.size, "size", "pixels", Interval::closed(1, largest_stamp),
                       "side of the PSF's image, odd (default: by --energy)"}),
      {p.energy, "energy", "", Interval::open(0, 1),
       fmt::format("share of the flux within the PSF's image, which is at most {0} x {0} pixels",
                   largest_chosen_stamp)},
      choice(p.integrated, "sampling", {{"integrated", true}, {"point", false}},
             "value of a pixel: the model integrated over the pixel, or at the pixel's centre"),
      {p.keep_missing_flux, "keep_missing_flux", "do not scale the PSF's sum to 1"}};
}

}  // namespace

const std::vector<std::string>& psf_models() {
  static const std::vector<std::string> models = {"gaussian", "moffat", "airy", "kolmogorov"};
  return models;
}

PsfOptions::PsfOptions(const OperationCall& call, InstrumentOption instrument)
    : call_(call), instrument_(std::move(instrument)) {
  if (instrument_.is_given()) {
    take_instrument();
    return;
  }
  if (!call.parameters.has("psf")) {
    fail("needs --psf ({} or a FITS file), or --instrument", fmt::join(psf_models(), ", "));
  }
  const std::vector<std::string>& models = psf_models();
  const std::string& name = call.parameters.text("psf");
  const auto model = std::ranges::find(models, name);
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
    fail("{}", kind_ == PsfKind::airy ? "needs --fwhm, or --diameter" : "needs --fwhm");
  }
  check_size();
  if (call.parameters.number("axis_ratio") == 1) {
    refuse("position_angle", "needs an --axis-ratio below 1");
  }
}

void PsfOptions::check_size() const {
  if (!call_.parameters.has("size")) return;
  refuse("energy", "chooses the size; give --size or --energy");
  if (const auto size = call_.parameters.integer("size"); size % 2 == 0) {
    fail("--size is {}; only odd sizes have a middle pixel", size);
  }
}

void PsfOptions::take_instrument() {
  check_size();
  for (const char* option :
       {"psf", "fwhm", "unit", "beta", "obscuration", "diameter", "axis_ratio", "position_angle"}) {
    refuse(option, "and --instrument both say what the PSF is; give one");
  }
  kind_ = instrument_.get().is_moffat ? PsfKind::moffat : PsfKind::gaussian;
}

bool PsfOptions::needs_scale() const {
  if (instrument_.is_given()) return true;
  return call_.parameters.has("diameter") || call_.parameters.text("unit") == "arcsec";
}

Psf PsfOptions::psf(const PlaneTask& task) const {
  PsfModel model;
  model.kind = kind_;
  model.beta = instrument_.is_given() ? instrument_.get().beta : call_.parameters.number("beta");
  model.obscuration = call_.parameters.number("obscuration");
  model.axis_ratio = call_.parameters.number("axis_ratio");
  if (model.axis_ratio < 1) model.position_angle = position_angle(task);
  const bool has_diameter = call_.parameters.has("diameter");
  const double asked = instrument_.is_given() ? instrument_.band(task).fwhm
                       : has_diameter         ? diffraction_fwhm(task)
                                              : plane_value(call_, "fwhm", task);
  model.fwhm = needs_scale() ? asked / pixel_scale(task.header, task.label) : asked;
  if (!(model.fwhm >= least_fwhm && model.fwhm <= largest_fwhm)) {
    fail("plane {}: a FWHM of {:.6g} pixels; [{}, {}] are possible", task.index + 1, model.fwhm,
         least_fwhm, largest_fwhm);
  }
  return Psf(model);
}

StampOptions PsfOptions::stamp() const { return read_object(call_.parameters, stamp_keys); }

void PsfOptions::check_file_name(const std::string& name) const {
  const bool is_word = name.find_first_of("./[") == std::string::npos && name != "-";
  std::error_code error;
  if (!is_word || std::filesystem::exists(name, error)) return;
  fail("--psf is {}; a model ({}) or a FITS file is needed{}", in_quotes(name),
       fmt::join(psf_models(), ", "), did_you_mean(name, psf_models()));
}

void PsfOptions::refuse(const char* option, const char* why) const {
  if (call_.parameters.is_given(option)) fail("{} {}", option_name(option), why);
}

double PsfOptions::position_angle(const PlaneTask& task) const {
  const double asked = call_.parameters.number("position_angle");
  const auto wcs = celestial_wcs(task);
  if (!wcs) return asked;
  const double x = (task.plane->width() - 1) / 2.0, y = (task.plane->height() - 1) / 2.0;
  try {
    return angle_on_pixels(*wcs, x, y, asked * degree) / degree - 90;
  } catch (const InputError& error) {
    fail("{}: --position-angle is from North, at the middle of the image, but {}", task.label,
         error.what());
  }
}

std::optional<CelestialWcs> PsfOptions::celestial_wcs(const PlaneTask& task) {
  if (!task.plane) return std::nullopt;
  try {
    return gamer::celestial_wcs(task.header, task.label);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

double PsfOptions::diffraction_fwhm(const PlaneTask& task) const {
  if (!task.info.wavelength) {
    fail("{}: --diameter needs the wavelength of plane {}, which has no WAVELEN; give --fwhm",
         task.label, task.index + 1);
  }
  const double ratio = *task.info.wavelength * angstrom / call_.parameters.number("diameter");
  return airy_fwhm(call_.parameters.number("obscuration")) * ratio / arcsecond;
}

StampFile::StampFile(const std::string& name, bool keep_flux) : name_(name), keep_flux_(keep_flux) {
  std::error_code error;
  if (std::filesystem::is_regular_file(name, error)) {
    if (const std::optional<PsfexFile> file = read_psfex_file(name)) {
      varying_ = std::make_shared<const VaryingPsf>(*file, name, keep_flux);
      return;
    }
  }
  input_.emplace(name);
  visit_planes(*input_, 1, [&](const PlaneTask& task) {
    const std::string plane = task.count == 1 ? "" : fmt::format(", plane {}", task.index + 1);
    planes_.emplace_back(task.plane, task.label + plane);
  });
}

StampSource StampFile::source(const PsfOptions& options, int index, int planes,
                              const std::string& label, const PixelPosition& at) const {
  if (varying_) {
    const Stamp stamp = varying_->stamp(at);
    return {stamp.width, stamp.height, [stamp] { return stamp; }};
  }
  const std::size_t count = planes_.size();
  if (count != 1 && count != static_cast<std::size_t>(planes)) {
    options.fail("the PSF {} has {} planes, {} has {}; one, or one for each is needed", name_,
                 count, label, planes);
  }
  const auto& [plane, plane_label] = planes_[count == 1 ? 0 : static_cast<std::size_t>(index)];
  const auto make = [plane = plane, name = plane_label, keep_flux = keep_flux_] {
    return read_stamp(*plane, name, keep_flux);
  };
  make();  // finds errors; the stamp is made again when it is used
  return {plane->width(), plane->height(), make};
}

ParameterTable psf_parameters(const PsfTexts& texts) {
  const ParameterTable model = {
      Parameter::numbers("fwhm", "pixels or arcsec", Interval::positive(), std::nullopt,
                         "full width at half maximum of models; one value, or one for each plane"),
      Parameter::choice("unit", {"pixel", "arcsec"}, "pixel", texts.unit),
      Parameter::number("beta", "", Interval::left_open(1, 100), 3.0,
                        "exponent of the Moffat profile"),
      Parameter::number("obscuration", "", Interval::closed(0, 0.95), 0.0,
                        "central obscuration of the Airy pattern, inner over outer diameter"),
      Parameter::number("diameter", "m", Interval::positive(), std::nullopt,
                        "aperture of the Airy pattern, whose width then follows from the "
                        "wavelengths of the planes"),
      Parameter::number(
          "axis_ratio", "", Interval::closed(0.1, 1), 1.0,
          "ratio of minor to major axis; the area stays that of a circle of this FWHM"),
      Parameter::number("position_angle", "deg", Interval::any(), 0.0, texts.position_angle)};
  return model + declarations(stamp_keys);
}

const char* const psf_model_text =
    "The models have radius r and FWHM w. gaussian: exp(-4 ln2 r^2/w^2). moffat: (1 + "
    "r^2/a^2)^-beta, w = 2 a sqrt(2^(1/beta) - 1). airy: [(2 J1(x)/x - e^2 2 J1(e x)/(e x)) / (1 - "
    "e^2)]^2, x = pi r D/lambda, with the obscuration e. kolmogorov: the Fourier transform of "
    "exp(-3.4419 (f/r0)^(5/3)), w = 0.97586/r0. With an axis ratio q, r^2 = q u^2 + v^2/q, where u "
    "is along the major axis. ";

}  // namespace gamer
