#include "image/convolution/convolution.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/no_value.h"
#include "image/convolution/fft.h"

namespace gamer {
namespace {

/// Stamps of up to this many pixels are summed directly, which is quicker than two transforms.
constexpr int direct_pixels = 25;
/// Least share of the stamp's sum that good pixels must have for a result.
constexpr double least_weight = 1e-3;
/// Largest side of an automatic transform, unless the stamp needs more: 32 MiB a thread.
constexpr int largest_chosen_transform = 2048;

/// Rounding error of a convolution by transforms, relative to the sum of the stamp.
template <class Real>
inline constexpr double rounding_error = 64 * std::numeric_limits<Real>::epsilon();

/// A stamp prepared for the computation: its pixels, or their transform multiplied by the 1/N of
/// the inverse transform.
template <class Real>
struct ConvolutionKernel {
  Stamp stamp;  ///< has no pixels where there is a transform
  double sum = 0;
  std::optional<Buffer<Real>> transform;
};

/// The kernels used last, for all planes.
class KernelCache {
 public:
  static KernelCache& get() {
    static KernelCache cache;
    return cache;
  }

  std::shared_ptr<const void> find(const void* owner) {
    const std::lock_guard lock(mutex_);
    const auto entry =
        std::ranges::find_if(entries_, [owner](const Entry& e) { return e.owner == owner; });
    if (entry == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, entry);
    return entries_.front().kernel;
  }

  void insert(const void* owner, std::shared_ptr<const void> kernel) {
    const std::lock_guard lock(mutex_);
    entries_.push_front({owner, std::move(kernel)});
    if (entries_.size() > most_value) entries_.pop_back();
  }

  void remove(const void* owner) {
    const std::lock_guard lock(mutex_);
    entries_.remove_if([owner](const Entry& e) { return e.owner == owner; });
  }

 private:
  static constexpr std::size_t most_value = 4;
  struct Entry {
    const void* owner;
    std::shared_ptr<const void> kernel;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;
};

void check_size(int width, int height) {
  const auto is_odd = [](int n) { return n > 0 && n % 2 == 1; };
  if (!is_odd(width) || !is_odd(height)) throw std::invalid_argument("a stamp with even sides");
}

void check_stamp(const Stamp& stamp) {
  check_size(stamp.width, stamp.height);
  if (stamp.values.size() !=
      static_cast<std::size_t>(stamp.width) * static_cast<std::size_t>(stamp.height)) {
    throw std::invalid_argument("a stamp's values are not width * height");
  }
  if (!std::ranges::all_of(stamp.values, [](double v) { return std::isfinite(v); })) {
    throw std::invalid_argument("a stamp's values are not finite");
  }
}

/// Multiplies `count`/2 complex numbers.
template <class Real>
void multiply(const Real* factors, std::size_t count, Real* values) {
  for (std::size_t i = 0; i < count; i += 2) {
    const Real re = values[i], im = values[i + 1];
    values[i] = re * factors[i] - im * factors[i + 1];
    values[i + 1] = re * factors[i + 1] + im * factors[i];
  }
}

/// Largest binary exponent of a tile's largest value; beyond it sums overflow. Below its negative,
/// small values lose digits.
template <class Real>
inline constexpr int most_exponent = std::numeric_limits<Real>::max_exponent / 2;

/// The exponent n for which 2^n brings a tile's largest value into the range of transforms.
template <class Real>
int scaling_exponent(double largest) {
  if (largest == 0) return 0;
  const int exponent = std::ilogb(largest);
  return std::clamp(exponent, -most_exponent<Real>, most_exponent<Real>) - exponent;
}

/// The number that stands for "no pixel", far from the number of any pixel.
constexpr int no_source = std::numeric_limits<int>::min();

/// The pixel of [0, size) that stands for x, or no_source.
int pixel_for(int x, int size, EdgeMode edge) {
  if (x >= 0 && x < size) return x;
  if (edge == EdgeMode::zero) return no_source;
  const int period = edge == EdgeMode::wrap ? size : 2 * size;
  const int inside = (x % period + period) % period;
  return inside < size ? inside : period - 1 - inside;
}

/// The image columns that replace the columns [first, first + count) of an input.
struct Columns {
  struct Run {
    int first = 0, count = 0;
  };
  /// Columns to read; the second run follows the first in memory.
  Run runs[2];
  /// Place of each column in the data read; empty where is_plain.
  std::vector<int> places;
  /// Whether columns [lead, lead + runs[0].count) are runs[0] and all others have no source.
  bool is_plain = false;
  int lead = 0;

  int read_count() const { return runs[0].count + runs[1].count; }
};

Columns make_columns(int first, int count, int size, EdgeMode edge) {
  Columns columns;
  const int begin = std::max(first, 0), end = std::min(first + count, size);
  if (edge == EdgeMode::zero || (begin == first && end == first + count)) {
    columns.runs[0] = {begin, end - begin};
    columns.is_plain = true;
    columns.lead = begin - first;
    return columns;
  }
  std::vector<int>& places = columns.places;
  for (int i = 0; i < count; ++i) places.push_back(pixel_for(first + i, size, edge));
  const auto [low, high] = std::minmax_element(places.begin(), places.end());
  columns.runs[0] = {*low, *high + 1 - *low};
  if (edge == EdgeMode::wrap && count < size) {
    // Both ends of the image are read, not the columns between them.
    const int start = places.front(), before_end = std::min(count, size - start);
    columns.runs[0] = {start, before_end};
    columns.runs[1] = {0, count - before_end};
    for (int i = 0; i < count; ++i) places[static_cast<std::size_t>(i)] = i;
  } else {
    const int offset = *low;
    for (int& place : places) place -= offset;
  }
  return columns;
}

/// Results of take_values().
struct Taken {
  bool has_missing = false;
  double largest = 0;  ///< size of a finite value
};

/// Multiplies by `scale`; missing pixels and too large values become 0.
template <class Real>
Taken take_values(const double* values, int count, double scale, Real* out) {
  constexpr double most_value = static_cast<double>(std::numeric_limits<Real>::max());
  Taken taken;
  int missing = 0;
  for (int i = 0; i < count; ++i) {
    const double size = std::abs(values[i]), scaled = scale * values[i];
    const bool is_good = size <= std::numeric_limits<double>::max();
    out[i] = std::abs(scaled) <= most_value ? static_cast<Real>(scaled) : Real{0};
    taken.largest = std::max(taken.largest, is_good ? size : 0);
    missing += is_good ? 0 : 1;
  }
  taken.has_missing = missing > 0;
  return taken;
}

bool needs_transform(int width, int height, const ConvolutionOptions& options) {
  return options.transform_width > 0 || options.transform_height > 0 ||
         width * height > direct_pixels;
}

template <class Real>
class ConvolvedPlane final : public Plane {
 public:
  ConvolvedPlane(PlanePtr source, int width, int height, std::function<Stamp()> make,
                 const ConvolutionOptions& options)
      : Plane(source->width(), source->height()),
        source_(std::move(source)),
        stamp_width_(width),
        stamp_height_(height),
        make_(std::move(make)),
        edge_(options.edge) {
    if (needs_transform(width, height, options)) transform_ = choose_transform(options);
  }
  ~ConvolvedPlane() override { KernelCache::get().remove(this); }

  Tile tile() const override {
    return transform_ == nullptr ? source_->tile() : Tile{tile_width(), tile_height()};
  }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const auto kernel = get_kernel();
    if (transform_ == nullptr) {
      const std::ptrdiff_t row = area.width + stamp_width_ - 1;
      std::vector<Real> values(static_cast<std::size_t>(row) *
                               static_cast<std::size_t>(area.height + stamp_height_ - 1));
      read_tile(*kernel, area, area, {values.data(), row}, out, stride);
      return;
    }
    Buffer<Real> buffer = transform_->take_buffer();
    const auto overlap = [](int first, int count, int low, int size) {
      const int begin = std::max(first, low), end = std::min(first + count, low + size);
      return std::pair(begin, end - begin);
    };
    const int right = area.x + area.width, top = area.y + area.height;
    for (int y = area.y / tile_height() * tile_height(); y < top; y += tile_height()) {
      for (int x = area.x / tile_width() * tile_width(); x < right; x += tile_width()) {
        const Area tile = {x, y, std::min(tile_width(), this->width() - x),
                           std::min(tile_height(), this->height() - y)};
        const auto [first_x, columns] = overlap(area.x, area.width, tile.x, tile.width);
        const auto [first_y, rows] = overlap(area.y, area.height, tile.y, tile.height);
        read_tile(*kernel, tile, {first_x, first_y, columns, rows},
                  {buffer.get(), transform_->stride()},
                  out + (first_y - area.y) * stride + (first_x - area.x), stride);
      }
    }
    transform_->give_back(std::move(buffer));
  }

 private:
  using KernelPtr = std::shared_ptr<const ConvolutionKernel<Real>>;
  /// Missing pixels of a tile's input, row by row: 1 where missing; empty where none is.
  using Mask = std::vector<std::uint8_t>;
  struct Rows {
    Real* values;
    std::ptrdiff_t stride;
    Real* operator[](int row) const { return values + row * stride; }
  };

  int tile_width() const { return transform_->width() - stamp_width_ + 1; }
  int tile_height() const { return transform_->height() - stamp_height_ + 1; }

  const Transform<Real>* choose_transform(const ConvolutionOptions& options) const;
  KernelPtr get_kernel() const;
  KernelPtr make_kernel() const;
  void read_tile(const ConvolutionKernel<Real>& kernel, const Area& tile, const Area& needed,
                 Rows values, double* out, std::ptrdiff_t stride) const;
  struct Input {
    Mask mask;
    double largest = 0;  ///< size of a finite value
  };
  struct SourceRows {
    int first;  ///< or no_source
    int count;
    int step;  ///< 1 or -1
  };
  SourceRows source_rows(const Area& input, int row, int most) const;
  void take_row(const Columns& columns, const double* read, double scale, int row,
                const Area& input, std::vector<double>& line, Real* target, Input& result) const;
  Input gather(const Area& input, double scale, Rows values) const;
  void convolve(const ConvolutionKernel<Real>& kernel, const Area& input, Rows values) const;

  PlanePtr source_;
  int stamp_width_, stamp_height_;
  std::function<Stamp()> make_;
  EdgeMode edge_;
  const Transform<Real>* transform_ = nullptr;  ///< null for direct sums
  mutable std::mutex kernel_mutex_;
};

/// Lengths for which FFTW is quick: 2^a with a >= 3, times 1, 3, 5 or 25. The first length that is
/// not below `most` ends the list.
std::vector<int> quick_lengths(int least, int most) {
  constexpr int size_factor = 8;
  constexpr int odd_factors[] = {1, 3, 5, 25};
  std::vector<int> lengths;
  const int first_beyond = [&] {
    int best = std::numeric_limits<int>::max();
    for (const int odd : odd_factors) {
      int n = odd * size_factor;
      while (n < most) n *= 2;
      best = std::min(best, n);
    }
    return best;
  }();
  for (const int odd : odd_factors) {
    for (int n = odd * size_factor; n <= first_beyond; n *= 2) {
      if (n >= least) lengths.push_back(n);
    }
  }
  std::ranges::sort(lengths);
  return lengths;
}

/// The cheapest grid of tiles. A transform of n pixels costs n (log2 n + overhead), and more where
/// it outgrows a core's cache. The factors are measured.
template <class Real>
const Transform<Real>* ConvolvedPlane<Real>::choose_transform(
    const ConvolutionOptions& options) const {
  constexpr double cache_bytes = 2 << 20, beyond_cache = 1.5, overhead = 16;
  const auto lengths = [](int asked, int size, int stamp) {
    if (asked > 0) return std::vector{asked};
    const long long all = static_cast<long long>(size) + stamp - 1;
    const long long most = std::min<long long>(all, std::max(largest_chosen_transform, 2 * stamp));
    return quick_lengths(stamp, static_cast<int>(most));
  };
  double best = std::numeric_limits<double>::infinity();
  int best_width = 0, best_height = 0;
  for (const int columns : lengths(options.transform_width, this->width(), stamp_width_)) {
    for (const int rows : lengths(options.transform_height, this->height(), stamp_height_)) {
      const double tiles =
          std::ceil(static_cast<double>(this->width()) / (columns - stamp_width_ + 1)) *
          std::ceil(static_cast<double>(this->height()) / (rows - stamp_height_ + 1));
      const double pixels = static_cast<double>(columns) * rows;
      const bool is_cached = pixels * sizeof(Real) <= cache_bytes;
      const double cost =
          tiles * pixels * (std::log2(pixels) + overhead) * (is_cached ? 1 : beyond_cache);
      if (cost >= best) continue;
      best = cost;
      best_width = columns;
      best_height = rows;
    }
  }
  return &transform_of<Real>(best_width, best_height);
}

template <class Real>
auto ConvolvedPlane<Real>::get_kernel() const -> KernelPtr {
  // Threads that need this kernel wait until one thread has made it.
  const std::lock_guard lock(kernel_mutex_);
  if (auto kernel = KernelCache::get().find(this)) {
    return std::static_pointer_cast<const ConvolutionKernel<Real>>(std::move(kernel));
  }
  KernelPtr kernel = make_kernel();
  KernelCache::get().insert(this, kernel);
  return kernel;
}

template <class Real>
auto ConvolvedPlane<Real>::make_kernel() const -> KernelPtr {
  auto kernel = std::make_shared<ConvolutionKernel<Real>>();
  kernel->stamp = make_();
  const Stamp& stamp = kernel->stamp;
  check_stamp(stamp);
  if (stamp.width != stamp_width_ || stamp.height != stamp_height_) {
    throw std::invalid_argument("a stamp of another size than announced");
  }
  kernel->sum = stamp.sum();
  if (transform_ == nullptr) return kernel;

  const int columns = transform_->width(), rows = transform_->height();
  Buffer<Real> buffer(transform_->reals());
  const Rows values{buffer.get(), transform_->stride()};
  std::fill_n(buffer.get(), transform_->reals(), Real{0});
  const double scale = 1.0 / (static_cast<double>(columns) * rows);
  // The stamp's last pixel, (w, h) from its middle, goes to (0, 0), and pixels before it to
  // negative places. The tile's first output pixel, whose input is at (w, h), thus appears at (0,
  // 0).
  for (int j = 0; j < stamp.height; ++j) {
    for (int i = 0; i < stamp.width; ++i) {
      const int y = (j + 1 - stamp.height + rows) % rows;
      const int x = (i + 1 - stamp.width + columns) % columns;
      values[y][x] = static_cast<Real>(scale * stamp.at(i - stamp.width / 2, j - stamp.height / 2));
    }
  }
  transform_->forward(buffer.get());
  kernel->transform = std::move(buffer);
  kernel->stamp = {};
  return kernel;
}

/// Makes the pixels `needed` of a tile; `values` has room for the tile's input.
template <class Real>
void ConvolvedPlane<Real>::read_tile(const ConvolutionKernel<Real>& kernel, const Area& tile,
                                     const Area& needed, Rows values, double* out,
                                     std::ptrdiff_t stride) const {
  const int half_width = stamp_width_ / 2, half_height = stamp_height_ / 2;
  const Area input = {tile.x - half_width, tile.y - half_height, tile.width + 2 * half_width,
                      tile.height + 2 * half_height};
  Input taken = gather(input, 1, values);
  const int exponent = scaling_exponent<Real>(taken.largest);
  if (exponent != 0) taken = gather(input, std::ldexp(1.0, exponent), values);
  const Mask& mask = taken.mask;
  convolve(kernel, input, values);
  const int left = needed.x - tile.x, low = needed.y - tile.y;
  const double back = std::ldexp(1.0, -exponent);
  for (int row = 0; row < needed.height; ++row) {
    std::transform(values[low + row] + left, values[low + row] + left + needed.width,
                   out + row * stride, [back](Real value) { return back * value; });
  }
  if (mask.empty()) return;

  const auto is_missing = [&](int x, int y) {
    return mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(input.width) +
                static_cast<std::size_t>(x)] != 0;
  };
  for (int y = 0; y < input.height; ++y) {
    for (int x = 0; x < input.width; ++x) values[y][x] = is_missing(x, y) ? Real{1} : Real{0};
  }
  convolve(kernel, input, values);
  // Smaller weights are rounding errors of the transform.
  const double noise = kernel.transform ? rounding_error<Real> * std::abs(kernel.sum) : 0;
  for (int row = 0; row < needed.height; ++row) {
    for (int i = 0; i < needed.width; ++i) {
      const int x = left + i, y = low + row;
      double& value = out[row * stride + i];
      const double lost = values[y][x], weight = kernel.sum - lost;
      if (is_missing(x + half_width, y + half_height)) {
        value = no_value;
      } else if (std::abs(lost) > noise) {
        const bool is_enough = weight > 0 && weight >= least_weight * kernel.sum;
        value = is_enough ? value * (kernel.sum / weight) : no_value;
      }
    }
  }
}

/// Rows of the source for a tile's rows from `row` on, at most `most`: upwards or (mirrored)
/// downwards.
template <class Real>
auto ConvolvedPlane<Real>::source_rows(const Area& input, int row, int most) const -> SourceRows {
  const auto source_row = [&](int y) { return pixel_for(input.y + y, this->height(), edge_); };
  SourceRows result{source_row(row), 1, 1};
  if (result.first == no_source) return result;
  if (row + 1 < input.height && source_row(row + 1) == result.first - 1) result.step = -1;
  while (result.count < most && row + result.count < input.height &&
         source_row(row + result.count) == result.first + result.step * result.count) {
    ++result.count;
  }
  return result;
}

/// Writes a row of the source, read as the runs of `columns`, to `target`. Marks of missing pixels
/// go to row `row` of the mask.
template <class Real>
void ConvolvedPlane<Real>::take_row(const Columns& columns, const double* read, double scale,
                                    int row, const Area& input, std::vector<double>& line,
                                    Real* target, Input& result) const {
  const int row_end = transform_ == nullptr ? input.width : transform_->width();
  int length = columns.read_count();
  if (!columns.is_plain) {
    for (std::size_t x = 0; x < line.size(); ++x) line[x] = read[columns.places[x]];
    read = line.data();
    length = input.width;
  }
  std::fill_n(target, columns.lead, Real{0});
  std::fill(target + columns.lead + length, target + row_end, Real{0});
  const Taken taken = take_values(read, length, scale, target + columns.lead);
  result.largest = std::max(result.largest, taken.largest);
  if (!taken.has_missing) return;
  result.mask.resize(static_cast<std::size_t>(input.width) *
                     static_cast<std::size_t>(input.height));
  std::uint8_t* const marks =
      result.mask.data() + static_cast<std::ptrdiff_t>(row) * input.width + columns.lead;
  for (int x = 0; x < length; ++x) marks[x] = std::isfinite(read[x]) ? 0 : 1;
}

/// Gathers the pixels `input`, which may reach beyond the plane, times `scale`. Missing pixels and
/// the rest of a transform's rows are 0.
template <class Real>
auto ConvolvedPlane<Real>::gather(const Area& input, double scale, Rows values) const -> Input {
  // Strips are read as doubles; they stay in the cache.
  constexpr int strip_pixels = 1 << 15;
  const Columns columns = make_columns(input.x, input.width, this->width(), edge_);
  const int count = columns.read_count();
  const int most_rows = std::max(strip_pixels / std::max(count, 1), 1);
  std::vector<double> strip(static_cast<std::size_t>(count) * static_cast<std::size_t>(most_rows));
  std::vector<double> line(columns.is_plain ? 0 : static_cast<std::size_t>(input.width));
  const int row_end = transform_ == nullptr ? input.width : transform_->width();
  Input result;
  for (int row = 0; row < input.height;) {
    const auto [first, rows, step] = source_rows(input, row, most_rows);
    if (first == no_source) {
      std::fill_n(values[row++], row_end, Real{0});
      continue;
    }
    const int lowest = std::min(first, first + step * (rows - 1));
    int behind = 0;
    for (const Columns::Run& run : columns.runs) {
      if (run.count > 0) {
        source_->read({run.first, lowest, run.count, rows}, strip.data() + behind, count);
      }
      behind += run.count;
    }
    for (int i = 0; i < rows; ++i, ++row) {
      const auto place = static_cast<std::ptrdiff_t>(first + step * i - lowest) * count;
      take_row(columns, strip.data() + place, scale, row, input, line, values[row], result);
    }
  }
  if (transform_ != nullptr) {
    for (int row = input.height; row < transform_->height(); ++row) {
      std::fill_n(values[row], row_end, Real{0});
    }
  }
  return result;
}

/// Replaces a tile's input by its output, which begins at the same place.
template <class Real>
void ConvolvedPlane<Real>::convolve(const ConvolutionKernel<Real>& kernel, const Area& input,
                                    Rows values) const {
  if (kernel.transform) {
    transform_->forward(values.values);
    multiply(kernel.transform->get(), transform_->reals(), values.values);
    transform_->backward(values.values);
    return;
  }
  const int width = input.width - stamp_width_ + 1, height = input.height - stamp_height_ + 1;
  std::vector<Real> sums(static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    std::ranges::fill(sums, Real{0});
    for (int j = 0; j < stamp_height_; ++j) {
      for (int i = 0; i < stamp_width_; ++i) {
        const auto factor =
            static_cast<Real>(kernel.stamp.at(stamp_width_ / 2 - i, stamp_height_ / 2 - j));
        const Real* const row = values[y + j] + i;
        for (int x = 0; x < width; ++x) sums[static_cast<std::size_t>(x)] += factor * row[x];
      }
    }
    // No later row needs this row.
    std::ranges::copy(sums, values[y]);
  }
}

}  // namespace

PlanePtr convolved(PlanePtr source, int width, int height, std::function<Stamp()> make,
                   const ConvolutionOptions& options) {
  check_size(width, height);
  const auto fits = [](int transform, int stamp) { return transform == 0 || transform >= stamp; };
  if (!fits(options.transform_width, width) || !fits(options.transform_height, height)) {
    throw std::invalid_argument("a transform smaller than the stamp");
  }
  // Direct sums stay in double precision: their pixels must not depend on a tile's scaling.
  if (options.is_single && needs_transform(width, height, options)) {
    return std::make_shared<ConvolvedPlane<float>>(std::move(source), width, height,
                                                   std::move(make), options);
  }
  return std::make_shared<ConvolvedPlane<double>>(std::move(source), width, height, std::move(make),
                                                  options);
}

PlanePtr convolved(PlanePtr source, Stamp stamp, const ConvolutionOptions& options) {
  check_stamp(stamp);
  const int width = stamp.width, height = stamp.height;
  return convolved(
      std::move(source), width, height, [shared = std::move(stamp)] { return shared; }, options);
}

}  // namespace gamer
