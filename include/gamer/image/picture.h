#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// RGB for the eye, 16 bits a channel, row 0 at the top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> rgb;
};

/// An asinh stretch that keeps hue (Lupton et al. 2004, PASP 116, 133). One plane is grey; three
/// become RGB, the longest wavelength red; two: the middle is their mean; more: the wavelengths are
/// sorted into three groups of nearly equal number and averaged. Each channel is first scaled to
/// equal its 99.5 % quantile of the non-zero pixels...
Picture make_picture(const Image& image, const std::vector<double>& wavelengths);

/// 16-bit PNG (RGB), 24-bit BMP; complete or absent. Throw RunError.
void write_png(const std::filesystem::path& path, const Picture& picture);
void write_bmp(const std::filesystem::path& path, const Picture& picture);

/// Collects the whole image, then makes and writes the picture (.png or .bmp).
std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

}  // namespace gamer
