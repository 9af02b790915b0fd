#pragma once

#include <algorithm>

namespace gamer {

/// A limit on the amount that is let through: `rate` per second, and `burst` at once.
class RateLimit {
 public:
  RateLimit(double rate, double burst) : rate_(rate), burst_(burst), left_(burst) {}

  /// Takes an amount at a time in seconds. Returns the time for which the next amount must wait,
  /// seconds.
  double take(double amount, double now) {
    left_ = std::min(burst_, left_ + (now - before_) * rate_) - amount;
    before_ = now;
    return left_ >= 0 ? 0 : -left_ / rate_;
  }

 private:
  double rate_, burst_, left_;
  double before_ = 0;
};

}  // namespace gamer
