#include "gamer/job/film.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/core/clock.h"
#include "gamer/core/simd.h"
#include "gamer/image/new_file.h"
#include "gamer/image/picture.h"
#include "gamer/job/resume.h"
#include "gamer/job/truth_table.h"
#include "gamer/job/warnings.h"
#include "gamer/render/galaxy_measure.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Name of the packed text with the numbers of the frames.
constexpr const char* packed_frames = "frames";

/// Largest number of frames that an estimate renders, and seconds for each.
constexpr int most_sampled = 3;
constexpr double sample_seconds = 1;

/// Numbers of a picture's tone.
constexpr std::size_t tone_numbers = 8;

/// The number in "<stem>_0007<...>", from 1; 0 where there is none.
int frame_number(const std::string& name, const std::string& stem) {
  constexpr std::size_t least_digits = 4, most_digits = 6;
  if (!name.starts_with(stem + "_")) return 0;
  const std::string rest = name.substr(stem.size() + 1);
  const auto end = std::ranges::find_if_not(rest, [](unsigned char c) { return std::isdigit(c); });
  const std::string digits(rest.begin(), end);
  if (digits.size() < least_digits || digits.size() > most_digits) return 0;
  return std::stoi(digits);
}

std::string tone_text(const std::array<double, 8>& tone) {
  return value_text(std::vector<double>(tone.begin(), tone.end()));
}

}  // namespace

Film::Film(std::unique_ptr<FrameJobs> jobs, const RenderParameters& parameters, JobOptions options)
    : jobs_(std::move(jobs)),
      options_(std::move(options)),
      parameters_(parameters),
      path_(parameters) {}

Film::Film(const RenderJob& animation, JobOptions options, int ranks, int threads)
    : Film(std::make_unique<FrameJobs>(animation), animation.parameters, std::move(options)) {
  header_ = make_image_header(animation);
  const ImageHeader truth_header = wanted_truth_header(animation, options_);
  if (options_.truth) {
    if (!options_.truth_table.empty()) {
      throw InputError(
          "gamer: --truth-table: an animation has a table for each frame; --truth "
          "puts them into the frames' files");
    }
    check_truth_table({}, parameters_.image.output);
  }
  check_row_memory(header_, header_.planes() + truth_header.planes(), ranks, threads);
  const InputFiles inputs(animation);
  for (int number = 0; number < frames(); ++number) {
    RenderParameters parameters = frame(number);
    const auto files = result_files(parameters, options_, header_, truth_header);
    inputs.check_outputs(files);
    parameters.image.output.overwrite = true;
    check_outputs(parameters, header_, truth_header);
    parameters.image.output.overwrite = options_.overwrite;
    if (options_.resume) {
      if (are_there(files)) {
        check_undamaged(parameters, options_, header_, truth_header);
        const auto tone = check_same_frame(files.front(), jobs_->record(), parameters);
        if (tone && !parameters_.image.output.tone) {
          earlier_tone_ = tone;
          earlier_picture_ = files.front();
        }
        if (!is_there(journal_path(parameters.image.output))) continue;
      }
    } else {
      if (hindrance_.empty())
        hindrance_ = gamer::hindrance(parameters.image.output, options_, files);
      if (!hindrance_.empty() && !options_.dry_run) throw InputError(hindrance_);
      std::ranges::copy_if(files, std::back_inserter(replaced_), is_there);
    }
    left_.push_back(number);
  }
}

std::string Film::pack() const {
  Record record = jobs_->record();
  record.push_back({packed_frames, "", fmt::format("{}", fmt::join(left_, " "))});
  return pack_record(record);
}

std::unique_ptr<Film> Film::unpack(std::string_view packed, JobOptions options) {
  Record record = unpack_record(packed);
  std::istringstream numbers(text_of(record, packed_frames).content.str());
  record.pop_back();
  auto jobs = std::make_unique<FrameJobs>(read_job(record));
  const RenderParameters parameters = jobs->parameters();
  std::unique_ptr<Film> film(new Film(std::move(jobs), parameters, std::move(options)));
  for (int number = 0; numbers >> number;) film->left_.push_back(number);
  return film;
}

RenderParameters Film::frame(int number) const {
  return frame_parameters(parameters_, path_, number);
}

std::string Film::names() const {
  const fs::path& output = parameters_.image.output.path;
  return fmt::format("{} to {}", frame_path(output, 0, frames()).string(),
                     frame_path(output, frames() - 1, frames()).filename().string());
}

std::string Film::size() const { return size_text(header_); }

double Film::pixels() const {
  const auto& region = parameters_.image.region;
  const double width = region ? region->width : parameters_.width;
  const double height = region ? region->height : parameters_.height;
  return static_cast<double>(left_.size()) * width * height;
}

std::vector<fs::path> Film::later_files() const {
  const fs::path& output = parameters_.image.output.path;
  const std::string suffix = image_suffix_text(output);
  std::string stem = output.filename().string();
  stem.resize(stem.size() - suffix.size());
  std::vector<fs::path> files;
  std::error_code error;
  fs::directory_iterator entry(output.has_parent_path() ? output.parent_path() : ".", error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (frame_number(name, stem) <= frames() || image_suffix_text(name) != suffix) continue;
    files.push_back(output.parent_path() / name);
  }
  std::ranges::sort(files);
  return files;
}

std::vector<JournalStatus> Film::journals() const {
  std::vector<JournalStatus> found;
  if (!options_.resume) return found;
  for (const int number : left_) {
    const fs::path path = journal_path(frame(number).image.output);
    if (!is_there(path)) continue;
    JournalStatus status = Journal::status(path);
    // With another instruction set the frame begins again.
    if (status.head.simd == simd_target_name(current_simd_target())) {
      found.push_back(std::move(status));
    }
  }
  return found;
}

std::string Film::finished_text() const {
  const std::vector<JournalStatus> found = journals();
  int done = 0, all = 0;
  for (const JournalStatus& status : found) {
    done += status.finished_rows;
    all += status.head.plan.rows;
  }
  if (found.empty()) return "";
  return fmt::format("; {} of {} rows of {} frame{} are in journals", done, all, found.size(),
                     found.size() == 1 ? "" : "s");
}

Film::FinishedFrames Film::finished_frames() const {
  const auto share = [](int done, int all) {
    return all > 0 ? std::min(1.0, static_cast<double>(done) / all) : 0.0;
  };
  FinishedFrames sum;
  for (const JournalStatus& status : journals()) {
    sum.image += share(status.finished_rows, status.head.plan.rows);
    sum.truth += share(status.finished_objects, status.head.plan.objects);
  }
  return sum;
}

JobEstimate Film::estimate(int ranks, int threads, double reading) {
  const double start = process_seconds();
  jobs_->measure(Ranks());
  const double measuring = process_seconds() - start;
  const auto count = static_cast<int>(left_.size());
  const int apart = frames_apart(count, ranks);
  const int workers = ranks * threads;
  JobEstimate film;
  film.preparing = reading + measuring;
  // Seconds of a frame on one rank, of a frame with all ranks, and of the preparation of a frame.
  double alone = 0, together = 0, preparing_frame = 0;
  const int sampled = std::min(count, most_sampled);
  for (int k = 0; k < sampled; ++k) {
    const int i = sampled == 1 ? 0 : k * (count - 1) / (sampled - 1);
    const double begin = process_seconds();
    RenderParameters parameters = frame(left_[static_cast<std::size_t>(i)]);
    // The film's tone is not known yet, and a measurement of the frame's own tone would take time.
    if (!parameters.image.output.tone)
      parameters.set("image", "tone", std::vector<double>(tone_numbers, 0.0));
    const RenderJob job = jobs_->make(std::move(parameters));
    const double making = process_seconds() - begin;
    const JobEstimate part = estimate_job(job, options_.truth, apart > 0 ? 1 : ranks, threads,
                                          {making, 0}, {}, sample_seconds);
    const double share = 1.0 / sampled;
    preparing_frame += share * part.preparing;
    alone += share * part.wall;
    // All ranks prepare a frame at the same time.
    const double twice = ranks > 1 ? making : 0;
    together += share * (apart > 0 ? part.preparing + (part.rendering + part.truth) / workers
                                   : part.wall - twice);
    film.rendering += share * part.rendering;
    film.truth += share * part.truth;
    film.memory = std::max(film.memory, part.memory);
    film.other_memory = std::max(film.other_memory, apart > 0 ? part.memory : part.other_memory);
  }
  const int each = apart / ranks, shared = count - apart;
  film.preparing += preparing_frame * (each + shared);
  film.wall =
      (ranks > 1 ? 2 : 1) * reading + measuring / workers + each * alone + shared * together;
  const FinishedFrames finished = finished_frames();
  film.wall -= (finished.image * film.rendering + finished.truth * film.truth) / workers;
  film.rendering *= count - finished.image;
  film.truth *= count - finished.truth;
  return film;
}

void Film::choose_tone(const Ranks& ranks, Executor& executor) {
  const auto tone = frame_tone(*jobs_, frame(parameters_.animation.tone_frame - 1), executor);
  // A film with two tones would flicker.
  if (ranks.rank() == 0 && earlier_tone_ && *earlier_tone_ != tone) {
    throw input_error({earlier_picture_.string(), 0, 0},
                      "the film has changed since it began: image.tone was {}, is {} (of frame {}, "
                      "animation.tone_frame); --overwrite starts anew",
                      tone_text(*earlier_tone_), tone_text(tone), parameters_.animation.tone_frame);
  }
  const std::string text = ranks.broadcast(tone_text(tone));
  const ConfigNode root = parse_toml("[image]\ntone = " + text, "image.tone");
  parameters_.image.output.tone = RenderParameters::read(root).image.output.tone;
  const auto& numbers = *parameters_.image.output.tone;
  parameters_.set("image", "tone", std::vector<double>(numbers.begin(), numbers.end()));
}

Film::Flaws Film::render_frame(int number, int ranks, int threads, Executor& executor,
                               const Messages& messages, RankReport& report) {
  const Clock clock;
  RenderParameters parameters = frame(number);
  parameters.image.output.overwrite = options_.overwrite;
  std::unique_ptr<Journal> earlier;
  if (options_.resume) {
    const fs::path path = journal_path(parameters.image.output);
    earlier = Journal::open(path, options_.journal_interval);
    // With another instruction set the rows' last digits would differ: the frame begins again.
    if (earlier && earlier->head().simd != simd_target_name(current_simd_target())) {
      earlier.reset();
      Journal::discard(path);
      parameters.image.output.overwrite = true;
    }
  }
  ImageTask work(jobs_->make(std::move(parameters)), options_, ranks, threads, std::move(earlier));
  if (!work.is_complete()) {
    work.begin();
    work.render(executor, messages.progress, report);
  }
  if (messages.say) messages.say(work.text(clock.seconds()));
  return {!work.darkness().empty(), work.unconverged_rays()};
}

void Film::warn_of(const std::map<int, Flaws>& flaws, const Messages& messages) {
  std::vector<int> dark, unconverged;
  double rays = 0;
  for (const auto& [number, flaw] : flaws) {
    if (flaw.is_dark) dark.push_back(number);
    if (flaw.unconverged_rays > 0) unconverged.push_back(number);
    rays += flaw.unconverged_rays;
  }
  if (!dark.empty()) {
    messages.warn(fmt::format("{} of {} frames without light; frame {}: {}", dark.size(),
                              flaws.size(), dark.front() + 1,
                              darkness_warning(jobs_->make(frame(dark.front())))));
  }
  if (!unconverged.empty()) {
    messages.warn(
        shortfall_warning(fmt::format("{} of {} frames, the first frame {}", unconverged.size(),
                                      flaws.size(), unconverged.front() + 1),
                          rays));
  }
}

void Film::render(const Ranks& ranks, int threads, Executor& executor, const Messages& messages,
                  RankReport& report) {
  const bool is_root = ranks.rank() == 0;
  jobs_->measure(ranks);
  for (const fs::path& file : replaced_) fs::remove(file);
  if (is_root && messages.say_when_stopped) {
    messages.say_when_stopped("; finished frames are kept; go on with: " + options_.resume_command);
  }
  if (picture_format(parameters_.image.output.path.string()) && !parameters_.image.output.tone) {
    choose_tone(ranks, executor);
  }
  const auto count = static_cast<int>(left_.size());
  const auto number = [&](int i) { return left_[static_cast<std::size_t>(i)]; };
  const int apart = frames_apart(count, ranks.size());
  std::map<int, Flaws> flaws;
  if (apart > 0) {
    Progress progress(apart, "frames", is_root ? messages.progress : Progress::Style::none, stderr);
    const std::unique_ptr<Executor> hand_out = ranks.executor(1);
    hand_out->run(
        even_blocks(apart, 1), 2,
        [&](RowRange block, std::span<double> values) {
          ThreadExecutor alone(threads);
          const Flaws found = render_frame(number(block.first), 1, threads, alone, {}, report);
          values[0] = found.is_dark ? 1 : 0;
          values[1] = found.unconverged_rays;
        },
        [&](RowRange block, std::span<const double> values) {
          progress.add(block.size());
          flaws[number(block.first)] = {values[0] != 0, values[1]};
          if (!messages.say) return;
          messages.say(
              frame_path(parameters_.image.output.path, number(block.first), frames()).string());
        });
    // While a rank waits for a frame, all its threads do.
    const double waiting = hand_out->times().waiting;
    report.runs += {waiting, 0, threads * waiting, 0};
  }
  for (int i = apart; i < count; ++i) {
    if (is_root) {
      flaws[number(i)] = render_frame(number(i), ranks.size(), threads, executor, messages, report);
    } else {
      help_render(jobs_->make(frame(number(i))), options_, executor, report);
    }
  }
  if (messages.warn) warn_of(flaws, messages);
}

}  // namespace gamer
