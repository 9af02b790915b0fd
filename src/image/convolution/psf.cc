#include "image/convolution/psf.h"

#include <algorithm>
#include <boost/math/special_functions/legendre.hpp>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "image/convolution/psf_profile.h"

namespace gamer {

namespace {

using std::numbers::pi;

/// Gauss-Legendre nodes in [-1, 1].
struct GaussRule {
  std::vector<double> nodes, weights;

  explicit GaussRule(int n) {
    for (const double x : boost::math::legendre_p_zeros<double>(n)) {
      const double slope = boost::math::legendre_p_prime(n, x);
      const double weight = 2 / ((1 - x * x) * slope * slope);
      for (const double side : {-x, x}) {
        nodes.push_back(side);
        weights.push_back(weight);
        if (x == 0) break;
      }
    }
  }

  /// The rule with an error of 1e-10 of the amplitude for frequency k, in rad over an interval of
  /// length 1: n!^4 k^(2n) / ((2n+1) (2n)!^3) (Abramowitz & Stegun 25.4.30).
  static GaussRule for_frequency(double k) {
    constexpr double log_error_bound = -23;
    for (int n = 2;; ++n) {
      const double log_error = 4 * std::lgamma(n + 1.0) + 2 * n * std::log(k) -
                               std::log(2 * n + 1.0) - 3 * std::lgamma(2 * n + 1.0);
      if (log_error < log_error_bound) return GaussRule(n);
    }
  }
};

/// Integrals of a PSF over pixels. With a band limit, one rule serves all pixels. For other PSFs,
/// rules of 2, 3, 5 and 8 nodes a side follow each other until two nearly agree. Where none do, the
/// square is split into four.
class PixelIntegral {
 public:
  /// `band_limit` in rad per pixel, 0 for none. Below `floor` values need no relative accuracy.
  PixelIntegral(const Psf& psf, double band_limit, double floor) : psf_(psf), floor_(floor) {
    const PsfModel& model = psf.model();
    const double stretch = std::sqrt(model.axis_ratio);
    minor_ = model.fwhm * stretch;
    core_ = core_radius * model.fwhm / stretch;
    if (band_limit > 0) {
      rules_ = {GaussRule::for_frequency(band_limit)};
    } else {
      for (const int n : {2, 3, 5, 8}) rules_.emplace_back(n);
    }
  }

  /// The integral over the pixel whose centre is (x, y).
  double operator()(double x, double y) const {
    return rules_.size() == 1 ? sum(rules_.front(), x, y, 0.5) : adaptive(x, y, 0.5, 0);
  }

 private:
  /// Half-width, in FWHM, of the core that squares wider than the FWHM could miss.
  static constexpr double core_radius = 3;
  static constexpr int deepest = 20;
  /// Tolerance of the difference between two rules. The error of the finer rule is much smaller.
  /// Let the error of n nodes be p^(-2 n). A difference of 1e-7 between 2 and 3 nodes then leaves
  /// an error of 3e-11. A difference of 1e-6 leaves 1e-10 between 3 and 5 nodes, and 3e-10 between
  /// 5 and 8.
  static constexpr double tolerance_of_few = 1e-7;
  static constexpr double relative_tolerance = 1e-6;

  /// The integral over the square of side 2 `half` around (x, y).
  double adaptive(double x, double y, double half, int depth) const {
    // Nodes could miss a PSF that is narrower than the square.
    const bool may_hide =
        2 * half > minor_ && std::abs(x) < core_ + half && std::abs(y) < core_ + half;
    if (!may_hide || depth == deepest) {
      double value = sum(rules_.front(), x, y, half);
      double tolerance = tolerance_of_few;
      for (std::size_t i = 1; i < rules_.size(); ++i) {
        const double coarse = std::exchange(value, sum(rules_[i], x, y, half));
        if (std::abs(value - coarse) <= tolerance * (value + floor_)) return value;
        tolerance = relative_tolerance;
      }
      if (depth == deepest) return value;
    }
    const double quarter = half / 2;
    double total = 0;
    for (const double dy : {-quarter, quarter}) {
      for (const double dx : {-quarter, quarter}) {
        total += adaptive(x + dx, y + dy, quarter, depth + 1);
      }
    }
    return total;
  }

  double sum(const GaussRule& rule, double x, double y, double half) const {
    const std::size_t n = rule.nodes.size();
    double total = 0;
    for (std::size_t j = 0; j < n; ++j) {
      double row = 0;
      for (std::size_t i = 0; i < n; ++i) {
        row += rule.weights[i] * psf_.density(x + half * rule.nodes[i], y + half * rule.nodes[j]);
      }
      total += rule.weights[j] * row;
    }
    return total * half * half;
  }

  const Psf& psf_;
  double floor_;
  double minor_ = 0, core_ = 0;
  std::vector<GaussRule> rules_;
};

/// The integral of a unit Gaussian over pixel i on one axis.
double gaussian_pixel(int i, double sigma) {
  const double scale = 1 / (sigma * std::numbers::sqrt2);
  // erfc is accurate in the wings.
  const double near = std::abs(i) - 0.5, far = near + 1;
  if (i == 0) return std::erf(far * scale);
  return (std::erfc(near * scale) - std::erfc(far * scale)) / 2;
}

/// Whether a Gaussian's axes are those of the pixels; if so, sets its widths along x and y.
bool is_aligned(const PsfModel& model, double& sigma_x, double& sigma_y) {
  if (model.kind != PsfKind::gaussian) return false;
  const double sigma = model.fwhm / std::sqrt(2 * gaussian_exponent);
  const double turn = std::remainder(model.position_angle, 180.0);
  const double stretch = std::sqrt(model.axis_ratio);
  sigma_x = sigma * stretch;
  sigma_y = sigma / stretch;
  if (std::abs(turn) == 90) std::swap(sigma_x, sigma_y);
  return model.axis_ratio == 1 || turn == 0 || std::abs(turn) == 90;
}

void require(bool is_good, const char* message) {
  if (!is_good) throw std::invalid_argument(message);
}

}  // namespace

Psf::Psf(const PsfModel& model) : model_(model) {
  require(model.fwhm > 0 && std::isfinite(model.fwhm), "FWHM outside ]0, inf[");
  require(model.beta > 1 && std::isfinite(model.beta), "beta outside ]1, inf[");
  require(model.obscuration >= 0 && model.obscuration < 1, "obscuration outside [0, 1[");
  require(model.axis_ratio > 0 && model.axis_ratio <= 1, "axis ratio outside ]0, 1]");
  require(std::isfinite(model.position_angle), "position angle is not finite");
  const double angle = model.position_angle * (pi / 180);
  sine_ = std::sin(angle);
  cosine_ = std::cos(angle);
  profile_ = make_profile(model);
}

double Psf::band_limit() const {
  return profile_->band_limit() / (model_.fwhm * std::sqrt(model_.axis_ratio));
}

Psf Psf::tabulated(double r) const {
  Psf quick = *this;
  if (auto table = profile_->tabulated(r / model_.fwhm)) quick.profile_ = std::move(table);
  return quick;
}

double Psf::density(double r) const {
  return profile_->density(r / model_.fwhm) / (model_.fwhm * model_.fwhm);
}

double Psf::density(double x, double y) const {
  if (model_.axis_ratio == 1) return density(std::sqrt(x * x + y * y));
  const double u = cosine_ * y - sine_ * x, v = cosine_ * x + sine_ * y;
  return density(std::sqrt(model_.axis_ratio * u * u + v * v / model_.axis_ratio));
}

double Psf::encircled_energy(double r) const { return profile_->energy(r / model_.fwhm); }

double Stamp::sum() const { return std::accumulate(values.begin(), values.end(), 0.0); }

int stamp_size(const Psf& psf, double energy) {
  require(energy > 0 && energy < 1, "energy outside ]0, 1[");
  const double stretch = 1 / std::sqrt(psf.model().axis_ratio);
  // Bisection over sides, since the radius may be far beyond the largest stamp.
  int low = 0, high = largest_chosen_stamp / 2;
  while (low < high) {
    const int middle = std::midpoint(low, high);
    const double reach = (middle + 0.5) / stretch;
    if (psf.encircled_energy(reach) >= energy) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return 2 * low + 1;
}

Stamp make_stamp(const Psf& psf, const StampOptions& options) {
  const int size = options.size == 0 ? stamp_size(psf, options.energy) : options.size;
  require(size >= 1 && size <= largest_stamp && size % 2 == 1, "size is not odd or too large");
  const std::size_t count = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  const int half = size / 2;
  Stamp stamp{size, size, std::vector<double>(count)};
  double* const middle = &stamp.values[count / 2];
  const auto pixel = [&](int dx, int dy) -> double& {
    return middle[static_cast<std::ptrdiff_t>(dy) * size + dx];
  };

  double sigma_x = 0, sigma_y = 0;
  if (options.integrated && is_aligned(psf.model(), sigma_x, sigma_y)) {
    for (int dy = -half; dy <= half; ++dy) {
      const double row = gaussian_pixel(dy, sigma_y);
      for (int dx = -half; dx <= half; ++dx) pixel(dx, dy) = row * gaussian_pixel(dx, sigma_x);
    }
  } else {
    // The corner is farthest; at worst it lies along the minor axis.
    const double corner = (half + 0.5) * std::numbers::sqrt2;
    const Psf quick = psf.tabulated(corner / std::sqrt(psf.model().axis_ratio));
    // Allowed error of all pixels together, as a share of the flux.
    constexpr double floor_value = 0.01;
    const PixelIntegral integral(quick, psf.band_limit(), floor_value / static_cast<double>(count));
    const auto value = [&](int dx, int dy) {
      return options.integrated ? integral(dx, dy) : quick.density(dx, dy);
    };
    if (psf.model().axis_ratio == 1) {
      for (int dy = 0; dy <= half; ++dy) {
        for (int dx = dy; dx <= half; ++dx) {
          const double v = value(dx, dy);
          for (const int x : {-dx, dx}) {
            for (const int y : {-dy, dy}) pixel(x, y) = pixel(y, x) = v;
          }
        }
      }
    } else {
      for (int dy = 0; dy <= half; ++dy) {
        for (int dx = -half; dx <= half; ++dx) pixel(dx, dy) = pixel(-dx, -dy) = value(dx, dy);
      }
    }
  }
  const double sum = stamp.sum();
  require(sum > 0, "the PSF is zero at all pixels");
  if (!options.keep_missing_flux) {
    for (double& v : stamp.values) v /= sum;
  }
  return stamp;
}

Stamp read_stamp(const Plane& image, const std::string& label, bool keep_flux) {
  const int width = image.width(), height = image.height();
  if (width % 2 == 0 || height % 2 == 0) {
    throw input_error(
        "{}: a PSF of {} x {} pixels has no middle pixel to be centred on; crop or pad it to odd "
        "sides",
        label, width, height);
  }
  if (width > largest_stamp || height > largest_stamp) {
    throw input_error("{}: a PSF of {} x {} pixels; at most {} x {}", label, width, height,
                      largest_stamp, largest_stamp);
  }
  Stamp stamp{width, height, {}};
  stamp.values.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  image.read(image.whole(), stamp.values.data());
  const auto bad = std::ranges::find_if(stamp.values, [](double v) { return !std::isfinite(v); });
  if (bad != stamp.values.end()) {
    const auto index = bad - stamp.values.begin();
    throw input_error("{}: pixel ({}, {}) of the PSF is {}; a PSF must be finite", label,
                      index % width + 1, index / width + 1, *bad);
  }
  const double sum = stamp.sum();
  if (!(sum > 0) || !std::isfinite(sum)) {
    throw input_error("{}: the PSF's pixels sum to {}; the sum must be positive", label, sum);
  }
  if (!keep_flux) {
    for (double& v : stamp.values) v /= sum;
  }
  return stamp;
}

}  // namespace gamer
