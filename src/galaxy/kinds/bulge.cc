#include "galaxy/kinds/bulge.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/bulge.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/kinds/spheroid-inl.h"

#ifndef GAMER_GALAXY_BULGE_SHAPE
#define GAMER_GALAXY_BULGE_SHAPE
namespace gamer {
namespace {

constexpr double mellier_mathez_power = 0.855;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// The envelope, with a relative error below 3e-7 (1 + |ln envelope|) for exact coordinates. No
/// value is below e^-87.
void BulgeEnvelope(const SampleBatch& batch, const SpheroidMetric& metric,
                   float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto b2 = MetricSquared(d, batch, i, metric);
    const auto b = hn::Sqrt(b2);
    const auto root = hn::Sqrt(hn::Sqrt(b));
    // b^-0.855 exp(-b^(1/4)) in one exponential.
    const auto exponent = hn::MulAdd(hn::Set(d, static_cast<float>(-0.5 * mellier_mathez_power)),
                                     Log(d, b2), hn::Neg(root));
    hn::Store(hn::Mul(Exp(d, exponent), hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(BulgeEnvelope);

namespace {

// r0 = R_e / 3434.12 (projected half-light radius of the density itself; docs/facts.md section 5).
constexpr double effective_radius_in_r0 = 3434.12;

// Value of b^(1/4) beyond which no light is left: P(8.58, 60) = 1 - 1e-17.
constexpr double largest_root = 60;

}  // namespace

Bulge::Bulge(double r0, const std::array<double, 3>& axis)
    : Spheroid(r0 * effective_radius_in_r0, axis), r0_(r0) {}

void Bulge::envelope(const SampleBatch& batch, float* out) const {
  const SpheroidMetric in_r0 = metric(r0_, effective_radius_in_r0);
  HWY_DYNAMIC_DISPATCH(BulgeEnvelope)(batch, in_r0, out);
}

double Bulge::envelope_integral() const {
  // The shell m = u^4 r0 of the bulge's own metric holds u^(11 - 4 0.855) e^-u du, an incomplete
  // Gamma function up to the taper.
  using Radii = boost::math::quadrature::gauss<double, 20>;
  using namespace boost::math::policies;
  using Policy = policy<promote_double<false>>;
  constexpr double power = 11 - 4 * mellier_mathez_power;
  const auto shells = [&](double stretch) {
    const auto root = [&](double distance) {
      return std::min(std::pow(distance / (stretch * r0_), 0.25), largest_root);
    };
    const double begin = root(taper_start), end = root(1);
    const double tapered =
        end > begin ? Radii::integrate(
                          [&](double u) {
                            const double m = u * u * u * u * r0_;
                            return std::pow(u, power) * std::exp(-u) * taper_at(m * stretch);
                          },
                          begin, end)
                    : 0.0;
    return boost::math::tgamma_lower(power + 1, begin, Policy()) + tapered;
  };
  const double mean = mean_over_directions(shells);
  return 16 * std::numbers::pi * std::pow(r0_, 3) * axis_[0] * axis_[1] * axis_[2] * mean;
}

double Bulge::face_on_column() const {
  // The surface density at R_e: 2 int_0^inf b^-0.855 exp(-b^(1/4)) ds, b^2 = R_e^2 + s^2 in r0.
  static const double half = [] {
    constexpr int steps = 2000;
    constexpr double reach = 6;  // s up to R_e sinh(6), about 200 R_e
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      const double u = reach * (i + 0.5) / steps;
      const double b = effective_radius_in_r0 * std::cosh(u);
      sum += std::pow(b, 1 - mellier_mathez_power) * std::exp(-std::pow(b, 0.25));
    }
    return sum * reach / steps;
  }();
  return 2 * r0_ * axis_[2] * half;
}

ComponentKind bulge_kind() {
  ComponentKind kind;
  kind.name = "bulge";
  kind.description =
      "spheroid of the de Vaucouleurs law: I_m b^-0.855 exp(-b^(1/4)), b = m/r0 (GAMER Eq. 12)";
  kind.traits = {.is_bulge = true};
  kind.parameters = {
      Parameter::number("radius", "galaxy radii",
                        Interval::left_open(0, 1).usual_logarithmic(1e-06, 0.001), std::nullopt,
                        "r0 of the density law; give this or `effective_radius`"),
      Parameter::number("effective_radius", "galaxy radii",
                        Interval::left_open(0, 1).usual_logarithmic(0.01, 0.5), std::nullopt,
                        "projected half-light radius, 3434.12 r0"),
      Parameter::vector3("axis", "", Interval::left_open(0, 10).usual(0.2, 2),
                         std::vector<double>{1, 1, 1}, "stretch along x, y, z"),
  };
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    const ParameterSet& v = input.values;
    if (v.has("radius") == v.has("effective_radius")) {
      throw InputError(
          v.has("radius") ? v.where("effective_radius") : input.node.where,
          input.context + (v.has("radius")
                               ? "'radius' and 'effective_radius' exclude each other; give one"
                               : "a bulge needs 'effective_radius' or 'radius'"));
    }
    const double r0 = v.has("radius") ? v.number("radius")
                                      : v.number("effective_radius") / effective_radius_in_r0;
    const auto& axis = v.numbers("axis");
    return std::make_unique<Bulge>(r0, std::array<double, 3>{axis[0], axis[1], axis[2]});
  };
  return kind;
}

}  // namespace gamer
#endif
