#include "processing/profile_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "processing/drawing.h"

namespace gamer {
namespace {

constexpr int profile_height = 1200;
constexpr double left_side = 130, right_side = 1160;
constexpr double profile_dot = 3.5;

/// A linear axis: values `low` to `high` at pixels `first` to `last`.
struct LinearScale {
  double low, high, first, last;

  double operator()(double value) const {
    return first + (last - first) * (value - low) / (high - low);
  }
};

/// Step of 1, 2 or 5 times a power of ten that gives about `count` ticks.
double tick_step(double range, int count) {
  const double rough = range / count, power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1, 2, 5}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10 * power;
}

/// The frame of one panel, with ticks, numbers and its title.
void draw_frame(Drawing& drawing, const LinearScale& x, const LinearScale& y,
                const std::string& title, bool has_numbers_below) {
  const double x_step = tick_step(x.high - x.low, 8);
  for (int i = static_cast<int>(std::ceil(x.low / x_step)); i * x_step <= x.high; ++i) {
    const double value = i * x_step;
    drawing.colour(grey);
    drawing.line(x(value), y.first, x(value), y.last, 1);
    drawing.colour(black);
    if (has_numbers_below) {
      drawing.text(fmt::format("{:g}", value), x(value), y.first + 1.3 * font_size, 0.5);
    }
  }
  const double low = std::min(y.low, y.high), high = std::max(y.low, y.high);
  const double y_step = tick_step(high - low, 5);
  for (int i = static_cast<int>(std::ceil(low / y_step)); i * y_step <= high; ++i) {
    const double value = i * y_step;
    drawing.colour(grey);
    drawing.line(x.first, y(value), x.last, y(value), 1);
    drawing.colour(black);
    drawing.text(fmt::format("{:g}", value), x.first - 10, y(value) + font_size / 3, 1);
  }
  drawing.box(x.first, y.last, x.last, y.first);
  drawing.outline(1.5);
  drawing.text_upwards(title, 1.5 * font_size, (y.first + y.last) / 2);
}

/// The scale of a panel that holds the values, with some room.
LinearScale panel(const std::vector<double>& values, double bottom, double top, bool is_inverted) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (!(high >= low)) low = high = 0;
  const double room = std::max(0.06 * (high - low), 1e-3 * std::max(1.0, std::fabs(high)));
  return is_inverted ? LinearScale{high + room, low - room, bottom, top}
                     : LinearScale{low - room, high + room, bottom, top};
}

void draw_disk(Drawing& drawing, const LinearScale& x, const LinearScale& y,
               const ProfileCurve& curve) {
  const DiskFit& disk = *curve.disk;
  constexpr double magnitudes_per_e = 1.085736204758129;
  const auto magnitude = [&](double r) {
    const bool is_outer = disk.type != DiskFit::Type::one && r > disk.break_radius;
    const double depth =
        is_outer ? disk.break_radius / disk.inner_scale + (r - disk.break_radius) / disk.outer_scale
                 : r / disk.inner_scale;
    return curve.zero_point + magnitudes_per_e * (depth - std::log(disk.central));
  };
  drawing.box(x.first, y.last, x.last, y.first);
  drawing.clip();
  const double corner = disk.type == DiskFit::Type::one ? x.high : disk.break_radius;
  drawing.line(x(0), y(magnitude(0)), x(corner), y(magnitude(corner)), 2);
  drawing.line(x(corner), y(magnitude(corner)), x(x.high), y(magnitude(x.high)), 2);
  drawing.no_clip();
}

void draw_labels(Drawing& drawing, const std::vector<ProfileCurve>& curves) {
  double baseline = 40 + 1.8 * font_size;
  for (std::size_t i = 0; i < curves.size(); ++i, baseline += 1.4 * font_size) {
    if (curves[i].label.empty()) continue;
    drawing.colour(okabe_ito[i % okabe_ito.size()]);
    drawing.text(curves[i].label, right_side - font_size, baseline, 1);
  }
}

}  // namespace

void write_profile_plot(const std::filesystem::path& path, const std::vector<ProfileCurve>& curves,
                        const std::vector<double>& angles, const std::string& unit,
                        bool overwrite) {
  Drawing drawing(plot_width, profile_height);
  const std::vector<Isophote>& shapes = curves.front().isophotes;
  const double outer = shapes.empty() ? 1 : shapes.back().radius;
  const LinearScale x = {0, 1.03 * outer, left_side, right_side};
  std::vector<double> magnitudes, ellipticities;
  for (const ProfileCurve& curve : curves) {
    magnitudes.insert(magnitudes.end(), curve.magnitudes.begin(), curve.magnitudes.end());
  }
  for (const Isophote& shape : shapes) ellipticities.push_back(1 - shape.axis_ratio);
  const LinearScale brightness = panel(magnitudes, 680, 40, true);
  const LinearScale ellipticity = panel(ellipticities, 900, 700, false);
  const LinearScale angle = panel(angles, 1105, 920, false);
  draw_frame(drawing, x, brightness, unit, false);
  draw_frame(drawing, x, ellipticity, "ellipticity", false);
  draw_frame(drawing, x, angle, "angle (deg)", true);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    drawing.colour(okabe_ito[i % okabe_ito.size()]);
    for (std::size_t j = 0; j < curves[i].magnitudes.size(); ++j) {
      const double value = curves[i].magnitudes[j];
      if (std::isfinite(value)) {
        drawing.dot(x(curves[i].isophotes[j].radius), brightness(value), profile_dot);
      }
    }
    if (curves[i].disk) draw_disk(drawing, x, brightness, curves[i]);
  }
  drawing.colour(okabe_ito[0]);
  for (std::size_t j = 0; j < shapes.size(); ++j) {
    drawing.dot(x(shapes[j].radius), ellipticity(ellipticities[j]), profile_dot);
    drawing.dot(x(shapes[j].radius), angle(angles[j]), profile_dot);
  }
  draw_labels(drawing, curves);
  drawing.colour(black);
  drawing.text("semi-major axis (pixels)", (x.first + x.last) / 2, profile_height - font_size, 0.5);
  drawing.write(path, overwrite);
}

}  // namespace gamer
