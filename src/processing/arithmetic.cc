#include "processing/arithmetic.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "core/no_value.h"

namespace gamer {
namespace {

class CombinedPlane final : public Plane {
 public:
  CombinedPlane(std::vector<PlanePtr> planes, Combination combination, bool skip_missing)
      : Plane(planes.front()->width(), planes.front()->height()),
        planes_(std::move(planes)),
        combination_(combination),
        skip_missing_(skip_missing) {}
  using Plane::read;

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    std::vector<double> result(count), values(count);
    planes_.front()->read(area, result.data());
    std::vector<int> there(skip_missing_ ? count : 0);
    if (skip_missing_) count_there(result, result, there);
    for (std::size_t i = 1; i < planes_.size(); ++i) {
      planes_[i]->read(area, values.data());
      combine(result, values, there);
    }
    finish(result, there);
    for (int row = 0; row < area.height; ++row) {
      std::copy_n(result.data() + static_cast<std::ptrdiff_t>(row) * area.width, area.width,
                  out + row * stride);
    }
  }

 private:
  /// Adds the present pixels to the counts `there`, and copies the values with 0 for missing ones.
  static void count_there(const std::vector<double>& values, std::vector<double>& filled,
                          std::vector<int>& there) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool is_there = !std::isnan(values[i]);
      there[i] += is_there ? 1 : 0;
      filled[i] = is_there ? values[i] : 0;
    }
  }

  void combine(std::vector<double>& result, std::vector<double>& values,
               std::vector<int>& there) const {
    if (skip_missing_) count_there(values, values, there);
    switch (combination_) {
      case Combination::sum:
      case Combination::mean:
        for (std::size_t i = 0; i < result.size(); ++i) result[i] += values[i];
        break;
      case Combination::difference:
        for (std::size_t i = 0; i < result.size(); ++i) result[i] -= values[i];
        break;
      case Combination::product:
        for (std::size_t i = 0; i < result.size(); ++i) result[i] *= values[i];
        break;
    }
  }

  void finish(std::vector<double>& result, const std::vector<int>& there) const {
    const auto planes = static_cast<double>(planes_.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
      if (skip_missing_ && there[i] == 0) {
        result[i] = no_value;
      } else if (combination_ == Combination::mean) {
        result[i] /= skip_missing_ ? there[i] : planes;
      }
    }
  }

  std::vector<PlanePtr> planes_;
  Combination combination_;
  bool skip_missing_;
};

}  // namespace

PlanePtr combined(std::vector<PlanePtr> planes, Combination combination, bool skip_missing) {
  const bool adds = combination == Combination::sum || combination == Combination::mean;
  if (planes.empty() || (skip_missing && !adds)) {
    throw std::invalid_argument("nothing to combine, or missing pixels that cannot be left out");
  }
  const Plane& first = *planes.front();
  for (const PlanePtr& plane : planes) {
    if (plane->width() == first.width() && plane->height() == first.height()) continue;
    throw input_error("planes of {} x {} and {} x {} pixels do not fit", first.width(),
                      first.height(), plane->width(), plane->height());
  }
  return std::make_shared<CombinedPlane>(std::move(planes), combination, skip_missing);
}

PlanePtr scaled(PlanePtr plane, double factor, double offset) {
  return changed(std::move(plane), [factor, offset](const Area& area, double* values) {
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    for (std::size_t i = 0; i < count; ++i) values[i] = factor * values[i] + offset;
  });
}

}  // namespace gamer
