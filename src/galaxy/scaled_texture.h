#pragma once

#include <span>
#include <vector>

#include "gamer/galaxy/texture.h"

namespace gamer {

/// A texture without twirl that is a function of the place, divided by its mean over the component.
/// If that mean is zero or infinite over the cloud, the function may stay as it is.
class ScaledTexture : public Texture {
 public:
  void normalise(std::span<const WeightedBatch> cloud, const FractalNoise::Factor& factor) override;
  bool statistics_only_scale() const override { return true; }
  std::vector<double> statistics() const override { return {scale_, rms_}; }
  void restore(std::span<const double> statistics) override {
    scale_ = statistics[0];
    rms_ = statistics[1];
  }
  double rms() const override { return rms_; }
  /// One over the function's mean; evaluate_whole() multiplies the function by it.
  double scale() const { return scale_; }

 protected:
  /// `no_mean` is the message of the error where the mean is zero or infinite; null for none.
  explicit ScaledTexture(const char* no_mean) : Texture(0), no_mean_(no_mean) {}

 private:
  const char* no_mean_;
  double scale_ = 1;
  double rms_ = 1;
};

}  // namespace gamer
