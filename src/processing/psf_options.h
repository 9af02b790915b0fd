#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "image/convolution/psf.h"
#include "processing/instrument_option.h"
#include "processing/plane_operation.h"
#include "processing/psfex.h"

namespace gamer {

/// Names of the models of --psf, in the order of PsfKind.
const std::vector<std::string>& psf_models();

/// The options of a PSF: --psf and psf_parameters().
class PsfOptions {
 public:
  /// An instrument, if given, replaces the options. Throws InputError for options that do not fit
  /// together.
  explicit PsfOptions(const OperationCall& call, InstrumentOption instrument = {});

  bool is_file() const { return is_file_; }
  bool needs_scale() const;

  /// The PSF on the pixels of `task`, whose plane may be null.
  Psf psf(const PlaneTask& task) const;
  StampOptions stamp() const;

  template <class... Values>
  [[noreturn]] void fail(fmt::format_string<Values...> message, Values&&... values) const {
    throw wrong(call_, message, std::forward<Values>(values)...);
  }

 private:
  /// Throws InputError for a word that names no file, which is then a mistyped model.
  void check_file_name(const std::string& name) const;
  void refuse(const char* option, const char* why) const;
  void check_size() const;
  /// Checks that no option of a model is given, and takes the instrument's.
  void take_instrument();
  /// Position angle of the PSF's major axis on the pixels, deg from +y towards -x.
  double position_angle(const PlaneTask& task) const;
  /// WCS of the planes to convolve, if they have one; in images of a PSF North is up.
  static std::optional<CelestialWcs> celestial_wcs(const PlaneTask& task);
  /// FWHM of diffraction, arcsec.
  double diffraction_fwhm(const PlaneTask& task) const;

  const OperationCall& call_;
  InstrumentOption instrument_;
  PsfKind kind_ = PsfKind::gaussian;
  bool is_file_ = false;
};

/// A stamp that is made when it is needed, and its size.
struct StampSource {
  int width = 1, height = 1;
  std::function<Stamp()> make;
};

/// A PSF file: images of stamps, one for all planes or one per plane, or a .psf file of PSFEx.
class StampFile {
 public:
  StampFile(const std::string& name, bool keep_flux);

  /// The PSF of a PSFEx file; null for other files.
  const std::shared_ptr<const VaryingPsf>& varying() const { return varying_; }
  /// The stamp for plane `index` of `planes` planes; from a PSFEx file, the stamp at the pixel
  /// `at`. Throws InputError, which names `label`, for a file of neither one plane nor `planes`
  /// planes, and for pixels that are no stamp.
  StampSource source(const PsfOptions& options, int index, int planes, const std::string& label,
                     const PixelPosition& at) const;

 private:
  std::string name_;
  bool keep_flux_;
  std::shared_ptr<const VaryingPsf> varying_;
  std::optional<FitsInput> input_;
  std::vector<std::pair<PlanePtr, std::string>> planes_;
};

/// Descriptions that differ between the operations.
struct PsfTexts {
  std::string unit, position_angle;
};

/// Declarations of a PSF's options, all but --psf.
ParameterTable psf_parameters(const PsfTexts& texts);

/// Formulae of the models.
extern const char* const psf_model_text;

}  // namespace gamer
