#include "gamer/job/star_tone.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gamer/render/renderer.h"
#include "job/tone_view.h"

namespace gamer {
namespace {

/// The image of a renderer without stars that are drawn one by one, times a factor.
Image render_all(const Renderer& renderer, const Ranks& ranks, int threads, double factor) {
  const int width = renderer.width(), height = renderer.height(), planes = renderer.planes();
  const auto row_values = static_cast<std::size_t>(width) * static_cast<std::size_t>(planes);
  const std::vector<RowRange> columns = {{0, width}};
  const std::vector<double> values = ranks.compute_together(
      even_blocks(height, 1), row_values, threads, [&](RowRange block, std::span<double> all) {
        for (int y = block.first; y < block.last; ++y) {
          const auto row = static_cast<std::size_t>(y - block.first);
          renderer.render_smooth(y, columns, all.subspan(row * row_values, row_values));
        }
      });
  Image image(width, height, planes);
  auto from = values.begin();
  for (int y = 0; y < height; ++y) {
    for (int plane = 0; plane < planes; ++plane, from += width) {
      std::transform(from, from + width, &image.at(0, y, plane),
                     [factor](double value) { return factor * value; });
    }
  }
  return image;
}

std::vector<double> wavelengths_of(const RenderJob& job) {
  std::vector<double> wavelengths;
  for (const SpectralPlane& plane : job.spectrum.planes) wavelengths.push_back(plane.wavelength);
  return wavelengths;
}

}  // namespace

bool measures_star_tone(const RenderParameters& parameters, const Scene& scene) {
  const bool has_white = parameters.draws_star_discs() && !parameters.stars.white_point;
  return (has_white || parameters.image.output.style.seeing > 0) &&
         scene.unit != PixelUnit::magnitude &&
         (!scene.stars.empty() || std::ranges::any_of(scene.galaxies, &PlacedGalaxy::draws_stars));
}

PictureTone picture_tone(const RenderJob& job, const Image& image) {
  return choose_tone(image, wavelengths_of(job), zero_points(job));
}

void find_star_tone(RenderJob& job, const Ranks& ranks, int threads) {
  if (job.parameters.image.output.tone) {
    job.parameters.stars.tone = job.parameters.image.output.tone;
    return;
  }
  const std::shared_ptr<const Scene> scene = tone_scene(job.camera, job.scene);
  const ToneView view = tone_view(job.parameters, job.camera, *scene);
  const Renderer renderer(view.parameters, view.camera, scene, job.spectrum);
  const double factor = counts_flux(scene->unit) ? 1 / view.pixel_area : 1;
  const Image image = render_all(renderer, ranks, threads, factor);
  // The light has no noise. Around a cropped view the image is dark, so that black is 0.
  std::optional<std::array<double, 3>> black;
  if (view.is_cropped) black.emplace();
  const PictureTone tone = choose_tone(image, wavelengths_of(job), zero_points(job), black, 0.0);
  // Without light the picture's own pixels give its tone.
  if (tone.slope > 0) job.parameters.stars.tone = tone.numbers();
}

OutputOptions toned_output(const OutputOptions& output, const RenderParameters& parameters) {
  OutputOptions result = output;
  if (!result.tone) result.tone = parameters.stars.tone;
  return result;
}

}  // namespace gamer
