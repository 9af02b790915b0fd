#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// RGB for the eye, 16 bits a channel, row 0 at the top. The values are sRGB's, as displays want
/// them.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> rgb;
};

/// The colour-preserving asinh stretch of Lupton et al. 2004 (PASP 116, 133): with the intensity
/// I = (r + g + b)/3, each channel c becomes c F(I)/I,
///   F(I) = scale asinh(slope I),
/// and all three are divided by the largest where that is above 1. So hue depends on the ratios of
/// the channels alone, however bright they are. The paper's Q and alpha are slope = alpha Q,
/// scale = 1/Q. Channels are >= 0; black is black.
std::array<double, 3> lupton_stretch(const std::array<double, 3>& rgb, double slope, double scale);

/// A picture of an image, with nothing to choose.
///
/// *Channels.* One plane is grey. Otherwise the planes are sorted by wavelength, the longest is
/// red; two planes: green is their mean; more than three: three groups of nearly equal number, each
/// the mean of its planes. Without wavelengths the planes count as sorted, reddest first. Pixels
/// that are not finite are black.
///
/// *Black.* Of each channel its sky m = q05 + 1.645 sigma is taken away, and what is then negative
/// is 0. q05 is the 5 % quantile and sigma the noise, 1.4826 median|v(x+1) - v(x)|/sqrt 2, but at
/// most (q50 - q05)/1.645. A noise-free image with dark corners has m = 0; of an image with sky and
/// noise, m is the sky.
///
/// *Balance.* With L_c the channel's light (of the pixels above 3 sigma) and L the mean of the L_c,
/// channel c is multiplied by (L/L_c)^0.5. At 1 the galaxy's sum would be white whatever its
/// stars; at 0 red galaxies would be all red. What stays is a yellow-white bulge in a bluer disk.
/// Green is then set so that its light is the geometric mean of red's and blue's: a galaxy as a
/// whole is never green or magenta.
///
/// *Stretch.* lupton_stretch() with the slope for which F(I_80) = 0.28 F(white): I_80 is the
/// brightness above which 80 % of the light lies, the outer disk of a spiral, and white the 99.99 %
/// quantile of the pixels with light. Where I_80 is above 0.28 white the stretch is linear. The
/// scale then makes the largest channel 1 at its own 99.99 % quantile, so that the nucleus is not
/// burnt out.
///
/// Quantiles are taken over at most 2^20 pixels, evenly spread. `wavelengths` is empty or has one
/// value per plane.
Picture make_picture(const Image& image, const std::vector<double>& wavelengths);

/// 16-bit PNG (RGB, marked as sRGB), 24-bit BMP; complete or absent, replacing what is there. Throw
/// RunError.
void write_png(const std::filesystem::path& path, const Picture& picture);
void write_bmp(const std::filesystem::path& path, const Picture& picture);

/// Collects the image's channels, then makes and writes the picture (.png or .bmp), one whatever
/// the layout.
std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

}  // namespace gamer
