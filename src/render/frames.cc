#include "gamer/render/frames.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "gamer/image/fits.h"
#include "gamer/image/picture.h"
#include "gamer/render/resume.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

Resources::Text* find(Record& record, const std::string& name) {
  const auto found = std::ranges::find(record, name, &Resources::Text::name);
  return found == record.end() ? nullptr : &*found;
}

std::set<std::string_view> lines_of(std::string_view text) {
  std::set<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.insert(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace

void check_same_frame(const std::filesystem::path& image, const Record& animation,
                      const RenderParameters& parameters) {
  const auto suffix = image_suffix(image);
  if (suffix != ImageSuffix::fits && suffix != ImageSuffix::fits_compressed) return;
  Record then = record_from_table(read_fits_table(image, record_table_name));
  Record now = animation;
  if (Resources::Text* text = find(now, recorded_parameters)) text->content = parameters.toml();
  // A frame's list leaves out the stars that it does not show.
  Resources::Text* all = find(now, recorded_scene);
  const Resources::Text* own = find(then, recorded_scene);
  if (all != nullptr && own != nullptr &&
      std::ranges::includes(lines_of(all->content), lines_of(own->content))) {
    all->content = own->content;
  }
  check_same_job(image, now);
}

int frames_apart(int frames, int ranks) { return ranks > 1 ? frames - frames % ranks : 0; }

std::array<double, 8> frame_tone(const Record& animation, RenderParameters parameters,
                                 Executor& executor) {
  make_preview(parameters);
  const RenderJob job = frame_job(animation, std::move(parameters));
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  const Image image = render_image(renderer, executor);
  std::vector<double> wavelengths;
  for (const SpectralPlane& plane : job.spectrum.planes) wavelengths.push_back(plane.wavelength);
  // Elsewhere the image is empty.
  return image.width() > 0 ? choose_tone(image, wavelengths).numbers() : std::array<double, 8>{};
}

}  // namespace gamer
