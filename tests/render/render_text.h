#pragma once

#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "gamer/job/schedule.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"
#include "gamer/scene/scene.h"
#include "render/measured_scene.h"

namespace gamer {

/// Galaxy files by name, a scene list and a parameter file, all as text.
struct TextScene {
  std::map<std::string, std::string> galaxies;
  std::string scene;
  std::string parameters;
};

inline Resources text_resources(const TextScene& text) {
  std::vector<Resources::Text> record;
  for (const auto& [name, content] : text.galaxies) {
    record.push_back({"galaxies/" + name, name + ".toml", content});
  }
  // The default band of magnitudes, as a triangle.
  record.push_back({"bandpasses/sdss_r", "bandpasses/sdss_r.band",
                    "# wavelength: Angstrom\n# response: photons\n5500 0\n6200 1\n6900 0\n"});
  return Resources::from_record(record);
}

inline Renderer text_renderer(const TextScene& text, const TruthSettings& truth = {}) {
  Resources resources = text_resources(text);
  return image_renderer(
      measured_job(RenderParameters::read(parse_toml(text.parameters, "render.par")), text.scene,
                   "scene.lst", resources),
      truth);
}

/// Renders on the calling thread, through the same steps as the program.
inline Image render_text(const TextScene& text, RenderCounts* counts = nullptr) {
  const Renderer renderer = text_renderer(text);
  if (counts != nullptr) {
    const int width = renderer.width(), height = renderer.height(), planes = renderer.planes();
    std::vector<double> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                               static_cast<std::size_t>(planes));
    renderer.render_rows({0, height}, values, *counts);
  }
  ThreadExecutor executor(1);
  return render_image(renderer, executor);
}

/// An orthographic view from +z that is `width` scene units wide.
inline std::string view_from_z(int columns, int rows, double width, const std::string& more = "") {
  return "[image]\nsize = [" + std::to_string(columns) + ", " + std::to_string(rows) +
         "]\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, 10]\nup = [0, 1, 0]\n"
         "width = " +
         fmt::format("{}", width) + "\n" + more;
}

inline double sum_of(const Image& image, int plane = 0) {
  double sum = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) sum += image.at(x, y, plane);
  }
  return sum;
}

}  // namespace gamer
