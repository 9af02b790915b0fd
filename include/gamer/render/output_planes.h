#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// One plane of the output of a Renderer.
struct OutputPlane {
  enum class Kind {
    image,          ///< the scene as seen
    dust_free,      ///< the scene without dust
    optical_depth,  ///< mean optical depth over the pixel
    owner,     ///< number of the object with most of the pixel's light in all planes; 0 for none
    share,     ///< the owner's share of the pixel's light
    object,    ///< the light of one object alone, seen through all dust
    component  ///< the light of one component of an object
  };
  Kind kind = Kind::image;
  std::size_t plane = 0;      ///< spectral
  std::size_t object = 0;     ///< from 0
  std::size_t component = 0;  ///< light component
  std::string label;          ///< "sdss_g", "DUSTFREE_sdss_g", "OBJECT_3_sdss_g"...
};

/// The planes of a scene's image, then those of `truth`.
std::vector<OutputPlane> output_planes(const Scene& scene, const Spectrum& spectrum,
                                       const TruthSettings& truth);

/// The planes of an image, and the places of each kind among them.
class OutputLayout {
 public:
  /// `objects` is the number of objects of the scene, `spectral` the number of spectral planes.
  OutputLayout(std::vector<OutputPlane> planes, std::size_t objects, std::size_t spectral);

  std::size_t size() const { return planes_.size(); }
  std::size_t spectral() const { return spectral_; }
  const std::vector<OutputPlane>& planes() const { return planes_; }
  /// The first plane of a kind; none if it was not requested.
  const std::optional<std::size_t>& dust_free() const { return dust_free_; }
  const std::optional<std::size_t>& optical_depth() const { return optical_depth_; }
  const std::optional<std::size_t>& owner() const { return owner_; }
  /// Whether there are planes of single components.
  bool has_components() const { return has_components_; }
  /// The first plane of the light of an object's emitter (light component); none if parts were not
  /// requested.
  std::optional<std::size_t> part(std::size_t object, std::size_t emitter) const;

 private:
  std::vector<OutputPlane> planes_;
  std::size_t spectral_;
  std::optional<std::size_t> dust_free_, optical_depth_, owner_;
  bool has_components_ = false;
  std::vector<std::size_t> parts_;  ///< [object] its first plane; empty without parts
};

}  // namespace gamer
