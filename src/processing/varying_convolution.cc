#include "processing/varying_convolution.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/no_value.h"
#include "processing/arithmetic.h"

namespace gamer {
namespace {

/// Sum of the convolutions of the stamps with their weighted sources.
PlanePtr sum_of_stamps(const PlanePtr& source, const std::shared_ptr<const VaryingPsf>& psf,
                       const ConvolutionOptions& options) {
  std::vector<PlanePtr> parts;
  for (std::size_t c = 0; c < psf->stamps().size(); ++c) {
    const PlanePtr weighted = changed(source, [psf, c](const Area& area, double* values) {
      for (int y = 0; y < area.height; ++y) {
        for (int x = 0; x < area.width; ++x, ++values) {
          *values *= psf->weight(c, {area.x + x + 1.0, area.y + y + 1.0});
        }
      }
    });
    parts.push_back(convolved(weighted, psf->stamps()[c], options));
  }
  return combined(std::move(parts), Combination::sum);
}

std::span<double> pixels_of(const Area& area, double* values) {
  return {values, static_cast<std::size_t>(area.width) * area.height};
}

class VaryingConvolution final : public Plane {
 public:
  VaryingConvolution(const PlanePtr& source, const std::shared_ptr<const VaryingPsf>& psf,
                     const ConvolutionOptions& options)
      : Plane(source->width(), source->height()),
        source_(source),
        light_(sum_of_stamps(changed(source,
                                     [](const Area& area, double* values) {
                                       for (double& v : pixels_of(area, values)) {
                                         v = std::isfinite(v) ? v : 0;
                                       }
                                     }),
                             psf, options)),
        good_(sum_of_stamps(changed(source,
                                    [](const Area& area, double* values) {
                                      for (double& v : pixels_of(area, values)) {
                                        v = std::isfinite(v) ? 1 : 0;
                                      }
                                    }),
                            psf, options)),
        all_(sum_of_stamps(changed(source,
                                   [](const Area& area, double* values) {
                                     std::ranges::fill(pixels_of(area, values), 1.0);
                                   }),
                           psf, options)),
        // Wrapped and mirrored images reach around, but no farther than the stamp.
        reach_x_(psf->width() / 2),
        reach_y_(psf->height() / 2),
        is_zero_edge_(options.edge == EdgeMode::zero) {}

  Tile tile() const override { return light_->tile(); }
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    light_->read(area, out, stride);
    if (!has_missing_near(area)) return;
    std::vector<double> good(static_cast<std::size_t>(area.width) * area.height), all = good,
                                                                                  own = good;
    good_->read(area, good.data());
    all_->read(area, all.data());
    source_->read(area, own.data());
    for (std::size_t i = 0; i < own.size(); ++i) {
      const auto width = static_cast<std::size_t>(area.width);
      double& value = out[static_cast<std::ptrdiff_t>(i / width) * stride +
                          static_cast<std::ptrdiff_t>(i % width)];
      constexpr double least_share = 1e-3, rounding = 1e-12;
      const double share = good[i] / all[i];
      if (!std::isfinite(own[i]) || !(share >= least_share)) {
        value = no_value;
      } else if (std::abs(share - 1) > rounding) {
        value /= share;
      }
    }
  }

 private:
  /// Whether a missing pixel is within reach of the area.
  bool has_missing_near(const Area& area) const {
    Area reached = whole();
    if (is_zero_edge_) {
      const int left = std::max(0, area.x - reach_x_), bottom = std::max(0, area.y - reach_y_);
      const int right = std::min(width(), area.x + area.width + reach_x_);
      const int top = std::min(height(), area.y + area.height + reach_y_);
      reached = {left, bottom, right - left, top - bottom};
    }
    bool is_found = false;
    constexpr int side = 512;
    for_each_block(reached, side, [&](const Area& block) {
      if (is_found) return;
      std::vector<double> values(static_cast<std::size_t>(block.width) * block.height);
      source_->read(block, values.data());
      is_found = std::ranges::any_of(values, [](double v) { return !std::isfinite(v); });
    });
    return is_found;
  }

  PlanePtr source_, light_, good_, all_;
  int reach_x_, reach_y_;
  bool is_zero_edge_;
};

}  // namespace

PlanePtr convolved(PlanePtr source, std::shared_ptr<const VaryingPsf> psf,
                   const ConvolutionOptions& options) {
  return std::make_shared<VaryingConvolution>(source, psf, options);
}

}  // namespace gamer
