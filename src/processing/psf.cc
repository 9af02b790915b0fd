#include "processing/psf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/interpolators/quintic_hermite.hpp>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/bessel.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "gamer/core/error.h"

namespace gamer {

/// A profile with radii in units of the FWHM.
class Psf::Profile {
 public:
  virtual ~Profile() = default;
  virtual double density(double r) const = 0;
  virtual double energy(double r) const = 0;
  /// 1 - energy(r), accurate where it is small.
  virtual double missing(double r) const { return 1 - energy(r); }
  /// Highest spatial frequency in the density, rad per FWHM; 0 where there is no limit.
  virtual double band_limit() const { return 0; }
  /// A table of the density up to the radius `last`, for quick evaluation; null where the density
  /// itself is quick.
  virtual std::shared_ptr<const Profile> tabulated(double last) const {
    static_cast<void>(last);
    return nullptr;
  }
};

namespace {

using std::numbers::pi;

double j0(double x) { return boost::math::cyl_bessel_j(0, x); }
double j1(double x) { return boost::math::cyl_bessel_j(1, x); }

/// The zero of `f`, whose signs differ at both ends, to the last bits.
template <class Function>
double root(Function f, double low, double high) {
  constexpr int bit_count = std::numeric_limits<double>::digits - 3;
  constexpr std::uintmax_t most_steps = 200;
  std::uintmax_t steps = most_steps;
  const auto [a, b] = boost::math::tools::toms748_solve(
      f, low, high, boost::math::tools::eps_tolerance<double>(bit_count), steps);
  return std::midpoint(a, b);
}

class GaussianProfile final : public Psf::Profile {
 public:
  /// exp(-k r^2) k/pi, k = 4 ln 2.
  static constexpr double exponent = 4 * std::numbers::ln2;

  double density(double r) const override { return exponent / pi * std::exp(-exponent * r * r); }
  double energy(double r) const override { return -std::expm1(-exponent * r * r); }
  double missing(double r) const override { return std::exp(-exponent * r * r); }
};

class MoffatProfile final : public Psf::Profile {
 public:
  explicit MoffatProfile(double beta)
      : beta_(beta),
        inverse_alpha2_(4 * std::expm1(std::numbers::ln2 / beta)),
        peak_((beta - 1) * inverse_alpha2_ / pi) {}

  double density(double r) const override {
    return peak_ * std::exp(-beta_ * std::log1p(r * r * inverse_alpha2_));
  }
  double energy(double r) const override {
    return -std::expm1((1 - beta_) * std::log1p(r * r * inverse_alpha2_));
  }
  double missing(double r) const override {
    return std::exp((1 - beta_) * std::log1p(r * r * inverse_alpha2_));
  }

 private:
  double beta_, inverse_alpha2_, peak_;
};

/// 2 J1(x)/x with its first two derivatives.
struct Jinc {
  double value = 1, slope = 0, curvature = -0.25;

  explicit Jinc(double x) {
    if (x == 0) return;
    const double bessel1 = j1(x), bessel2_x = boost::math::cyl_bessel_j(2, x) / x;
    value = 2 * bessel1 / x;
    slope = -2 * bessel2_x;
    curvature = (6 * bessel2_x - 2 * bessel1) / x;
  }
};

double jinc(double x) { return x == 0 ? 1 : 2 * j1(x) / x; }

/// Intensity at x = pi D r/lambda, 1 in the middle.
double airy_intensity(double x, double obscuration) {
  const double e2 = obscuration * obscuration;
  double amplitude = jinc(x);
  if (e2 > 0) amplitude = (amplitude - e2 * jinc(obscuration * x)) / (1 - e2);
  return amplitude * amplitude;
}

class AiryProfile : public Psf::Profile {
 public:
  explicit AiryProfile(double obscuration)
      : obscuration_(obscuration),
        scale_(pi * airy_fwhm(obscuration)),
        peak_((1 - obscuration * obscuration) / (4 * pi)) {}

  double density(double r) const override {
    return peak_ * scale_ * scale_ * airy_intensity(scale_ * r, obscuration_);
  }

  /// Closed form for the full aperture, 1 - J0^2 - J1^2; else a sum over steps of half a ring.
  double energy(double r) const override {
    const double x = scale_ * r;
    if (obscuration_ == 0) return 1 - missing(r);
    const auto steps = static_cast<int>(std::ceil(2 * x / pi));
    const double step = x / std::max(steps, 1);
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      constexpr unsigned node_count = 10;
      sum += boost::math::quadrature::gauss<double, node_count>::integrate(
          [&](double t) { return 2 * pi * t * airy_intensity(t, obscuration_); }, i * step,
          (i + 1) * step);
    }
    return peak_ * sum;
  }
  double missing(double r) const override {
    const double x = scale_ * r;
    return obscuration_ == 0 ? j0(x) * j0(x) + j1(x) * j1(x) : 1 - energy(r);
  }

  /// Band limit of the aperture's autocorrelation.
  double band_limit() const override { return 2 * scale_; }
  std::shared_ptr<const Psf::Profile> tabulated(double last) const override;

 protected:
  double obscuration_, scale_, peak_;
};

/// The amplitude by quintic Hermite interpolation. It holds no frequency above 1, so steps of 1/16
/// leave errors of 1e-12.
class AiryTable final : public AiryProfile {
 public:
  AiryTable(double obscuration, double last)
      : AiryProfile(obscuration), amplitude_(make_table(obscuration, last * scale_)) {}

  double density(double r) const override {
    const double amplitude = amplitude_(scale_ * r);
    return peak_ * scale_ * scale_ * amplitude * amplitude;
  }

 private:
  using Hermite = boost::math::interpolators::cardinal_quintic_hermite<std::vector<double>>;

  static Hermite make_table(double obscuration, double last) {
    constexpr int knots_per_unit = 16;
    const double e = obscuration, e2 = e * e, norm = 1 / (1 - e2);
    const auto count = static_cast<std::size_t>(last * knots_per_unit) + 2;
    std::vector<double> values(count), slopes(count), curvatures(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = static_cast<double>(i) / knots_per_unit;
      const Jinc outer(x), inner(e * x);
      values[i] = norm * (outer.value - e2 * inner.value);
      slopes[i] = norm * (outer.slope - e2 * e * inner.slope);
      curvatures[i] = norm * (outer.curvature - e2 * e2 * inner.curvature);
    }
    return Hermite(std::move(values), std::move(slopes), std::move(curvatures), 0.0,
                   1.0 / knots_per_unit);
  }

  Hermite amplitude_;
};

std::shared_ptr<const Psf::Profile> AiryProfile::tabulated(double last) const {
  return std::make_shared<AiryTable>(obscuration_, last);
}

/// The Kolmogorov PSF as a function of the radius t in units of lambda/r0.
class KolmogorovTable {
 public:
  /// Half the structure function: 6.8839 / 2 = (24/5 Gamma(6/5))^(5/6).
  static double coefficient() { return std::pow(24.0 / 5 * std::tgamma(6.0 / 5), 5.0 / 6); }

  static const KolmogorovTable& get() {
    static const KolmogorovTable table;
    return table;
  }

  double density(double t) const {
    if (t < table_end) return density_(t);
    return tail(t, density_terms_) / (t * t);
  }
  double energy(double t) const { return t < table_end ? energy_(t) : 1 - missing(t); }
  double missing(double t) const {
    return t < table_end ? 1 - energy_(t) : tail(t, missing_terms_);
  }
  double fwhm() const { return fwhm_; }

 private:
  static constexpr double table_end = 6;
  static constexpr int knots_per_unit = 64;
  /// Terms of the asymptotic series; at table_end further terms are below 1e-13 of the first.
  static constexpr std::size_t term_count = 12;

  using Hermite = boost::math::interpolators::cardinal_quintic_hermite<std::vector<double>>;
  using Series = std::array<double, term_count>;

  KolmogorovTable()
      : density_(make_table(false)),
        energy_(make_table(true)),
        density_terms_(make_series(false)),
        missing_terms_(make_series(true)) {
    fwhm_ = 2 * root([&](double t) { return density_(t) - density_(0) / 2; }, 0.0, 1.0);
  }

  /// Transforms with f = t^3, which makes the integrand smooth at 0. I = int 2 pi f OTF J0(2 pi f
  /// r) df, energy = r int 2 pi OTF J1(2 pi f r) df. They also give the derivatives that the table
  /// needs.
  static Hermite make_table(bool is_energy) {
    constexpr double least_otf = 1e-18;
    const double last = std::pow(-std::log(least_otf) / coefficient(), 1.0 / 5);
    constexpr int panels = 12;
    constexpr unsigned node_count = 30;
    struct Node {
      double frequency = 0;
      double weight = 0;  ///< of df
    };
    std::vector<Node> nodes;
    using Gauss = boost::math::quadrature::gauss<double, node_count>;
    const double half = last / panels / 2;
    for (int panel = 0; panel < panels; ++panel) {
      for (std::size_t i = 0; i < Gauss::abscissa().size(); ++i) {
        for (const double side : {-1.0, 1.0}) {
          const double t = (2 * panel + 1 + side * Gauss::abscissa()[i]) * half;
          const double otf = std::exp(-coefficient() * std::pow(t, 5));
          nodes.push_back({t * t * t, half * Gauss::weights()[i] * 3 * t * t * otf});
        }
      }
    }
    constexpr auto knots = static_cast<std::size_t>(table_end) * knots_per_unit + 1;
    std::vector<double> values(knots), slopes(knots), curvatures(knots);
    for (std::size_t knot = 0; knot < knots; ++knot) {
      const double r = static_cast<double>(knot) / knots_per_unit;
      double density = 0, slope = 0, curvature = 0, energy = 0;
      for (const Node& node : nodes) {
        const double k = 2 * pi * node.frequency, x = k * r;
        const double bessel0 = j0(x), bessel1 = j1(x);
        const double derivative = x == 0 ? 0.5 : bessel0 - bessel1 / x;  // of J1
        density += node.weight * k * bessel0;
        slope -= node.weight * k * k * bessel1;
        curvature -= node.weight * k * k * k * derivative;
        energy += node.weight * 2 * pi * r * bessel1;
      }
      values[knot] = is_energy ? energy : density;
      slopes[knot] = is_energy ? 2 * pi * r * density : slope;
      curvatures[knot] = is_energy ? 2 * pi * (density + r * slope) : curvature;
    }
    return Hermite(std::move(values), std::move(slopes), std::move(curvatures), 0.0,
                   1.0 / knots_per_unit);
  }

  /// The transform of the OTF's power series term by term (Gradshteyn & Ryzhik 6.561.14). The
  /// series is in powers of r^(-5/3), for r^2 I or for the energy beyond r.
  static Series make_series(bool is_missing) {
    Series terms{};
    double factor = 1;  // (-coefficient)^n / n!
    for (std::size_t n = 1; n <= term_count; ++n) {
      factor *= -coefficient() / static_cast<double>(n);
      const double s = 5.0 / 3 * static_cast<double>(n);
      const double gamma = std::tgamma(1 + s / 2);
      // 1/Gamma(-s/2) by reflection, which also holds at the poles.
      const double inverse_gamma = -std::sin(pi * s / 2) * gamma / pi;
      const double term = factor * std::pow(pi, -s - 1) * gamma * inverse_gamma;
      terms[n - 1] = is_missing ? 2 * pi * term / s : term;
    }
    return terms;
  }

  static double tail(double t, const Series& terms) {
    const double root3 = std::cbrt(t);
    const double y = 1 / (t * root3 * root3);
    double sum = 0;
    for (std::size_t n = term_count; n > 0; --n) sum = (sum + terms[n - 1]) * y;
    return sum;
  }

  Hermite density_, energy_;
  Series density_terms_, missing_terms_;
  double fwhm_ = 1;
};

class KolmogorovProfile final : public Psf::Profile {
 public:
  double density(double r) const override { return scale_ * scale_ * table_.density(scale_ * r); }
  double energy(double r) const override { return table_.energy(scale_ * r); }
  double missing(double r) const override { return table_.missing(scale_ * r); }

 private:
  const KolmogorovTable& table_ = KolmogorovTable::get();
  double scale_ = table_.fwhm();
};

std::shared_ptr<const Psf::Profile> make_profile(const PsfModel& model) {
  switch (model.kind) {
    case PsfKind::gaussian:
      return std::make_shared<GaussianProfile>();
    case PsfKind::moffat:
      return std::make_shared<MoffatProfile>(model.beta);
    case PsfKind::airy:
      return std::make_shared<AiryProfile>(model.obscuration);
    case PsfKind::kolmogorov:
      return std::make_shared<KolmogorovProfile>();
  }
  throw std::invalid_argument("unknown PSF");
}

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

/// Integrals of a PSF over pixels. With a band limit, one rule serves all pixels. Other PSFs use
/// rules of 2, 3, 5 and 8 nodes a side until two successive rules nearly agree; where none agree,
/// the square is split into four.
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

  /// Over the pixel whose centre is (x, y).
  double operator()(double x, double y) const {
    constexpr double one_half = 0.5;
    return rules_.size() == 1 ? sum(rules_.front(), x, y, one_half) : adaptive(x, y, one_half, 0);
  }

 private:
  /// Half-width, in FWHM, of the core that squares wider than the FWHM could miss.
  static constexpr double core_radius = 3;
  static constexpr int deepest = 20;
  /// Tolerance of the difference between two rules. The error of the finer rule is much smaller. If
  /// the error of n nodes is p^(-2 n), a difference of 1e-7 between 2 and 3 leaves 3e-11, 1e-6
  /// between 3 and 5 leaves 1e-10, between 5 and 8 3e-10.
  static constexpr double tolerance_of_few = 1e-7;
  static constexpr double relative_tolerance = 1e-6;

  /// Over the square of side 2 `half` around (x, y).
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
  const double sigma = model.fwhm / std::sqrt(2 * GaussianProfile::exponent);
  const double turn = std::remainder(model.position_angle, 180.0);
  const double stretch = std::sqrt(model.axis_ratio);
  sigma_x = sigma * stretch;
  sigma_y = sigma / stretch;
  if (std::abs(turn) == 90) std::swap(sigma_x, sigma_y);
  return model.axis_ratio == 1 || turn == 0 || std::abs(turn) == 90;
}

void check(bool is_good, const char* message) {
  if (!is_good) throw std::invalid_argument(message);
}

}  // namespace

double airy_fwhm(double obscuration) {
  // Half the intensity lies before the first zero, which is at 1.22 at most.
  constexpr double beyond_share = 0.7;
  const double x =
      root([&](double t) { return airy_intensity(t, obscuration) - 0.5; }, 0.0, pi * beyond_share);
  return 2 * x / pi;
}

Psf::Psf(const PsfModel& model) : model_(model) {
  check(model.fwhm > 0 && std::isfinite(model.fwhm), "FWHM outside ]0, inf[");
  check(model.beta > 1 && std::isfinite(model.beta), "beta outside ]1, inf[");
  check(model.obscuration >= 0 && model.obscuration < 1, "obscuration outside [0, 1[");
  check(model.axis_ratio > 0 && model.axis_ratio <= 1, "axis ratio outside ]0, 1]");
  check(std::isfinite(model.position_angle), "position angle is not finite");
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

double Psf::energy_radius(double energy) const {
  check(energy > 0 && energy < 1, "energy outside ]0, 1[");
  const auto excess = [&](double r) { return (1 - energy) - profile_->missing(r); };
  double high = 1;
  while (excess(high) < 0) high *= 2;
  return model_.fwhm * root(excess, 0.0, high);
}

double Stamp::sum() const { return std::accumulate(values.begin(), values.end(), 0.0); }

int stamp_size(const Psf& psf, double energy) {
  check(energy > 0 && energy < 1, "energy outside ]0, 1[");
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
  check(size >= 1 && size <= largest_stamp && size % 2 == 1, "size is not odd or too large");
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
  check(sum > 0, "the PSF is zero at all pixels");
  if (!options.keep_missing_flux) {
    for (double& v : stamp.values) v /= sum;
  }
  return stamp;
}

Stamp read_stamp(const Plane& image, const std::string& label, bool keep_flux) {
  const int width = image.width(), height = image.height();
  if (width % 2 == 0 || height % 2 == 0) {
    throw InputError(
        fmt::format("{}: a PSF of {} x {} pixels has no middle pixel to be centred on; "
                    "crop or pad it to odd sides",
                    label, width, height));
  }
  if (width > largest_stamp || height > largest_stamp) {
    throw InputError(fmt::format("{}: a PSF of {} x {} pixels; at most {} x {}", label, width,
                                 height, largest_stamp, largest_stamp));
  }
  Stamp stamp{width, height, {}};
  stamp.values.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  image.read(image.whole(), stamp.values.data());
  const auto bad = std::find_if(stamp.values.begin(), stamp.values.end(),
                                [](double v) { return !std::isfinite(v); });
  if (bad != stamp.values.end()) {
    const auto index = bad - stamp.values.begin();
    throw InputError(fmt::format("{}: pixel ({}, {}) of the PSF is {}; a PSF must be finite", label,
                                 index % width + 1, index / width + 1, *bad));
  }
  const double sum = stamp.sum();
  if (!(sum > 0) || !std::isfinite(sum)) {
    throw InputError(
        fmt::format("{}: the PSF's pixels sum to {}; the sum must be positive", label, sum));
  }
  if (!keep_flux) {
    for (double& v : stamp.values) v /= sum;
  }
  return stamp;
}

}  // namespace gamer
