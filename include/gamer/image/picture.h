#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"
#include "gamer/image/plane.h"

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

/// The channels that make_picture() makes of planes of one size: one (grey) or three, red first.
/// Pixels that are not finite are 0. Throws std::invalid_argument where the wavelengths are neither
/// none nor one per plane.
std::vector<PlanePtr> picture_channels(const std::vector<PlanePtr>& planes,
                                       const std::vector<double>& wavelengths);

/// What make_picture() chooses for its channels; see there. The colour of the pixel (r, g, b) is
/// lupton_stretch() of factor_c max(c - black_c, 0).
struct PictureTone {
  std::array<double, 3> black{};
  std::array<double, 3> factor = {1, 1, 1};
  double slope = 0;  ///< slope = scale = 0 where there is nothing to see
  double scale = 0;

  std::array<double, 3> colour(const std::array<double, 3>& rgb) const;

  /// Black, factor, slope, scale.
  std::array<double, 8> numbers() const;
  static PictureTone of_numbers(const std::array<double, 8>& numbers);
};

/// Chooses what `black` and `factor` leave open. One channel or three, all finite, in three passes
/// over them at most; a grey picture's three values are the same. `threads` make the channels'
/// pixels.
PictureTone automatic_tone(std::span<const PlanePtr> channels, int threads,
                           const std::optional<std::array<double, 3>>& black = {},
                           const std::optional<std::array<double, 3>>& factor = {});

/// Nearest of 65536 steps; what is not in [0, 1] goes to its nearer end, NaN to 0.
std::uint16_t to_16_bits(double value);

enum class PictureFormat { png, bmp };
/// By the name's suffix; "-" is a PNG. Nothing for other names.
std::optional<PictureFormat> picture_format(const std::string& name);

struct PictureFileOptions {
  std::string name;  ///< a path, or "-": standard output
  PictureFormat format = PictureFormat::png;
  int bits = 16;  ///< of a PNG's channel: 8 or 16; a BMP file has 8
  bool overwrite = false;
  std::string comment;  ///< a PNG's text "Comment" where not empty
  /// Tables of a PNG, as pack_png_table() makes them.
  std::vector<std::vector<unsigned char>> tables;
};

/// Throws InputError: unknown suffix, other bits, a folder that is not there, a file that exists
/// (unless overwrite), more pixels than the format holds, standard output that is a terminal.
void check_picture_file(const PictureFileOptions& options, int width, int height);

/// A picture in the making, row after row from the top: a PNG (RGB, marked as sRGB) or a 24-bit
/// BMP; complete or absent. Standard output gets the bytes when all are there. 8 bits are the
/// nearest of 16.
class PictureFile {
 public:
  /// Throws RunError.
  PictureFile(const PictureFileOptions& options, int width, int height);
  ~PictureFile();

  /// 3 * width values: red, green, blue of the next row. Throws RunError.
  void write_row(std::span<const std::uint16_t> rgb);
  /// After the last row: gives the file its final name. Throws RunError, also when a file stands
  /// there that may not be overwritten.
  void finish();

  class Encoder;

 private:
  PictureFileOptions options_;
  int width_, height_;
  int rows_ = 0;
  struct Destination;
  std::unique_ptr<Destination> destination_;
  std::unique_ptr<Encoder> encoder_;
};

/// What make_picture() chooses of an image.
PictureTone choose_tone(const Image& image, const std::vector<double>& wavelengths);

/// 16-bit PNG, 24-bit BMP; complete or absent, replacing what is there. Throw RunError.
void write_png(const std::filesystem::path& path, const Picture& picture);
void write_bmp(const std::filesystem::path& path, const Picture& picture);

/// Collects the image's channels, then makes and writes the picture (.png or .bmp), one whatever
/// the layout. A PNG keeps the header's tables.
std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

}  // namespace gamer
