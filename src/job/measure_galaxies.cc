#include "gamer/job/measure_galaxies.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gamer/core/parallel_for.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"
#include "gamer/job/calibration_cache.h"

namespace gamer {
namespace {

/// Each galaxy that is being measured needs some 10 MiB.
constexpr std::size_t galaxies_at_a_time = 4;

/// Galaxies whose numbers are held at one time.
constexpr std::size_t most_together = 1024;

/// Largest number of galaxies of a job for which the cache takes the parts of all of them. In
/// larger jobs it takes only the parts of references.
constexpr std::size_t most_cached = CalibrationCache::most_files / 4;

/// The references that still lack closures, in the order of their galaxies. Each has the footprints
/// of all galaxies that take closures from it.
std::vector<std::pair<Galaxy*, FootprintRange>> references_to_measure(
    std::span<const std::shared_ptr<Galaxy>> galaxies, std::span<const FootprintRange> footprints) {
  std::vector<std::pair<Galaxy*, FootprintRange>> result;
  std::unordered_map<Galaxy*, std::size_t> places;
  for (std::size_t g = 0; g < galaxies.size(); ++g) {
    Galaxy* const reference = galaxies[g]->reference().get();
    if (reference == nullptr) continue;
    FootprintRange needed = footprints.empty() ? FootprintRange() : footprints[g];
    needed.needs_light_means = false;
    const auto [place, is_new] = places.try_emplace(reference, result.size());
    if (is_new) {
      result.emplace_back(reference, needed);
    } else {
      FootprintRange& known = result[place->second].second;
      known = known | needed;
    }
  }
  std::erase_if(
      result, [](const auto& r) { return r.first->calibration().closure_range.covers(r.second); });
  for (auto& [reference, range] : result) range = range | reference->calibration().closure_range;
  return result;
}

/// Blocks of parts. Ranks take several parts at a time, fewer towards the end, since a block's
/// numbers are held twice.
std::vector<RowRange> part_blocks(int parts, const Ranks& ranks) {
  constexpr int most = 1024;
  const int shares = ranks.size() > 1 ? 4 * ranks.size() : 1;
  std::vector<RowRange> blocks;
  for (int first = 0; first < parts;) {
    const int last = first + std::clamp((parts - first) / shares, 1, most);
    blocks.push_back({first, last});
    first = last;
  }
  return blocks;
}

/// Whether the cache takes a galaxy. Drafts, which are measured over few points, soon change.
bool is_for_cache(const Galaxy& galaxy) {
  return galaxy.most_cloud_points() >= GalaxySettings().most_cloud_points;
}

/// A measurement of galaxies in rounds.
class Measurement {
 public:
  Measurement(const Ranks& ranks, CalibrationMemory* memory, bool is_cached)
      : ranks_(ranks), memory_(memory), is_cached_(is_cached) {}

  void add(Galaxy& galaxy, FootprintRange footprints) {
    subjects_.push_back({GalaxyStatistics(galaxy, footprints), &galaxy});
  }
  void run();

 private:
  /// A galaxy that is measured.
  struct Subject {
    GalaxyStatistics statistics;
    const Galaxy* galaxy;
  };
  struct Row {
    std::size_t subject, part;
  };

  /// The name of a part in known_.
  static std::string known_name(const Subject& subject, const std::string& part) {
    return subject.galaxy->shape() + ' ' + part;
  }
  /// Takes the parts that the cache holds.
  void recall();
  void measure(GalaxyStatistics::Round round);
  /// Gives the cache the parts that it did not hold.
  void keep() const;
  /// Calls GalaxyStatistics::measure() unless the part is known.
  void measure_part(Subject& subject, GalaxyStatistics::Round round, std::size_t part,
                    std::span<double> numbers);
  void take(GalaxyStatistics::Round round, const Row& row, std::span<const double> numbers);

  const Ranks& ranks_;
  CalibrationMemory* memory_;
  bool is_cached_;
  std::vector<Subject> subjects_;
  CalibrationParts known_;         ///< of galaxies that are cached; names begin with their shapes
  std::set<std::string> changed_;  ///< shapes of galaxies with parts that the cache did not hold
};

void Measurement::run() {
  if (is_cached_) recall();
  for (const GalaxyStatistics::Round round : GalaxyStatistics::rounds) measure(round);
  for (Subject& subject : subjects_) subject.statistics.adopt();
  keep();
}

void Measurement::recall() {
  const CalibrationCache* const cache = calibration_cache();
  for (const Subject& subject : subjects_) {
    if (cache != nullptr && is_for_cache(*subject.galaxy)) {
      known_.merge(cache->load(subject.galaxy->shape()));
    }
  }
  if (ranks_.size() == 1) return;
  const std::string all = ranks_.broadcast(ranks_.rank() == 0 ? pack_parts(known_) : "");
  if (ranks_.rank() != 0) known_ = unpack_parts(all);
}

void Measurement::measure_part(Subject& subject, GalaxyStatistics::Round round, std::size_t part,
                               std::span<double> numbers) {
  const std::string name = subject.statistics.name(round, part);
  if (memory_ != nullptr && memory_->recall(name, numbers)) return;
  const auto known = known_.find(known_name(subject, name));
  const bool is_known = known != known_.end() && known->second.size() <= numbers.size();
  if (is_known) {
    const auto rest = std::ranges::copy(known->second, numbers.begin()).out;
    std::fill(rest, numbers.end(), 0.0);
  } else {
    subject.statistics.measure(round, part, numbers);
  }
  if (memory_ != nullptr) memory_->keep(name, numbers, !is_known);
}

void Measurement::take(GalaxyStatistics::Round round, const Row& row,
                       std::span<const double> numbers) {
  Subject& subject = subjects_[row.subject];
  subject.statistics.take(round, row.part, numbers);
  if (!is_cached_ || calibration_cache() == nullptr || !is_for_cache(*subject.galaxy)) return;
  while (!numbers.empty() && numbers.back() == 0) numbers = numbers.first(numbers.size() - 1);
  std::vector<double> kept(numbers.begin(), numbers.end());
  const std::string name = known_name(subject, subject.statistics.name(round, row.part));
  if (known_.try_emplace(name, std::move(kept)).second) changed_.insert(subject.galaxy->shape());
}

void Measurement::measure(GalaxyStatistics::Round round) {
  std::size_t numbers = 0;
  std::vector<Row> rows;
  for (std::size_t k = 0; k < subjects_.size(); ++k) {
    const GalaxyStatistics& statistics = subjects_[k].statistics;
    numbers = std::max(numbers, statistics.most_numbers());
    for (std::size_t part = 0; part < statistics.parts(round); ++part) rows.push_back({k, part});
  }
  const std::vector<RowRange> blocks = part_blocks(static_cast<int>(rows.size()), ranks_);
  const auto measure_block = [&](RowRange range, std::span<double> values) {
    // The parts of a galaxy are measured one after the other.
    std::vector<RowRange> runs;
    for (int row = range.first; row < range.last; ++row) {
      const std::size_t subject = rows[static_cast<std::size_t>(row)].subject;
      if (runs.empty() || rows[static_cast<std::size_t>(runs.back().first)].subject != subject) {
        runs.push_back({row, row});
      }
      ++runs.back().last;
    }
    const auto measure_run = [&](std::size_t run) {
      for (int row = runs[run].first; row < runs[run].last; ++row) {
        const auto [subject, part] = rows[static_cast<std::size_t>(row)];
        const auto place = static_cast<std::size_t>(row - range.first) * numbers;
        measure_part(subjects_[subject], round, part, values.subspan(place, numbers));
      }
    };
    parallel_for(runs.size(), measure_run, galaxies_at_a_time);
  };
  std::vector<double> all;
  // Parts are equal on all ranks, since they follow from the parts that all have taken.
  if (!rows.empty()) all = ranks_.compute_together(blocks, numbers, 1, measure_block);
  if (all.size() != rows.size() * numbers) {
    throw std::logic_error("ranks do not measure the same galaxies");
  }
  for (std::size_t row = 0; row < rows.size(); ++row) {
    take(round, rows[row], std::span(all).subspan(row * numbers, numbers));
  }
  for (Subject& subject : subjects_) subject.statistics.finish(round);
}

void Measurement::keep() const {
  const CalibrationCache* const cache = calibration_cache();
  if (cache == nullptr) return;
  for (const std::string& shape : changed_) {
    auto end = known_.lower_bound(shape);
    const auto begin = end;
    while (end != known_.end() && end->first.starts_with(shape)) ++end;
    cache->save(shape, {begin, end});
  }
}

}  // namespace

void measure_galaxies(std::span<const std::shared_ptr<Galaxy>> galaxies,
                      std::span<const FootprintRange> footprints, const Ranks& ranks,
                      CalibrationMemory* memory) {
  Measurement of_references(ranks, memory, true);
  for (const auto& [reference, range] : references_to_measure(galaxies, footprints)) {
    of_references.add(*reference, range);
  }
  of_references.run();
  const bool is_cached = galaxies.size() <= most_cached;
  for (std::size_t first = 0; first < galaxies.size(); first += most_together) {
    Measurement measurement(ranks, memory, is_cached);
    const std::size_t last = std::min(first + most_together, galaxies.size());
    for (std::size_t g = first; g < last; ++g) {
      measurement.add(*galaxies[g], footprints.empty() ? FootprintRange() : footprints[g]);
    }
    measurement.run();
  }
}

}  // namespace gamer
