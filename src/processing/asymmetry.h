#pragma once

#include <array>

#include "gamer/image/image.h"
#include "processing/sky_noise.h"

namespace gamer {

/// Asymmetry A (Conselice, Bershady & Jangren 2000, ApJ 529, 886) about (x, y), counted from 0:
///   A = (sum |I - I180| - n <|B - B180|>) / sum |I|
/// over a circle of n pixels, with exact fractions of pixels at its edge. I180 is the image turned
/// by 180 degrees, interpolated by cubic convolution. The noise term is computed for the sub-pixel
/// fractions of I180, since interpolation smooths noise. There is no factor 1/2: A lies in [0, 2].
struct Asymmetry {
  double x = 0, y = 0;
  double value = 0;
  double sky_term = 0;  ///< the noise term, which is subtracted
};

Asymmetry asymmetry_about(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky);

/// The least asymmetry. From (x, y) the centre moves to the one of its eight neighbours with the
/// least asymmetry, until no neighbour has less. Steps begin with radius/32 and are halved down to
/// 1/64 pixel.
Asymmetry least_asymmetry(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky);

/// Weights of the four pixels around a turned coordinate, by Keys' cubic convolution. `fraction` in
/// [0, 1[ is the coordinate's fraction. The first pixel is one before the coordinate's whole part.
std::array<double, 4> turned_weights(double fraction);

/// The image interpolated with these weights; (x, y) is the coordinates' whole part. Pixels beyond
/// the edges are 0.
double turned_value(const Image& image, int x, int y, const std::array<double, 4>& weights_x,
                    const std::array<double, 4>& weights_y);

}  // namespace gamer
