#include "gamer/galaxy/star_clumps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "galaxy/associations/association_clumps.h"
#include "galaxy/associations/association_texture.h"
#include "galaxy/running_sums.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer {
namespace {

// Places in a clump that give its bound. Their density is q^3.
constexpr std::size_t places_of_clump = 64;

// Margin of the bound, since D and M vary between these places. M has many scales: fewer
// places or a smaller margin lose stars where it is large.
constexpr double bound_margin = 1.5;
// Most clumps of a box without parts.
constexpr std::uint32_t most_clumps = 8;
// Attempts to place a star by the shape of the halo. In the deepest cavity an attempt succeeds with
// a probability of 0.15.
constexpr int most_attempts = 64;

/// Uniform random numbers that follow from a key.
class Numbers {
 public:
  explicit Numbers(std::uint64_t key) : key_(key) {}
  double next() { return to_unit(mix64(key_ += golden_gamma)); }

 private:
  std::uint64_t key_;
};

/// A place in the unit ball with the density q^3.
ClumpPlace place_in_ball(Numbers& numbers) {
  constexpr int steps = 1 << 12;
  static const std::vector<double> below =
      running_sums(steps, [](double r) { return r * r * std::pow(1 - r * r, 3); });
  const double r = place_of_sum(below, numbers.next() * below.back());
  const double cosine = 2 * numbers.next() - 1, sine = std::sqrt(1 - cosine * cosine);
  const double angle = 2 * std::numbers::pi * numbers.next();
  return {r * sine * std::cos(angle), r * sine * std::sin(angle), r * cosine};
}

/// The volume integrals of a clump's halo and of its cores.
struct ClumpLight {
  ClumpLight(const ClumpTier& tier, const AssociationClump& clump) {
    const double volume = clump.radius * clump.radius * clump.radius;
    halo = volume * double{tier.halo[clump.model]} *
           (halo_volume - double{tier.cavity[clump.model]} * cavity_volume);
    cores = volume * double{tier.cores[clump.model]} * cores_volume;
  }
  double halo, cores;
};

/// A place in the clump that follows K, in its radii along the lattice's axes.
ClumpPlace place_of_star(const ClumpTier& tier, const AssociationClump& clump, Numbers numbers) {
  const ClumpLight light(tier, clump);
  const ClumpShape& shape = clump.shape;
  ClumpPlace at{};
  if (numbers.next() * (light.halo + light.cores) < light.cores) {
    const bool is_first = numbers.next() * (1 + double{second_core}) < 1;
    at = place_in_ball(numbers);
    constexpr double radius{core_radius};
    at = {radius * at.x + double{is_first ? shape.core[0] : -shape.core[1]},
          radius * at.y + double{is_first ? shape.core[1] : shape.core[0]}, radius * at.z};
    return bent_place(tier, clump, at);
  }
  const double brightest = 1 + std::abs(double{shape.tilt[0]}) + std::abs(double{shape.tilt[1]});
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    at = place_in_ball(numbers);
    if (numbers.next() * brightest < halo_share(tier, clump, at)) break;
  }
  return bent_place(tier, clump, at);
}

}  // namespace

struct StarClumps::Source {
  AssociationClump clump;
  std::size_t tier;
  double bound;  ///< of share D M w/p
  double stars;  ///< candidates where n is 1
};

StarClumps::~StarClumps() = default;

StarClumps::StarClumps(const AssociationTexture& texture, const Layer& layer)
    : texture_(texture), layer_(layer) {
  for (std::size_t l = 0; l < texture.tiers().size(); ++l) find_sources(l);
  nodes_.emplace_back();
  add_node(0, 0, static_cast<std::uint32_t>(sources_.size()));
}

double StarClumps::scale() const { return texture_.scale(); }

void StarClumps::find_sources(std::size_t tier) {
  static const std::vector<ClumpPlace> places = [] {
    std::vector<ClumpPlace> result;
    Numbers numbers(0);
    for (std::size_t n = 0; n < places_of_clump; ++n) result.push_back(place_in_ball(numbers));
    return result;
  }();
  constexpr std::size_t in_batch = batch_capacity / places_of_clump;
  std::vector<Source> found;
  for (const AssociationClump& clump : find_clumps(texture_, tier)) {
    found.push_back({clump, tier, 0, 0});
  }
  parallel_for((found.size() + in_batch - 1) / in_batch, [&](std::size_t b) {
    const std::span batch = std::span(found)
                                .subspan(b * in_batch)
                                .first(std::min(in_batch, found.size() - b * in_batch));
    BatchArray x{}, y{}, z{}, light;
    std::vector<const Source*> owners;
    for (const Source& source : batch) {
      const AssociationClump& clump = source.clump;
      for (const ClumpPlace& at : places) {
        x[owners.size()] = static_cast<float>(clump.x + clump.radius * at.x);
        y[owners.size()] = static_cast<float>(clump.y + clump.radius * at.y);
        z[owners.size()] = static_cast<float>(clump.z + clump.radius * at.z);
        owners.push_back(&source);
      }
    }
    evaluate_places({x.data(), y.data(), z.data(), owners.size()}, owners, light.data());
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const float* const own = light.data() + k * places_of_clump;
      const ClumpLight whole(texture_.tiers()[tier], batch[k].clump);
      batch[k].bound = bound_margin * double{*std::max_element(own, own + places_of_clump)};
      batch[k].stars = batch[k].bound * (whole.halo + whole.cores);
    }
  });
  std::ranges::copy_if(found, std::back_inserter(sources_),
                       [](const Source& source) { return source.stars > 0; });
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
  // A clump in a warped layer is as high as the plane rises across it, too.
  const double slope = warp.is_flat() ? 0 : std::numbers::sqrt2 * warp.steepest(1);
  const double reach = widest * clump_reach(double{texture_.tiers().front().bends});
  node.box.half = half + reach * (1 + slope);
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
    std::ranges::nth_element(begin, begin + lower, begin + count, {}, place);
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
      offer(sources_[i], i, key, number, take);
    }
  }
}

void StarClumps::offer(const Source& source, std::uint32_t index, std::uint64_t key, double number,
                       const std::function<void(const Candidate&)>& take) const {
  const AssociationClump& clump = source.clump;
  const ClumpTier& tier = texture_.tiers()[source.tier];
  const std::uint64_t word = hash_words({key, source.tier, clump.cell});
  double expected = number * source.stars, count = 0;
  poisson_variates(word, 0, {&expected, 1}, {&count, 1});
  const double c = double{tier.cosine} * tier.side, s = double{tier.sine} * tier.side;
  for (std::uint64_t n = 0; static_cast<double>(n) < count; ++n) {
    Candidate candidate{};
    candidate.key = mix64(word + (n + 1) * golden_gamma);
    candidate.clump = index;
    Numbers numbers(candidate.key ^ golden_gamma);
    candidate.threshold = source.bound * numbers.next();
    const ClumpPlace at = place_of_star(tier, clump, numbers);
    candidate.position[0] = clump.x + clump.radius * (c * at.x - s * at.y);
    candidate.position[1] = clump.y + clump.radius * (s * at.x + c * at.y);
    candidate.position[2] = clump.z + clump.radius * at.z;
    candidate.position[2] += layer_.shape().warp.lift(candidate.position[0], candidate.position[1]);
    take(candidate);
  }
}

void StarClumps::evaluate(const Points& points, std::span<const std::uint32_t> clumps,
                          float* out) const {
  std::vector<const Source*> owners;
  for (const std::uint32_t clump : clumps) owners.push_back(&sources_[clump]);
  BatchArray z{};
  for (std::size_t i = 0; i < points.size; ++i) {
    z[i] = points.z[i] -
           static_cast<float>(layer_.shape().warp.lift(double{points.x[i]}, double{points.y[i]}));
  }
  evaluate_places({points.x, points.y, z.data(), points.size}, owners, out);
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
