#include "render/light_sums.h"

#include <algorithm>
#include <utility>

namespace gamer {

LightSums::LightSums(const OutputLayout& layout, std::span<const double> unit_factors,
                     std::size_t width, std::span<double> values)
    : layout_(&layout), unit_factors_(unit_factors), width_(width), values_(values) {
  if (layout.owner()) owners_.resize(values.size() / layout.size());
}

void LightSums::clear() {
  std::ranges::fill(values_, 0.0);
  for (auto& owner : owners_) owner.clear();
}

void LightSums::add_planes(std::size_t first, std::span<const double> light, double* pixel) const {
  for (std::size_t p = 0; p < light.size(); ++p) pixel[(first + p) * width_] += light[p];
}

void LightSums::add(std::size_t row, std::size_t x, const Source& source,
                    std::span<const double> seen, std::span<const double> dust_free) {
  add(row, x, source.object, seen, dust_free);
  add_part(row, x, source, seen);
}

void LightSums::add_part(std::size_t row, std::size_t x, const Source& source,
                         std::span<const double> seen) {
  const auto part = layout_->part(source.object, source.emitter);
  if (part) add_planes(*part, seen, pixel(row, x));
}

void LightSums::add(std::size_t row, std::size_t x, std::size_t object,
                    std::span<const double> seen, std::span<const double> dust_free) {
  double* const sums = pixel(row, x);
  add_planes(0, seen, sums);
  if (layout_->dust_free()) add_planes(*layout_->dust_free(), dust_free, sums);
  if (!layout_->owner()) return;
  double& light = owners_[row * width_ + x][object];
  for (std::size_t p = 0; p < seen.size(); ++p) light += seen[p] * unit_factors_[p];
}

void LightSums::add_depth(std::size_t row, std::size_t x, std::span<const double> depth) {
  if (layout_->optical_depth()) add_planes(*layout_->optical_depth(), depth, pixel(row, x));
}

LightSums::Owner LightSums::owner(std::size_t row, std::size_t x) const {
  if (owners_.empty()) return {};
  std::pair<std::size_t, double> most{0, 0.0};
  double whole = 0;
  for (const auto& [object, light] : owners_[row * width_ + x]) {
    whole += light;
    if (light > most.second) most = {object + 1, light};
  }
  return {most.first, whole > 0 ? most.second / whole : 0};
}

}  // namespace gamer
