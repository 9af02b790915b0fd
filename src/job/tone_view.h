#pragma once

#include <memory>

#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// A view of few pixels on which the tone of a picture is measured. Its pixels are a fixed share of
/// the largest galaxy, or of the window where that is smaller. The brightness of the structure that
/// these pixels resolve thus does not depend on the image's size.
struct ToneView {
  /// Without stars that are drawn one by one. A view with wider pixels than the image has one ray
  /// for each pixel and a coarse tolerance.
  RenderParameters parameters;
  Camera camera;
  /// Area of a pixel, pixels of the image.
  double pixel_area = 1;
  /// Whether the view leaves out parts of the window without galaxies that decide the tone.
  bool is_cropped = false;
};

/// The galaxies that decide the tone: all that touch the window, except galaxies much smaller than
/// the largest. The nuclei of small galaxies behind a large galaxy may be much brighter than its
/// disk. If the deciding galaxies are far apart, the largest alone decides. The result has neither
/// stars nor rows of a list. It is the scene itself where no galaxy decides.
std::shared_ptr<const Scene> tone_scene(const Camera& camera, std::shared_ptr<const Scene> scene);

/// The view of the galaxies of tone_scene(). Throws InputError for a WCS that cannot be reduced.
ToneView tone_view(const RenderParameters& parameters, const Camera& camera, const Scene& scene);

}  // namespace gamer
