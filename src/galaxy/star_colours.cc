#include "gamer/galaxy/star_colours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace gamer {

/// M, with a table that the first use fills.
class StarColours::Mean {
 public:
  explicit Mean(std::shared_ptr<const Sed> sed) : sed_(std::move(sed)) {}

  double flux(double wavelength) const {
    std::call_once(is_filled_, [&] { fill(); });
    const double x = std::log(wavelength / shortest) / step;
    const auto last = static_cast<double>(logs_.size() - 1);
    if (!(x >= 0 && x < last)) return sed_->flux(wavelength);
    const auto i = static_cast<std::size_t>(x);
    return std::exp(std::lerp(logs_[i], logs_[i + 1], x - static_cast<double>(i)));
  }

 private:
  // Least range of the table's wavelengths, Angstrom, and its step in ln(lambda).
  static constexpr double shortest = 100, longest = 1e6, step = 0.002;

  void fill() const {
    const auto count = static_cast<std::size_t>(std::log(longest / shortest) / step) + 2;
    std::vector<double> logs;
    for (std::size_t i = 0; i < count; ++i) {
      const double flux = sed_->flux(shortest * std::exp(step * static_cast<double>(i)));
      logs.push_back(std::log(std::max(flux, std::numeric_limits<double>::min())));
    }
    logs_ = std::move(logs);
  }

  std::shared_ptr<const Sed> sed_;
  mutable std::once_flag is_filled_;
  mutable std::vector<double> logs_;  ///< ln M
};

StarColours::StarColours(std::shared_ptr<const Sed> mean)
    : mean_(std::make_shared<const Mean>(std::move(mean))) {}

std::shared_ptr<const Sed> StarColours::spectrum(std::shared_ptr<const Sed> whole,
                                                 std::shared_ptr<const Sed> blackbodies) const {
  class Tinted : public Sed {
   public:
    Tinted(std::shared_ptr<const Sed> whole, std::shared_ptr<const Sed> blackbodies,
           std::shared_ptr<const Mean> mean)
        : Sed("stars"),
          whole_(std::move(whole)),
          blackbodies_(std::move(blackbodies)),
          mean_(std::move(mean)) {}

    double flux(double wavelength) const override {
      constexpr double least = 1e-290;
      const double mean = mean_->flux(wavelength);
      const double tint = mean > least ? blackbodies_->flux(wavelength) / mean : 1;
      return tint * whole_->flux(wavelength);
    }
    Range range() const override { return whole_->range(); }
    std::span<const double> kinks() const override { return whole_->kinks(); }

   private:
    std::shared_ptr<const Sed> whole_, blackbodies_;
    std::shared_ptr<const Mean> mean_;
  };
  return std::make_shared<const Tinted>(std::move(whole), std::move(blackbodies), mean_);
}

}  // namespace gamer
