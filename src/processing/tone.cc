#include "processing/tone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/message.h"
#include "core/no_value.h"
#include "processing/statistics.h"
#include "processing/tone_kernel.h"

namespace gamer {
namespace {

/// Planes stacked on top of each other; narrower planes are filled with NaN.
class JoinedPlane final : public Plane {
 public:
  explicit JoinedPlane(std::span<const PlanePtr> planes)
      : Plane(widest(planes), total_height(planes)), planes_(planes.begin(), planes.end()) {}

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    int bottom = 0;
    for (const PlanePtr& plane : planes_) {
      const int first = std::max(area.y, bottom);
      const int last = std::min(area.y + area.height, bottom + plane->height());
      const int there = std::clamp(plane->width() - area.x, 0, area.width);
      if (first < last) {
        double* rows = out + (first - area.y) * stride;
        if (there > 0) plane->read({area.x, first - bottom, there, last - first}, rows, stride);
        for (int row = 0; row < last - first; ++row) {
          std::fill(rows + row * stride + there, rows + row * stride + area.width, no_value);
        }
      }
      bottom += plane->height();
    }
  }

 private:
  static int widest(std::span<const PlanePtr> planes) {
    int width = 0;
    for (const PlanePtr& plane : planes) width = std::max(width, plane->width());
    return width;
  }
  static int total_height(std::span<const PlanePtr> planes) {
    long long height = 0;
    for (const PlanePtr& plane : planes) height += plane->height();
    if (height > std::numeric_limits<int>::max()) {
      throw InputError("too many rows in all planes together; take them one by one");
    }
    return static_cast<int>(height);
  }

  std::vector<PlanePtr> planes_;
};

Statistics statistics_of(std::span<const PlanePtr> planes, int threads) {
  return planes.size() == 1 ? statistics(*planes.front(), threads)
                            : statistics(JoinedPlane(planes), threads);
}

LinearTone scale_to(double wanted, double measured, const char* what) {
  if (std::isnan(measured)) throw InputError("no pixel has a finite value");
  const double factor = wanted / measured;
  if (!(measured > 0) || !std::isfinite(factor) || factor == 0) {
    throw input_error("the {} is {:.6g}, which no positive factor brings to {:.6g}", what, measured,
                      wanted);
  }
  return {0, factor};
}

PlanePtr curved(PlanePtr plane, const ToneKernel& kernel) {
  return changed(std::move(plane), [kernel](const Area& area, double* values) {
    apply_tone(kernel, values, static_cast<std::size_t>(area.width) * area.height);
  });
}

/// The stretch as a template, for inlining; `f` takes x >= 0 and maps NaN to NaN.
template <class Function>
PlanePtr stretched_by(PlanePtr plane, const Stretch& stretch, Function f) {
  const double low = stretch.limits.low, range = stretch.limits.high - stretch.limits.low;
  return changed(std::move(plane),
                 [low, range, clip = stretch.clip, f](const Area& area, double* values) {
                   const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
                   for (std::size_t i = 0; i < count; ++i) {
                     double x = (values[i] - low) / range;
                     if (clip) x = std::clamp(x, 0.0, 1.0);
                     values[i] = std::copysign(f(std::abs(x)), x);
                   }
                 });
}

}  // namespace

LinearTone tone_to_total(std::span<const PlanePtr> planes, double total, int threads) {
  return scale_to(total, statistics_of(planes, threads).sum, "sum of the pixels");
}

LinearTone tone_to_peak(std::span<const PlanePtr> planes, double peak, int threads) {
  return scale_to(peak, statistics_of(planes, threads).max, "largest pixel");
}

LinearTone tone_to_mean(std::span<const PlanePtr> planes, double mean, int threads) {
  return scale_to(mean, statistics_of(planes, threads).mean, "mean of the pixels");
}

Limits quantile_limits(std::span<const PlanePtr> planes, double low, double high, int threads) {
  const std::array fractions = {low, high};
  const std::vector<double> values = planes.size() == 1
                                         ? quantiles(*planes.front(), fractions, threads)
                                         : quantiles(JoinedPlane(planes), fractions, threads);
  if (std::isnan(values[0])) throw InputError("no pixel has a finite value");
  return {values[0], values[1]};
}

LinearTone tone_to_unit_range(const Limits& limits) {
  const double factor = 1 / (limits.high - limits.low);
  if (!(limits.high > limits.low) || !std::isfinite(factor) || factor == 0) {
    throw input_error("{:.6g} and {:.6g} span no range of values that becomes 0 to 1", limits.low,
                      limits.high);
  }
  return {limits.low, factor};
}

PlanePtr linear_tone(PlanePtr plane, const LinearTone& tone) {
  return changed(std::move(plane), [tone](const Area& area, double* values) {
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    for (std::size_t i = 0; i < count; ++i) values[i] = tone.factor * (values[i] - tone.offset);
  });
}

PlanePtr gamma_tone(PlanePtr plane, double maximum, double gamma) {
  return curved(std::move(plane), {.parameter = gamma, .range = maximum});
}

double positive_maximum(std::span<const PlanePtr> planes, int threads) {
  const double maximum = statistics_of(planes, threads).max;
  if (std::isnan(maximum)) throw InputError("no pixel has a finite value");
  if (!(maximum > 0)) throw InputError("no pixel is above 0");
  return maximum;
}

PlanePtr stretched(PlanePtr plane, const Stretch& stretch) {
  const double a = stretch.softening;
  const auto [low, high] = stretch.limits;
  ToneKernel kernel{.offset = low, .range = high - low, .clip = stretch.clip};
  switch (stretch.function) {
    case Stretch::Function::square_root:
      return stretched_by(std::move(plane), stretch, [](double x) { return std::sqrt(x); });
    case Stretch::Function::logarithm:
      kernel.curve = ToneCurve::logarithm;
      kernel.parameter = a;
      kernel.factor = 1 / std::log1p(a);
      return curved(std::move(plane), kernel);
    case Stretch::Function::asinh:
      kernel.curve = ToneCurve::asinh;
      kernel.parameter = 1 / a;
      kernel.factor = 1 / std::asinh(1 / a);
      return curved(std::move(plane), kernel);
    case Stretch::Function::linear: break;
  }
  return stretched_by(std::move(plane), stretch, [](double x) { return x; });
}

double default_softening(Stretch::Function function) {
  constexpr double logarithm_scale = 1000, asinh_scale = 0.1;
  switch (function) {
    case Stretch::Function::logarithm: return logarithm_scale;
    case Stretch::Function::asinh: return asinh_scale;
    default: return 1;
  }
}

}  // namespace gamer
