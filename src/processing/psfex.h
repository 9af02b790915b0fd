#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gamer/image/fits/psfex_file.h"
#include "gamer/image/wcs.h"
#include "image/convolution/psf.h"

namespace gamer {

/// A PSF that varies over an image, on the image's pixels. At a place it is a sum of stamps, whose
/// weights depend on the place. Samples between those of the file come from Lanczos interpolation
/// (lanczos5).
class VaryingPsf {
 public:
  /// The PSF has the file's flux with `keep_flux`, otherwise a flux of 1. Messages begin with
  /// `label`.
  VaryingPsf(const PsfexFile& file, const std::string& label, bool keep_flux);

  int width() const { return stamps_.front().width; }
  int height() const { return stamps_.front().height; }
  const std::vector<Stamp>& stamps() const { return stamps_; }
  /// The weight of a stamp at a place. Throws InputError where the PSF's flux is not positive.
  double weight(std::size_t stamp, const PixelPosition& at) const;
  /// The PSF at a place. Throws InputError as weight() does.
  Stamp stamp(const PixelPosition& at) const;

 private:
  std::string label_;
  bool keep_flux_;
  int degree_;
  std::vector<PsfexFile::Axis> axes_;
  std::vector<Stamp> stamps_;
  std::vector<double> sums_;  ///< of the stamps
};

}  // namespace gamer
