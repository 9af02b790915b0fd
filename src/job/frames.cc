#include "gamer/job/frames.h"
#include "gamer/job/schedule.h"

#include <algorithm>
#include <set>
#include <utility>

#include "gamer/job/measure_galaxies.h"
#include "gamer/job/resume.h"
#include "gamer/job/star_tone.h"
#include "job/make_job.h"

namespace gamer {
namespace {

std::set<std::string_view> distinct_lines(std::string_view text) {
  std::set<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.insert(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace

FrameJobs::FrameJobs(const Record& animation)
    : record_(animation),
      parameters_(recorded_render_parameters(animation)),
      resources_(Resources::from_record(animation)),
      list_(text_of(animation, recorded_scene)),
      catalogue_(Catalogue::parse(list_.content, list_.label, parameters_.catalogue.format)),
      library_(parameters_, list_.label, resources_) {
  if (const Resources::Text* columns = resources_.recorded(recorded_columns)) columns_ = *columns;
}

FrameJobs::FrameJobs(const RenderJob& animation) : FrameJobs(animation.record) {
  for (const PlacedGalaxy& placed : animation.scene->galaxies) {
    library_.add(placed.type, placed.sed, placed.seed, placed.galaxy);
  }
  unmeasured_ = animation.pending.galaxies;
}

void FrameJobs::measure(const Ranks& ranks) {
  measure_galaxies(std::exchange(unmeasured_, {}), {}, ranks);
}

RenderJob FrameJobs::make(RenderParameters parameters) {
  const Ranks alone;
  measure(alone);
  RenderJob job = make_job(std::move(parameters), catalogue_, resources_, library_, list_.content);
  // Galaxies are measured for all footprints, since later frames may be nearer.
  job.pending.footprints.clear();
  // Each rank completes the job alone, whether one rank or all make the frame.
  complete(job, alone, 1);
  // The previous frame has recorded its own rows.
  if (columns_) resources_.add(*columns_);
  return recorded(std::move(job), list_.label, resources_);
}

std::optional<std::array<double, 8>> check_same_frame(const std::filesystem::path& image,
                                                      const Record& animation,
                                                      RenderParameters parameters) {
  if (!keeps_record(image)) return std::nullopt;
  const Record then = read_record(image);
  const RenderParameters recorded = recorded_render_parameters(then);
  if (recorded.image.output.tone && !parameters.image.output.tone) {
    const auto& numbers = *recorded.image.output.tone;
    parameters.set("image", "tone", std::vector<double>(numbers.begin(), numbers.end()));
  }
  Record now = animation;
  if (Resources::Text* text = find_text(now, recorded_parameters)) {
    text->content = parameters.toml();
  }
  // A frame's list leaves out the stars that it does not show.
  for (const char* name : {recorded_scene, recorded_columns}) {
    Resources::Text* all = find_text(now, name);
    const Resources::Text* shown = find_text(then, name);
    if (all != nullptr && shown != nullptr &&
        std::ranges::includes(distinct_lines(all->content), distinct_lines(shown->content))) {
      all->content = shown->content;
    }
  }
  check_same_job(image, then, now);
  return recorded.image.output.tone;
}

int frames_apart(int frames, int ranks) { return ranks > 1 ? frames - frames % ranks : 0; }

std::array<double, 8> frame_tone(FrameJobs& jobs, RenderParameters parameters, Executor& executor) {
  make_preview(parameters);
  const RenderJob job = jobs.make(std::move(parameters));
  const Renderer renderer = image_renderer(job);
  const Image image = render_image(renderer, executor);
  // Without objects the image is empty.
  return image.width() > 0 ? picture_tone(job, image).numbers() : std::array<double, 8>{};
}

}  // namespace gamer
