#pragma once

#include "gamer/image/fits/psfex_file.h"
#include "gamer/image/wcs.h"
#include "processing/psf.h"

namespace gamer {

/// The PSF at a place of the image, on the image's pixels. Samples between those of the file come
/// from Lanczos interpolation (lanczos5). The sum is 1, or the file's flux with `keep_flux`. Throws
/// InputError, beginning with `label`, where the sum is not positive.
Stamp psfex_stamp(const PsfexFile& file, const PixelPosition& at, const std::string& label,
                  bool keep_flux);

}  // namespace gamer
