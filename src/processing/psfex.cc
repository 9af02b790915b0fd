#include "processing/psfex.h"

#include <algorithm>
#include <cmath>

#include "core/message.h"
#include "processing/kernel.h"

namespace gamer {
namespace {

/// Weights of `count` samples, whose middle is count/2, for each pixel of a side of `side` pixels.
/// Samples beyond the file are 0.
std::vector<std::vector<double>> weights_of(int count, int side, double sampling) {
  constexpr Kernel kernel = Kernel::lanczos5;
  const int reach = static_cast<int>(kernel_radius(kernel));
  std::vector<std::vector<double>> all;
  for (int pixel = -(side / 2); pixel <= side / 2; ++pixel) {
    const double at = pixel / sampling + count / 2;
    const int first = static_cast<int>(std::floor(at)) - reach + 1;
    const std::vector<double> kernel_weights =
        interpolation_weights(kernel, at, 1, first, 2 * reach);
    std::vector<double> weights(static_cast<std::size_t>(count));
    for (int i = std::max(first, 0); i < std::min(first + 2 * reach, count); ++i) {
      weights[static_cast<std::size_t>(i)] = kernel_weights[static_cast<std::size_t>(i - first)];
    }
    all.push_back(std::move(weights));
  }
  return all;
}

/// Odd number of pixels that `count` samples cover.
int side_of(int count, double sampling) {
  return 2 * static_cast<int>(std::floor(count / 2 * sampling)) + 1;
}

/// The file's samples on the image's pixels.
Stamp on_pixels(const PsfexFile& file, const double* samples) {
  Stamp stamp;
  stamp.width = std::min(side_of(file.width, file.sampling), largest_stamp);
  stamp.height = std::min(side_of(file.height, file.sampling), largest_stamp);
  stamp.values.clear();
  const auto in_x = weights_of(file.width, stamp.width, file.sampling);
  const auto in_y = weights_of(file.height, stamp.height, file.sampling);
  // Along x first: [sample row][pixel].
  std::vector<double> rows;
  for (int j = 0; j < file.height; ++j) {
    const double* row = samples + static_cast<std::ptrdiff_t>(j) * file.width;
    for (const std::vector<double>& weights : in_x) {
      double sum = 0;
      for (std::size_t i = 0; i < weights.size(); ++i) sum += weights[i] * row[i];
      rows.push_back(sum);
    }
  }
  const auto width = static_cast<std::size_t>(stamp.width);
  for (const std::vector<double>& weights : in_y) {
    for (std::size_t x = 0; x < width; ++x) {
      double sum = 0;
      for (std::size_t j = 0; j < weights.size(); ++j) sum += weights[j] * rows[j * width + x];
      stamp.values.push_back(sum);
    }
  }
  return stamp;
}

}  // namespace

VaryingPsf::VaryingPsf(const PsfexFile& file, const std::string& label, bool keep_flux)
    : label_(label), keep_flux_(keep_flux), degree_(file.degree), axes_(file.axes) {
  const std::size_t samples = static_cast<std::size_t>(file.width) * file.height;
  for (int c = 0; c < file.components; ++c) {
    stamps_.push_back(on_pixels(file, file.values.data() + static_cast<std::size_t>(c) * samples));
    // A sample stands for sampling^2 pixels.
    for (double& value : stamps_.back().values) value /= file.sampling * file.sampling;
    sums_.push_back(stamps_.back().sum());
  }
}

double VaryingPsf::weight(std::size_t stamp, const PixelPosition& at) const {
  double x = 0, y = 0;
  if (!axes_.empty()) {
    const auto value = [&](const PsfexFile::Axis& axis) {
      return ((axis.name == "X_IMAGE" ? at.x : at.y) - axis.zero) / axis.scale;
    };
    x = value(axes_[0]);
    y = value(axes_[1]);
  }
  double flux = 0, result = 0, in_y = 1;
  std::size_t c = 0;
  for (int j = 0; j <= degree_; ++j, in_y *= y) {
    double weight = in_y;
    for (int i = 0; i + j <= degree_; ++i, weight *= x, ++c) {
      flux += weight * sums_[c];
      if (c == stamp) result = weight;
    }
  }
  if (!(flux > 0 && std::isfinite(flux))) {
    throw input_error("{}: the PSF at {:.6g},{:.6g} has the sum {:.6g}; a positive one is needed",
                      label_, at.x, at.y, flux);
  }
  return keep_flux_ ? result : result / flux;
}

Stamp VaryingPsf::stamp(const PixelPosition& at) const {
  std::vector<double> factors;
  for (std::size_t c = 0; c < stamps_.size(); ++c) factors.push_back(weight(c, at));
  Stamp result = stamps_.front();
  for (std::size_t k = 0; k < result.values.size(); ++k) {
    double sum = 0;
    for (std::size_t c = 0; c < factors.size(); ++c) sum += factors[c] * stamps_[c].values[k];
    result.values[k] = sum;
  }
  return result;
}

}  // namespace gamer
