#include "gamer/noise/cloud.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/cloud.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"
#include "gamer/core/parallel_for.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Adds w, w x, w x^2, w^2, w^2 x, w^2 x^2 to `sums`.
void AddMoments(std::size_t size, const float* HWY_RESTRICT weight, const float* HWY_RESTRICT x,
                double* HWY_RESTRICT sums) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> df;
  const auto load = [&](const float* from)
                        HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, from)); };
  auto w0 = hn::Zero(d), wx = w0, wxx = w0, ww = w0, wwx = w0, wwxx = w0;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= size; i += lanes) {
    const auto w = load(weight + i);
    const auto value = load(x + i);
    const auto light = hn::Mul(w, value);
    w0 = hn::Add(w0, w);
    wx = hn::Add(wx, light);
    wxx = hn::MulAdd(light, value, wxx);
    ww = hn::MulAdd(w, w, ww);
    wwx = hn::MulAdd(w, light, wwx);
    wwxx = hn::MulAdd(light, light, wwxx);
  }
  const decltype(w0) lanes_of[] = {w0, wx, wxx, ww, wwx, wwxx};
  for (std::size_t k = 0; k < CloudMoments::count; ++k) {
    sums[k] += hn::GetLane(hn::SumOfLanes(d, lanes_of[k]));
  }
  for (; i < size; ++i) {
    const double w = weight[i], light = w * double{x[i]};
    const double last[] = {w, light, light * double{x[i]}, w * w, w * light, light * light};
    for (std::size_t k = 0; k < CloudMoments::count; ++k) sums[k] += last[k];
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(AddMoments);

std::vector<WeightedBatch> Cloud::all() const {
  std::vector<WeightedBatch> result(batches);
  parallel_for(batches, [&](std::size_t b) { fill(b, result[b]); });
  return result;
}

void CloudMoments::add(const WeightedBatch& batch, const float* x) {
  HWY_DYNAMIC_DISPATCH(AddMoments)(batch.size, batch.weight.data(), x, sums_);
}

void CloudMoments::add(std::span<const double> sums) {
  for (std::size_t k = 0; k < count; ++k) sums_[k] += sums[k];
}

CloudMean CloudMoments::mean() const {
  const double squares = std::max(sums_[5] - x() * (2 * sums_[4] - x() * sums_[3]), 0.0);
  return {x(), xx(), std::sqrt(squares) / sums_[0]};
}

std::size_t shared_cloud_size(double points, std::size_t most) {
  const double power = std::exp2(std::ceil(std::log2(points)));
  return static_cast<std::size_t>(std::min(power, static_cast<double>(most)));
}

CloudMean mean_over(std::span<const WeightedBatch> cloud,
                    const std::function<void(std::size_t b, BatchArray& out)>& values) {
  std::vector<CloudMoments> parts(cloud.size());
  parallel_for(cloud.size(), [&](std::size_t b) {
    BatchArray x;
    values(b, x);
    parts[b].add(cloud[b], x.data());
  });
  CloudMoments moments;
  for (const CloudMoments& part : parts) moments.add(part.sums());
  return moments.mean();
}

}  // namespace gamer
#endif
