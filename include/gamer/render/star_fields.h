#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "gamer/galaxy/star_field.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// Which stars of a scene's star fields an image shows one by one, and what the light of the others
/// is.
///
/// A star of luminosity L at the distance d from the camera (1 in an orthographic view) has q =
/// L/d^2. It shines by itself with the weight w(q): 0 up to a limit q0 of its field, 1 from 4 q0
/// on, between them the smoothstep in ln q. The rest, 1 - w, is part of the field's smooth light,
/// whose share of the emissivity at a distance d is the mean of 1 - w(L/d^2) over the light of the
/// population and whose spectrum is the mean of that light: points and smooth light together are,
/// in expectation, the field's emissivity everywhere. Nothing depends on pixels or rays but q0, for
/// which `stars_per_pixel` stars above it are expected in the pixel that sees most of them.
class StarFields {
 public:
  /// A part of the smooth light with a spectrum of its own: that of what is left at one distance;
  /// parts of neighbouring distances blend.
  struct Part {
    std::shared_ptr<const Sed> sed;
    /// Share of the field's emissivity, over log2 of the distance; empty: all of it everywhere.
    std::vector<float> share;
  };
  struct Field {
    int galaxy;
    std::size_t component;
    const StarField* stars;
    double limit;  ///< q0; infinite where no star shines by itself
    std::vector<Part> parts;
    float first_log = 0;  ///< log2 of the distance of Part::share's first value
    float per_octave = 1;

    /// w(q).
    double weight(double q) const;
  };

  /// Without the camera, or with 0, all stars are smooth light.
  StarFields(const Scene& scene, const Camera& camera, double stars_per_pixel);

  bool empty() const { return fields_.empty(); }
  std::span<const Field> fields() const { return fields_; }
  /// Of a component of a placed galaxy; null where it is no star field.
  const Field* find(int galaxy, std::size_t component) const;
  /// Whether all of the scene is at one distance.
  bool is_parallel() const { return is_parallel_; }

 private:
  void set_limit(const Scene& scene, const Camera& camera, double stars_per_pixel, Field& field);
  void set_parts(double nearest, double farthest, Field& field) const;

  bool is_parallel_;
  std::vector<Field> fields_;  ///< by galaxy and component
};

}  // namespace gamer
