#pragma once

#include "gamer/image/image.h"
#include "processing/sky_noise.h"

namespace gamer {

/// Clumpiness S of the light between two circles about (x, y), counted from 0:
///   S = (sum max(0, I - Is) - n <max(0, B - Bs)>) / sum I
/// with exact fractions of the n pixels. Is is the image's mean over a square of `width` pixels.
/// Conselice 2003 (ApJS 147, 1) multiplies S by 10; Lotz et al. 2004 (AJ 128, 163) does not.
double clumpiness(const Image& image, double x, double y, double inner, double outer, double width,
                  const SkyNoise& sky);

}  // namespace gamer
