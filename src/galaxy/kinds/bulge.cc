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

#ifndef GAMER_GALAXY_BULGE_SHAPE
#define GAMER_GALAXY_BULGE_SHAPE
namespace gamer {
namespace {

struct BulgeShape {
  float inverse_axis[3];  ///< 1/(a r0)
  float softening;        ///< (epsilon/r0)^2
};

constexpr double mellier_mathez_power = 0.855;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Relative error below 3e-7 (1 + |ln envelope|), given exact coordinates; nothing is below e^-87.
void BulgeEnvelope(const SampleBatch& batch, const BulgeShape& shape, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto x = hn::Mul(hn::Load(d, batch.x.data() + i), hn::Set(d, shape.inverse_axis[0]));
    const auto y = hn::Mul(hn::Load(d, batch.y.data() + i), hn::Set(d, shape.inverse_axis[1]));
    const auto z = hn::Mul(hn::Load(d, batch.z.data() + i), hn::Set(d, shape.inverse_axis[2]));
    const auto b2 =
        hn::MulAdd(x, x, hn::MulAdd(y, y, hn::MulAdd(z, z, hn::Set(d, shape.softening))));
    const auto b = hn::Sqrt(b2);
    const auto root = hn::Sqrt(hn::Sqrt(b));
    // b^-0.855 exp(-b^(1/4)) in one exponential.
    const auto exponent = hn::MulAdd(hn::Set(d, static_cast<float>(-0.5 * mellier_mathez_power)),
                                     Log(d, b2), hn::Neg(root));
    hn::Store(hn::Mul(Exp(d, exponent), hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(BulgeEnvelope);

namespace {

// r0 = R_e / 3434.12 (projected half-light radius of the density itself; docs/facts.md section 5).
constexpr double effective_radius_in_r0 = 3434.12;

// Softening in units of R_e.
constexpr double softening_radius = 1e-5;

// b^(1/4) beyond which there is no light left: P(8.58, 60) = 1 - 1e-17.
constexpr double largest_root = 60;

// The cusp within this many R_e holds 0.4 % of the light, which four rays get right to a tenth.
constexpr double finest_cell = 0.01;

// Nodes across the ray's closest approach: k nodes away they stand at sinh(k / this) of it.
constexpr double nodes_per_width = 1.6;

}  // namespace

Bulge::Bulge(double r0, const std::array<double, 3>& axis)
    : r0_(r0), axis_(axis), inverse_axis_{1 / axis[0], 1 / axis[1], 1 / axis[2]} {}

double Bulge::effective_radius() const { return r0_ * effective_radius_in_r0; }

void Bulge::envelope(const SampleBatch& batch, float* out) const {
  BulgeShape shape{};
  for (int i = 0; i < 3; ++i) shape.inverse_axis[i] = static_cast<float>(inverse_axis_[i] / r0_);
  const double softening = softening_radius * effective_radius_in_r0;
  shape.softening = static_cast<float>(softening * softening);
  HWY_DYNAMIC_DISPATCH(BulgeEnvelope)(batch, shape, out);
}

double Bulge::envelope_integral() const {
  // Along each direction n of an octant, shells of the bulge's own metric, m = u^4 r0, that of u
  // holding u^(11 - 4 0.855) e^-u du: an incomplete Gamma function up to the taper, which begins
  // and ends at distances m |S n| from the centre, S the stretch. Gauss' rules for what is smooth:
  // the taper, cos(theta) and phi.
  using Directions = boost::math::quadrature::gauss<double, 30>;
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
  const auto of_angle = [&](double cosine) {
    const double sine = std::sqrt(1 - cosine * cosine);
    const auto of_direction = [&](double angle) {
      return shells(std::hypot(sine * std::cos(angle) * axis_[0], sine * std::sin(angle) * axis_[1],
                               cosine * axis_[2]));
    };
    if (axis_[0] == axis_[1]) return of_direction(0);
    const double quarter = 0.5 * std::numbers::pi;
    return Directions::integrate(of_direction, 0.0, quarter) / quarter;
  };
  const bool is_round = axis_[0] == axis_[1] && axis_[1] == axis_[2];
  const double mean = is_round ? shells(axis_[0]) : Directions::integrate(of_angle, 0.0, 1.0);
  return 16 * std::numbers::pi * std::pow(r0_, 3) * axis_[0] * axis_[1] * axis_[2] * mean;
}

void Bulge::plan(const BallRay& ray, const Accuracy& /*accuracy*/, RayPlan& out) const {
  // Closest approach in the bulge's own metric.
  double od = 0, dd = 0, oo = 0;
  for (int i = 0; i < 3; ++i) {
    const double o = ray.origin[i] * inverse_axis_[i];
    const double direction = ray.direction[i] * inverse_axis_[i];
    od += o * direction;
    dd += direction * direction;
    oo += o * o;
  }
  const double softening = softening_radius * effective_radius();
  const double per_dd = 1 / dd, centre = -od * per_dd;
  const double impact2 = std::max(oo + od * centre, 0.0) + softening * softening;
  const double width = std::sqrt(impact2 * per_dd);
  out.extend(ray.begin, ray.end);
  out.focuses.push_back({centre, width, nodes_per_width / width});
}

ColumnScale Bulge::column_scale(const double nearest[3], const double direction[3],
                                double reach) const {
  // Columns follow q^2 = n.M n, M = A - (A d)(A d)/(d.A d), A = diag(1/axis^2): seen along d, the
  // ellipsoid is an ellipse whose short half axis is 1/sqrt(largest eigenvalue of M).
  std::array<double, 3> a{};
  double dad = 0, nan = 0, nad = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    a[i] = inverse_axis_[i] * inverse_axis_[i];
    dad += direction[i] * a[i] * direction[i];
    nan += nearest[i] * a[i] * nearest[i];
    nad += nearest[i] * a[i] * direction[i];
  }
  // M's other two eigenvalues have this sum and this product, since M d = 0.
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += a[i] - a[i] * a[i] * direction[i] * direction[i] / dad;
  const double product = a[0] * a[1] * a[2] / dad;
  const double largest = 0.5 * (sum + std::sqrt(std::max(sum * sum - 4 * product, 0.0)));
  const double short_axis = 1 / std::sqrt(largest);
  const double q = std::sqrt(std::max(nan - nad * nad / dad, 0.0));
  return {.envelope =
              short_axis * std::max(q - reach / short_axis, finest_cell * effective_radius())};
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
      Parameter::number("radius", "galaxy radii", Interval::left_open(0, 1), std::nullopt,
                        "r0 of the density law; give this or `effective_radius`"),
      Parameter::number("effective_radius", "galaxy radii", Interval::left_open(0, 1), std::nullopt,
                        "projected half-light radius, 3434.12 r0"),
      Parameter::vector3("axis", "", Interval::left_open(0, 10), std::vector<double>{1, 1, 1},
                         "stretch along x, y, z"),
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
