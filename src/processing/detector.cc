#include "processing/detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"

namespace gamer {
namespace {

/// Pixels worked on at a time; they stay in the first-level cache.
constexpr int piece_size = 512;

/// Kinds of a pixel's random numbers.
enum Draw : std::uint64_t { photons = 1, read_noise_name, gaussian };

std::uint64_t row_key(std::uint64_t key, Draw draw, int y) {
  return hash_words({key, draw, static_cast<std::uint64_t>(y)});
}

/// Calls work(x, y, values) for pieces of rows.
template <class Work>
void for_each_piece(const Area& area, double* values, Work work) {
  for (int row = 0; row < area.height; ++row) {
    double* first = values + static_cast<std::ptrdiff_t>(row) * area.width;
    for (int i = 0; i < area.width; i += piece_size) {
      const auto size = static_cast<std::size_t>(std::min(piece_size, area.width - i));
      work(area.x + i, area.y + row, std::span(first + i, size));
    }
  }
}

/// Replaces v by mu.
void expect(const Detector& detector, std::span<double> values) {
  const double scale = detector.electron_rate * detector.exposure;
  const double background = detector.background();
  // The comparison is false for NaN, so NaN stays.
  for (double& v : values) v = (v < 0 ? 0 : v) * scale + background;
}

/// values[i] += sigma z, where z is a normal variate.
void add_normal(std::uint64_t key, int x, double sigma, std::span<double> values) {
  std::array<double, piece_size> buffer;
  const std::span normals(buffer.data(), values.size());
  normal_variates(key, static_cast<std::uint64_t>(x), normals);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += sigma * normals[i];
}

}  // namespace

std::uint64_t noise_key(std::uint64_t seed, std::string_view label, int occurrence) {
  std::uint64_t name = label.size();
  for (const char c : label) name = hash_words({name, static_cast<unsigned char>(c)});
  return hash_words({seed, name, static_cast<std::uint64_t>(occurrence)});
}

PlanePtr observed(PlanePtr source, const Detector& detector, std::uint64_t key) {
  const double read_noise = detector.read_noise * std::sqrt(detector.exposures);
  const double most = detector.full_well * detector.exposures;
  return changed(std::move(source), [=](const Area& area, double* values) {
    for_each_piece(area, values, [&](int x, int y, std::span<double> piece) {
      expect(detector, piece);
      poisson_variates(row_key(key, photons, y), static_cast<std::uint64_t>(x), piece, piece);
      if (read_noise > 0) add_normal(row_key(key, read_noise_name, y), x, read_noise, piece);
      for (double& v : piece) v = (v > most ? most : v) * detector.per_electron + detector.offset;
    });
  });
}

PlanePtr observed_variance(PlanePtr source, const Detector& detector) {
  const double read = detector.read_noise * detector.read_noise * detector.exposures;
  const double square = detector.per_electron * detector.per_electron;
  return changed(std::move(source), [=](const Area& area, double* values) {
    const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
    expect(detector, all);
    for (double& v : all) v = (v + read) * square;
  });
}

PlanePtr with_gaussian_noise(PlanePtr source, double sigma, std::uint64_t key) {
  return changed(std::move(source), [=](const Area& area, double* values) {
    for_each_piece(area, values, [&](int x, int y, std::span<double> piece) {
      add_normal(row_key(key, gaussian, y), x, sigma, piece);
    });
  });
}

PlanePtr gaussian_variance(PlanePtr source, double sigma) {
  return changed(std::move(source), [variance = sigma * sigma](const Area& area, double* values) {
    const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
    for (double& v : all) v = std::isnan(v) ? v : variance;
  });
}

double signal_norm(const Plane& plane, int threads) {
  double sum = 0;
  for_each_band(plane, threads, [&](const Area& area, const double* values) {
    const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
    for (const double v : all) sum += std::isnan(v) ? 0 : v * v;
  });
  return std::sqrt(sum);
}

}  // namespace gamer
