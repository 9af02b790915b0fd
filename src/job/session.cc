#include "gamer/job/session.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/image_writer.h"
#include "gamer/image/stamp_writer.h"
#include "gamer/job/record.h"
#include "gamer/job/schedule.h"
#include "gamer/job/stamps.h"
#include "gamer/job/star_table.h"
#include "gamer/job/star_tone.h"
#include "gamer/job/truth_table.h"
#include "gamer/job/warnings.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"
#include "job/make_job.h"
#include "job/scene_input.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Records the galaxies of the input beside its label, where the scene looks first.
void add_galaxies(const RenderInput& input, const std::string& label, Resources& resources) {
  for (const auto& [name, text] : input.galaxies) {
    if (name.find('/') != std::string::npos) {
      throw input_error("galaxy '{}': a name in memory has no '/'", name);
    }
    const fs::path file = (fs::path(label).parent_path() / (name + ".toml")).lexically_normal();
    const bool is_below = file.is_relative() && !file.generic_string().starts_with("../");
    const std::string key = (is_below ? "galaxies/./" : "galaxies/") + file.generic_string();
    resources.add({key, file.generic_string(), text});
  }
}

/// The catalogue of the input. The catalogue of a text is a view into the resources.
Catalogue catalogue_of(const RenderInput& input, const RenderParameters& parameters,
                       Resources& resources) {
  if (const auto* table = std::get_if<DataTable>(&input.scene)) {
    return Catalogue::from_table(*table, input.label);
  }
  if (const auto* text = std::get_if<RenderInput::Text>(&input.scene)) {
    const Resources::Text& scene = resources.add({recorded_scene, input.label, text->content});
    return Catalogue::parse(scene.content, scene.label, parameters.catalogue.format,
                            parameters.catalogue.hdu);
  }
  JobRequest request;
  request.scene = std::get<fs::path>(input.scene);
  return read_catalogue(request, parameters, resources);
}

/// Copies the rows of a block into an image of the first planes and an image of the other planes.
void take_rows(RowRange rows, std::span<const double> values, Image& first, Image& others) {
  const double* from = values.data();
  const auto width = static_cast<std::size_t>(first.width());
  for (int row = rows.first; row < rows.last; ++row) {
    for (int plane = 0; plane < first.planes() + others.planes(); ++plane, from += width) {
      const bool is_first = plane < first.planes();
      double* const to = is_first ? first.plane(plane) : others.plane(plane - first.planes());
      std::copy_n(from, width, to + static_cast<std::size_t>(row) * width);
    }
  }
}

/// The values of an image in the order of ImageWriter, one row.
void append_row(const Image& image, int row, std::vector<double>& values) {
  for (int plane = 0; plane < image.planes(); ++plane) {
    const double* from = image.plane(plane) + static_cast<std::size_t>(row) * image.width();
    values.insert(values.end(), from, from + image.width());
  }
}

/// A render in progress.
class RenderInProgress {
 public:
  RenderInProgress(const RenderControl& control, TeamExecutor& executor, Rendering& rendering)
      : control_(control), executor_(executor), job_(*rendering.job), rendering_(rendering) {}

  void render() {
    if (control_.truth) describe_objects();
    makes_stamps(job_.parameters) ? render_stamps() : render_image();
    if (rendering_.unconverged_rays > 0) {
      rendering_.warnings.push_back(shortfall_warning("the render", rendering_.unconverged_rays));
    }
  }

 private:
  using Stage = RenderProgress::Stage;

  void tell(Stage stage, int done, int total) const {
    if (control_.cancellation != nullptr && control_.cancellation->is_requested()) {
      throw Cancelled();
    }
    if (control_.progress) control_.progress({stage, done, total});
  }

  void describe_objects() {
    int done = 0;
    const auto total = static_cast<int>(job_.scene->objects);
    tell(Stage::truth, 0, total);
    rendering_.truth = truth_table(
        job_, executor_, [&](int objects) { tell(Stage::truth, done += objects, total); });
  }

  void render_image() {
    const bool has_truth = control_.truth || control_.truth_images;
    const TruthSettings truth = has_truth ? job_.parameters.truth : TruthSettings();
    const Renderer renderer = image_renderer(job_, truth);
    const int width = renderer.width(), height = renderer.height();
    const auto planes = static_cast<int>(job_.spectrum.planes.size());
    if (job_.parameters.stars.table) rendering_.stars = star_table(job_, renderer, executor_);
    rendering_.image = Image(width, height, planes);
    rendering_.truth_images = Image(width, height, renderer.planes() - planes);
    tell(Stage::rows, 0, height);
    // In a team all ranks must have equal blocks.
    const std::vector<RowRange> blocks =
        control_.finished && !control_.team
            ? blocks_from_middle(height, executor_.workers(),
                                 most_block_rows(width, renderer.planes()))
            : render_blocks(renderer, executor_);
    std::mutex mutex;
    double unconverged = 0;
    int done = 0;
    bool is_dark = true;
    executor_.run(
        blocks, static_cast<std::size_t>(width) * static_cast<std::size_t>(renderer.planes()),
        [&](RowRange rows, std::span<double> values) {
          RenderCounts counts;
          renderer.render_rows(rows, values, counts);
          const std::lock_guard lock(mutex);
          unconverged += static_cast<double>(counts.unconverged_rays);
        },
        [&](RowRange rows, std::span<const double> values) {
          take_rows(rows, values, rendering_.image, rendering_.truth_images);
          is_dark = is_dark && !has_light(values, false);
          if (control_.finished) control_.finished(rows, rendering_);
          tell(Stage::rows, done += rows.size(), height);
        });
    rendering_.unconverged_rays =
        job_.unconverged_rays +
        static_cast<double>(executor_.sum(static_cast<std::uint64_t>(unconverged)));
    if (is_dark) rendering_.warnings.push_back(darkness_warning(job_));
  }

  void render_stamps() {
    const StampRenderer renderer(job_);
    const auto total = static_cast<int>(renderer.size());
    const auto planes = static_cast<int>(job_.spectrum.planes.size());
    for (std::size_t stamp = 0; stamp < renderer.size(); ++stamp) {
      const ImageRegion& region = renderer.region(stamp);
      rendering_.stamps.push_back({region, Image(region.width, region.height, planes)});
    }
    tell(Stage::stamps, 0, total);
    rendering_.unconverged_rays = job_.unconverged_rays;
    int done = 0;
    RankReport report;
    renderer.run(
        executor_,
        [&](std::size_t stamp, std::span<const double> values, double rays) {
          Image none, &image = rendering_.stamps[stamp].image;
          take_rows({0, image.height()}, values, image, none);
          rendering_.unconverged_rays += rays;
          tell(Stage::stamps, ++done, total);
        },
        report);
  }

  const RenderControl& control_;
  TeamExecutor& executor_;
  const RenderJob& job_;
  Rendering& rendering_;
};

}  // namespace

// ---- Rendering ---------------------------------------------------------------------------------

ImageHeader Rendering::header() const {
  ImageHeader header = make_image_header(*job);
  header.cards.push_back({"DATE", fits_date(), "time of writing (UTC)"});
  if (truth) header.data_tables.push_back(*truth);
  if (stars) header.data_tables.push_back(*stars);
  return header;
}

void Rendering::write(const fs::path& path, bool overwrite) const {
  OutputOptions output = job->parameters.image.output;
  output.path = path;
  output.overwrite = overwrite;
  check_output_suffix(output);
  const ImageHeader image_header = header();
  const std::vector<Card> cards = shortfall_cards(unconverged_rays);
  if (makes_stamps(job->parameters)) {
    std::vector<ImageRegion> regions;
    double pixels = 0;
    for (const Stamp& stamp : stamps) {
      regions.push_back(stamp.region);
      pixels += static_cast<double>(stamp.region.width) * stamp.region.height;
    }
    check_stamp_output(output, image_header, pixels);
    const std::vector<StampHeader> descriptions = describe_stamps(*job, regions, image_header);
    const auto writer = make_stamp_writer(output, image_header, stamps.size(),
                                          [&](std::size_t stamp) { return descriptions[stamp]; });
    for (std::size_t stamp = 0; stamp < stamps.size(); ++stamp) {
      std::vector<double> values;
      for (int row = 0; row < stamps[stamp].image.height(); ++row) {
        append_row(stamps[stamp].image, row, values);
      }
      writer->write(stamp, values);
    }
    writer->add_cards(cards);
    return writer->finish();
  }
  check_output(output, image_header);
  std::unique_ptr<ImageWriter> writer =
      make_image_writer(toned_output(output, job->parameters), image_header);
  const int planes = image.planes() + truth_images.planes();
  if (truth_images.planes() > 0) {
    RenderParameters parameters = job->parameters;
    parameters.image.output = output;
    ImageHeader truth_header = make_truth_header(*job);
    truth_header.cards.push_back(image_header.cards.back());
    check_output(truth_output(parameters), truth_header);
    writer = make_split_writer(std::move(writer), image.planes(),
                               make_image_writer(truth_output(parameters), truth_header), planes,
                               image.width());
  }
  std::vector<double> values;
  for (int row = 0; row < image.height(); ++row) {
    values.clear();
    append_row(image, row, values);
    append_row(truth_images, row, values);
    writer->write_rows(row, 1, values);
  }
  writer->add_cards(cards);
  writer->finish();
}

// ---- Session -----------------------------------------------------------------------------------

Session::Session(int threads, std::vector<fs::path> folders)
    : threads_(threads), folders_(std::move(folders)) {
  if (threads < 1) throw std::invalid_argument(fmt::format("cannot render in {} threads", threads));
}

RenderJob Session::load(const RenderInput& input) const {
  Resources resources(folders_);
  resources.add({recorded_parameters, input.label, input.parameters});
  JobRequest request;
  request.settings = input.settings;
  RenderParameters parameters = load_parameters(request, resources);
  std::string label;
  const auto make = [&](const Catalogue& catalogue) {
    label = catalogue.label();
    add_galaxies(input, label, resources);
    GalaxyLibrary library(parameters, label, resources);
    if (input.is_draft) library.measure_as_draft();
    galaxies_->begin_scene();
    library.reuse(galaxies_);
    return make_job(std::move(parameters), catalogue, resources, library);
  };
  RenderJob job = make(catalogue_of(input, parameters, resources));
  return recorded(std::move(job), label, resources);
}

RenderJob Session::load(const JobRequest& request) const {
  Resources resources = open_resources(request, folders_);
  return read_job(request, resources);
}

Rendering Session::render(RenderJob job, const RenderControl& control) const {
  TeamExecutor executor(control.team.value_or(Team()), threads_);
  const CancellationScope scope(control.cancellation);
  Rendering rendering;
  try {
    check_cancelled();
    if (job.parameters.animation.frames > 0) {
      throw InputError("a film has many images; render its frames, each with its own camera");
    }
    rendering.warnings = job_warnings(job);
    if (control.progress) control.progress({});
    use_threads(threads_);
    if (control.team) executor.agree(hash_text(0, pack_record(job.record)));
    job.pending.truth = control.truth || control.truth_images;
    complete(job, Ranks(), threads_, memory_.get());
    rendering.job = std::make_shared<const RenderJob>(std::move(job));
    RenderInProgress(control, executor, rendering).render();
    executor.leave();
  } catch (const std::bad_alloc&) {
    executor.leave(std::current_exception());
    throw RunError("out of memory");
  } catch (...) {
    executor.leave(std::current_exception());
    throw;
  }
  return rendering;
}

}  // namespace gamer
