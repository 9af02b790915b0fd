#include "galaxy/kinds/sersic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/sersic.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/kinds/spheroid-inl.h"

#ifndef GAMER_GALAXY_SERSIC_SHAPE
#define GAMER_GALAXY_SERSIC_SHAPE
namespace gamer {
namespace {

struct SersicShape {
  SpheroidMetric metric;  ///< in units of R_e
  const float* table;
  float last;  ///< index of the table's last interval
  float start;
  float inverse_step;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void SersicEnvelope(const SampleBatch& batch, const SersicShape& shape, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto m2 = MetricSquared(d, batch, i, shape.metric);
    auto place = hn::Mul(hn::Sub(hn::Mul(hn::Set(d, 0.5f), Log(d, m2)), hn::Set(d, shape.start)),
                         hn::Set(d, shape.inverse_step));
    place = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, shape.last + 1));
    const auto node = hn::Min(hn::Floor(place), hn::Set(d, shape.last));
    const auto index = hn::ConvertTo(di, node);
    const auto low = hn::GatherIndex(d, shape.table, index);
    const auto high = hn::GatherIndex(d, shape.table + 1, index);
    const auto exponent = hn::MulAdd(hn::Sub(place, node), hn::Sub(high, low), low);
    hn::Store(hn::Mul(Exp(d, exponent), hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SersicEnvelope);

namespace {

constexpr int table_intervals = 4096;

// Logarithm below which the envelope is 0 in single precision.
constexpr float least_logarithm = -86;

constexpr double smallest_index = 0.5, largest_index = 10;

/// ln nu(x) by the trapezoidal rule in t, whose error falls as exp(-pi^2/step).
class LogDensity {
 public:
  LogDensity(double n, double b) : n_(n), b_(b) {
    // Largest number of terms; at the smallest x of the table the last terms are negligible.
    constexpr int most_terms = 100;
    for (int k = 1; k <= most_terms; ++k) {
      const double cosh = std::cosh(step * k), root = std::pow(cosh, 1 / n);
      terms_.push_back({cosh, root - 1, root / cosh});
    }
  }

  double operator()(double x) const {
    constexpr double negligible = 1e-14;
    const double exponent = b_ * std::pow(x, 1 / n_);
    double sum = 0.5;
    for (const Term& term : terms_) {
      const double addend = term.factor * std::exp(-exponent * term.excess);
      sum += addend;
      if (addend < negligible * sum && term.cosh * x > 1) break;
    }
    return std::log(b_ / (std::numbers::pi * n_) * step * sum) + (1 / n_ - 1) * std::log(x) -
           exponent;
  }

 private:
  static constexpr double step = 0.25;
  /// cosh t, (cosh t)^(1/n) - 1 and (cosh t)^(1/n - 1).
  struct Term {
    double cosh, excess, factor;
  };
  double n_, b_;
  std::vector<Term> terms_;
};

/// The value at x of a table that SersicProfile has at equal steps of ln x.
template <class Value>
double between_nodes(const std::vector<Value>& table, double x) {
  constexpr double least = SersicProfile::least, most = SersicProfile::most;
  const double place = std::clamp(std::log(x / least) / std::log(most / least), 0.0, 1.0) *
                       static_cast<double>(table.size() - 1);
  const auto node = std::min(static_cast<std::size_t>(place), table.size() - 2);
  return std::lerp(double{table[node]}, double{table[node + 1]}, place - static_cast<double>(node));
}

}  // namespace

std::shared_ptr<const SersicProfile> SersicProfile::of(double n) {
  static std::mutex mutex;
  static std::map<double, std::weak_ptr<const SersicProfile>> known;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const SersicProfile> profile = known[n].lock();
  if (profile == nullptr) known[n] = profile = std::make_shared<const SersicProfile>(n);
  return profile;
}

SersicProfile::SersicProfile(double n)
    : b_(boost::math::gamma_p_inv(2 * n, 0.5)), step_(std::log(most / least) / table_intervals) {
  const LogDensity log_density(n, b_);
  const double first = log_density(least);
  centre_ = std::exp(first);
  inside_.push_back(std::pow(least, 3) / 3);
  double last = 0;
  for (int k = 0; k <= table_intervals; ++k) {
    const double x = least * std::exp(step_ * k);
    float value = least_logarithm;
    if (k == 0 || table_.back() > least_logarithm) {
      value = std::max(static_cast<float>(log_density(x) - first), least_logarithm);
    }
    table_.push_back(value);
    const double shell = std::pow(x, 3) * std::exp(double{value});
    if (k > 0) inside_.push_back(inside_.back() + 0.5 * step_ * (last + shell));
    last = shell;
  }
}

double SersicProfile::inside(double x) const { return between_nodes(inside_, x); }

double SersicProfile::density(double x) const { return std::exp(between_nodes(table_, x)); }

Sersic::Sersic(double n, double effective_radius, const std::array<double, 3>& axis,
               double boxiness)
    : Spheroid(effective_radius, axis, boxiness), profile_(SersicProfile::of(n)) {}

void Sersic::envelope(const SampleBatch& batch, float* out) const {
  SersicShape shape{};
  shape.metric = metric(effective_radius_, 1);
  shape.table = profile_->table().data();
  shape.last = static_cast<float>(table_intervals - 1);
  shape.start = static_cast<float>(std::log(SersicProfile::least));
  shape.inverse_step = static_cast<float>(1 / profile_->step());
  HWY_DYNAMIC_DISPATCH(SersicEnvelope)(batch, shape, out);
}

double Sersic::envelope_integral() const {
  // The light lost to the taper, by a rule in ln m between its begin and its end.
  using Radii = boost::math::quadrature::gauss<double, 30>;
  const auto shells = [&](double stretch) {
    const double begin = taper_start / (stretch * effective_radius_);
    const double end = 1 / (stretch * effective_radius_);
    const double tapered = Radii::integrate(
        [&](double u) {
          const double x = std::exp(u);
          return x * x * x * profile_->density(x) * taper_at(x * effective_radius_ * stretch);
        },
        std::log(begin), std::log(end));
    return profile_->inside(begin) + tapered;
  };
  return 4 * std::numbers::pi * std::pow(effective_radius_, 3) * axis_[0] * axis_[1] * axis_[2] *
         mean_over_directions(shells);
}

double Sersic::face_on_column() const {
  // The surface density at R_e, exp(-b).
  return effective_radius_ * axis_[2] * std::exp(-profile_->b()) / profile_->centre();
}

ComponentKind sersic_kind() {
  ComponentKind kind;
  kind.name = "sersic";
  kind.description =
      "spheroid that projects to Sersic's law, exp(-b (R/R_e)^(1/n)); I_m where it is densest";
  kind.traits = {.is_bulge = true};
  constexpr double smallest_radius = 1e-3;
  kind.parameters = {
      Parameter::number("index", "", Interval::closed(smallest_index, largest_index).usual(0.5, 8),
                        4.0, "n: 0.5 is a Gaussian, 1 exponential, 4 de Vaucouleurs' law"),
      required(Parameter::number("effective_radius", "galaxy radii",
                                 Interval::closed(smallest_radius, 1).usual_logarithmic(0.01, 1),
                                 std::nullopt,
                                 "R_e, projected half-light radius where the axes are 1")),
      Parameter::vector3("axis", "", Interval::closed(0.05, 10).usual(0.2, 2),
                         std::vector<double>{1, 1, 1}, "stretch along x, y, z"),
      Parameter::number("boxiness", "", Interval::closed(2, 4), 2.0,
                        "c of m^c = |x|^c + |y|^c + |z|^c, relative to the axes: 2 is an "
                        "ellipsoid, 4 nearly a box; above 2, R_e is that of the ellipsoid"),
      Parameter::boolean("bulge", true, "its light counts as the bulge in the truth table"),
  };
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    const auto& axis = input.values.numbers("axis");
    return std::make_unique<Sersic>(
        input.values.number("index"), input.values.number("effective_radius"),
        std::array<double, 3>{axis[0], axis[1], axis[2]}, input.values.number("boxiness"));
  };
  return kind;
}

}  // namespace gamer
#endif
