#include "processing/resample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/no_value.h"

namespace gamer {
namespace {

// ---- Weights along one axis --------------------------------------------------------------------

/// The kernel that interpolates the running sum.
class SumKernel {
 public:
  SumKernel(Kernel kernel, double step) : kernel_(kernel) {
    switch (kernel) {
      case Kernel::area:
        kernel_ = Kernel::bilinear;
        radius_ = 1;
        break;
      case Kernel::bilinear:
        is_spline_ = true;
        radius_ = spline_radius;
        break;
      default: scale_ = std::max(1.0, step); radius_ = kernel_radius(kernel) * scale_;
    }
  }

  double radius() const { return radius_; }

  /// Weights of the edges `first`, `first` + 1... in the running sum at x.
  std::vector<double> edge_weights(double x, int first, int count) const {
    if (!is_spline_) return interpolation_weights(kernel_, x, scale_, first, count);
    std::vector<double> weights(count);
    for (int i = 0; i < count; ++i) weights[i] = quadratic_spline(std::abs(first + i - x));
    return weights;
  }

 private:
  static constexpr double spline_radius = 1.5;

  static double quadratic_spline(double d) {
    if (d < 0.5) return 0.75 - d * d;
    return d < spline_radius ? 0.5 * (spline_radius - d) * (spline_radius - d) : 0;
  }

  Kernel kernel_;
  bool is_spline_ = false;
  double scale_ = 1, radius_ = 0;
};

/// Weights of input pixels, for each output pixel along one axis.
class AxisWeights {
 public:
  struct Row {
    int first = 0, count = 0;
    const double* weights = nullptr;
    double sum = 0;
  };

  AxisWeights(int input, int output, double first, double step, Kernel kernel, bool is_brightness)
      : input_(input) {
    const SumKernel sum_kernel(kernel, step);
    starts_.push_back(0);
    for (int i = 0; i < output; ++i) {
      // Clamped to the input's edges, which the outermost pixels must reach despite rounding.
      const auto end = static_cast<double>(input);
      const double low = i == 0 ? 0 : std::clamp(first + i * step, 0.0, end);
      const double high = i == output - 1 ? end : std::clamp(first + (i + 1) * step, 0.0, end);
      if (kernel == Kernel::nearest) {
        append_nearest(low, high);
      } else {
        append(sum_kernel, low, high);
      }
      if (is_brightness) {
        for (std::size_t k = starts_.back(); k < weights_.size(); ++k) weights_[k] /= sums_.back();
        sums_.back() = 1;
      }
      starts_.push_back(weights_.size());
    }
  }

  Row row(int output) const {
    const auto i = static_cast<std::size_t>(output);
    return {firsts_[i], static_cast<int>(starts_[i + 1] - starts_[i]), &weights_[starts_[i]],
            sums_[i]};
  }

  /// Range (begin, end) of the input pixels that outputs [first, first + count) need.
  std::pair<int, int> reach(int first, int count) const {
    int begin = input_, end = 0;
    for (int i = first; i < first + count; ++i) {
      const Row r = row(i);
      begin = std::min(begin, r.first);
      end = std::max(end, r.first + r.count);
    }
    return {begin, end};
  }

 private:
  void append_nearest(double low, double high) {
    firsts_.push_back(std::min(static_cast<int>(0.5 * (low + high)), input_ - 1));
    weights_.push_back(high - low);
    sums_.push_back(high - low);
  }

  void append(const SumKernel& kernel, double low, double high) {
    // Only pixels in [begin, end[ add to the difference.
    const int begin = static_cast<int>(std::floor(low - kernel.radius()));
    const int end = static_cast<int>(std::ceil(high + kernel.radius()));
    std::vector<double> pixels(end - begin);
    const auto add = [&](double x, double sign) {
      const std::vector<double> edges = kernel.edge_weights(x, begin, end - begin + 1);
      // A pixel is part of the running sum at all edges above it.
      double above = 0;
      for (int i = end - begin - 1; i >= 0; --i) {
        above += edges[i + 1];
        pixels[i] += sign * above;
      }
    };
    add(high, 1);
    add(low, -1);
    std::vector<double> folded(input_ < end - begin ? input_ : end - begin);
    // A pixel outside the input counts as its mirror image, which is as far inside the edge.
    // `folded` therefore needs no more pixels than the kernel's range or the input.
    const int first = std::clamp(begin, 0, input_ - static_cast<int>(folded.size()));
    for (int i = begin; i < end; ++i) folded[mirrored(i) - first] += pixels[i - begin];
    trim(folded, first);
    sums_.push_back(high - low);
  }

  int mirrored(int pixel) const {
    const int period = 2 * input_;
    const int place = (pixel % period + period) % period;
    return place < input_ ? place : period - 1 - place;
  }

  /// Appends the weights without rounding errors at the ends.
  void trim(const std::vector<double>& pixels, int first) {
    constexpr double rounding_error = 4e-15;
    double most = 0;
    for (const double weight : pixels) most = std::max(most, std::abs(weight));
    const auto counts = [&](double weight) { return std::abs(weight) > rounding_error * most; };
    const auto from = std::ranges::find_if(pixels, counts);
    const auto to = std::find_if(pixels.rbegin(), pixels.rend(), counts).base();
    firsts_.push_back(first + static_cast<int>(from - pixels.begin()));
    weights_.insert(weights_.end(), from, to);
  }

  int input_;
  std::vector<int> firsts_;
  std::vector<std::size_t> starts_;
  std::vector<double> weights_, sums_;
};

// ---- The plane ---------------------------------------------------------------------------------

class ResampledPlane final : public Plane {
 public:
  ResampledPlane(PlanePtr source, const ResampleGrid& grid, Kernel kernel, PixelValues values)
      : Plane(grid.width, grid.height),
        source_(std::move(source)),
        columns_(source_->width(), grid.width, grid.first_x, grid.step_x, kernel,
                 values == PixelValues::brightness),
        rows_(source_->height(), grid.height, grid.first_y, grid.step_y, kernel,
              values == PixelValues::brightness) {}

  /// Tiles have enough rows that the overlap of neighbouring tiles, the kernel's reach, costs
  /// little.
  Tile tile() const override {
    constexpr int least_rows = 64;
    const Tile usual = Plane::tile();
    return {usual.width, std::min(std::max(usual.height, least_rows), height())};
  }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const auto [x1, x2] = columns_.reach(area.x, area.width);
    const auto [y1, y2] = rows_.reach(area.y, area.height);
    const std::vector<std::vector<Share>> shares = shares_of(area, y1, y2);
    for (int j = 0; j < area.height; ++j) std::fill_n(out + j * stride, area.width, 0.0);
    Missing missing;
    // The source is read in pieces of whole rows, for any number that an output row needs.
    const int width = x2 - x1, piece = std::clamp(piece_pixels / width, 1, y2 - y1);
    std::vector<double> values(static_cast<std::size_t>(width) * piece), row(area.width);
    for (int y = y1; y < y2; y += piece) {
      const int count = std::min(piece, y2 - y);
      source_->read({x1, y, width, count}, values.data());
      for (int k = 0; k < count; ++k) {
        double* from = values.data() + static_cast<std::size_t>(k) * width;
        const std::vector<Share>& to = shares[static_cast<std::size_t>(y + k - y1)];
        if (std::any_of(from, from + width, [](double v) { return std::isnan(v); })) {
          take_missing(area, x1, from, width, to, missing);
        }
        along_x(area, x1, from, row);
        for (const Share& share : to) {
          double* target = out + share.row * stride;
          for (int i = 0; i < area.width; ++i) target[i] += share.weight * row[i];
        }
      }
    }
    if (!missing.weight.empty()) finish(area, missing, out, stride);
  }

 private:
  static constexpr int piece_pixels = 1 << 16;

  /// Contribution of a source row to an output row of the area.
  struct Share {
    int row;
    double weight;
  };
  /// Sums of the missing pixels' weights and of the weights' absolute values; empty for none.
  struct Missing {
    std::vector<double> weight, size;
  };

  std::vector<std::vector<Share>> shares_of(const Area& area, int begin, int end) const {
    std::vector<std::vector<Share>> shares(static_cast<std::size_t>(end - begin));
    for (int j = 0; j < area.height; ++j) {
      const AxisWeights::Row row = rows_.row(area.y + j);
      for (int k = 0; k < row.count; ++k) {
        shares[static_cast<std::size_t>(row.first + k - begin)].push_back({j, row.weights[k]});
      }
    }
    return shares;
  }

  void along_x(const Area& area, int x1, const double* from, std::vector<double>& out) const {
    for (int i = 0; i < area.width; ++i) {
      const AxisWeights::Row row = columns_.row(area.x + i);
      const double* pixels = from + (row.first - x1);
      double sum = 0;
      for (int k = 0; k < row.count; ++k) sum += row.weights[k] * pixels[k];
      out[i] = sum;
    }
  }

  /// Adds the weights of a row's missing pixels and sets their values to 0.
  void take_missing(const Area& area, int x1, double* from, int width,
                    const std::vector<Share>& shares, Missing& missing) const {
    const std::size_t pixels = static_cast<std::size_t>(area.width) * area.height;
    missing.weight.resize(pixels);
    missing.size.resize(pixels);
    std::vector<double> weight(area.width), size(area.width);
    for (int i = 0; i < area.width; ++i) {
      const AxisWeights::Row row = columns_.row(area.x + i);
      for (int k = 0; k < row.count; ++k) {
        if (!std::isnan(from[row.first - x1 + k])) continue;
        weight[i] += row.weights[k];
        size[i] += std::abs(row.weights[k]);
      }
    }
    for (const Share& share : shares) {
      const std::size_t first = static_cast<std::size_t>(share.row) * area.width;
      for (int i = 0; i < area.width; ++i) {
        missing.weight[first + i] += share.weight * weight[i];
        missing.size[first + i] += std::abs(share.weight) * size[i];
      }
    }
    std::replace_if(
        from, from + width, [](double v) { return std::isnan(v); }, 0.0);
  }

  void finish(const Area& area, const Missing& missing, double* out, std::ptrdiff_t stride) const {
    for (int j = 0; j < area.height; ++j) {
      const double row_sum = rows_.row(area.y + j).sum;
      for (int i = 0; i < area.width; ++i) {
        const double all = row_sum * columns_.row(area.x + i).sum;
        const std::size_t index = static_cast<std::size_t>(j) * area.width + i;
        double& value = out[j * stride + i];
        if (missing.size[index] >= missing_share * all) {
          value = no_value;
        } else if (missing.size[index] > 0) {
          value *= all / (all - missing.weight[index]);
        }
      }
    }
  }

  PlanePtr source_;
  AxisWeights columns_, rows_;
};

}  // namespace

ResampleGrid grid_of_factor(int width, int height, double factor) {
  if (!(factor > 0) || !std::isfinite(factor) || !std::isfinite(1 / factor)) {
    throw std::invalid_argument("a factor that is not positive");
  }
  const auto whole = [&](int size) {
    // A side that exceeds a whole number by less than this counts as whole.
    constexpr double rounding_error = 1e-6;
    const double pixels = std::max(1.0, std::ceil(size * factor - rounding_error));
    if (pixels > std::numeric_limits<int>::max()) throw std::invalid_argument("too large a factor");
    return static_cast<int>(pixels);
  };
  ResampleGrid grid = {whole(width), whole(height), 1 / factor, 1 / factor, 0, 0};
  grid.first_x = 0.5 * (width - grid.width * grid.step_x);
  grid.first_y = 0.5 * (height - grid.height * grid.step_y);
  return grid;
}

ResampleGrid grid_of_size(int input_width, int input_height, int width, int height) {
  if (width < 1 || height < 1) throw std::invalid_argument("an image without pixels");
  return {width,
          height,
          static_cast<double>(input_width) / width,
          static_cast<double>(input_height) / height,
          0,
          0};
}

PixelMap resample_map(const ResampleGrid& grid) {
  // Pixel 1 begins at coordinate 1/2.
  constexpr double corner_offset = 0.5;
  return {1 / grid.step_x,
          0,
          0,
          1 / grid.step_y,
          corner_offset - (corner_offset + grid.first_x) / grid.step_x,
          corner_offset - (corner_offset + grid.first_y) / grid.step_y};
}

PlanePtr resample(PlanePtr source, const ResampleGrid& grid, Kernel kernel, PixelValues values) {
  return std::make_shared<ResampledPlane>(std::move(source), grid, kernel, values);
}

}  // namespace gamer
