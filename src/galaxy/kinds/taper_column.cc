#include "galaxy/kinds/taper_column.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <utility>

#include "gamer/galaxy/sample_batch.h"

namespace gamer {
namespace {

using Rule = boost::math::quadrature::gauss<double, 20>;

// Heights up to this many h hold all light.
constexpr double most_heights = 20;

}  // namespace

double mean_taper(double r, double h) {
  if (r >= 1) return 0;
  // The taper is 1 up to t h and 0 from t_end h on.
  const double t = std::sqrt(std::max(taper_start * taper_start - r * r, 0.0)) / h;
  if (t >= most_heights) return 1;
  const double t_end = std::min(std::sqrt(1 - r * r) / h, most_heights);
  const auto integrand = [&](double u) {
    const double sech = 1 / std::cosh(u);
    return sech * sech * taper_at(std::hypot(r, h * u));
  };
  // Most light is within 3 h of the taper's begin.
  const double t_middle = std::min(t + 3, t_end);
  const double tapered =
      Rule::integrate(integrand, t, t_middle) + Rule::integrate(integrand, t_middle, t_end);
  return std::tanh(t) + tapered;
}

double mean_taper(double r, double h, double lift) {
  if (r >= 1) return 0;
  // The taper is 1 between -inner and inner, and 0 beyond outer, as heights above z = 0.
  const double inner = std::sqrt(std::max(taper_start * taper_start - r * r, 0.0));
  const double outer = std::sqrt(1 - r * r);
  const auto share = [&](double z) {
    return std::clamp((z - lift) / h, -most_heights, most_heights);
  };
  const auto integrand = [&](double u) {
    const double sech = 1 / std::cosh(u);
    return 0.5 * sech * sech * taper_at(std::hypot(r, h * u + lift));
  };
  double sum = 0.5 * (std::tanh(share(inner)) - std::tanh(share(-inner)));
  for (const auto& [from, to] :
       {std::pair(share(-outer), share(-inner)), std::pair(share(inner), share(outer))}) {
    // Most light is within 3 h of the mid-plane.
    double begin = from;
    for (const double middle : {-3.0, 0.0, 3.0, to}) {
      const double end = std::clamp(middle, begin, to);
      if (end > begin) sum += Rule::integrate(integrand, begin, end);
      begin = end;
    }
  }
  return sum;
}

}  // namespace gamer
