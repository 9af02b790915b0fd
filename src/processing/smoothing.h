#pragma once

#include "gamer/image/image.h"

namespace gamer {

/// The mean of a plane of pixels over a square of `width` >= 1 pixels about each pixel. Pixels at
/// the square's sides count by their part inside, so that the square is centred for any width. At
/// the image's edges the mean is over the part of the square inside the image. Missing pixels make
/// their neighbours NaN.
Image box_mean(const Image& image, double width);

/// The image with 0 for missing pixels.
Image present_pixels(const Image& image);

/// The plane smoothed by a Gaussian of `sigma` pixels, cut at 4 sigma, with nothing beyond the
/// edges.
Image gaussian_mean(const Image& image, double sigma);

}  // namespace gamer
