#include "image/convolution/psf_profile.h"

#include <algorithm>
#include <array>
#include <boost/math/interpolators/quintic_hermite.hpp>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace gamer {
namespace {

using std::numbers::pi;

double j0(double x) { return boost::math::cyl_bessel_j(0, x); }
double j1(double x) { return boost::math::cyl_bessel_j(1, x); }

class GaussianProfile final : public Psf::Profile {
 public:
  double density(double r) const override {
    return gaussian_exponent / pi * std::exp(-gaussian_exponent * r * r);
  }
  double energy(double r) const override { return -std::expm1(-gaussian_exponent * r * r); }
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

  /// The closed form 1 - J0^2 - J1^2 for the full aperture; for others a sum over steps of half a
  /// ring.
  double energy(double r) const override {
    const double x = scale_ * r;
    if (obscuration_ == 0) return 1 - (j0(x) * j0(x) + j1(x) * j1(x));
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

  /// Band limit of the aperture's autocorrelation.
  double band_limit() const override { return 2 * scale_; }
  std::shared_ptr<const Psf::Profile> tabulated(double last) const override;

 protected:
  double obscuration_, scale_, peak_;
};

/// The Airy pattern from a table of its amplitude, with quintic Hermite interpolation. The
/// amplitude has no frequency above 1, so that steps of 1/16 leave errors of 1e-12.
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
  double energy(double t) const { return t < table_end ? energy_(t) : 1 - tail(t, missing_terms_); }
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

 private:
  const KolmogorovTable& table_ = KolmogorovTable::get();
  double scale_ = table_.fwhm();
};

}  // namespace

std::shared_ptr<const Psf::Profile> make_profile(const PsfModel& model) {
  switch (model.kind) {
    case PsfKind::gaussian: return std::make_shared<GaussianProfile>();
    case PsfKind::moffat: return std::make_shared<MoffatProfile>(model.beta);
    case PsfKind::airy: return std::make_shared<AiryProfile>(model.obscuration);
    case PsfKind::kolmogorov: return std::make_shared<KolmogorovProfile>();
  }
  throw std::invalid_argument("unknown PSF");
}

double airy_fwhm(double obscuration) {
  // The intensity falls to one half before the first zero, which is at x/pi = 1.22 at most.
  constexpr double beyond_share = 0.7;
  const double x =
      root([&](double t) { return airy_intensity(t, obscuration) - 0.5; }, 0.0, pi * beyond_share);
  return 2 * x / pi;
}

}  // namespace gamer
