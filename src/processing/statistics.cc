#include "processing/statistics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "core/no_value.h"

namespace gamer {
namespace {

/// Knuth's exact sum: a + b = sum + error in exact arithmetic.
struct TwoSum {
  double sum, error;
  TwoSum(double a, double b) : sum(a + b) {
    const double part = sum - a;
    error = (a - (sum - part)) + (b - part);
  }
};

/// A sum with a running error term: relative error 2^-53 unless terms cancel by 2^50.
class Sum {
 public:
  void add(double value) {
    const TwoSum result(high_, value);
    high_ = result.sum;
    low_ += result.error;
  }
  double value() const { return std::isfinite(high_) ? high_ + low_ : high_; }

 private:
  double high_ = 0, low_ = 0;
};

/// Pixels of a piece of a row; its moments about its own mean are computed in the cache.
constexpr int values_at_once = 4096;
constexpr int lane_count = 8;

/// Independent sums that compilers turn into vector code.
class LaneSums {
 public:
  void add(const double* values, int count) {
    int i = 0;
    for (; i + lane_count <= count; i += lane_count) {
      for (int lane = 0; lane < lane_count; ++lane) {
        const TwoSum result(high_[lane], values[i + lane]);
        high_[lane] = result.sum;
        low_[lane] += result.error;
      }
    }
    for (int lane = 0; i < count; ++i, ++lane) {
      const TwoSum result(high_[lane], values[i]);
      high_[lane] = result.sum;
      low_[lane] += result.error;
    }
  }
  void add_to(Sum& sum) const {
    for (int lane = 0; lane < lane_count; ++lane) {
      sum.add(high_[lane]);
      if (std::isfinite(high_[lane])) sum.add(low_[lane]);
    }
  }

 private:
  std::array<double, lane_count> high_{}, low_{};
};

double squares_about(const double* values, int count, double mean) {
  std::array<double, lane_count> sums{};
  int i = 0;
  for (; i + lane_count <= count; i += lane_count) {
    for (int lane = 0; lane < lane_count; ++lane) {
      const double difference = values[i + lane] - mean;
      sums[lane] += difference * difference;
    }
  }
  for (; i < count; ++i) sums[0] += (values[i] - mean) * (values[i] - mean);
  double total = 0;
  for (const double sum : sums) total += sum;
  return total;
}

class StatisticsPass {
 public:
  void take(const Area& area, const double* values) {
    for (int row = 0; row < area.height; ++row) {
      for (int x = 0; x < area.width; x += values_at_once) {
        const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * area.width + x;
        take_piece(values + first, std::min(values_at_once, area.width - x), area.x + x,
                   area.y + row);
      }
    }
  }

  Statistics result() {
    if (statistics_.count == 0) {
      statistics_.sum = statistics_.min = statistics_.max = no_value;
      statistics_.mean = statistics_.sigma = no_value;
      return statistics_;
    }
    const auto count = static_cast<double>(statistics_.count);
    statistics_.sum = sum_.value();
    statistics_.mean = statistics_.sum / count;
    statistics_.sigma = std::sqrt(squares_ / count);
    return statistics_;
  }

 private:
  void take_piece(const double* values, int length, int x, int y) {
    // A sum that is finite has only finite terms.
    double probe = 0;
    for (int i = 0; i < length; ++i) probe += 0 * values[i];
    int count = length;
    const double* finite = values;
    if (probe != 0) {
      count = 0;
      for (int i = 0; i < length; ++i) {
        if (std::isfinite(values[i])) {
          kept_[count++] = values[i];
        } else {
          ++(std::isnan(values[i]) ? statistics_.nans : statistics_.infinities);
        }
      }
      finite = kept_.data();
    }
    if (count == 0) return;
    take_extremes(values, length, finite, count, x, y);
    LaneSums lanes;
    lanes.add(finite, count);
    lanes.add_to(sum_);
    Sum piece_sum;
    lanes.add_to(piece_sum);
    // Sums of squares about a common mean are merged as in Chan, Golub & LeVeque 1983.
    const double mean = piece_sum.value() / count;
    const double before = static_cast<double>(statistics_.count), after = before + count;
    const double difference = mean - mean_;
    squares_ +=
        squares_about(finite, count, mean) + difference * difference * (before * (count / after));
    mean_ += difference * (count / after);
    statistics_.count += count;
  }

  void take_extremes(const double* values, int length, const double* finite, int count, int x,
                     int y) {
    std::array<double, lane_count> lows, highs;
    lows.fill(finite[0]);
    highs.fill(finite[0]);
    int i = 0;
    for (; i + lane_count <= count; i += lane_count) {
      for (int lane = 0; lane < lane_count; ++lane) {
        const double value = finite[i + lane];
        lows[lane] = value < lows[lane] ? value : lows[lane];
        highs[lane] = value > highs[lane] ? value : highs[lane];
      }
    }
    for (; i < count; ++i) {
      lows[0] = std::min(lows[0], finite[i]);
      highs[0] = std::max(highs[0], finite[i]);
    }
    const double low = *std::ranges::min_element(lows);
    const double high = *std::ranges::max_element(highs);
    const auto position = [&](double value) {
      return Statistics::Pixel{
          x + static_cast<int>(std::find(values, values + length, value) - values), y};
    };
    if (statistics_.count == 0 || low < statistics_.min) {
      statistics_.min = low;
      statistics_.min_at = position(low);
    }
    if (statistics_.count == 0 || high > statistics_.max) {
      statistics_.max = high;
      statistics_.max_at = position(high);
    }
  }

  Statistics statistics_;
  Sum sum_;
  double mean_ = 0, squares_ = 0;
  std::array<double, values_at_once> kept_;
};

/// Largest number of values in memory.
constexpr std::size_t held = std::size_t{1} << 22;
constexpr int digit_bits = 16;
constexpr int key_bits = 64;
constexpr std::size_t bin_count = std::size_t{1} << digit_bits;
constexpr std::uint64_t sign = std::uint64_t{1} << 63;

/// Unsigned integers in the order of the numbers; -0 counts as 0.
std::uint64_t key_of(double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value + 0.0);
  return (bits & sign) != 0 ? ~bits : bits | sign;
}

double value_of(std::uint64_t key) {
  return std::bit_cast<double>((key & sign) != 0 ? key & ~sign : ~key);
}

/// A quantile's rank or two neighbouring ranks, and the fraction between them.
struct Quantile {
  std::int64_t lower = 0, upper = 0;
  double fraction = 0;

  Quantile(double q, std::int64_t count) {
    const double place = q * static_cast<double>(count - 1);
    lower = std::min(static_cast<std::int64_t>(std::floor(place)), count - 1);
    upper = std::min(lower + 1, count - 1);
    fraction = place - static_cast<double>(lower);
  }
  double value(double low, double high) const {
    if (fraction <= 0 || low == high) return low;
    // The interpolation starts from the nearer end, as in NumPy. Where the difference overflows, it
    // is a weighted mean.
    const double difference = high - low;
    if (!std::isfinite(difference)) return low * (1 - fraction) + high * fraction;
    return fraction < 0.5 ? low + difference * fraction : high - difference * (1 - fraction);
  }
};

void check_fractions(std::span<const double> fractions) {
  for (const double q : fractions) {
    if (!(q >= 0 && q <= 1)) throw std::invalid_argument("a quantile outside [0, 1]");
  }
}

/// Puts the values of all `ranks` (ascending) of values[0, count) where sorting would put them.
void select_ranks(std::span<double> values, std::span<const std::int64_t> ranks) {
  if (ranks.empty()) return;
  const std::size_t middle = ranks.size() / 2;
  const auto rank = static_cast<std::ptrdiff_t>(ranks[middle]);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  select_ranks(values.first(static_cast<std::size_t>(rank)), ranks.first(middle));
  std::vector<std::int64_t> above;
  for (const std::int64_t other : ranks.subspan(middle + 1)) above.push_back(other - rank - 1);
  select_ranks(values.subspan(static_cast<std::size_t>(rank) + 1), above);
}

/// Calls `use` with every finite |v - center|, or with v where center is NaN.
void for_each_value(const Plane& plane, double center, int threads,
                    const std::function<void(const double* values, std::size_t count)>& use) {
  std::vector<double> kept;
  for_each_band(plane, threads, [&](const Area& area, const double* values) {
    const std::size_t size = static_cast<std::size_t>(area.width) * area.height;
    kept.resize(size);
    std::size_t count = 0;
    const bool distance = !std::isnan(center);
    for (std::size_t i = 0; i < size; ++i) {
      kept[count] = distance ? std::fabs(values[i] - center) : values[i];
      count += std::isfinite(values[i]) ? 1 : 0;
    }
    use(kept.data(), count);
  });
}

/// Order statistics of a plane's values, by radix selection from the highest bits down.
class Selection {
 public:
  Selection(const Plane& plane, double center, int threads)
      : plane_(plane), center_(center), threads_(threads) {}

  std::vector<double> quantiles(std::span<const double> fractions) {
    read_first();
    if (count_ == 0) return std::vector<double>(fractions.size(), no_value);
    std::vector<Quantile> wanted;
    std::vector<std::int64_t> ranks;
    for (const double q : fractions) {
      wanted.emplace_back(q, count_);
      ranks.push_back(wanted.back().lower);
      ranks.push_back(wanted.back().upper);
    }
    std::ranges::sort(ranks);
    ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
    const std::vector<double> values = find(ranks);
    const auto value = [&](std::int64_t rank) {
      return values[static_cast<std::size_t>(std::lower_bound(ranks.begin(), ranks.end(), rank) -
                                             ranks.begin())];
    };
    std::vector<double> results;
    for (const Quantile& quantile : wanted) {
      results.push_back(quantile.value(value(quantile.lower), value(quantile.upper)));
    }
    return results;
  }

 private:
  /// Keys that share their highest bits and hold wanted ranks.
  struct Group {
    std::uint64_t prefix = 0;
    std::int64_t below = 0;  ///< number of values less than the group's
    std::int64_t count = 0;  ///< number of its values
    std::vector<std::int64_t> ranks;
    std::vector<std::int64_t> bins;
    std::vector<double> values;
  };

  /// Keeps the values as long as they are few, and counts the bins of the first digit.
  void read_first() {
    first_bins_.assign(bin_count, 0);
    for_each_value(plane_, center_, threads_, [&](const double* values, std::size_t count) {
      count_ += static_cast<std::int64_t>(count);
      for (std::size_t i = 0; i < count; ++i) {
        used_bits_ |= std::bit_cast<std::uint64_t>(values[i]);
        ++first_bins_[key_of(values[i]) >> (key_bits - digit_bits)];
      }
      if (static_cast<std::size_t>(count_) <= held) {
        held_.insert(held_.end(), values, values + count);
      } else {
        held_ = {};
      }
    });
  }

  std::vector<double> find(const std::vector<std::int64_t>& ranks) {
    if (static_cast<std::size_t>(count_) <= held) {
      select_ranks(held_, ranks);
      std::vector<double> values;
      for (const std::int64_t rank : ranks) {
        values.push_back(held_[static_cast<std::size_t>(rank)] + 0.0);
      }
      return values;
    }
    Group all;
    all.count = count_;
    all.ranks = ranks;
    all.bins = std::move(first_bins_);
    std::vector<Group> groups = divide({std::move(all)});
    // Numbers that were floats or small integers end in zero bits, which need no pass.
    const int significant = key_bits - std::countr_zero(used_bits_ | sign);
    for (int settled = digit_bits;; settled += digit_bits) {
      std::size_t candidates = 0;
      for (const Group& group : groups) candidates += static_cast<std::size_t>(group.count);
      if (settled >= significant) return settled_values(groups, settled, ranks.size());
      if (candidates <= held) return collected_values(groups, settled);
      count_digits(groups, settled);
      groups = divide(std::move(groups));
    }
  }

  /// The groups, after the next digit, that hold ranks.
  static std::vector<Group> divide(std::vector<Group> groups) {
    std::vector<Group> parts;
    for (const Group& group : groups) {
      std::int64_t below = group.below;
      std::size_t next = 0;
      for (std::size_t bin = 0; bin < bin_count && next < group.ranks.size(); ++bin) {
        const std::int64_t above = below + group.bins[bin];
        if (group.ranks[next] < above) {
          Group part;
          part.prefix = group.prefix << digit_bits | bin;
          part.below = below;
          part.count = group.bins[bin];
          for (; next < group.ranks.size() && group.ranks[next] < above; ++next) {
            part.ranks.push_back(group.ranks[next]);
          }
          parts.push_back(std::move(part));
        }
        below = above;
      }
    }
    return parts;
  }

  /// Calls use(group, value) for every value whose highest `settled` bits are a group's bits.
  template <class Use>
  void for_each_candidate(std::vector<Group>& groups, int settled, Use use) {
    // The first digit excludes most values.
    std::vector<bool> wanted(bin_count);
    const int rest = key_bits - settled;
    for (const Group& group : groups) wanted[group.prefix >> (settled - digit_bits)] = true;
    for_each_value(plane_, center_, threads_, [&](const double* values, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t key = key_of(values[i]);
        if (!wanted[key >> (key_bits - digit_bits)]) continue;
        const std::uint64_t prefix = key >> rest;
        const auto group = std::lower_bound(
            groups.begin(), groups.end(), prefix,
            [](const Group& candidate, std::uint64_t value) { return candidate.prefix < value; });
        if (group != groups.end() && group->prefix == prefix) use(*group, values[i]);
      }
    });
  }

  void count_digits(std::vector<Group>& groups, int settled) {
    for (Group& group : groups) group.bins.assign(bin_count, 0);
    const int shift = key_bits - settled - digit_bits;
    for_each_candidate(groups, settled, [&](Group& group, double value) {
      ++group.bins[(key_of(value) >> shift) & (bin_count - 1)];
    });
  }

  /// Values of the groups when all bits but trailing zeros are settled: each group is one number.
  std::vector<double> settled_values(const std::vector<Group>& groups, int settled,
                                     std::size_t count) const {
    std::vector<double> results;
    results.reserve(count);
    for (const Group& group : groups) {
      std::uint64_t key = group.prefix;
      if (settled < key_bits) {
        key <<= key_bits - settled;
        // Keys of negative numbers are complements, so their trailing zeros are ones.
        if ((key & sign) == 0) key |= (std::uint64_t{1} << (key_bits - settled)) - 1;
      }
      results.insert(results.end(), group.ranks.size(), value_of(key));
    }
    return results;
  }

  std::vector<double> collected_values(std::vector<Group>& groups, int settled) {
    for_each_candidate(groups, settled,
                       [](Group& group, double value) { group.values.push_back(value); });
    std::vector<double> results;
    for (Group& group : groups) {
      for (std::int64_t& rank : group.ranks) rank -= group.below;
      select_ranks(group.values, group.ranks);
      for (const std::int64_t rank : group.ranks) {
        results.push_back(group.values[static_cast<std::size_t>(rank)] + 0.0);
      }
    }
    return results;
  }

  const Plane& plane_;
  const double center_;
  const int threads_;
  std::int64_t count_ = 0;
  std::uint64_t used_bits_ = 0;
  std::vector<std::int64_t> first_bins_;
  std::vector<double> held_;
};

}  // namespace

Statistics statistics(const Plane& plane, int threads) {
  StatisticsPass pass;
  for_each_band(plane, threads,
                [&](const Area& area, const double* values) { pass.take(area, values); });
  return pass.result();
}

std::vector<double> quantiles(const Plane& plane, std::span<const double> fractions, int threads) {
  check_fractions(fractions);
  return Selection(plane, no_value, threads).quantiles(fractions);
}

double median(const Plane& plane, int threads) {
  return quantiles(plane, std::array{0.5}, threads).front();
}

std::vector<double> quantiles(std::vector<double> values, std::span<const double> fractions) {
  check_fractions(fractions);
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return std::vector<double>(fractions.size(), no_value);
  const int count = static_cast<int>(values.size());
  return quantiles(MemoryPlane(count, 1, std::move(values)), fractions, 1);
}

double mad_sigma(const Plane& plane, double center, int threads) {
  if (!std::isfinite(center)) return no_value;
  return mad_to_sigma * Selection(plane, center, threads).quantiles(std::array{0.5}).front();
}

Background clipped_background(const Plane& plane, double clip, int threads) {
  if (!(clip > 0)) throw std::invalid_argument("a clip that is not positive");
  constexpr int most_passes = 20;
  Background background;
  background.level = median(plane, threads);
  background.sigma = mad_sigma(plane, background.level, threads);
  for (int pass = 0; pass < most_passes; ++pass) {
    const double reach = clip * background.sigma;
    const double low = background.level - reach, high = background.level + reach;
    StatisticsPass kept;
    std::vector<double> values;
    for_each_band(plane, threads, [&](const Area& area, const double* all) {
      const std::size_t size = static_cast<std::size_t>(area.width) * area.height;
      values.resize(size);
      for (std::size_t i = 0; i < size; ++i) {
        values[i] = all[i] >= low && all[i] <= high ? all[i] : no_value;
      }
      kept.take(area, values.data());
    });
    const Statistics result = kept.result();
    if (result.count == background.count) break;
    background = {result.mean, result.sigma, result.count};
  }
  return background;
}

}  // namespace gamer
