#include "galaxy/kinds/taper_column.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>

#include "gamer/galaxy/sample_batch.h"

namespace gamer {

double mean_taper(double r, double h) {
  using Rule = boost::math::quadrature::gauss<double, 20>;
  if (r >= 1) return 0;
  // The taper is 1 up to t h and 0 from t_end h on. Heights of 20 h hold all light.
  constexpr double reach = 20;
  const double t = std::sqrt(std::max(taper_start * taper_start - r * r, 0.0)) / h;
  if (t >= reach) return 1;
  const double t_end = std::min(std::sqrt(1 - r * r) / h, reach);
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

}  // namespace gamer
