#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "gamer/render/output_planes.h"

namespace gamer {

/// Sums of light for rows of an image, in each plane. All light of rays and stars passes through
/// add().
class LightSums {
 public:
  /// The sums are values[(row * layout.size() + plane) * width + x]. `unit_factors`, by spectral
  /// plane, make light of different planes comparable.
  LightSums(const OutputLayout& layout, std::span<const double> unit_factors, std::size_t width,
            std::span<double> values);

  /// The source of light. The emitter is the light component of a galaxy; a star has one emitter.
  struct Source {
    std::size_t object, emitter;
  };
  /// Adds light of a source to a pixel, by spectral plane: `seen` with dust, `dust_free` without
  /// dust.
  void add(std::size_t row, std::size_t x, const Source& source, std::span<const double> seen,
           std::span<const double> dust_free);
  /// Adds light of an object to a pixel, apart from the planes of parts.
  void add(std::size_t row, std::size_t x, std::size_t object, std::span<const double> seen,
           std::span<const double> dust_free);
  /// Adds light of a source to the planes of its part, if there are such planes.
  void add_part(std::size_t row, std::size_t x, const Source& source, std::span<const double> seen);
  /// Adds to the optical depth of a pixel, by spectral plane.
  void add_depth(std::size_t row, std::size_t x, std::span<const double> depth);

  /// A pixel's planes are width() apart.
  double* pixel(std::size_t row, std::size_t x) {
    return values_.data() + row * layout_->size() * width_ + x;
  }
  std::size_t width() const { return width_; }
  void clear();

  /// The object with most of a pixel's light in all planes, counted from 1 (0: none), and its share
  /// of this light.
  struct Owner {
    std::size_t number = 0;
    double share = 0;
  };
  Owner owner(std::size_t row, std::size_t x) const;

 private:
  /// Adds to the planes from `first` on.
  void add_planes(std::size_t first, std::span<const double> light, double* pixel) const;

  const OutputLayout* layout_;
  std::span<const double> unit_factors_;
  std::size_t width_;
  std::span<double> values_;
  /// [row * width + x]: light of each object in all planes; empty if no owner is requested.
  std::vector<std::map<std::size_t, double>> owners_;
};

}  // namespace gamer
