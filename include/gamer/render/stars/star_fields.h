#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "gamer/galaxy/kinds/star_field.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// The stars of a scene's star fields, split into stars that an image draws individually and smooth
/// light.
///
/// A star of luminosity L at the distance d from the camera (1 in an orthographic view) has the
/// flux q = L/d^2. Its weight w(q) as a drawn point is 0 up to a limit q0 of its field and 1 from 4
/// q0 on, with the smoothstep in ln q between them. The rest, 1 - w, is part of the field's smooth
/// light. At a distance d the smooth light's share of the emissivity is the mean of 1 - w(L/d^2),
/// weighted with the population's light. Its spectrum is the corresponding mean. Points and smooth
/// light together are thus, in expectation, the field's emissivity everywhere. Only q0 depends on
/// pixels: the pixel with most stars above q0 expects `stars_per_pixel` of them.
class StarFields {
 public:
  /// A part of the smooth light, with the spectrum of the light at one distance. Parts of
  /// neighbouring distances are mixed.
  struct SmoothPart {
    std::shared_ptr<const Sed> sed;
    /// Share of the field's emissivity at the distances of the field's `scale`; empty if the share
    /// is 1 everywhere.
    std::vector<float> share;
  };
  /// Distances at which shares are tabulated, several per octave; shares are linear in between. The
  /// bits of positive floats ascend with their values, so that a place on the scale is a difference
  /// of bits. The upper bits of this difference are the index of a distance. Its lower bits are the
  /// fraction of the way to the next distance.
  class DistanceScale {
   public:
    static constexpr int log2_values_per_octave = 5;

    DistanceScale() = default;
    /// The scale covers the distances from `nearest` to `farthest`, both positive floats.
    DistanceScale(double nearest, double farthest);

    std::size_t size() const { return size_; }
    double at(std::size_t i) const {
      return double{std::bit_cast<float>(first_ + (static_cast<std::uint32_t>(i) << shift))};
    }
    std::uint32_t first_bits() const { return first_; }
    std::uint32_t largest_offset() const { return largest_offset_; }
    static constexpr int shift = std::numeric_limits<float>::digits - 1 - log2_values_per_octave;
    static constexpr std::uint32_t mask = (1u << shift) - 1;

   private:
    std::uint32_t first_ = 0, largest_offset_ = 0;
    std::size_t size_ = 0;
  };
  struct Field {
    int galaxy;
    std::size_t component;
    const StarField* stars;
    double limit;  ///< q0; infinite if no star is drawn individually
    std::vector<SmoothPart> parts;
    DistanceScale scale;

    /// w(q).
    double weight(double q) const;
    /// out = light times the part's share at these distances, in whole vectors (batch.h). Distances
    /// beyond the ends of the scale have the share at its ends.
    void dim(const SmoothPart& part, std::span<const float> distances, const float* light,
             float* out) const;
  };

  /// All stars are smooth light if `stars_per_pixel` is 0. Stars of galaxies without
  /// PlacedGalaxy::draws_stars are always smooth light.
  StarFields(const Scene& scene, const Camera& camera, double stars_per_pixel);

  bool empty() const { return fields_.empty(); }
  std::span<const Field> fields() const { return fields_; }
  /// The field of a component of a placed galaxy; null if the component is no star field.
  const Field* find(int galaxy, std::size_t component) const;
  /// Whether the whole scene is at one distance.
  bool is_parallel() const { return is_parallel_; }

 private:
  void set_limit(const Scene& scene, const Camera& camera, double stars_per_pixel, Field& field);
  void set_parts(double nearest, double farthest, Field& field) const;

  bool is_parallel_;
  std::vector<Field> fields_;  ///< by galaxy and component
};

}  // namespace gamer
