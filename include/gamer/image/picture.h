#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"
#include "gamer/image/picture_colours.h"
#include "gamer/image/plane.h"

namespace gamer {

/// An RGB picture of 16 bits a channel, row 0 at the top. The values are sRGB, as displays expect.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> rgb;
};

/// Makes a picture of an image, with a tone that follows from the image alone.
///
/// *Channels.* One plane is grey. Otherwise the planes are sorted by wavelength, and the longest is
/// red. With two planes, green is their mean. More than three planes form three groups of nearly
/// equal number; a channel is the mean of its group. Planes without wavelengths count as sorted,
/// reddest first. Pixels that are not finite are black.
///
/// *Black.* Each channel's sky m = q05 + 1.645 sigma is subtracted, q05 the 5 % quantile; negative
/// results become 0. The noise sigma is 1.4826 median|v(x+1) - v(x)|/sqrt 2, at most (q50 -
/// q05)/1.645. In a noise-free image with dark corners, m = 0; in an image with sky and noise, m is
/// the sky.
///
/// *Light per unit wavelength.* Channels of calibrated planes are multiplied by channel_factors().
/// Light like that of the Sun is then nearly white, and a picture of three planes does not depend
/// on the image's unit.
///
/// *Balance.* L_c is the channel's light and L the mean of the L_c. The light of every channel is
/// summed over the pixels in which some channel is 3 sigma above its sky. Channel c is multiplied
/// by (L/L_c)^0.5. With exponent 1 the summed light would always be white; with exponent 0 a red
/// galaxy would be red all over. With 0.5 a yellow-white bulge in a bluer disk remains. Green is
/// then scaled so that half of the light is greener than the geometric mean of red and blue. Most
/// of a galaxy is thus neither green nor magenta, whatever its H II regions are. The colour is that
/// of pixels, or of groups of successive pixels that are 30 sigma above the sky in all channels.
///
/// *Stretch.* lupton_stretch() is applied with the slope for which F(I_80) = 0.28 F(white). The
/// pixels brighter than I_80 (in a spiral, those inside the outer disk) hold 80 % of the light. A
/// fifth of these pixels, the middle, is brighter than I_f. The slope is smaller where otherwise
/// F(I_f) > 0.54 F(white), so that the middle of a galaxy without a bulge keeps its colours. White
/// is the 99.99 % quantile of the pixels with light, interpolated between two of them. The stretch
/// is linear where I_80 > 0.28 white or I_f > 0.54 white. The scale makes the largest channel 1 at
/// its own 99.99 % quantile, so that the nucleus is not saturated.
///
/// Quantiles use at most 2^20 pixels, evenly spread. `wavelengths` and `zero_points` have one value
/// per plane or none.
Picture make_picture(const Image& image, const std::vector<double>& wavelengths,
                     const std::vector<double>& zero_points = {});

/// Light per unit wavelength of the value 1 of each plane, in a common unit:
///   10^(-0.4 (Z_p - Z_0)) (lambda_0/lambda_p)^2,
/// where the zero point Z_p is the AB magnitude of the value 1. Empty where wavelengths or zero
/// points are. Throws std::invalid_argument where their numbers differ.
std::vector<double> light_of_unit(const std::vector<double>& wavelengths,
                                  const std::vector<double>& zero_points);

/// Factors of the channels of picture_channels() that make them light per unit wavelength; their
/// product is 1. A channel has the mean `light` (light_of_unit()) of its planes. All factors are 1
/// for one plane, and where `light` is empty.
std::array<double, 3> channel_factors(int planes, const std::vector<double>& wavelengths,
                                      const std::vector<double>& light);

/// The zero points of a header's planes: the numbers of cards MAGZERO. Empty where a plane has
/// none.
std::vector<double> zero_points_of(const ImageHeader& header);

/// The channels that make_picture() makes of planes of equal size: one (grey) or three, red first.
/// Pixels that are not finite are 0. Throws std::invalid_argument for wavelengths whose number is
/// not that of the planes.
std::vector<PlanePtr> picture_channels(const std::vector<PlanePtr>& planes,
                                       const std::vector<double>& wavelengths);

/// The light of each plane in a pixel that is white at full brightness in a picture. All channels
/// of the pixel are 1, and planes of a channel are equal. Empty where the picture has no light.
/// With two planes green is their mean and nearly 1. The sky is not included. See
/// picture_channels() for `wavelengths`.
std::vector<double> picture_white(const PictureTone& tone, int planes,
                                  const std::vector<double>& wavelengths);

/// Chooses slope and scale, and black and factor where they are not given. There are one or three
/// `channels` with finite pixels, which are read once. A grey picture's three values are equal.
/// `threads` is the number of threads that make the pixels. The chosen factor includes those of
/// channel_factors(). `noise` is sigma of the pixels' noise, where it is known.
PictureTone automatic_tone(std::span<const PlanePtr> channels, int threads,
                           const std::optional<std::array<double, 3>>& black = {},
                           const std::optional<std::array<double, 3>>& factor = {},
                           const std::array<double, 3>& channel_factors = {1, 1, 1},
                           std::optional<double> noise = {});

/// The nearest of 65536 steps of [0, 1]; values outside go to the nearer end, NaN to 0.
std::uint16_t to_16_bits(double value);

enum class PictureFormat { png, bmp };
/// The format of a file name's suffix; "-" is PNG. Nothing for other names.
std::optional<PictureFormat> picture_format(const std::string& name);

struct PictureFileOptions {
  std::string name;  ///< a path, or "-": standard output
  PictureFormat format = PictureFormat::png;
  int bits = 16;  ///< bits of a PNG's channel, 8 or 16; a BMP file has 8
  bool overwrite = false;
  std::string comment;  ///< text "Comment" of a PNG; empty for none
  /// Tables of a PNG, as pack_png_table() makes them.
  std::vector<std::vector<unsigned char>> tables;
};

/// Throws InputError for an unknown suffix, other bits, a missing folder or an existing file
/// (unless overwrite). Other errors are more pixels than the format holds, and a terminal as
/// standard output.
void check_picture_file(const PictureFileOptions& options, int width, int height);

/// A picture file written row by row from the top; it is complete or absent. The format is PNG
/// (RGB, marked as sRGB) or 24-bit BMP. Standard output gets the bytes when the file is complete.
/// Channels of 8 bits are rounded from 16.
class PictureFile {
 public:
  /// Throws RunError if the file cannot be made.
  PictureFile(const PictureFileOptions& options, int width, int height);
  ~PictureFile();

  /// 3 * width values: red, green, blue of the next row. Throws RunError if writing fails.
  void write_row(std::span<const std::uint16_t> rgb);
  /// Gives the file its final name after the last row. Throws RunError, also when a file there must
  /// not be overwritten.
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

/// The tone that make_picture() chooses for an image, with a known black and noise where given.
PictureTone choose_tone(const Image& image, const std::vector<double>& wavelengths,
                        const std::vector<double>& zero_points = {},
                        const std::optional<std::array<double, 3>>& black = {},
                        std::optional<double> noise = {});

/// A writer that collects the image's channels, then makes and writes one picture (.png or .bmp) in
/// any layout. A PNG keeps the header's tables.
std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

}  // namespace gamer
