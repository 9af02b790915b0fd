#include "processing/rotate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/no_value.h"
#include "processing/blocked_plane.h"
#include "processing/geometry.h"

namespace gamer {
namespace {

constexpr double right_angle = 90, full_circle = 360;

/// Number of quarter turns, 0 to 3, where the angle is a multiple of 90 degrees.
std::optional<int> quarter_count(double angle) {
  const double quarters = std::fmod(angle, full_circle) / right_angle;
  if (quarters != std::round(quarters)) return std::nullopt;
  return static_cast<int>(quarters);
}

struct Turn {
  double cosine, sine;

  explicit Turn(double angle) {
    constexpr double half_circle = 180;
    const double radians = std::fmod(angle, full_circle) * std::numbers::pi / half_circle;
    cosine = std::cos(radians);
    sine = std::sin(radians);
  }
};

/// std::floor() without a call.
int whole_part(double x) {
  const int toward_zero = static_cast<int>(x);
  return toward_zero - (x < toward_zero ? 1 : 0);
}

/// Table of interpolation weights, of sum 1, of the pixels around a place between pixels.
class KernelTable {
 public:
  explicit KernelTable(Kernel kernel)
      : taps_(std::max(1, static_cast<int>(2 * kernel_radius(kernel)))) {
    weights_.resize(static_cast<std::size_t>(phases + 2) * taps_);
    // A fraction may round to 1, which needs one more row.
    for (int phase = 0; phase <= phases + 1; ++phase) {
      const std::vector<double> row =
          taps_ == 1 ? std::vector<double>{1}
                     : interpolation_weights(kernel, phase / phases, 1, 1 - taps_ / 2, taps_);
      std::ranges::copy(row, &weights_[static_cast<std::size_t>(phase) * taps_]);
    }
  }

  int taps() const { return taps_; }

  /// Weights of pixels floor(x) - taps/2 + 1... for the fraction of x. They are interpolated
  /// linearly between table rows. The error is the second derivative / (8 phases^2), at most 4e-8.
  template <int Taps>
  void weights(double fraction, double* out) const {
    const double place = fraction * phases;
    const auto row = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(row);
    const double* low = &weights_[row * Taps];
    for (int i = 0; i < Taps; ++i) out[i] = low[i] + part * (low[Taps + i] - low[i]);
  }

 private:
  static constexpr double phases = 4096;

  int taps_;
  std::vector<double> weights_;
};

class RotatedPlane final : public BlockedPlane {
 public:
  RotatedPlane(PlanePtr source, const Rotation& rotation, const PlaneSize& size)
      : BlockedPlane(size.width, size.height, side_length),
        source_(std::move(source)),
        table_(rotation.kernel),
        turn_(rotation.angle),
        fill_(rotation.fill) {}

 private:
  static constexpr int side_length = 256;

  struct Point {
    double x, y;
  };
  /// Place in the source of an output pixel's centre; both are counted from 0.
  Point source_place(double x, double y) const {
    const double dx = x - 0.5 * (width() - 1), dy = y - 0.5 * (height() - 1);
    return {turn_.cosine * dx + turn_.sine * dy + 0.5 * (source_->width() - 1),
            turn_.cosine * dy - turn_.sine * dx + 0.5 * (source_->height() - 1)};
  }

  /// Source pixels with a weight in the block's pixels; some may be outside the source.
  Area reach(const Area& block) const {
    double x1 = std::numeric_limits<double>::infinity(), y1 = x1, x2 = -x1, y2 = -x1;
    for (const int x : {block.x, block.x + block.width - 1}) {
      for (const int y : {block.y, block.y + block.height - 1}) {
        const Point place = source_place(x, y);
        x1 = std::min(x1, place.x);
        x2 = std::max(x2, place.x);
        y1 = std::min(y1, place.y);
        y2 = std::max(y2, place.y);
      }
    }
    const int margin = table_.taps() / 2 + 1;
    const auto first = [&](double low) { return static_cast<int>(std::floor(low)) - margin; };
    const auto size = [&](double low, double high) {
      return static_cast<int>(std::floor(high)) + margin + 1 - first(low);
    };
    return {first(x1), first(y1), size(x1, x2), size(y1, y2)};
  }

  void read_block(const Area& block, double* out, std::ptrdiff_t stride,
                  std::vector<double>& values) const override {
    const Area from = reach(block);
    // The part of the source within reach, with a margin.
    const int x1 = std::clamp(from.x, 0, source_->width());
    const int x2 = std::clamp(from.x + from.width, 0, source_->width());
    const int y1 = std::clamp(from.y, 0, source_->height());
    const int y2 = std::clamp(from.y + from.height, 0, source_->height());
    if (x1 >= x2 || y1 >= y2) {
      for (int j = 0; j < block.height; ++j) std::fill_n(out + j * stride, block.width, fill_);
      return;
    }
    const bool is_inside = x2 - x1 == from.width && y2 - y1 == from.height;
    const std::size_t count = static_cast<std::size_t>(from.width) * from.height;
    if (is_inside) {
      values.resize(count);
    } else {
      values.assign(count, fill_);
    }
    source_->read(
        {x1, y1, x2 - x1, y2 - y1},
        values.data() + static_cast<std::ptrdiff_t>(y1 - from.y) * from.width + (x1 - from.x),
        from.width);
    constexpr int bilinear = 2, bicubic = 4, lanczos3_width = 6;
    switch (table_.taps()) {
      case 1: return take_nearest(block, out, stride, values, from);
      case bilinear: return interpolate<bilinear>(block, out, stride, values, from);
      case bicubic: return interpolate<bicubic>(block, out, stride, values, from);
      case lanczos3_width: return interpolate<lanczos3_width>(block, out, stride, values, from);
      default:
        constexpr int lanczos5_width = 10;
        return interpolate<lanczos5_width>(block, out, stride, values, from);
    }
  }

  /// Calls use(j, i, place) for the pixels of a block. Small squares keep the source's pixels in
  /// the cache.
  template <class Use>
  void for_each_place(const Area& block, Use use) const {
    constexpr int square = 32;
    for (int y = 0; y < block.height; y += square) {
      for (int x = 0; x < block.width; x += square) {
        const int y2 = std::min(y + square, block.height), x2 = std::min(x + square, block.width);
        for (int j = y; j < y2; ++j) {
          for (int i = x; i < x2; ++i) use(j, i, source_place(block.x + i, block.y + j));
        }
      }
    }
  }

  void take_nearest(const Area& block, double* out, std::ptrdiff_t stride,
                    const std::vector<double>& values, const Area& from) const {
    for_each_place(block, [&](int j, int i, const Point& place) {
      const int x = whole_part(place.x + 0.5) - from.x;
      const int y = whole_part(place.y + 0.5) - from.y;
      out[j * stride + i] = values[static_cast<std::size_t>(y) * from.width + x];
    });
  }

  template <int Taps>
  void interpolate(const Area& block, double* out, std::ptrdiff_t stride,
                   const std::vector<double>& values, const Area& from) const {
    for_each_place(block, [&](int j, int i, const Point& place) {
      const int x = whole_part(place.x), y = whole_part(place.y);
      double wx[Taps], wy[Taps];
      table_.weights<Taps>(place.x - x, wx);
      table_.weights<Taps>(place.y - y, wy);
      constexpr int before = Taps / 2 - 1;
      const double* first = values.data() +
                            static_cast<std::ptrdiff_t>(y - before - from.y) * from.width +
                            (x - before - from.x);
      // Columns are summed first, since they are independent.
      double columns[Taps] = {};
      for (int l = 0; l < Taps; ++l) {
        const double* row = first + static_cast<std::ptrdiff_t>(l) * from.width;
        for (int k = 0; k < Taps; ++k) columns[k] += wy[l] * row[k];
      }
      double sum = 0;
      for (int k = 0; k < Taps; ++k) sum += wx[k] * columns[k];
      if (std::isnan(sum)) sum = sum_of_present<Taps>(wx, wy, first, from.width);
      out[j * stride + i] = sum;
    });
  }

  template <int Taps>
  static double sum_of_present(const double* wx, const double* wy, const double* first,
                               std::ptrdiff_t stride) {
    double sum = 0, present = 0, lost = 0;
    for (int l = 0; l < Taps; ++l) {
      for (int k = 0; k < Taps; ++k) {
        const double weight = wx[k] * wy[l], value = first[l * stride + k];
        if (weight == 0) continue;
        if (std::isnan(value)) {
          lost += std::abs(weight);
        } else {
          present += weight;
          sum += weight * value;
        }
      }
    }
    if (lost >= missing_share) return no_value;
    return sum / present;
  }

  PlanePtr source_;
  KernelTable table_;
  Turn turn_;
  double fill_;
};

}  // namespace

PlaneSize rotated_size(int width, int height, const Rotation& rotation) {
  if (!std::isfinite(rotation.angle)) throw std::invalid_argument("an angle that is not finite");
  if (const auto quarters = quarter_count(rotation.angle)) {
    return *quarters % 2 == 0 ? PlaneSize{width, height} : PlaneSize{height, width};
  }
  if (!rotation.full_canvas) return {width, height};
  const Turn turn(rotation.angle);
  const auto whole = [](double size) {
    constexpr double rounding_error = 1e-9;
    const double pixels = std::ceil(size * (1 - rounding_error));
    if (pixels > std::numeric_limits<int>::max()) throw std::invalid_argument("too large a canvas");
    return static_cast<int>(pixels);
  };
  return {whole(std::abs(width * turn.cosine) + std::abs(height * turn.sine)),
          whole(std::abs(width * turn.sine) + std::abs(height * turn.cosine))};
}

PixelMap rotation_map(int width, int height, const Rotation& rotation) {
  if (const auto quarters = quarter_count(rotation.angle)) {
    return quarter_turns_map(width, height, *quarters);
  }
  const PlaneSize size = rotated_size(width, height, rotation);
  const Turn turn(rotation.angle);
  PixelMap map = {turn.cosine, -turn.sine, turn.sine, turn.cosine, 0, 0};
  const PixelPosition middle = map({0.5 * (width + 1), 0.5 * (height + 1)});
  map.x0 = 0.5 * (size.width + 1) - middle.x;
  map.y0 = 0.5 * (size.height + 1) - middle.y;
  return map;
}

PlanePtr rotate(PlanePtr source, const Rotation& rotation) {
  if (rotation.kernel == Kernel::area) throw std::invalid_argument("no kernel of a rotation");
  const PlaneSize size = rotated_size(source->width(), source->height(), rotation);
  if (const auto quarters = quarter_count(rotation.angle)) {
    return quarter_turns(std::move(source), *quarters);
  }
  return std::make_shared<RotatedPlane>(std::move(source), rotation, size);
}

}  // namespace gamer
