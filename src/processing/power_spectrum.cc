#include "processing/power_spectrum.h"

#include <fftw3.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>

#include "core/message.h"
#include "core/no_value.h"
#include "image/convolution/fftw_planner.h"
#include "image/memory.h"

namespace gamer {
namespace {

using std::numbers::pi;
constexpr double sigma_per_fwhm = 1 / 2.3548200450309493;

struct FftwFree {
  void operator()(double* memory) const { fftw_free(memory); }
};

/// Rows of real pixels, padded for an in-place transform.
class Field {
 public:
  Field(int width, int height, const std::string& label)
      : width_(width), height_(height), stride_(2 * (static_cast<std::ptrdiff_t>(width) / 2 + 1)) {
    const std::uint64_t bytes =
        static_cast<std::uint64_t>(stride_) * static_cast<std::uint64_t>(height) * sizeof(double);
    const std::uint64_t available = available_memory();
    if (bytes > available) {
      throw input_error(
          "{}: the spectrum of {} x {} pixels needs {} of memory, {} are available; crop or bin "
          "the image first",
          label, width, height, bytes_text(bytes), bytes_text(available));
    }
    values_.reset(fftw_alloc_real(bytes / sizeof(double)));
    if (!values_) throw std::bad_alloc();
  }

  int width() const { return width_; }
  int height() const { return height_; }
  double* row(int y) { return values_.get() + y * stride_; }

  void transform() {
    auto* spectrum = reinterpret_cast<fftw_complex*>(values_.get());
    std::unique_lock planning(fftw_planner_mutex());
    const fftw_plan plan =
        fftw_plan_dft_r2c_2d(height_, width_, values_.get(), spectrum, FFTW_ESTIMATE);
    planning.unlock();
    fftw_execute(plan);
    planning.lock();
    fftw_destroy_plan(plan);
  }

 private:
  int width_, height_;
  std::ptrdiff_t stride_;
  std::unique_ptr<double[], FftwFree> values_;
};

/// Moments of f(value) over the pixels where it is finite.
struct ValueMoments {
  std::int64_t count = 0;
  double mean = 0, sigma = 0, skewness = 0;
};

template <class Function>
ValueMoments moments_of_values(Field& field, Function function) {
  ValueMoments result;
  double sum = 0;
  for (int y = 0; y < field.height(); ++y) {
    double row = 0;
    for (int x = 0; x < field.width(); ++x) {
      const double value = function(field.row(y)[x]);
      if (!std::isfinite(value)) continue;
      ++result.count;
      row += value;
    }
    sum += row;
  }
  const auto count = static_cast<double>(result.count);
  result.mean = sum / count;
  double squares = 0, cubes = 0;
  for (int y = 0; y < field.height(); ++y) {
    double row_squares = 0, row_cubes = 0;
    for (int x = 0; x < field.width(); ++x) {
      const double value = function(field.row(y)[x]);
      if (!std::isfinite(value)) continue;
      const double difference = value - result.mean;
      row_squares += difference * difference;
      row_cubes += difference * difference * difference;
    }
    squares += row_squares;
    cubes += row_cubes;
  }
  result.sigma = std::sqrt(squares / count);
  result.skewness = cubes / count / (result.sigma * result.sigma * result.sigma);
  return result;
}

std::vector<double> window_weights(const SpectrumOptions& options, int side) {
  std::vector<double> weights(static_cast<std::size_t>(side), 1.0);
  if (options.window == SpectrumWindow::none) return weights;
  const double rise = side * (options.window == SpectrumWindow::hann ? 0.5 : options.taper);
  for (int i = 0; i < side; ++i) {
    const double distance = std::min(i, side - 1 - i) + 0.5;
    if (distance >= rise) continue;
    const double sine = std::sin(pi / 2 * distance / rise);
    weights[static_cast<std::size_t>(i)] = sine * sine;
  }
  return weights;
}

double sum_of_squares(const std::vector<double>& weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight * weight;
  return sum;
}

void load(const Plane& plane, const SpectrumOptions& options, int threads, Field& field) {
  for_each_band(plane, threads, [&](const Area& area, const double* values) {
    for (int y = 0; y < area.height; ++y) {
      double* row = field.row(area.y + y);
      for (int x = 0; x < area.width; ++x) {
        double value = *values++;
        if (options.opacity) value = -std::log1p(-value);
        if (options.logarithm) value = std::log(value);
        row[x] = value;
      }
    }
  });
}

/// Averages the transform over annuli. The window's loss of power is not yet corrected.
std::vector<PowerSpectrum::Annulus> average(Field& field) {
  const int side = std::min(field.width(), field.height());
  std::vector<PowerSpectrum::Annulus> annuli(static_cast<std::size_t>(side / 2));
  const double x_scale = static_cast<double>(side) / field.width();
  const double y_scale = static_cast<double>(side) / field.height();
  for (int y = 0; y < field.height(); ++y) {
    const double ky = y_scale * (y <= field.height() / 2 ? y : y - field.height());
    const double* row = field.row(y);
    for (int x = 0; x <= field.width() / 2; ++x) {
      const double kx = x_scale * x;
      const auto k = static_cast<std::size_t>(std::lround(std::sqrt(kx * kx + ky * ky)));
      if (k == 0 || k > annuli.size()) continue;
      // A real image's spectrum is symmetric; only half of it is stored.
      const int copies = x == 0 || 2 * x == field.width() ? 1 : 2;
      const double re = row[2 * x], im = row[2 * x + 1];
      annuli[k - 1].power += copies * (re * re + im * im);
      annuli[k - 1].modes += copies;
    }
  }
  for (std::size_t i = 0; i < annuli.size(); ++i) {
    annuli[i].k = static_cast<int>(i) + 1;
    annuli[i].frequency = annuli[i].k / static_cast<double>(side);
    annuli[i].power /= static_cast<double>(annuli[i].modes);
  }
  return annuli;
}

void correct(const SpectrumOptions& options, PowerSpectrum::Annulus& annulus) {
  constexpr double least_transfer = 1e-6;
  const double phase = 2 * pi * options.psf_fwhm * sigma_per_fwhm * annulus.frequency;
  const double transfer = std::exp(-phase * phase);
  annulus.power =
      transfer < least_transfer ? no_value : (annulus.power - options.white_level) / transfer;
}

/// The mean power and mean ln k of the modes in one bin.
struct Bin {
  double power = 0, log_k = 0, modes = 0;
};

PowerSpectrum::Fit fit_line(const std::vector<PowerSpectrum::Annulus>& annuli, int side,
                            const SpectrumOptions& options) {
  PowerSpectrum::Fit fit;
  fit.slope = fit.slope_error = fit.amplitude = no_value;
  fit.lowest = options.lowest;
  fit.highest = options.highest > 0 ? options.highest : side / 4.0;
  if (!(fit.lowest < fit.highest)) return fit;
  std::vector<Bin> bins(static_cast<std::size_t>(options.bins));
  const double log_width = std::log(fit.highest / fit.lowest) / options.bins;
  for (const PowerSpectrum::Annulus& annulus : annuli) {
    if (annulus.k < fit.lowest || annulus.k > fit.highest || !std::isfinite(annulus.power)) {
      continue;
    }
    const int number = static_cast<int>(std::log(annulus.k / fit.lowest) / log_width);
    Bin& bin = bins[static_cast<std::size_t>(std::min(number, options.bins - 1))];
    const auto modes = static_cast<double>(annulus.modes);
    bin.power += modes * annulus.power;
    bin.log_k += modes * std::log(annulus.k);
    bin.modes += modes;
  }
  std::erase_if(bins, [](const Bin& bin) { return !(bin.power > 0); });
  fit.bins = static_cast<int>(bins.size());
  constexpr int least_bins = 3;
  if (fit.bins < least_bins) return fit;
  double x_mean = 0, y_mean = 0;
  for (Bin& bin : bins) {
    bin.log_k /= bin.modes;
    bin.power = std::log(bin.power / bin.modes);
    x_mean += bin.log_k / fit.bins;
    y_mean += bin.power / fit.bins;
  }
  double xx = 0, xy = 0;
  for (const Bin& bin : bins) {
    xx += (bin.log_k - x_mean) * (bin.log_k - x_mean);
    xy += (bin.log_k - x_mean) * (bin.power - y_mean);
  }
  fit.slope = xy / xx;
  fit.amplitude = std::exp(y_mean - fit.slope * x_mean);
  // HC3 of MacKinnon & White 1985, since bins at low k scatter more.
  double squares = 0;
  for (const Bin& bin : bins) {
    const double distance = bin.log_k - x_mean;
    const double residual = bin.power - y_mean - fit.slope * distance;
    const double leverage = 1.0 / fit.bins + distance * distance / xx;
    squares += std::pow(distance * residual / (1 - leverage), 2);
  }
  fit.slope_error = std::sqrt(squares) / xx;
  return fit;
}

}  // namespace

PowerSpectrum power_spectrum(const Plane& plane, const SpectrumOptions& options,
                             const std::string& label, int threads) {
  const int side = std::min(plane.width(), plane.height());
  if (side < 2) {
    throw input_error("{}: {} x {} pixels have no power spectrum", label, plane.width(),
                      plane.height());
  }
  Field field(plane.width(), plane.height(), label);
  load(plane, options, threads, field);

  PowerSpectrum result;
  result.width = plane.width();
  result.height = plane.height();
  const ValueMoments values = moments_of_values(field, [](double value) { return value; });
  if (values.count == 0) throw input_error("{}: no pixel has a value that can be used", label);
  const ValueMoments logarithms =
      options.logarithm ? values : moments_of_values(field, [](double value) {
        return value > 0 ? std::log(value) : no_value;
      });
  result.count = values.count;
  result.missing = static_cast<std::int64_t>(plane.width()) * plane.height() - values.count;
  result.mean = values.mean;
  result.sigma = values.sigma;
  result.skewness = values.skewness;
  result.log_sigma = logarithms.count > 1 ? logarithms.sigma : no_value;
  result.log_skewness = logarithms.count > 1 ? logarithms.skewness : no_value;

  const std::vector<double> across = window_weights(options, plane.width());
  const std::vector<double> up = window_weights(options, plane.height());
  for (int y = 0; y < field.height(); ++y) {
    double* row = field.row(y);
    const double weight = up[static_cast<std::size_t>(y)];
    for (int x = 0; x < field.width(); ++x) {
      row[x] = std::isfinite(row[x])
                   ? (row[x] - values.mean) * weight * across[static_cast<std::size_t>(x)]
                   : 0;
    }
  }
  field.transform();
  result.annuli = average(field);
  const double weights = sum_of_squares(across) * sum_of_squares(up);
  for (PowerSpectrum::Annulus& annulus : result.annuli) {
    annulus.power /= weights;
    correct(options, annulus);
  }
  result.fit = fit_line(result.annuli, side, options);
  return result;
}

}  // namespace gamer
