#pragma once

#include <memory>
#include <span>

#include "gamer/image/image.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/medium.h"
#include "gamer/render/sampler.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// Renders rows of an image of a scene. Rows may be rendered in any order from any thread or
/// process; their values are always the same.
class Renderer {
 public:
  Renderer(const RenderParameters& parameters, const Camera& camera,
           std::shared_ptr<const Scene> scene);

  int width() const { return camera_.width(); }
  int height() const { return camera_.height(); }
  int planes() const { return medium_.planes(); }

  /// values[((row - first) * planes + plane) * width + x]: the mean over a pixel's sub-pixel rays.
  void render_rows(RowRange rows, std::span<double> values) const;
  /// The same, and adds what it took.
  void render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const;

 private:
  Camera camera_;
  int supersample_;
  Medium medium_;
  std::unique_ptr<Sampler> sampler_;
};

/// The whole image in memory, on rank 0 (elsewhere an empty one).
Image render_image(const Renderer& renderer, Executor& executor);

/// Rows that a block should have so that `workers` stay busy to the end.
int block_rows(int height, int workers);

}  // namespace gamer
