#include "gamer/galaxy/star_clumps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "galaxy/associations/association_clumps.h"
#include "galaxy/associations/association_texture.h"
#include "gamer/core/cancellation.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer {
namespace {

// Number of places in a clump whose largest value gives the clump's bound. The places have the
// density q^3.
constexpr std::size_t places_of_clump = 64;
// Margin of the bound, since D and M vary between these places. M has many scales: fewer places or
// a smaller margin would lose stars where M is large.
constexpr double bound_margin = 1.5;
// Clumps count as absent where their random number exceeds this factor times the occupancy at their
// centre. The factor is a margin, since the octaves vary across a clump.
constexpr double absent_margin = 4;
// Most clumps of a box without parts.
constexpr std::uint32_t most_clumps = 8;
// Largest expected number of candidates of a part of a clump. Larger parts are halved.
constexpr double most_candidates = 16;
constexpr int deepest = 20;
// Largest distance of a clump's light from its centre in the plane, radii. Cores may reach further
// than the halo.
const double reach_in_plane =
    std::numbers::sqrt2 * (double{core_offset} + double{wide_bend.height + narrow_bend.height}) +
    double{core_radius};
// Largest factor by which the waves of a clump stretch distances.
double largest_stretch() {
  double stretch = 1;
  for (const Bend& bend : {wide_bend, narrow_bend}) {
    const double one = stretch_of(8 * double{bend.height * bend.cycles});
    stretch *= one * one;
  }
  return stretch;
}

// The parts of a clump whose light is proportional to q^3.
constexpr int part_count = 3;
constexpr int halo = 0, first_core = 1;

/// An upper bound of the halo's factor of tilt.
double tilt_bound(const ClumpShape& shape) {
  return 1 + std::abs(double{shape.tilt[0]}) + std::abs(double{shape.tilt[1]});
}

/// Volume integral of a part of K. For the halo it is the integral of an upper bound.
double light_of_part(const ClumpTier& tier, const AssociationClump& clump, int part) {
  const double volume = clump.radius * clump.radius * clump.radius;
  if (part == halo) {
    return volume * halo_volume * double{tier.halo[clump.model]} * tilt_bound(clump.shape);
  }
  constexpr double cores = 1 + double{second_core};
  const double share = (part == first_core ? 1 : double{second_core}) / cores;
  return share * volume * cores_volume * double{tier.cores[clump.model]};
}

/// The place in a part of a clump that corresponds to the place `at` in the unit ball. The result
/// is in radii of the clump along the lattice's axes.
ClumpPlace place_in_part(const ClumpTier& tier, const AssociationClump& clump, int part,
                         ClumpPlace at) {
  if (part != halo) {
    const ClumpShape& shape = clump.shape;
    constexpr double radius{core_radius};
    at = {radius * at.x + double{part == first_core ? shape.core[0] : -shape.core[1]},
          radius * at.y + double{part == first_core ? shape.core[1] : shape.core[0]},
          radius * at.z};
  }
  return bent_place(tier, clump, at);
}

}  // namespace

struct StarClumps::Source {
  AssociationClump clump;
  std::size_t tier;
  double bound;  ///< of share D M w/p
};

StarClumps::~StarClumps() = default;

StarClumps::StarClumps(const AssociationTexture& texture, const Layer& layer)
    : texture_(texture), layer_(layer) {
  for (std::size_t l = 0; l < texture.tiers().size(); ++l) find_sources(l);
  nodes_.emplace_back();
  add_node(0, 0, static_cast<std::uint32_t>(sources_.size()));
}

std::size_t StarClumps::octaves() const { return texture_.octaves(); }

double StarClumps::scale() const { return texture_.scale(); }

std::vector<StarClumps::Source> StarClumps::possible_sources(std::size_t tier) const {
  std::vector<Source> result;
  const std::vector<AssociationClump> clumps = find_clumps(texture_, tier);
  for (std::size_t first = 0; first < clumps.size(); first += batch_capacity) {
    const std::span batch =
        std::span(clumps).subspan(first).first(std::min(batch_capacity, clumps.size() - first));
    BatchArray x{}, y{}, z{};
    for (std::size_t i = 0; i < batch.size(); ++i) {
      x[i] = static_cast<float>(batch[i].x);
      y[i] = static_cast<float>(batch[i].y);
      z[i] = static_cast<float>(batch[i].z);
    }
    AssociationTexture::OctaveArrays noise, products;
    texture_.fill_octaves({x.data(), y.data(), z.data(), batch.size()}, noise);
    texture_.multiply_octaves(batch.size(), noise, nullptr, products);
    const BatchArray& crowding = products[texture_.octaves_before(tier)];
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const double occupancy = batch[i].occupancy * double{std::max(crowding[i], least_complexes)};
      if (batch[i].number <= absent_margin * occupancy) result.push_back({batch[i], tier, 0});
    }
  }
  return result;
}

void StarClumps::find_sources(std::size_t tier) {
  static const std::vector<ClumpPlace> places = [] {
    std::vector<ClumpPlace> result;
    for (std::size_t n = 0; n < places_of_clump; ++n) {
      std::array<double, 3> u{};
      R3Sequence().point(n, u.data());
      result.push_back(place_in_ball(u));
    }
    return result;
  }();
  constexpr std::size_t in_batch = batch_capacity / places_of_clump;
  std::vector<Source> found = possible_sources(tier);
  parallel_for((found.size() + in_batch - 1) / in_batch, [&](std::size_t b) {
    const std::span batch = std::span(found)
                                .subspan(b * in_batch)
                                .first(std::min(in_batch, found.size() - b * in_batch));
    BatchArray x{}, y{}, z{}, light;
    std::vector<const Source*> owners;
    for (const Source& source : batch) {
      const AssociationClump& clump = source.clump;
      for (const ClumpPlace& at : places) {
        // Every second place moves along its column to where the clump is nearest to the mid-plane.
        const double half = std::sqrt(1 - at.x * at.x - at.y * at.y);
        const double up =
            owners.size() % 2 == 0 ? at.z : std::clamp(-clump.z / clump.radius, -half, half);
        x[owners.size()] = static_cast<float>(clump.x + clump.radius * at.x);
        y[owners.size()] = static_cast<float>(clump.y + clump.radius * at.y);
        z[owners.size()] = static_cast<float>(clump.z + clump.radius * up);
        owners.push_back(&source);
      }
    }
    evaluate_places({x.data(), y.data(), z.data(), owners.size()}, owners, light.data());
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const float* const own = light.data() + k * places_of_clump;
      batch[k].bound = bound_margin * double{*std::max_element(own, own + places_of_clump)};
    }
  });
  std::ranges::copy_if(found, std::back_inserter(sources_),
                       [](const Source& source) { return source.bound > 0; });
}

void StarClumps::add_node(std::size_t at, std::uint32_t first, std::uint32_t count) {
  const LayerWarp& warp = layer_.shape().warp;
  std::array<double, 3> low, high;
  low.fill(2);
  high.fill(-2);
  double widest = 0;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const AssociationClump& clump = sources_[i].clump;
    const std::array<double, 3> place = {clump.x, clump.y, clump.z + warp.lift(clump.x, clump.y)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], place[axis]);
      high[axis] = std::max(high[axis], place[axis]);
    }
    widest = std::max(widest, clump.radius);
  }
  Node node{{}, first, count, 0};
  double half = 0;
  std::size_t longest = 0;
  for (std::size_t axis = 0; axis < 3 && count > 0; ++axis) {
    node.box.centre[axis] = 0.5 * (low[axis] + high[axis]);
    half = std::max(half, 0.5 * (high[axis] - low[axis]));
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  }
  node.box.half = half + widest * reach_in_plane * (1 + warp_slope());
  if (count > most_clumps) {
    node.parts = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    const auto begin = sources_.begin() + first;
    const std::uint32_t lower = count / 2;
    const auto place = [&](const Source& source) {
      const AssociationClump& clump = source.clump;
      return std::array{longest == 0   ? clump.x
                        : longest == 1 ? clump.y
                                       : clump.z,
                        static_cast<double>(source.tier), clump.x, clump.y};
    };
    std::ranges::sort(begin, begin + count, {}, place);
    add_node(node.parts, first, lower);
    add_node(node.parts + 1, first + lower, count - lower);
  }
  nodes_[at] = node;
}

void StarClumps::walk(std::uint64_t key, double number, const std::function<bool(const Box&)>& keep,
                      const std::function<void(const Candidate&)>& take) const {
  std::vector<std::uint32_t> open = {0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!keep(node.box)) continue;
    if (node.parts != 0) {
      open.insert(open.end(), {node.parts + 1, node.parts});
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Source& source = sources_[i];
      const std::uint64_t word = hash_words({key, source.tier, source.clump.cell});
      for (int part = 0; part < part_count; ++part) {
        const double expected = number * source.bound *
                                light_of_part(texture_.tiers()[source.tier], source.clump, part);
        if (!(expected > 0)) continue;
        const Piece whole{i, part, {0, 0, 0}, 0, mix64(word + std::uint64_t(part) * golden_gamma)};
        offer(whole, expected, keep, take);
      }
    }
  }
}

void StarClumps::offer(const Piece& piece, double expected,
                       const std::function<bool(const Box&)>& keep,
                       const std::function<void(const Candidate&)>& take) const {
  if (expected <= most_candidates || piece.level == deepest) return fill(piece, expected, take);
  if (!keep(box_of(piece))) return;
  check_cancelled();
  const double half = std::ldexp(1.0, -piece.level - 1);
  for (std::uint64_t octant = 0; octant < 8; ++octant) {
    Piece inner = piece;
    ++inner.level;
    inner.key = mix64(piece.key + (octant + 1) * golden_gamma);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((octant >> axis) & 1) inner.low[axis] += half;
    }
    offer(inner, expected / 8, keep, take);
  }
}

void StarClumps::fill(const Piece& piece, double expected,
                      const std::function<void(const Candidate&)>& take) const {
  const Source& source = sources_[piece.clump];
  const AssociationClump& clump = source.clump;
  const ClumpTier& tier = texture_.tiers()[source.tier];
  double count = 0;
  poisson_variates(piece.key, 0, {&expected, 1}, {&count, 1});
  const double side = std::ldexp(1.0, -piece.level);
  // The words of the candidates follow those of the octants.
  constexpr std::uint64_t first_word = 9;
  for (std::uint64_t n = 0; static_cast<double>(n) < count; ++n) {
    Candidate candidate{};
    candidate.key = mix64(piece.key + (first_word + n) * golden_gamma);
    candidate.clump = piece.clump;
    const auto unit = [&](std::uint64_t word) {
      return to_unit(mix64(~candidate.key + word * golden_gamma));
    };
    std::array<double, 3> u{};
    for (std::size_t axis = 0; axis < 3; ++axis) u[axis] = piece.low[axis] + side * unit(axis + 1);
    const ClumpPlace at = place_in_ball(u);
    candidate.threshold = source.bound * unit(4);
    if (piece.part == halo) {
      candidate.threshold *= tilt_bound(clump.shape) / halo_share(tier, clump, at);
    }
    const auto place = place_of(source, place_in_part(tier, clump, piece.part, at));
    std::ranges::copy(place, candidate.position);
    take(candidate);
  }
}

std::array<double, 3> StarClumps::place_of(const Source& source, const ClumpPlace& at) const {
  const AssociationClump& clump = source.clump;
  const ClumpTier& tier = texture_.tiers()[source.tier];
  const double c = double{tier.cosine} * tier.side, s = double{tier.sine} * tier.side;
  const double x = clump.x + clump.radius * (c * at.x - s * at.y);
  const double y = clump.y + clump.radius * (s * at.x + c * at.y);
  return {x, y, clump.z + clump.radius * at.z + layer_.shape().warp.lift(x, y)};
}

double StarClumps::warp_slope() const {
  const LayerWarp& warp = layer_.shape().warp;
  if (warp.is_flat()) return 0;
  // Clumps may reach beyond the ball.
  const double farthest = 1 + 2 * texture_.tiers().front().side;
  return std::numbers::sqrt2 * warp.steepest(farthest);
}

StarClumps::Box StarClumps::box_of(const Piece& piece) const {
  const Source& source = sources_[piece.clump];
  const ClumpTier& tier = texture_.tiers()[source.tier];
  const double side = std::ldexp(1.0, -piece.level);
  const std::array middle = {piece.low[0] + 0.5 * side, piece.low[1] + 0.5 * side,
                             piece.low[2] + 0.5 * side};
  const double near = radius_of_share(piece.low[0]), far = radius_of_share(piece.low[0] + side);
  const double r = radius_of_share(middle[0]);
  const auto angle = [&](double u) { return std::acos(std::clamp(2 * u - 1, -1.0, 1.0)); };
  // The piece lies within this distance of the place of its middle, before the waves.
  const double along = std::max(angle(piece.low[1]) - angle(middle[1]),
                                angle(middle[1]) - angle(piece.low[1] + side));
  const double across = far * (along + std::numbers::pi * side);
  const double distance = std::min(std::max(far - r, r - near) + across, 2 * far);
  const auto place =
      place_of(source, place_in_part(tier, source.clump, piece.part, place_in_ball(middle)));
  const double half = source.clump.radius * largest_stretch() * distance * (1 + warp_slope());
  return {{place[0], place[1], place[2]}, half};
}

void StarClumps::evaluate(const Points& points, std::span<const std::uint32_t> clumps,
                          float* out) const {
  std::array<const Source*, batch_capacity> owners;
  BatchArray z{};
  for (std::size_t i = 0; i < points.size; ++i) {
    owners[i] = &sources_[clumps[i]];
    const double lift = layer_.shape().warp.lift(double{points.x[i]}, double{points.y[i]});
    z[i] = static_cast<float>(double{points.z[i]} - lift);
  }
  evaluate_places({points.x, points.y, z.data(), points.size}, std::span(owners).first(points.size),
                  out);
}

void StarClumps::evaluate_places(const Points& points, std::span<const Source* const> owners,
                                 float* out) const {
  AssociationTexture::OctaveArrays noise, products;
  texture_.fill_octaves(points, noise);
  texture_.multiply_octaves(points.size, noise, nullptr, products);
  layer_.envelope_above_plane(points, out);
  for (std::size_t i = 0; i < points.size; ++i) {
    const Source& source = *owners[i];
    const double crowding{
        std::max(products[texture_.octaves_before(source.tier)][i], least_complexes)};
    const double occupancy = std::min(source.clump.occupancy * crowding, double{most_occupancy});
    const double weight = weight_of(source.clump.number, occupancy);
    out[i] = static_cast<float>(double{out[i]} * double{products[texture_.octaves()][i]} * weight *
                                double{texture_.tiers()[source.tier].share} / occupancy);
  }
}

}  // namespace gamer
