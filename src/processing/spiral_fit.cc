#include "processing/spiral_fit.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <utility>

#include "core/message.h"
#include "core/no_value.h"
#include "gamer/core/units.h"

namespace gamer {
namespace {

using Complex = std::complex<double>;

/// A row of the map divided by its mean, missing values as 1; empty where it cannot be used.
struct Row {
  double mean = no_value;
  std::vector<double> values;
};

Row relative_row(const Image& map, int row) {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < map.width(); ++i) {
    const double value = map.at(i, row);
    if (!std::isfinite(value)) continue;
    sum += value;
    ++count;
  }
  Row result;
  if (2 * count <= map.width() || !(sum > 0)) return result;
  result.mean = sum / count;
  for (int i = 0; i < map.width(); ++i) {
    const double value = map.at(i, row);
    result.values.push_back(std::isfinite(value) ? value / result.mean : 1);
  }
  return result;
}

/// <I exp(-i m theta)> of a row, theta at the middle of each column.
Complex mode_of(const std::vector<double>& values, int m) {
  Complex sum = 0;
  const auto count = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += values[i] * std::polar(1.0, -m * full_turn * (static_cast<double>(i) + 0.5) / count);
  }
  return sum / count;
}

/// A row's mode at its ln r.
struct Coefficient {
  double u;
  Complex value;
};

double amplitude(const std::vector<Coefficient>& coefficients, double p) {
  Complex sum = 0;
  for (const Coefficient& one : coefficients) sum += one.value * std::polar(1.0, p * one.u);
  return std::abs(sum) / static_cast<double>(coefficients.size());
}

/// The p of the largest amplitude: on a grid of a tenth of the resolution, then by golden sections.
double peak(const std::vector<Coefficient>& coefficients, double most_p) {
  constexpr double oversampling = 10, golden = 0.6180339887498949;
  constexpr int sections = 60;
  const double range = coefficients.back().u - coefficients.front().u;
  const double step = full_turn / range / oversampling;
  const int steps = static_cast<int>(std::ceil(most_p / step));
  double best = 0, most = -1;
  for (int i = -steps; i <= steps; ++i) {
    const double found = amplitude(coefficients, i * step);
    if (found <= most) continue;
    most = found;
    best = i * step;
  }
  double low = best - step, high = best + step;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = amplitude(coefficients, left), at_right = amplitude(coefficients, right);
  for (int i = 0; i < sections; ++i) {
    if (at_left > at_right) {
      high = std::exchange(right, left);
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = amplitude(coefficients, left);
    } else {
      low = std::exchange(left, right);
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = amplitude(coefficients, right);
    }
  }
  return (low + high) / 2;
}

double pitch_of(int arms, double p) { return p == 0 ? std::numbers::pi / 2 : std::atan(arms / p); }

constexpr double most_p_per_arm = 60;  ///< a pitch of 1 degree

/// Standard error of the pitch when each eighth of the rows is left out in turn.
double jackknife_error(const std::vector<Coefficient>& coefficients, int arms, double pitch) {
  constexpr std::size_t parts = 8;
  std::array<double, parts> changes{};
  double mean = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<Coefficient> rest;
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      if (i * parts / coefficients.size() != part) rest.push_back(coefficients[i]);
    }
    // Pitches of 90 and -90 degrees are equal.
    const double change = pitch_of(arms, peak(rest, most_p_per_arm * arms)) - pitch;
    changes[part] = std::remainder(change, std::numbers::pi);
    mean += changes[part] / parts;
  }
  double squares = 0;
  for (const double change : changes) squares += (change - mean) * (change - mean);
  return std::sqrt(squares * (parts - 1) / parts);
}

std::vector<Coefficient> coefficients_of(const std::vector<Row>& rows, const PolarGrid& grid,
                                         int m) {
  std::vector<Coefficient> result;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    if (rows[j].values.empty()) continue;
    result.push_back(
        {std::log(grid.radius(static_cast<double>(j) + 0.5)), mode_of(rows[j].values, m)});
  }
  return result;
}

std::vector<Row> relative_rows(const Image& map) {
  std::vector<Row> rows;
  for (int j = 0; j < map.height(); ++j) rows.push_back(relative_row(map, j));
  return rows;
}

}  // namespace

SpiralFit fit_spiral(const Image& map, const PolarGrid& grid) {
  constexpr std::size_t least_rows = 8;
  const std::vector<Row> rows = relative_rows(map);
  SpiralFit fit;
  for (int m = 1; m <= most_arms; ++m) {
    const std::vector<Coefficient> coefficients = coefficients_of(rows, grid, m);
    if (coefficients.size() < least_rows) {
      throw input_error(
          "only {} of {} radii from {:.4g} to {:.4g} pixels have light all round; a spiral needs "
          "{}",
          coefficients.size(), rows.size(), grid.inner, grid.outer, least_rows);
    }
    const double p = peak(coefficients, most_p_per_arm * m);
    SpiralMode& mode = fit.modes[static_cast<std::size_t>(m) - 1];
    mode = {m, amplitude(coefficients, p), pitch_of(m, p), 0};
    if (mode.amplitude > fit.strongest.amplitude) fit.strongest = mode;
  }
  if (fit.strongest.arms == 0) fit.strongest = fit.modes.front();
  const int arms = fit.strongest.arms;
  fit.strongest.error =
      jackknife_error(coefficients_of(rows, grid, arms), arms, fit.strongest.pitch);
  fit.modes[static_cast<std::size_t>(arms) - 1] = fit.strongest;
  return fit;
}

namespace {

/// Value of a periodic list at a place between its elements, linear.
double periodic(const std::vector<double>& values, double place) {
  const auto count = static_cast<double>(values.size());
  const double wrapped = place - count * std::floor(place / count);
  const auto left = static_cast<std::size_t>(wrapped) % values.size();
  const double share = wrapped - std::floor(wrapped);
  return (1 - share) * values[left] + share * values[(left + 1) % values.size()];
}

/// The mean of the rows [first, last), each turned back by (u - u0)/tan P.
struct StraightRow {
  std::vector<double> values;
  double mean = no_value;
  std::array<double, 4> amplitudes{};
};

StraightRow straight_row(const std::vector<Row>& rows, const PolarGrid& grid, std::size_t first,
                         std::size_t last, double u0, double cotangent) {
  StraightRow result;
  std::vector<double> sum(static_cast<std::size_t>(grid.columns), 0.0);
  double brightness = 0;
  int count = 0;
  for (std::size_t j = first; j < last; ++j) {
    if (rows[j].values.empty()) continue;
    const double u = std::log(grid.radius(static_cast<double>(j) + 0.5));
    const double turn = (u - u0) * cotangent / grid.azimuth_step();
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += periodic(rows[j].values, static_cast<double>(i) + turn);
    }
    for (int m = 1; m <= static_cast<int>(result.amplitudes.size()); ++m) {
      result.amplitudes[static_cast<std::size_t>(m) - 1] +=
          2 * std::abs(mode_of(rows[j].values, m));
    }
    brightness += rows[j].mean;
    ++count;
  }
  if (count == 0) return result;
  for (double& value : sum) value /= count;
  for (double& value : result.amplitudes) value /= count;
  result.mean = brightness / count;
  result.values = std::move(sum);
  return result;
}

/// Distance in columns from a peak to the first place where the values fall to `level`.
double half_width(const std::vector<double>& values, std::size_t peak, int direction,
                  double level) {
  const auto size = static_cast<int>(values.size());
  const auto value = [&](int distance) {
    const int place = (static_cast<int>(peak) + direction * distance) % size;
    return values[static_cast<std::size_t>(place < 0 ? place + size : place)];
  };
  for (int i = 1; i < size; ++i) {
    if (value(i) > level) continue;
    return i - 1 + (value(i - 1) - level) / (value(i - 1) - value(i));
  }
  return no_value;
}

/// Fills contrast and widths from a straightened row.
void measure_arms(const StraightRow& row, const PolarGrid& grid, const SpiralMode& mode,
                  ArmsAtRadius& result) {
  const auto columns = static_cast<int>(row.values.size());
  const double spacing = static_cast<double>(columns) / mode.arms;
  // The crest of the mode: m theta = -arg(a_m), theta at the columns' middles.
  const double crest =
      std::arg(std::conj(mode_of(row.values, mode.arms))) / mode.arms / grid.azimuth_step() - 0.5;
  const auto at = [&](int column) {
    const int place = column % columns;
    return static_cast<std::size_t>(place < 0 ? place + columns : place);
  };
  std::vector<int> peaks;
  for (int arm = 0; arm < mode.arms; ++arm) {
    const double middle = crest + arm * spacing;
    int best = static_cast<int>(std::round(middle));
    const int reach = static_cast<int>(spacing / 4);
    for (int i = best - reach, last = best + reach; i <= last; ++i) {
      if (row.values[at(i)] > row.values[at(best)]) best = i;
    }
    peaks.push_back(best);
  }
  double peak_sum = 0, valley_sum = 0;
  for (std::size_t arm = 0; arm < peaks.size(); ++arm) {
    const int next = arm + 1 < peaks.size() ? peaks[arm + 1] : peaks.front() + columns;
    double least = row.values[at(peaks[arm])];
    for (int i = peaks[arm]; i < next; ++i) least = std::min(least, row.values[at(i)]);
    peak_sum += row.values[at(peaks[arm])];
    valley_sum += least;
  }
  const double valley = valley_sum / mode.arms;
  constexpr double pogson = 2.5;
  result.contrast = valley > 0 ? pogson * std::log10(peak_sum / valley_sum) : no_value;
  double width = 0;
  for (const int peak : peaks) {
    const double level = (row.values[at(peak)] + valley) / 2;
    width +=
        half_width(row.values, at(peak), 1, level) + half_width(row.values, at(peak), -1, level);
  }
  result.width_azimuth = width / mode.arms * grid.azimuth_step();
  result.width = result.radius * result.width_azimuth * std::fabs(std::sin(mode.pitch));
}

/// The pitch of the mode within a window about u0; NaN where the window has too few rows.
double local_pitch(const std::vector<Coefficient>& coefficients, double u0, int arms) {
  constexpr double half_window = 0.25;
  constexpr std::size_t least_rows = 8;
  std::vector<Coefficient> near;
  for (const Coefficient& one : coefficients) {
    if (std::fabs(one.u - u0) <= half_window) near.push_back(one);
  }
  if (near.size() < least_rows) return no_value;
  return pitch_of(arms, peak(near, most_p_per_arm * arms));
}

}  // namespace

std::vector<ArmsAtRadius> arms_by_radius(const Image& map, const PolarGrid& grid,
                                         const SpiralMode& mode, int bins) {
  const std::vector<Row> rows = relative_rows(map);
  const std::vector<Coefficient> coefficients = coefficients_of(rows, grid, mode.arms);
  const double cotangent = 1 / std::tan(mode.pitch);
  std::vector<ArmsAtRadius> result;
  for (int bin = 0; bin < bins; ++bin) {
    const auto first = rows.size() * static_cast<std::size_t>(bin) / static_cast<std::size_t>(bins);
    const auto last =
        rows.size() * (static_cast<std::size_t>(bin) + 1) / static_cast<std::size_t>(bins);
    if (first == last) continue;
    ArmsAtRadius arms;
    arms.radius = grid.radius(static_cast<double>(first + last) / 2);
    const double u0 = std::log(arms.radius);
    const StraightRow row = straight_row(rows, grid, first, last, u0, cotangent);
    arms.brightness = row.mean;
    arms.contrast = arms.width = arms.width_azimuth = arms.pitch = no_value;
    arms.amplitudes.fill(no_value);
    if (!row.values.empty()) {
      measure_arms(row, grid, mode, arms);
      arms.amplitudes = row.amplitudes;
      arms.pitch = local_pitch(coefficients, u0, mode.arms);
    }
    result.push_back(arms);
  }
  return result;
}

}  // namespace gamer
