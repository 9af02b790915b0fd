#include "gamer/render/spectral_basis.h"

#include <algorithm>
#include <array>
#include <boost/math/special_functions/legendre.hpp>
#include <cmath>

#include "gamer/sed/igm.h"
#include "gamer/sed/photometry.h"

namespace gamer {
namespace {

// Limits of the interpolation's order and of the number of segments per e-fold of wavelength.
constexpr std::size_t highest_order = 6;
constexpr std::size_t most_segments = 24;
constexpr std::size_t most_nodes_of_segment =
    std::max<std::size_t>(highest_order, most_band_samples);

constexpr double screens[] = {0.25, 1, 4};

/// Gauss-Legendre points of [-1, 1], ascending.
std::vector<double> gauss_points(std::size_t order) {
  const std::vector<double> zeros = boost::math::legendre_p_zeros<double>(static_cast<int>(order));
  std::vector<double> points;
  for (auto zero = zeros.rbegin(); zero != zeros.rend(); ++zero) {
    if (*zero > 0) points.push_back(-*zero);
  }
  points.insert(points.end(), zeros.begin(), zeros.end());
  return points;
}

/// Number of segments of a range of wavelengths.
std::size_t segments_in(const Sed::Range& range, double spacing) {
  // Tolerance of rounding, so that a whole number of spacings does not get an extra segment.
  constexpr double rounding = 1e-9;
  return static_cast<std::size_t>(std::ceil(std::log(range.high / range.low) / spacing - rounding));
}

/// The union of ranges, ascending.
std::vector<Sed::Range> merged(std::vector<Sed::Range> ranges) {
  std::ranges::sort(ranges, [](const Sed::Range& a, const Sed::Range& b) { return a.low < b.low; });
  std::vector<Sed::Range> result;
  for (const Sed::Range& range : ranges) {
    if (!result.empty() && range.low <= result.back().high) {
      result.back().high = std::max(result.back().high, range.high);
    } else {
      result.push_back(range);
    }
  }
  return result;
}

}  // namespace

struct SpectralBasis::Trial {
  const Probe* probe;
  struct Plane {
    FluxSamples light;
    double free = 0;  ///< sum of the dust-free light
    double behind[std::size(screens)] = {};
  };
  std::vector<Plane> planes;
};

SpectralBasis::SpectralBasis(Spectrum spectrum, const std::vector<Probe>& probes,
                             std::optional<int> band_samples, double allowed)
    : spectrum_(std::move(spectrum)) {
  std::vector<Sed::Range> ranges;
  for (const SpectralPlane& plane : spectrum_.planes) ranges.push_back(plane.range());
  const auto widest = [](const std::vector<Sed::Range>& intervals) {
    double width = 0;
    for (const Sed::Range& range : intervals) width = std::max(width, range.high / range.low);
    return std::log(width);
  };
  if (probes.empty()) {
    add_segment(ranges.front().low, ranges.front().high, 1);
  } else if (band_samples) {
    own_segments_ = true;
    for (const Sed::Range& range : ranges) {
      add_segment(range.low, range.high,
                  range.high > range.low ? static_cast<std::size_t>(*band_samples) : 1);
    }
  } else {
    const std::vector<Sed::Range> covered = merged(ranges);
    // One interval for all wavelengths is an alternative to nodes at single wavelengths.
    const std::vector<Sed::Range> whole = {{covered.front().low, covered.back().high}};
    struct Layout {
      const std::vector<Sed::Range>* intervals;
      std::size_t order;
      double spacing;
      std::size_t nodes;
    };
    std::vector<Layout> layouts;
    for (const auto* intervals : {&covered, &whole}) {
      for (std::size_t order = 1; order <= highest_order; ++order) {
        for (std::size_t count = 1; count <= most_segments; ++count) {
          const double width = widest(*intervals);
          if (width == 0 && (order > 1 || count > 1)) continue;
          const double spacing = width / static_cast<double>(count);
          std::size_t nodes = 0;
          for (const Sed::Range& range : *intervals) {
            nodes += range.high > range.low ? segments_in(range, spacing) * order : 1;
          }
          layouts.push_back({intervals, order, spacing, nodes});
        }
      }
    }
    std::ranges::stable_sort(layouts,
                             [](const Layout& a, const Layout& b) { return a.nodes < b.nodes; });
    const std::vector<Trial> tried = trials(probes);
    double best = HUGE_VAL;
    const Layout* chosen = nullptr;
    for (const Layout& layout : layouts) {
      set_segments(*layout.intervals, layout.order, layout.spacing);
      const double reached = error(tried);
      if (reached < best) {
        best = reached;
        chosen = &layout;
      }
      if (best <= allowed) break;
    }
    set_segments(*chosen->intervals, chosen->order, chosen->spacing);
  }
  for (std::size_t p = 0; p < planes(); ++p) {
    const std::vector<double> values = interpolation(p);
    const auto largest = std::ranges::max_element(values);
    main_nodes_.push_back(static_cast<std::size_t>(largest - values.begin()));
  }
}

void SpectralBasis::set_segments(const std::vector<Sed::Range>& intervals, std::size_t order,
                                 double spacing) {
  segments_.clear();
  nodes_.clear();
  places_.clear();
  scales_.clear();
  for (const Sed::Range& range : intervals) {
    if (!(range.high > range.low)) {
      add_segment(range.low, range.high, 1);
      continue;
    }
    const double width = std::log(range.high / range.low);
    const std::size_t count = segments_in(range, spacing);
    for (std::size_t k = 0; k < count; ++k) {
      const auto end = [&](std::size_t i) {
        return i == count ? range.high
                          : range.low * std::exp(width * static_cast<double>(i) /
                                                 static_cast<double>(count));
      };
      add_segment(end(k), end(k + 1), order);
    }
  }
}

void SpectralBasis::add_segment(double low, double high, std::size_t order) {
  segments_.push_back({low, high, nodes_.size(), order});
  const std::vector<double> points = gauss_points(order);
  for (std::size_t j = 0; j < order; ++j) {
    nodes_.push_back(0.5 * (low + high) + 0.5 * (high - low) * points[j]);
    places_.push_back(points[j]);
    double product = 1;
    for (std::size_t m = 0; m < order; ++m) {
      if (m != j) product *= points[j] - points[m];
    }
    scales_.push_back(1 / product);
  }
}

const SpectralBasis::Segment& SpectralBasis::segment_at(std::size_t plane,
                                                        double wavelength) const {
  if (own_segments_) return segments_[plane];
  const auto outside = [&](const Segment& segment) {
    return std::max({segment.low - wavelength, wavelength - segment.high, 0.0});
  };
  return *std::ranges::min_element(
      segments_, [&](const Segment& a, const Segment& b) { return outside(a) < outside(b); });
}

void SpectralBasis::spread(std::size_t plane, double wavelength, double light,
                           double* nodes) const {
  const Segment& segment = segment_at(plane, wavelength);
  nodes += segment.first;
  if (segment.count == 1) {
    nodes[0] += light;
    return;
  }
  const double* place = places_.data() + segment.first;
  const double* scale = scales_.data() + segment.first;
  const double at = (2 * wavelength - segment.low - segment.high) / (segment.high - segment.low);
  // l_j has the factors at - place[m] for all m except j: first m > j, then m < j.
  std::array<double, most_nodes_of_segment + 1> behind;
  behind[segment.count] = light;
  for (std::size_t j = segment.count; j > 0; --j) behind[j - 1] = behind[j] * (at - place[j - 1]);
  double before = 1;
  for (std::size_t j = 0; j < segment.count; ++j) {
    nodes[j] += scale[j] * before * behind[j + 1];
    before *= at - place[j];
  }
}

std::vector<double> SpectralBasis::weights(const Sed& sed, double redshift) const {
  std::vector<double> result(planes() * size(), 0.0);
  for (std::size_t p = 0; p < planes(); ++p) {
    const FluxSamples samples = spectrum_.planes[p].samples(sed, redshift, spectrum_.igm);
    for (std::size_t k = 0; k < samples.flux.size(); ++k) {
      if (samples.flux[k] == 0) continue;
      spread(p, samples.wavelength[k], samples.flux[k], result.data() + p * size());
    }
  }
  return result;
}

std::vector<double> SpectralBasis::interpolation(std::size_t plane) const {
  std::vector<double> result(size(), 0.0);
  spread(plane, spectrum_.planes[plane].wavelength, 1, result.data());
  return result;
}

double SpectralBasis::extinction(const ExtinctionCurve& curve, double redshift, double wavelength) {
  const double rest = std::max(wavelength / (1 + redshift), lyman_limit);
  const Sed::Range range = curve.range();
  return curve.relative(std::clamp(rest, range.low, range.high));
}

std::vector<SpectralBasis::Trial> SpectralBasis::trials(const std::vector<Probe>& probes) const {
  std::vector<Trial> result;
  for (const Probe& probe : probes) {
    Trial trial{&probe, {}};
    for (const SpectralPlane& own : spectrum_.planes) {
      Trial::Plane plane;
      plane.light = own.samples(*probe.sed, probe.sed_redshift, spectrum_.igm);
      for (std::size_t k = 0; k < plane.light.flux.size(); ++k) {
        const double light = plane.light.flux[k];
        plane.free += light;
        const double here = extinction(*probe.dust, probe.dust_redshift, plane.light.wavelength[k]);
        for (std::size_t s = 0; s < std::size(screens); ++s) {
          plane.behind[s] += light * std::exp(-screens[s] * here);
        }
      }
      trial.planes.push_back(std::move(plane));
    }
    result.push_back(std::move(trial));
  }
  return result;
}

double SpectralBasis::error(const std::vector<Trial>& trials) const {
  double largest = 0;
  std::vector<double> total(size()), at_nodes(size());
  for (const Trial& trial : trials) {
    for (std::size_t j = 0; j < size(); ++j) {
      at_nodes[j] = extinction(*trial.probe->dust, trial.probe->dust_redshift, nodes_[j]);
    }
    for (std::size_t p = 0; p < planes(); ++p) {
      const Trial::Plane& plane = trial.planes[p];
      if (!(plane.free > 0)) continue;
      std::ranges::fill(total, 0.0);
      for (std::size_t k = 0; k < plane.light.flux.size(); ++k) {
        const double light = plane.light.flux[k];
        if (light != 0) spread(p, plane.light.wavelength[k], light, total.data());
      }
      for (std::size_t s = 0; s < std::size(screens); ++s) {
        double sum = 0;
        for (std::size_t j = 0; j < size(); ++j) {
          if (total[j] != 0) sum += total[j] * std::exp(-screens[s] * at_nodes[j]);
        }
        largest = std::max(largest, std::abs(sum - plane.behind[s]) / plane.free);
      }
    }
  }
  return largest;
}

}  // namespace gamer
