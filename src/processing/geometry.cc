#include "processing/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "core/no_value.h"
#include "processing/blocked_plane.h"

namespace gamer {
namespace {

// ---- Flip --------------------------------------------------------------------------------------

class FlippedPlane final : public Plane {
 public:
  FlippedPlane(PlanePtr source, FlipAxis axis)
      : Plane(source->width(), source->height()),
        source_(std::move(source)),
        in_x_(axis != FlipAxis::y),
        in_y_(axis != FlipAxis::x) {}

  Tile tile() const override { return source_->tile(); }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    Area from = area;
    if (in_x_) from.x = width() - area.x - area.width;
    if (in_y_) from.y = height() - area.y - area.height;
    source_->read(from, out, stride);
    if (in_x_) {
      for (int j = 0; j < area.height; ++j) {
        std::reverse(out + j * stride, out + j * stride + area.width);
      }
    }
    if (in_y_) {
      for (int j = 0; j < area.height / 2; ++j) {
        double* low = out + j * stride;
        std::swap_ranges(low, low + area.width, out + (area.height - 1 - j) * stride);
      }
    }
  }

 private:
  PlanePtr source_;
  bool in_x_, in_y_;
};

// ---- Crop and pad ------------------------------------------------------------------------------

class CroppedPlane final : public Plane {
 public:
  CroppedPlane(PlanePtr source, const Area& box)
      : Plane(box.width, box.height), source_(std::move(source)), box_(box) {}

  Tile tile() const override { return source_->tile(); }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    source_->read({area.x + box_.x, area.y + box_.y, area.width, area.height}, out, stride);
  }

 private:
  PlanePtr source_;
  Area box_;
};

int checked_sum(int size, int before, int after) {
  const long long sum = static_cast<long long>(size) + before + after;
  if (before < 0 || after < 0 || sum > std::numeric_limits<int>::max()) {
    throw std::invalid_argument("margins out of range");
  }
  return static_cast<int>(sum);
}

class PaddedPlane final : public Plane {
 public:
  PaddedPlane(PlanePtr source, const Margins& margins, double fill)
      : Plane(checked_sum(source->width(), margins.left, margins.right),
              checked_sum(source->height(), margins.bottom, margins.top)),
        source_(std::move(source)),
        x_(margins.left),
        y_(margins.bottom),
        fill_(fill) {}

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const int x1 = std::max(area.x, x_);
    const int x2 = std::min(area.x + area.width, x_ + source_->width());
    const int y1 = std::max(area.y, y_);
    const int y2 = std::min(area.y + area.height, y_ + source_->height());
    const bool touches = x1 < x2 && y1 < y2;
    for (int j = 0; j < area.height; ++j) {
      double* row = out + j * stride;
      const bool within = touches && area.y + j >= y1 && area.y + j < y2;
      std::fill(row, row + (within ? x1 - area.x : area.width), fill_);
      if (within) std::fill(row + (x2 - area.x), row + area.width, fill_);
    }
    if (!touches) return;
    source_->read({x1 - x_, y1 - y_, x2 - x1, y2 - y1},
                  out + (y1 - area.y) * stride + (x1 - area.x), stride);
  }

 private:
  PlanePtr source_;
  int x_, y_;
  double fill_;
};

// ---- Quarter turns -----------------------------------------------------------------------------

/// A plane turned by 90 degrees, counter-clockwise or clockwise.
class TurnedPlane final : public BlockedPlane {
 public:
  TurnedPlane(PlanePtr source, bool clockwise)
      : BlockedPlane(source->height(), source->width(), side_length),
        source_(std::move(source)),
        clockwise_(clockwise) {}

 private:
  static constexpr int side_length = 512;

  void read_block(const Area& area, double* out, std::ptrdiff_t stride,
                  std::vector<double>& values) const override {
    // Counter-clockwise, (x, y) comes from (y, width - 1 - x); clockwise from (height - 1 - y, x).
    Area from = {area.y, area.x, area.height, area.width};
    if (clockwise_) {
      from.x = height() - area.y - area.height;
    } else {
      from.y = width() - area.x - area.width;
    }
    values.resize(static_cast<std::size_t>(area.width) * area.height);
    source_->read(from, values.data());
    for (int j = 0; j < area.height; ++j) {
      double* row = out + j * stride;
      const double* column = values.data() + (clockwise_ ? area.height - 1 - j : j);
      for (int i = 0; i < area.width; ++i) {
        const int source_row = clockwise_ ? i : area.width - 1 - i;
        row[i] = column[static_cast<std::size_t>(source_row) * area.height];
      }
    }
  }

  PlanePtr source_;
  bool clockwise_;
};

/// Number of quarter turns within a circle, 0 to 3.
int turns_in_circle(int count) {
  constexpr int full_circle = 4;
  return (count % full_circle + full_circle) % full_circle;
}

// ---- Bin ---------------------------------------------------------------------------------------

int blocks(int size, int n) {
  if (n < 1 || n > size) throw std::invalid_argument("bins larger than the image");
  return size / n;
}

class BinnedPlane final : public Plane {
 public:
  BinnedPlane(PlanePtr source, int nx, int ny, PixelValues values)
      : Plane(blocks(source->width(), nx), blocks(source->height(), ny)),
        source_(std::move(source)),
        nx_(nx),
        ny_(ny),
        pixels_(static_cast<double>(nx) * ny),
        scale_(values == PixelValues::flux ? 1 : 1 / pixels_) {}

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    // The source is read in pieces of whole rows, for blocks of any size.
    const int width = area.width * nx_, rows = area.height * ny_;
    const int piece = std::clamp(piece_pixels / width, 1, rows);
    std::vector<double> values(static_cast<std::size_t>(width) * piece), sums(area.width);
    std::vector<long long> missing(area.width);
    for (int first = 0; first < rows; first += piece) {
      const int count = std::min(piece, rows - first);
      source_->read({area.x * nx_, area.y * ny_ + first, width, count}, values.data());
      for (int row = first; row < first + count; ++row) {
        add(values.data() + static_cast<std::size_t>(row - first) * width, sums, missing);
        if (row % ny_ == ny_ - 1) finish(sums, missing, out + row / ny_ * stride);
      }
    }
  }

 private:
  static constexpr int piece_pixels = 1 << 16;

  void add(const double* row, std::vector<double>& sums, std::vector<long long>& missing) const {
    for (std::size_t i = 0; i < sums.size(); ++i, row += nx_) {
      double sum = 0;
      for (int k = 0; k < nx_; ++k) sum += row[k];
      if (std::isnan(sum)) {
        sum = 0;
        for (int k = 0; k < nx_; ++k) {
          const bool is_missing = std::isnan(row[k]);
          missing[i] += is_missing ? 1 : 0;
          if (!is_missing) sum += row[k];
        }
      }
      sums[i] += sum;
    }
  }

  void finish(std::vector<double>& sums, std::vector<long long>& missing, double* out) const {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const auto lost = static_cast<double>(missing[i]);
      out[i] = sums[i] * scale_;
      if (lost >= missing_share * pixels_) {
        out[i] = no_value;
      } else if (lost > 0) {
        out[i] *= pixels_ / (pixels_ - lost);
      }
    }
    std::ranges::fill(sums, 0);
    std::ranges::fill(missing, 0);
  }

  PlanePtr source_;
  int nx_, ny_;
  double pixels_, scale_;
};

}  // namespace

PlanePtr flip(PlanePtr source, FlipAxis axis) {
  return std::make_shared<FlippedPlane>(std::move(source), axis);
}

PixelMap flip_map(int width, int height, FlipAxis axis) {
  PixelMap map;
  if (axis != FlipAxis::y) {
    map.xx = -1;
    map.x0 = width + 1.0;
  }
  if (axis != FlipAxis::x) {
    map.yy = -1;
    map.y0 = height + 1.0;
  }
  return map;
}

PlanePtr crop(PlanePtr source, const Area& box) {
  const bool is_within = box.x >= 0 && box.y >= 0 && box.width >= 1 && box.height >= 1 &&
                         box.width <= source->width() - box.x &&
                         box.height <= source->height() - box.y;
  if (!is_within) throw std::invalid_argument("a box that reaches outside the image");
  return std::make_shared<CroppedPlane>(std::move(source), box);
}

PixelMap crop_map(const Area& box) {
  return {.x0 = -static_cast<double>(box.x), .y0 = -static_cast<double>(box.y)};
}

PlanePtr pad(PlanePtr source, const Margins& margins, double fill) {
  return std::make_shared<PaddedPlane>(std::move(source), margins, fill);
}

PixelMap pad_map(const Margins& margins) {
  return {.x0 = static_cast<double>(margins.left), .y0 = static_cast<double>(margins.bottom)};
}

Area box_about(const PixelPosition& middle, int width, int height) {
  // Pixel 1 has its centre at 1.
  const auto first = [](double at, int length) {
    return static_cast<int>(std::floor(at - 0.5 * (length + 1) + 0.5));
  };
  return {first(middle.x, width), first(middle.y, height), width, height};
}

PlanePtr window(PlanePtr source, const Area& box, double fill) {
  const int left = std::max(0, -box.x), bottom = std::max(0, -box.y);
  const int right = std::max(0, box.x + box.width - source->width());
  const int top = std::max(0, box.y + box.height - source->height());
  const Area common = {box.x + left, box.y + bottom, box.width - left - right,
                       box.height - bottom - top};
  PlanePtr part = crop(std::move(source), common);
  if (left == 0 && bottom == 0 && right == 0 && top == 0) return part;
  return pad(std::move(part), {left, right, bottom, top}, fill);
}

PlanePtr quarter_turns(PlanePtr source, int count) {
  switch (turns_in_circle(count)) {
    case 0: return source;
    case 1: return std::make_shared<TurnedPlane>(std::move(source), false);
    case 2: return flip(std::move(source), FlipAxis::both);
    default: return std::make_shared<TurnedPlane>(std::move(source), true);
  }
}

PixelMap quarter_turns_map(int width, int height, int count) {
  switch (turns_in_circle(count)) {
    case 0: return {};
    case 1: return {0, -1, 1, 0, height + 1.0, 0};
    case 2: return flip_map(width, height, FlipAxis::both);
    default: return {0, 1, -1, 0, 0, width + 1.0};
  }
}

PlanePtr bin(PlanePtr source, int nx, int ny, PixelValues values) {
  return std::make_shared<BinnedPlane>(std::move(source), nx, ny, values);
}

PixelMap bin_map(int nx, int ny) {
  // The lower left corner, (1/2, 1/2), is fixed.
  constexpr double corner_offset = 0.5;
  return {1.0 / nx,
          0,
          0,
          1.0 / ny,
          corner_offset - corner_offset / nx,
          corner_offset - corner_offset / ny};
}

}  // namespace gamer
