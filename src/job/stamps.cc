#include "gamer/job/stamps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <new>
#include <utility>

#include "core/message.h"
#include "gamer/core/capitals.h"
#include "gamer/core/clock.h"
#include "gamer/image/fits/fits.h"
#include "gamer/job/resume.h"
#include "gamer/job/schedule.h"
#include "gamer/job/truth_table.h"
#include "image/memory.h"

namespace gamer {
namespace {

/// Angle from a galaxy's centre that its stamp holds, rad.
double reach_of(const PlacedGalaxy& placed, const RenderJob& job) {
  const StampSettings& stamps = job.parameters.stamps;
  const double radius = stamps.radius == StampSettings::Radius::ball ? placed.bounding_radius
                                                                     : placed.half_light_radius;
  return stamps.extent * radius / job.camera.distance(placed.centre);
}

/// Pixels on a side of a stamp that reaches `reach` pixels from its middle pixel.
int side_of(double reach, const StampSettings& stamps) {
  const double most = 0.5 * (stamps.largest - 1);
  const int half = static_cast<int>(std::min(std::ceil(reach), most));
  return std::max(2 * half + 1, stamps.smallest);
}

ImageRegion around(const glm::dvec2& pixel, int side) {
  const int half = side / 2;
  return {static_cast<int>(std::lround(pixel.x)) - half,
          static_cast<int>(std::lround(pixel.y)) - half, side, side};
}

}  // namespace

bool makes_stamps(const RenderParameters& parameters) {
  return parameters.image.output.layout == ImageLayout::stamps;
}

std::vector<ImageRegion> stamp_regions(const RenderJob& job) {
  const StampSettings& stamps = job.parameters.stamps;
  const Camera& camera = job.camera;
  std::vector<ImageRegion> regions(job.scene->objects);
  for (const PlacedGalaxy& placed : job.scene->galaxies) {
    const std::optional<glm::dvec2> pixel = camera.pixel(placed.centre);
    if (!pixel) {
      throw input_error(
          "a stamp of object {}{}: its centre has no pixel, because the projection does not show "
          "it",
          placed.object + 1, placed.id.empty() ? "" : fmt::format(" ({})", placed.id));
    }
    // Along its shortest side a pixel covers the least angle, so that the reach has most pixels.
    const double step = camera.pixel_size(placed.centre) / camera.distance(placed.centre);
    const double reach = reach_of(placed, job) / (step * camera.pixel_aspect());
    regions[placed.object] = around(*pixel, stamps.size.value_or(side_of(reach, stamps)));
  }
  for (const PlacedStar& star : job.scene->stars) {
    regions[star.object] = around(star.pixel, stamps.size.value_or(stamps.smallest));
  }
  return regions;
}

namespace {

/// EXTNAME and EXTVER of each stamp.
std::vector<StampHeader> name_stamps(const RenderJob& job) {
  std::vector<StampHeader> stamps(job.scene->objects);
  for (const PlacedGalaxy& placed : job.scene->galaxies) stamps[placed.object].name = placed.id;
  for (const PlacedStar& star : job.scene->stars) stamps[star.object].name = star.id;
  // The file's tables have names, too.
  std::map<std::string, int> counts = {{"SCENE", 1}, {"TRUTH", 1}, {"INPUTS", 1}};
  for (std::size_t stamp = 0; stamp < stamps.size(); ++stamp) {
    StampHeader& stamp_header = stamps[stamp];
    if (stamp_header.name.empty()) stamp_header.name = fmt::format("OBJECT_{}", stamp + 1);
    // Readers find names in any case.
    stamp_header.version = ++counts[in_capitals(stamp_header.name)];
  }
  return stamps;
}

}  // namespace

std::vector<StampHeader> describe_stamps(const RenderJob& job, std::span<const ImageRegion> regions,
                                         const ImageHeader& header) {
  std::vector<StampHeader> stamps = name_stamps(job);
  for (std::size_t stamp = 0; stamp < stamps.size(); ++stamp) {
    StampHeader& stamp_header = stamps[stamp];
    const ImageRegion& region = regions[stamp];
    stamp_header.width = region.width;
    stamp_header.height = region.height;
    stamp_header.wcs_records = job.camera.with_window(region).wcs_records();
    stamp_header.cards = {
        {"ROW", static_cast<long long>(stamp + 1), "of the tables SCENE and TRUTH"},
        {"LTV1", static_cast<double>(-region.left), "x here less x in the whole image"},
        {"LTV2", static_cast<double>(-region.bottom), "y here less y in the whole image"}};
    // These cards without a number hold for all planes; a cube also has numbered ones.
    for (const Card& card : header.cards) {
      if (card.key == "MAGZERO" || card.key == "PHOTZP") stamp_header.cards.push_back(card);
    }
  }
  return stamps;
}

// ---- StampRenderer -----------------------------------------------------------------------------

StampRenderer::StampRenderer(const RenderJob& job)
    : job_(job),
      regions_(stamp_regions(job)),
      galaxies_(job.scene->objects, nullptr),
      stars_(job.scene->objects, nullptr) {
  for (const PlacedGalaxy& placed : job.scene->galaxies) galaxies_[placed.object] = &placed;
  for (const PlacedStar& star : job.scene->stars) stars_[star.object] = &star;
}

std::size_t StampRenderer::values(std::size_t stamp) const {
  return static_cast<std::size_t>(regions_[stamp].width) *
         static_cast<std::size_t>(regions_[stamp].height) * job_.spectrum.planes.size();
}

std::size_t StampRenderer::most_bytes() const {
  std::size_t most = 0;
  for (std::size_t stamp = 0; stamp < size(); ++stamp) most = std::max(most, values(stamp));
  return most * sizeof(double);
}

std::shared_ptr<const Scene> StampRenderer::alone(std::size_t object) const {
  auto scene = std::make_shared<Scene>();
  scene->unit = job_.scene->unit;
  scene->objects = 1;
  if (galaxies_[object] != nullptr) {
    scene->galaxies = {*galaxies_[object]};
    scene->galaxies.front().object = 0;
  } else {
    scene->stars = {*stars_[object]};
    scene->stars.front().object = 0;
  }
  return scene;
}

Renderer StampRenderer::renderer(std::size_t stamp) const {
  return {job_.parameters, job_.camera.with_window(regions_[stamp]), alone(stamp), job_.spectrum};
}

std::size_t stamp_piece(std::span<const std::size_t> values, std::uint64_t most) {
  for (std::size_t piece = 256;; piece *= 2) {
    std::uint64_t pieces = 0;
    for (const std::size_t count : values) pieces += (count + piece - 1) / piece;
    if (pieces <= most || pieces == values.size()) return piece;
  }
}

void StampRenderer::run(Executor& executor, const Take& take, RankReport& report) const {
  // A row of the executor is a piece of a stamp, so that stamps may differ in size. Each stamp
  // begins a new piece.
  std::vector<std::size_t> sizes;
  for (std::size_t stamp = 0; stamp < size(); ++stamp) sizes.push_back(values(stamp) + 1);
  const std::size_t piece = stamp_piece(sizes, std::numeric_limits<int>::max());
  std::vector<RowRange> blocks;
  int end = 0;
  for (std::size_t stamp = 0; stamp < size(); ++stamp) {
    const int first = end;
    end += static_cast<int>((sizes[stamp] + piece - 1) / piece);
    blocks.push_back({first, end});
  }
  const auto stamp_of = [&](RowRange rows) {
    const auto found = std::ranges::lower_bound(blocks, rows.first, {}, &RowRange::first);
    return static_cast<std::size_t>(found - blocks.begin());
  };
  std::mutex mutex;
  executor.run(
      blocks, piece,
      [&](RowRange rows, std::span<double> all) {
        const std::size_t stamp = stamp_of(rows), count = values(stamp);
        RenderCounts counts;
        renderer(stamp).render_rows({0, regions_[stamp].height}, all.first(count), counts);
        std::ranges::fill(all.subspan(count), 0.0);
        all[count] = static_cast<double>(counts.unconverged_rays);
        const std::lock_guard lock(mutex);
        report.counts += counts;
      },
      [&](RowRange rows, std::span<const double> all) {
        const std::size_t stamp = stamp_of(rows), count = values(stamp);
        take(stamp, all.first(count), all[count]);
      });
}

// ---- StampTask ---------------------------------------------------------------------------------

namespace {

/// Throws InputError for options that stamps do not have.
void check_options(const RenderParameters& parameters, const JobOptions& options) {
  if (options.resume) {
    throw InputError("gamer: --resume: stamps have no journal; --overwrite makes them anew");
  }
  if (options.truth && parameters.truth.any()) {
    throw InputError(
        "gamer: --truth: stamps have table TRUTH, but no images of [truth]; leave those keys out");
  }
}

}  // namespace

StampTask::StampTask(RenderJob job, JobOptions options, int ranks, int threads)
    : job_(std::move(job)), options_(std::move(options)) {
  check_options(job_.parameters, options_);
  header_ = make_image_header(job_);
  regions_ = stamp_regions(job_);
  OutputOptions output = job_.parameters.image.output;
  std::vector<std::filesystem::path> files = {output.path};
  if (!options_.truth_table.empty()) files.push_back(options_.truth_table);
  InputFiles(job_).check_outputs(files);
  hindrance_ = gamer::hindrance(output, options_, files);
  output.overwrite = true;
  check_stamp_output(output, header_, pixels());
  if (options_.truth) check_truth_table(options_.truth_table, job_.parameters.image.output);
  if (!options_.dry_run && !hindrance_.empty()) throw InputError(hindrance_);
  const std::uint64_t needed =
      static_cast<std::uint64_t>(held_blocks(ranks, threads)) * StampRenderer(job_).most_bytes();
  if (const std::uint64_t available = available_memory(); needed > available) {
    throw input_error(
        "the largest stamps need {} of memory, {} is available; stamps.largest limits their size",
        bytes_text(needed), bytes_text(available));
  }
}

void StampTask::complete(const Ranks& ranks, int threads, Progress::Style style) {
  GalaxyProgress progress(style);
  job_.pending.progress = progress.counter();
  job_.pending.truth = options_.truth;
  gamer::complete(job_, ranks, threads);
}

std::optional<DataTable> StampTask::describe_objects(Executor& executor,
                                                     Progress::Style style) const {
  if (!options_.truth) return std::nullopt;
  Progress progress(static_cast<int>(job_.scene->objects), "objects of TRUTH", style, stderr);
  return truth_table(job_, executor, [&](int objects) { progress.add(objects); });
}

void StampTask::render(Executor& executor, Progress::Style style, RankReport& report) {
  try {
    unconverged_rays_ = job_.unconverged_rays;
    report.layer_counts += job_.layer_counts;
    // --overwrite replaces the rows of an interrupted image, too.
    Journal::discard(journal_path(job_.parameters.image.output));
    const std::optional<DataTable> truth = describe_objects(executor, style);
    const std::string date = fits_date();
    header_.cards.push_back({"DATE", date, "time of writing (UTC)"});
    if (truth && options_.truth_table.empty()) header_.data_tables.push_back(*truth);
    const Clock clock;
    const std::vector<StampHeader> stamps = describe_stamps(job_, regions_, header_);
    const auto writer = make_stamp_writer(job_.parameters.image.output, header_, regions_.size(),
                                          [&](std::size_t stamp) { return stamps[stamp]; });
    Progress progress(static_cast<int>(regions_.size()), "stamps", style, stderr);
    const RunTimes before = executor.times();
    report.writing += clock.seconds();
    StampRenderer(job_).run(
        executor,
        [&](std::size_t stamp, std::span<const double> values, double rays) {
          writer->write(stamp, values);
          unconverged_rays_ += rays;
          progress.add(1);
        },
        report);
    const RunTimes times = executor.times() - before;
    report.runs += times;
    const Clock end;
    writer->add_cards(shortfall_cards(unconverged_rays_));
    writer->finish();
    if (truth && !options_.truth_table.empty()) {
      write_truth_table(options_.truth_table, *truth, date);
    }
    report.writing += times.consume + end.seconds();
  } catch (const std::bad_alloc&) {
    throw RunError("gamer: out of memory");
  }
}

std::string StampTask::plan() const {
  int least = 0, most = 0;
  if (!regions_.empty()) {
    const auto [low, high] = std::ranges::minmax(regions_, {}, &ImageRegion::width);
    least = low.width, most = high.width;
  }
  const std::string sides =
      least == most ? fmt::format("{}", most) : fmt::format("{} to {}", least, most);
  return fmt::format("{}: {} stamp{} of {} pixels a side, {} plane{}",
                     job_.parameters.image.output.path.string(), regions_.size(),
                     regions_.size() == 1 ? "" : "s", sides, header_.planes(),
                     header_.planes() == 1 ? "" : "s");
}

std::string StampTask::shortfall() const {
  if (unconverged_rays_ == 0) return "";
  return shortfall_warning(job_.parameters.image.output.path.string(), unconverged_rays_);
}

double StampTask::pixels() const {
  double sum = 0;
  for (const ImageRegion& region : regions_) {
    sum += static_cast<double>(region.width) * region.height;
  }
  return sum;
}

void help_stamps(const RenderJob& job, const JobOptions& options, Executor& executor,
                 RankReport& report) {
  const RunTimes before = executor.times();
  if (options.truth) truth_table(job, executor);
  StampRenderer(job).run(executor, {}, report);
  report.runs += executor.times() - before;
}

}  // namespace gamer
