#include "gamer/render/spectral_basis.h"

#include <algorithm>
#include <boost/math/special_functions/legendre.hpp>
#include <cmath>
#include <limits>

#include "gamer/sed/igm.h"

namespace gamer {
namespace {

// Orders of the interpolation that are tried, and segments per e-fold of wavelength.
constexpr std::size_t highest_order = 6;
constexpr std::size_t most_segments = 24;

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

/// Segments of a range that is no single wavelength.
std::size_t segments_in(const Sed::Range& range, double spacing) {
  // A little less than a whole number of spacings must not become one more.
  constexpr double rounding = 1e-9;
  return static_cast<std::size_t>(std::ceil(std::log(range.high / range.low) / spacing - rounding));
}

/// The union of ranges, ascending.
std::vector<Sed::Range> merged(std::vector<Sed::Range> ranges) {
  std::sort(ranges.begin(), ranges.end(),
            [](const Sed::Range& a, const Sed::Range& b) { return a.low < b.low; });
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
    std::vector<double> light;  ///< of each sample
    double free = 0;            ///< their sum
    double behind[std::size(screens)] = {};
  };
  std::vector<Plane> planes;
};

SpectralBasis::SpectralBasis(Spectrum spectrum, const std::vector<Probe>& probes,
                             std::optional<int> band_samples, double allowed)
    : spectrum_(std::move(spectrum)) {
  std::vector<Sed::Range> ranges;
  for (const SpectralPlane& plane : spectrum_.planes) {
    ranges.push_back(plane.range());
    Samples samples;
    if (plane.band == nullptr) {
      samples.wavelength = {plane.wavelength};
      samples.weight = {plane.wavelength * plane.wavelength};
    } else {
      const Bandpass::Nodes& nodes = plane.band->nodes();
      samples.wavelength = nodes.wavelength;
      for (std::size_t k = 0; k < nodes.wavelength.size(); ++k) {
        const double wavelength = nodes.wavelength[k];
        samples.weight.push_back(nodes.weight[k] * wavelength / plane.band->log_width());
      }
    }
    samples_.push_back(std::move(samples));
  }
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
    const std::vector<Sed::Range> own = merged(ranges);
    // The alternative to single wavelengths on their own: one interval for all.
    const std::vector<Sed::Range> whole = {{own.front().low, own.back().high}};
    struct Layout {
      const std::vector<Sed::Range>* intervals;
      std::size_t order;
      double spacing;
      std::size_t nodes;
    };
    std::vector<Layout> layouts;
    for (const auto* intervals : {&own, &whole}) {
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
    std::stable_sort(layouts.begin(), layouts.end(),
                     [](const Layout& a, const Layout& b) { return a.nodes < b.nodes; });
    const std::vector<Trial> tried = trials(probes);
    double best = HUGE_VAL;
    const Layout* chosen = nullptr;
    for (const Layout& layout : layouts) {
      set_segments(*layout.intervals, layout.order, layout.spacing);
      interpolate_samples();
      const double reached = error(tried);
      if (reached < best) {
        best = reached;
        chosen = &layout;
      }
      if (best <= allowed) break;
    }
    set_segments(*chosen->intervals, chosen->order, chosen->spacing);
  }
  interpolate_samples();
  std::vector<double> values;
  for (std::size_t p = 0; p < planes(); ++p) {
    const std::size_t first = polynomials(p, spectrum_.planes[p].wavelength, values);
    const auto largest = std::max_element(values.begin(), values.end());
    main_nodes_.push_back(first + static_cast<std::size_t>(largest - values.begin()));
  }
}

void SpectralBasis::set_segments(const std::vector<Sed::Range>& intervals, std::size_t order,
                                 double spacing) {
  segments_.clear();
  nodes_.clear();
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
  for (const double point : gauss_points(order)) {
    nodes_.push_back(0.5 * (low + high) + 0.5 * (high - low) * point);
  }
}

std::size_t SpectralBasis::polynomials(std::size_t plane, double wavelength,
                                       std::vector<double>& values) const {
  const Segment* nearest = &segments_[own_segments_ ? plane : 0];
  if (!own_segments_) {
    double smallest = HUGE_VAL;
    for (const Segment& segment : segments_) {
      const double outside = std::max({segment.low - wavelength, wavelength - segment.high, 0.0});
      if (outside < smallest) {
        smallest = outside;
        nearest = &segment;
      }
    }
  }
  values.assign(nearest->count, 1.0);
  for (std::size_t j = 0; j < nearest->count; ++j) {
    for (std::size_t m = 0; m < nearest->count; ++m) {
      if (m == j) continue;
      values[j] *= (wavelength - nodes_[nearest->first + m]) /
                   (nodes_[nearest->first + j] - nodes_[nearest->first + m]);
    }
  }
  return nearest->first;
}

void SpectralBasis::interpolate_samples() {
  std::vector<double> values;
  for (std::size_t p = 0; p < planes(); ++p) {
    Samples& samples = samples_[p];
    samples.first.clear();
    samples.begin = {0};
    samples.values.clear();
    for (const double wavelength : samples.wavelength) {
      samples.first.push_back(polynomials(p, wavelength, values));
      samples.values.insert(samples.values.end(), values.begin(), values.end());
      samples.begin.push_back(samples.values.size());
    }
  }
}

void SpectralBasis::Samples::spread(std::size_t k, double light, double* nodes) const {
  for (std::size_t i = begin[k]; i < begin[k + 1]; ++i) {
    nodes[first[k] + i - begin[k]] += light * values[i];
  }
}

double SpectralBasis::source(const Sed& sed, double redshift, double wavelength) const {
  const double transmitted =
      spectrum_.igm == Igm::madau95 ? madau95_transmission(wavelength, redshift) : 1.0;
  return transmitted > 0 ? sed.flux(wavelength / (1 + redshift)) * transmitted / (1 + redshift) : 0;
}

std::vector<double> SpectralBasis::weights(const Sed& sed, double redshift) const {
  std::vector<double> result(planes() * size(), 0.0);
  for (std::size_t p = 0; p < planes(); ++p) {
    const Samples& samples = samples_[p];
    for (std::size_t k = 0; k < samples.wavelength.size(); ++k) {
      const double light = samples.weight[k] * source(sed, redshift, samples.wavelength[k]);
      if (light != 0) samples.spread(k, light, result.data() + p * size());
    }
  }
  return result;
}

std::vector<double> SpectralBasis::interpolation(std::size_t plane) const {
  std::vector<double> result(size(), 0.0), values;
  const std::size_t first = polynomials(plane, spectrum_.planes[plane].wavelength, values);
  std::copy(values.begin(), values.end(), result.begin() + static_cast<std::ptrdiff_t>(first));
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
    for (const Samples& samples : samples_) {
      Trial::Plane plane;
      for (std::size_t k = 0; k < samples.wavelength.size(); ++k) {
        const double wavelength = samples.wavelength[k];
        const double light = samples.weight[k] * source(*probe.sed, probe.sed_redshift, wavelength);
        plane.light.push_back(light);
        plane.free += light;
        const double here = extinction(*probe.dust, probe.dust_redshift, wavelength);
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
      std::fill(total.begin(), total.end(), 0.0);
      for (std::size_t k = 0; k < plane.light.size(); ++k) {
        if (plane.light[k] != 0) samples_[p].spread(k, plane.light[k], total.data());
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
