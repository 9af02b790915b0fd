#include "gamer/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

namespace gamer {

namespace {

// Rays that are worked on together: enough to fill batches after refinement, few enough for what
// their nodes hold, which grows with the number of planes, to stay in the second-level cache.
constexpr std::size_t most_rays_at_once = 256;
constexpr std::size_t fewest_rays_at_once = 8;
constexpr std::size_t rays_times_planes = 384;

constexpr int blocks_per_worker = 8;
constexpr int largest_block = 16;

/// Holds all rays: those of the ends and any between them.
RayBundle bundle_of(std::span<const Ray> rays) {
  RayBundle bundle;
  bundle.axis = rays[rays.size() / 2];
  for (const Ray& ray : rays) {
    bundle.radius = std::max(bundle.radius, glm::length(ray.origin - bundle.axis.origin));
    const double cosine = glm::dot(ray.direction, bundle.axis.direction);
    const double sine = glm::length(glm::cross(ray.direction, bundle.axis.direction));
    bundle.tangent = std::max(bundle.tangent, cosine > 0 ? sine / cosine : HUGE_VAL);
  }
  return bundle;
}

}  // namespace

Renderer::Renderer(const RenderParameters& parameters, const Camera& camera,
                   std::shared_ptr<const Scene> scene)
    : camera_(camera),
      supersample_(parameters.supersample),
      medium_(std::move(scene), parameters.wavelengths,
              Accuracy::from_tolerance(parameters.tolerance)),
      sampler_(make_sampler(medium_, parameters)) {}

void Renderer::render_rows(RowRange rows, std::span<double> values) const {
  RenderCounts counts;
  render_rows(rows, values, counts);
}

void Renderer::render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const {
  const auto width = static_cast<std::size_t>(camera_.width());
  const auto planes = static_cast<std::size_t>(medium_.planes());
  const auto sub = static_cast<std::size_t>(supersample_);
  const std::size_t rays_per_pixel = sub * sub;
  const std::size_t rays_at_once =
      std::clamp(rays_times_planes / planes, fewest_rays_at_once, most_rays_at_once);
  const std::size_t pixels_at_once = std::max<std::size_t>(1, rays_at_once / rays_per_pixel);
  std::vector<Ray> rays;
  std::vector<int> candidates;
  std::vector<Hit> hits;
  std::vector<std::size_t> hit_ends;
  std::vector<std::span<const Hit>> hits_of_ray;
  std::vector<double> intensities;
  for (int row = rows.first; row < rows.last; ++row) {
    double* out = values.data() + static_cast<std::size_t>(row - rows.first) * planes * width;
    for (std::size_t begin = 0; begin < width; begin += pixels_at_once) {
      const std::size_t pixels = std::min(pixels_at_once, width - begin);
      rays.clear();
      for (std::size_t x = begin; x < begin + pixels; ++x) {
        for (std::size_t k = 0; k < rays_per_pixel; ++k) {
          const auto offset = [&](std::size_t i) {
            return (static_cast<double>(i) + 0.5) / static_cast<double>(sub) - 0.5;
          };
          rays.push_back(camera_.ray(static_cast<double>(x) + offset(k % sub),
                                     static_cast<double>(row) + offset(k / sub)));
        }
      }
      candidates.clear();
      medium_.candidates(bundle_of(rays), candidates);
      hits.clear();
      hit_ends.clear();
      for (const Ray& ray : rays) {
        medium_.hits(ray, candidates, hits);
        hit_ends.push_back(hits.size());
      }
      hits_of_ray.clear();
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::size_t start = i == 0 ? 0 : hit_ends[i - 1];
        hits_of_ray.emplace_back(hits.data() + start, hit_ends[i] - start);
      }
      intensities.assign(rays.size() * planes, 0.0);
      if (!hits.empty()) sampler_->integrate(hits_of_ray, intensities, counts);
      for (std::size_t x = 0; x < pixels; ++x) {
        for (std::size_t w = 0; w < planes; ++w) {
          double sum = 0;
          for (std::size_t k = 0; k < rays_per_pixel; ++k) {
            sum += intensities[(x * rays_per_pixel + k) * planes + w];
          }
          out[w * width + begin + x] = sum / static_cast<double>(rays_per_pixel);
        }
      }
    }
  }
}

Image render_image(const Renderer& renderer, Executor& executor) {
  const int width = renderer.width(), planes = renderer.planes();
  Image image(width, renderer.height(), planes);
  executor.run(
      renderer.height(), block_rows(renderer.height(), executor.workers()),
      static_cast<std::size_t>(width) * static_cast<std::size_t>(planes),
      [&](RowRange rows, std::span<double> values) { renderer.render_rows(rows, values); },
      [&](RowRange rows, std::span<const double> values) {
        std::size_t k = 0;
        for (int row = rows.first; row < rows.last; ++row) {
          for (int plane = 0; plane < planes; ++plane) {
            for (int x = 0; x < width; ++x) image.at(x, row, plane) = values[k++];
          }
        }
      });
  return image;
}

int block_rows(int height, int workers) {
  return std::clamp(height / (blocks_per_worker * std::max(workers, 1)), 1, largest_block);
}

}  // namespace gamer
