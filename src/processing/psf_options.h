#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "processing/plane_operation.h"
#include "processing/psf.h"

namespace gamer {

/// Names of the models of --psf, in the order of PsfKind.
const std::vector<std::string>& psf_models();

/// The options of a PSF: --psf and psf_parameters().
class PsfOptions {
 public:
  /// Throws InputError for options that do not fit together.
  explicit PsfOptions(const OperationCall& call);

  bool is_file() const { return is_file_; }
  bool needs_scale() const;

  /// The PSF on the pixels of `task`, whose plane may be null.
  Psf psf(const PlaneTask& task) const;
  StampOptions stamp() const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// A word that names no file is a mistyped model name.
  void check_file_name(const std::string& name) const;
  void refuse(const char* option, const char* why) const;
  /// Position angle of the major axis on the pixels, deg from +y towards -x.
  double position_angle(const PlaneTask& task) const;
  /// WCS of the planes to convolve, if they have one; in images of a PSF North is up.
  static std::optional<CelestialWcs> celestial_wcs(const PlaneTask& task);
  /// FWHM of diffraction, arcsec.
  double diffraction_fwhm(const PlaneTask& task) const;

  const OperationCall& call_;
  PsfKind kind_ = PsfKind::gaussian;
  bool is_file_ = false;
};

/// The stamps of a PSF file: one for all planes, or one per plane.
class StampFile {
 public:
  StampFile(const std::string& name, bool keep_flux);

  std::size_t count() const { return planes_.size(); }
  /// Index of the stamp for plane `index` of `planes`. Throws InputError, which names `label`,
  /// where the file has neither one plane nor as many.
  std::size_t index_of(const PsfOptions& options, int index, int planes,
                       const std::string& label) const;
  const Plane& plane(std::size_t index) const { return *planes_[index].first; }
  Stamp stamp(std::size_t index) const;

 private:
  FitsInput input_;
  bool keep_flux_;
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
