// The densities of a point do not depend on the other points of its batch, nor on its index.
// Otherwise images would depend on how threads share the rays.

#include "gamer/core/batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/error.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/noise/footprint.h"
#include "gamer/noise/noise.h"

namespace gamer::batch_test {
namespace {

/// Hashed numbers.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : seed_(seed) {}
  double unit() { return to_unit(hash_words({seed_, ++count_})); }
  double between(double low, double high) { return low + (high - low) * unit(); }
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(unit() * static_cast<double>(n));
  }
  bool one_in(std::size_t n) { return below(n) == 0; }

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

/// A value of a parameter near its default; empty for the default itself.
std::string value_near_default(const Parameter& parameter, Chance& chance) {
  constexpr double factor = 2, small = 0.1;
  if (chance.one_in(3)) return "";
  if (parameter.type == ParameterType::choice) {
    return "\"" + parameter.choices[chance.below(parameter.choices.size())] + "\"";
  }
  const bool whole = parameter.type == ParameterType::integer;
  if (!whole && parameter.type != ParameterType::number) return "";
  double value = 0;
  if (const auto* number = std::get_if<double>(&parameter.default_value)) value = *number;
  if (const auto* number = std::get_if<std::int64_t>(&parameter.default_value)) {
    value = static_cast<double>(*number);
  }
  value = value == 0 ? small * chance.unit() : value * std::pow(factor, chance.between(-1, 1));
  if (!parameter.interval.contains(value)) return "";
  return whole ? value_text(static_cast<std::int64_t>(value)) : value_text(value);
}

/// Keys of a table with values near their defaults, each after `separator`.
std::string some_values(const ParameterTable& table, const std::vector<std::string>& without,
                        const std::string& separator, Chance& chance) {
  std::string text;
  for (const Parameter& parameter : table) {
    if (parameter.required || std::ranges::count(without, parameter.name) > 0) continue;
    const std::string value = value_near_default(parameter, chance);
    if (!value.empty()) text += separator + parameter.name + " = " + value;
  }
  return text;
}

std::string some_arms(Chance& chance) {
  return chance.one_in(2) ? "[arms]\nmodel = \"logarithmic\"\npitch_angle = " +
                                value_text(chance.between(8, 40)) + "\n"
                          : "[arms]\nmodel = \"ringermacher-mead\"\nscale = " +
                                value_text(std::pow(10, chance.between(-1.7, 0.3))) + "\n";
}

/// The keys that some_values() leaves out for a radial law, and the law's own text.
struct LawKeys {
  std::vector<std::string> without;
  std::string text;
};

LawKeys some_law(Chance& chance) {
  const std::vector<std::string> of_breaks = {"break_radius", "outer_rh", "break_sharpness"};
  const std::vector<std::string> of_rings = {"ring_radius", "ring_width", "ring_outer_width"};
  LawKeys result{{"position_angle", "break_radius", "ring_radius"}, ""};
  const auto add = [&](const std::vector<std::string>& keys) {
    result.without.insert(result.without.end(), keys.begin(), keys.end());
  };
  const std::size_t law = chance.below(3);
  if (law != 1) add(of_breaks);
  if (law != 2) add(of_rings);
  if (law == 1) result.text = "\nbreak_radius = " + value_text(chance.between(0.1, 0.8));
  if (law == 2) {
    add({"rh", "axis_ratio"});
    result.text = "\nring_radius = " + value_text(chance.between(0.1, 0.8)) +
                  "\naxis_ratio = 0.6\nposition_angle = " + value_text(chance.between(0, 360));
  }
  return result;
}

/// A galaxy with a component of a kind, whose parameters are random. Dust with noise is added, so
/// that batches have variants.
std::string some_galaxy(const ComponentKind& kind, Chance& chance) {
  LawKeys law;
  if (std::ranges::any_of(kind.parameters, [](const auto& p) { return p.name == "ring_radius"; })) {
    law = some_law(chance);
  }
  std::vector<std::string> without = {"radius", "fraction", "seed"};
  without.insert(without.end(), law.without.begin(), law.without.end());
  std::string text = some_arms(chance) + "[[component]]\nclass = \"" + kind.name +
                     "\"\nname = \"own\"\n" + some_values(kind.parameters, without, "\n", chance) +
                     law.text;
  for (const Parameter& parameter : kind.parameters) {
    if (parameter.name == "sed" && parameter.required) text += "\nsed = \"flat\"";
    if (parameter.name == "radius") text += "\neffective_radius = 0.1";
    if (parameter.required && parameter.type == ParameterType::number) {
      text += "\n" + parameter.name + " = 0.1";
    }
  }
  if (kind.noise) {
    // Without keys that belong to other combinations.
    const std::string noise =
        some_values(kind.noise->table(),
                    {"seed", "spectral_index", "amplitude", "ridge_offset", "ridge_gain",
                     "warp_frequency", "warp_octaves", "theta", "exponent", "offset", "contrast",
                     "floor", "lacunarity", "frequency_scale"},
                    ", ", chance);
    text += "\nnoise = {frequency_scale = " + value_text(chance.between(0.5, 8)) + noise + "}";
  }
  return text +
         "\n[[component]]\nclass = \"dust\"\nname = \"lanes\"\ntwirl = 0.6\n"
         "noise = {octaves = 5, frequency_scale = 4}\n";
}

struct Ray {
  float footprint, obliquity;
};
struct Place {
  float x, y, z;
  Ray ray;
};

/// Random points and rays. Many footprints are at the ends of the range over which an octave fades.
std::vector<Place> some_places(std::size_t count, Chance& chance) {
  std::vector<Place> places(count);
  for (Place& place : places) {
    // Arms may be steep near the centre.
    const double r = std::pow(chance.unit(), 3), angle = chance.between(-4, 4);
    place = {static_cast<float>(r * std::cos(angle)),
             static_cast<float>(r * std::sin(angle)),
             static_cast<float>(0.1 * chance.between(-1, 1)),
             {static_cast<float>(std::pow(10, chance.between(-6, 0))),
              static_cast<float>(chance.one_in(2) ? 0 : chance.between(0, 2.5))}};
    if (chance.one_in(8)) place.ray.footprint = 0;
    const double cycles = chance.one_in(2) ? fade_begin : fade_end;
    if (chance.one_in(4)) place.ray.footprint = static_cast<float>(cycles / (1 << chance.below(9)));
  }
  return places;
}

/// densities[k][i] of all components and deviations at the places order[i].
std::vector<std::vector<float>> densities_at(const Galaxy& galaxy, const std::vector<Place>& places,
                                             const std::vector<std::size_t>& order,
                                             std::span<const double> deviations) {
  const std::size_t count =
      galaxy.components().size() * std::max<std::size_t>(deviations.size(), 1);
  std::vector<BatchArray> densities(count);
  std::vector<std::vector<float>> result(count);
  for (std::size_t first = 0; first < order.size(); first += batch_capacity) {
    const std::size_t size = std::min(batch_capacity, order.size() - first);
    BatchArray x{}, y{}, z{};
    RayBatch rays{};
    for (std::size_t i = 0; i < size; ++i) {
      const Place& place = places[order[first + i]];
      x[i] = place.x;
      y[i] = place.y;
      z[i] = place.z;
      rays.footprint[i] = place.ray.footprint;
      rays.obliquity[i] = place.ray.obliquity;
    }
    EvaluationCounts counts;
    galaxy.evaluate({x.data(), y.data(), z.data(), size}, 1e-6f, &rays, deviations, densities,
                    counts);
    for (std::size_t k = 0; k < count; ++k) {
      result[k].insert(result[k].end(), densities[k].data(), densities[k].data() + size);
    }
  }
  return result;
}

bool is_same(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Checks that places in batches of all sizes and orders have the densities that they have alone.
void check_batches(const Galaxy& galaxy, const std::vector<Place>& places, Chance& chance) {
  const std::span<const double> variants = dust_deviations;
  std::vector<std::size_t> all(places.size());
  std::iota(all.begin(), all.end(), 0);
  for (const std::span<const double> deviations : {variants.first(0), variants}) {
    std::vector<std::vector<float>> alone;
    for (const std::size_t i : all) {
      const auto own = densities_at(galaxy, places, {i}, deviations);
      alone.resize(own.size());
      for (std::size_t k = 0; k < own.size(); ++k) alone[k].push_back(own[k][0]);
    }
    for (const std::size_t size : {places.size(), places.size() / 2, std::size_t{5}}) {
      std::vector<std::size_t> order = all;
      for (std::size_t i = order.size(); i-- > 1;) std::swap(order[i], order[chance.below(i + 1)]);
      order.resize(size);
      const auto together = densities_at(galaxy, places, order, deviations);
      for (std::size_t k = 0; k < together.size(); ++k) {
        for (std::size_t i = 0; i < size; ++i) {
          ASSERT_TRUE(is_same(together[k][i], alone[k][order[i]]))
              << "component " << k << ", point " << order[i] << ": " << together[k][i] << " and "
              << alone[k][order[i]];
        }
      }
    }
  }
}

/// Checks that rays which resolve all dust have no variants, whatever other rays of their batch
/// have.
void check_narrow_rays(const Galaxy& galaxy, const std::vector<Place>& places) {
  const std::size_t count = galaxy.components().size();
  std::vector<std::size_t> narrow;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool hides = std::ranges::any_of(galaxy.components(), [&](const auto& component) {
      return component->absorbs() && component->hides_texture(double{places[i].ray.footprint});
    });
    if (!hides) narrow.push_back(i);
  }
  std::vector<std::size_t> all(places.size());
  std::iota(all.begin(), all.end(), 0);
  const auto with = densities_at(galaxy, places, all, dust_deviations);
  const auto without = densities_at(galaxy, places, narrow, {});
  for (std::size_t c = 0; c < count; ++c) {
    for (std::size_t i = 0; i < narrow.size(); ++i) {
      ASSERT_TRUE(is_same(with[c][narrow[i]], without[c][i]))
          << "component " << c << ": " << with[c][narrow[i]] << " and " << without[c][i];
    }
  }
}

class Batches : public testing::TestWithParam<const Noise*> {};

TEST_P(Batches, DoNotChangeAPoint) {
  // Some parameters make no galaxy.
  constexpr int wanted = 2, most_tries = 20;
  const Noise& noise = *GetParam();
  for (const ComponentKind& kind : component_kinds()) {
    int made = 0;
    for (std::uint64_t seed = 0; seed < most_tries && made < wanted; ++seed) {
      Chance chance(hash_words({seed, kind.name.size(), noise.name().size()}));
      const std::string text = some_galaxy(kind, chance);
      SCOPED_TRACE(text);
      GalaxySettings settings = settings_with(1, noise);
      settings.most_cloud_points = 2 * batch_capacity;
      std::shared_ptr<const Galaxy> galaxy;
      try {
        galaxy = parse_galaxy(text, settings);
      } catch (const InputError&) {
        continue;
      }
      ++made;
      const std::vector<Place> places = some_places(batch_capacity / 2, chance);
      for_each_simd_target([&] {
        check_batches(*galaxy, places, chance);
        check_narrow_rays(*galaxy, places);
      });
      if (HasFatalFailure()) return;
    }
    EXPECT_EQ(made, wanted) << kind.name;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryNoise, Batches, testing::ValuesIn(noise_kinds()),
                         [](const auto& tested) { return std::string(tested.param->name()); });

}  // namespace
}  // namespace gamer::batch_test
