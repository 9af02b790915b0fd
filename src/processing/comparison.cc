#include "processing/comparison.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace gamer {
namespace {

double ratio(double difference, double reference) {
  return difference == 0 ? 0 : difference / reference;
}

}  // namespace

double Comparison::relative_max() const { return ratio(max_difference, max_reference); }
double Comparison::relative_rms() const { return ratio(rms_difference, rms_reference); }

bool Comparison::within(double relative, double absolute) const {
  return mismatched == 0 && max_difference <= absolute + relative * max_reference;
}

Comparison compare(const Plane& a, const Plane& b, int threads) {
  if (a.width() != b.width() || a.height() != b.height()) {
    throw std::invalid_argument("planes of different sizes");
  }
  Comparison result;
  double squares = 0, reference_squares = 0;
  std::vector<double> other;
  for_each_band(a, threads, [&](const Area& area, const double* values) {
    other.resize(static_cast<std::size_t>(area.width) * area.height);
    b.read(area, other.data());
    const double* second = other.data();
    for (int y = 0; y < area.height; ++y) {
      double row_squares = 0, row_reference = 0;
      for (int x = 0; x < area.width; ++x) {
        const double from = *values++, to = *second++;
        if (!std::isfinite(from) || !std::isfinite(to)) {
          const bool equal = from == to || (std::isnan(from) && std::isnan(to));
          if (!equal) ++result.mismatched;
          continue;
        }
        ++result.count;
        const double difference = std::fabs(to - from);
        if (difference > 0) ++result.differing;
        if (difference > result.max_difference) {
          result.max_difference = difference;
          result.max_at = {area.x + x, area.y + y};
        }
        result.max_reference = std::max(result.max_reference, std::fabs(from));
        row_squares += difference * difference;
        row_reference += from * from;
      }
      squares += row_squares;
      reference_squares += row_reference;
    }
  });
  if (result.count > 0) {
    const auto count = static_cast<double>(result.count);
    result.rms_difference = std::sqrt(squares / count);
    result.rms_reference = std::sqrt(reference_squares / count);
  }
  return result;
}

}  // namespace gamer
