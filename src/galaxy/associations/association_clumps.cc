#include "galaxy/associations/association_clumps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "galaxy/running_sums.h"
#include "noise/lattice.h"

namespace gamer {
namespace {

/// A wave of period 1 between -1 and 1.
double wave(double x) {
  const double f = x - std::nearbyint(x);
  return f * (8 - 16 * std::abs(f));
}

/// The surface density at (x, y), interpolated.
double density_at(const SurfaceDensity& density, double x, double y) {
  const double last = density.points - 1;
  const auto place = [&](double coordinate) {
    return std::clamp(0.5 * last * (coordinate + 1), 0.0, last);
  };
  const double u = place(x), v = place(y);
  const double column = std::min(std::floor(u), last - 1);
  const double row = std::min(std::floor(v), last - 1);
  const auto points = static_cast<std::size_t>(density.points);
  const float* const corner = density.values.data() + static_cast<std::size_t>(row) * points +
                              static_cast<std::size_t>(column);
  const double low = std::lerp(double{corner[0]}, double{corner[1]}, u - column);
  const double high = std::lerp(double{corner[points]}, double{corner[points + 1]}, u - column);
  return std::lerp(low, high, v - row);
}

}  // namespace

double radius_of_share(double u) {
  constexpr int steps = 1 << 12;
  static const std::vector<double> below =
      running_sums(steps, [](double r) { return r * r * std::pow(1 - r * r, 3); });
  return place_of_sum(below, u * below.back());
}

ClumpPlace place_in_ball(const std::array<double, 3>& u) {
  const double r = radius_of_share(u[0]);
  const double cosine = 2 * u[1] - 1, sine = std::sqrt(1 - cosine * cosine);
  const double angle = 2 * std::numbers::pi * u[2];
  return {r * sine * std::cos(angle), r * sine * std::sin(angle), r * cosine};
}

double halo_share(const ClumpTier& tier, const AssociationClump& clump, const ClumpPlace& at) {
  const double in_plane = 1 - at.x * at.x - at.y * at.y;
  return (1 - double{tier.cavity[clump.model]} * in_plane * in_plane) *
         (1 + double{clump.shape.tilt[0]} * at.x + double{clump.shape.tilt[1]} * at.y);
}

ClumpPlace bent_place(const ClumpTier& tier, const AssociationClump& clump, ClumpPlace at) {
  const ClumpShape& shape = clump.shape;
  const auto bent = [&](const Bend& by, double along, double phase) {
    return double{by.height} * double{tier.bends} * wave(along * double{by.cycles} + phase);
  };
  const double turn = at.z * double{bend_turn};
  at.y -= bent(narrow_bend, at.x, double{shape.phase[3]});
  at.x -= bent(narrow_bend, at.y, double{shape.phase[2]});
  at.y -= bent(wide_bend, at.x, double{shape.phase[1]} - turn);
  at.x -= bent(wide_bend, at.y, double{shape.phase[0]} + turn);
  return at;
}

double cells_of(const ClumpTier& tier) { return 4 / (tier.side * tier.side); }

std::vector<AssociationClump> find_clumps(const AssociationTexture& texture, std::size_t l) {
  const ClumpTier& tier = texture.tiers()[l];
  const double c = double{tier.cosine} * tier.side, s = double{tier.sine} * tier.side;
  // The factor of an octave is below 2.
  const double most = std::ldexp(1.0, static_cast<int>(texture.octaves_before(l)));
  // Cells within this radius may hold clumps, in sides of a cell.
  const double reach = 1 / tier.side + 1;
  const auto first_row = static_cast<int>(std::floor(double{tier.offset_y} - reach)) - 1;
  const auto last_row = static_cast<int>(std::ceil(double{tier.offset_y} + reach));
  std::vector<AssociationClump> result;
  for (int j = first_row; j <= last_row; ++j) {
    // The row's places nearest to the axis.
    const double near = std::max({j - double{tier.offset_y}, double{tier.offset_y} - j - 1, 0.0});
    const double half = std::sqrt(std::max(reach * reach - near * near, 0.0));
    const auto first = static_cast<int>(std::floor(double{tier.offset_x} - half)) - 1;
    const auto last = static_cast<int>(std::ceil(double{tier.offset_x} + half));
    const std::uint32_t along = mix32(static_cast<std::uint32_t>(j) * lattice_py + tier.seed);
    for (int i = first; i <= last; ++i) {
      const std::uint32_t word = mix32((static_cast<std::uint32_t>(i) * lattice_px) ^ along);
      const double u = i + (word & 0xFFFF) * 0x1p-16 - double{tier.offset_x};
      const double v = j + (word >> 16) * 0x1p-16 - double{tier.offset_y};
      if (u * u + v * v > reach * reach) continue;
      const double x = tier.side * (c * u - s * v), y = tier.side * (s * u + c * v);
      const std::uint32_t again = mix32(word + cell_step);
      const double number = (again & 0xFFFF) * 0x1p-16;
      const double occupancy = double{tier.occupancy} * density_at(texture.density(), x, y);
      const double largest = std::min(occupancy * most, double{most_occupancy});
      if (number > (1 + double{fade_range}) * largest) continue;
      const std::size_t k = again >> (32 - clump_bits);
      const std::uint64_t place =
          (std::uint64_t{static_cast<std::uint32_t>(i)} << 32) | static_cast<std::uint32_t>(j);
      result.push_back({x, y, double{tier.height[k]}, 1 / double{tier.inverse_radius[k]}, number,
                        occupancy, k, ClumpShape(mix32(again + cell_step)), place});
    }
  }
  return result;
}

}  // namespace gamer
