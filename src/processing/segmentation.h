#pragma once

#include <cstddef>
#include <vector>

#include "gamer/image/image.h"
#include "processing/aperture.h"

namespace gamer {

/// Connected pieces of pixels; pixels that touch at a corner are connected.
struct Pieces {
  std::vector<int> labels;         ///< of each pixel, row by row; 0: in no piece
  std::vector<std::size_t> sizes;  ///< pixels of piece 1, 2...
};
Pieces connected_pieces(const std::vector<bool>& inside, int width, int height);

/// The pixels of a galaxy (Lotz, Primack & Madau 2004, AJ 128, 163). The image is smoothed by a
/// Gaussian of sigma = petrosian/5. Pixels of at least the smooth image's mean on the Petrosian
/// ellipse form pieces. The galaxy is the piece that holds the brightest smoothed pixel within that
/// ellipse. The mean is over the ellipses petrosian - 1/2 to petrosian + 1/2. Throws InputError
/// where the galaxy has fewer than two pixels.
std::vector<bool> galaxy_pixels(const Image& image, const Ellipses& ellipses, double petrosian);

}  // namespace gamer
