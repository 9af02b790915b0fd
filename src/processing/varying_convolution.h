#pragma once

#include <memory>

#include "gamer/image/plane.h"
#include "image/convolution/convolution.h"
#include "processing/psfex.h"

namespace gamer {

/// The convolution with a PSF that varies over the image. The light of each pixel s is spread by
/// the PSF at that pixel, the sum of stamps B_c with weights w_c(s):
///   out(p) = sum over s of PSF_s(p - s) source(s) = sum over c of (B_c * (w_c source))(p).
/// The PSF's coordinates of the source's first pixel are (1, 1). Missing pixels are as in
/// convolved().
PlanePtr convolved(PlanePtr source, std::shared_ptr<const VaryingPsf> psf,
                   const ConvolutionOptions& options);

}  // namespace gamer
