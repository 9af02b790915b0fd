#include "processing/spectrum_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "processing/drawing.h"

namespace gamer {
namespace {

constexpr int spectrum_height = 900;
constexpr double left_margin = 130, right_margin = 40, top_margin = 40,
                 bottom_margin = 95;  ///< margins
constexpr double tick_length = 10, minor_tick = 5;
constexpr double spectrum_dot = 2.5;

constexpr Colour light_grey = {0.95, 0.95, 0.95};

/// A logarithmic axis: values `low` to `high` at pixels `first` to `last`.
struct Axis {
  double low, high, first, last;

  double operator()(double value) const {
    return first + (last - first) * std::log(value / low) / std::log(high / low);
  }
  bool contains(double value) const {
    constexpr double rounding_error = 1e-9;
    return value >= low * (1 - rounding_error) && value <= high * (1 + rounding_error);
  }
};

/// Step, in decades, between numbers at the axis.
int decade_step(const Axis& axis) {
  constexpr double most_numbers = 9;
  return std::max(1, static_cast<int>(std::ceil(std::log10(axis.high / axis.low) / most_numbers)));
}

/// Calls tick(value, decade's exponent, multiple 1 ... 9) for the axis' ticks.
template <class Tick>
void for_each_tick(const Axis& axis, Tick tick) {
  const auto first = static_cast<int>(std::floor(std::log10(axis.low)));
  const auto last = static_cast<int>(std::ceil(std::log10(axis.high)));
  for (int exponent = first; exponent <= last; ++exponent) {
    for (int multiple = 1; multiple <= 9; ++multiple) {
      const double value = multiple * std::pow(10.0, exponent);
      if (axis.contains(value)) tick(value, exponent, multiple);
    }
  }
}

void draw_axes(Drawing& drawing, const Axis& x, const Axis& y, const std::string& unit) {
  for_each_tick(x, [&](double value, int, int multiple) {
    drawing.colour(multiple == 1 ? grey : light_grey);
    drawing.line(x(value), y.first, x(value), y.last, 1);
  });
  const int step = decade_step(y);
  for_each_tick(y, [&](double value, int exponent, int multiple) {
    if (multiple != 1 || exponent % step != 0) return;
    drawing.colour(grey);
    drawing.line(x.first, y(value), x.last, y(value), 1);
  });
  drawing.colour(black);
  drawing.box(x.first, y.last, x.last, y.first);
  drawing.outline(1.5);
  // k is not written as a power of ten; where the axis has few decades, 2 and 5 have numbers, too.
  const bool few_decades = x.high / x.low < 1e3;
  constexpr double highest_plain = 1e4;
  for_each_tick(x, [&](double value, int exponent, int multiple) {
    drawing.line(x(value), y.first, x(value), y.first - (multiple == 1 ? tick_length : minor_tick),
                 1.5);
    const bool numbered = multiple == 1 || (few_decades && (multiple == 2 || multiple == 5));
    if (!numbered) return;
    if (value <= highest_plain) {
      drawing.text(fmt::format("{:.0f}", value), x(value), y.first + 1.3 * font_size, 0.5);
    } else {
      drawing.power_of_ten(exponent, x(value), y.first + 1.3 * font_size, 0.5);
    }
  });
  for_each_tick(y, [&](double value, int exponent, int multiple) {
    drawing.line(x.first, y(value), x.first + (multiple == 1 ? tick_length : minor_tick), y(value),
                 1.5);
    if (multiple == 1 && exponent % step == 0) {
      drawing.power_of_ten(exponent, x.first - tick_length, y(value) + font_size / 3, 1);
    }
  });
  drawing.text("k (waves per shorter side)", (x.first + x.last) / 2, spectrum_height - font_size,
               0.5);
  drawing.text_upwards(unit.empty() ? "power" : fmt::format("power ({})²", unit), 1.5 * font_size,
                       (y.first + y.last) / 2);
}

void draw_curve(Drawing& drawing, const Axis& x, const Axis& y, const PowerSpectrum& spectrum,
                const Colour& colour) {
  drawing.box(x.first, y.last, x.last, y.first);
  drawing.clip();
  drawing.colour(colour, 0.7);
  for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
    if (annulus.power > 0) drawing.dot(x(annulus.k), y(annulus.power), spectrum_dot);
  }
  const PowerSpectrum::Fit& fit = spectrum.fit;
  if (std::isfinite(fit.slope)) {
    const auto power = [&](double k) { return fit.amplitude * std::pow(k, fit.slope); };
    drawing.colour(colour);
    drawing.line(x(fit.lowest), y(power(fit.lowest)), x(fit.highest), y(power(fit.highest)), 3);
  }
  drawing.no_clip();
}

std::string legend_text(const SpectrumCurve& curve) {
  const PowerSpectrum::Fit& fit = curve.spectrum.fit;
  if (!std::isfinite(fit.slope)) return curve.label;
  // A real minus sign.
  return fmt::format("{}{}slope {}{:.2f} ± {:.2f}", curve.label, curve.label.empty() ? "" : ": ",
                     fit.slope < 0 ? "−" : "", std::fabs(fit.slope), fit.slope_error);
}

void draw_legend(Drawing& drawing, const Axis& x, const Axis& y,
                 std::span<const SpectrumCurve> curves) {
  double widest = 0;
  for (const SpectrumCurve& curve : curves) {
    widest = std::max(widest, drawing.text_width(legend_text(curve)));
  }
  const double left = x.last - font_size - widest;
  double baseline = y.last + 1.8 * font_size;
  for (std::size_t i = 0; i < curves.size(); ++i, baseline += 1.4 * font_size) {
    const std::string text = legend_text(curves[i]);
    if (text.empty()) continue;
    drawing.colour(okabe_ito[i % okabe_ito.size()]);
    drawing.line(left - 1.7 * font_size, baseline - font_size / 3, left - 0.4 * font_size,
                 baseline - font_size / 3, 3);
    drawing.colour(black);
    drawing.text(text, left, baseline);
  }
}

}  // namespace

void write_spectrum_plot(const std::filesystem::path& path, std::span<const SpectrumCurve> curves,
                         const std::string& unit, bool overwrite) {
  double highest_k = 1;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const SpectrumCurve& curve : curves) {
    for (const PowerSpectrum::Annulus& annulus : curve.spectrum.annuli) {
      highest_k = std::max<double>(highest_k, annulus.k);
      if (!(annulus.power > 0) || !std::isfinite(annulus.power)) continue;
      least = std::min(least, annulus.power);
      most = std::max(most, annulus.power);
    }
  }
  if (!(most > 0)) least = most = 1;
  constexpr double room = 1.1, headroom = 3;
  const Axis x = {1 / room, highest_k * room, left_margin, plot_width - right_margin};
  Axis y = {least / room / room, most * headroom, spectrum_height - bottom_margin, top_margin};
  // The axis of a flat spectrum still needs numbers.
  constexpr double two_decades = 100;
  if (y.high / y.low < two_decades) {
    y.low = std::pow(10.0, std::floor(std::log10(y.low)));
    y.high = std::pow(10.0, std::ceil(std::log10(y.high)));
  }
  Drawing drawing(plot_width, spectrum_height);
  draw_axes(drawing, x, y, unit);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    draw_curve(drawing, x, y, curves[i].spectrum, okabe_ito[i % okabe_ito.size()]);
  }
  draw_legend(drawing, x, y, curves);
  drawing.write(path, overwrite);
}

}  // namespace gamer
