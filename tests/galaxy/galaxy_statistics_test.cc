// Statistics that processes measure in parts and share.

#include "gamer/galaxy/calibration/galaxy_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/galaxy/kinds/star_field.h"

namespace gamer::galaxy_statistics_test {
namespace {

// Every kind of texture, with followers that have a texture or none. Followers stand before the
// followed disk.
const std::string all_parts =
    "[arms]\nmodel = \"logarithmic\"\n"
    "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.1\n"
    "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nfraction = 0.1\nnoise = {octaves = 2}\n"
    "follows = \"arms\"\n"
    "[[component]]\nclass = \"stars\"\nname = \"plain\"\nsed = \"flat\"\nfraction = 0.1\n"
    "noise = false\nfollows = \"arms\"\n"
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"flat\"\nfraction = 0.3\n"
    "noise = {octaves = 3, combination = \"multiplicative\", amplitude = 3, warp = 0.05}\n"
    "[[component]]\nclass = \"dust\"\nnoise = {octaves = 3, combination = \"ridged\"}\n"
    "[[component]]\nclass = \"veins\"\noctaves = 2\n"
    "[[component]]\nclass = \"associations\"\nsed = \"flat\"\nfraction = 0.1\n"
    "[[component]]\nclass = \"starfield\"\nnumber = 1e4\nfraction = 0.2\nnoise = {octaves = 2}\n";

GalaxySettings quick_settings() {
  GalaxySettings settings = settings_with(3);
  settings.most_cloud_points = 4 * batch_capacity;
  return settings;
}

std::shared_ptr<Galaxy> read_galaxy(const std::string& text, const GalaxySettings& settings) {
  Resources resources({});
  return Galaxy::read(parse_toml(text, "g.toml"), settings, resources);
}

/// Points along a spiral, at heights up to `height`.
struct SpiralPoints {
  BatchArray x{}, y{}, z{};

  SpiralPoints(double radius, double height) {
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double share = static_cast<double>(i) / batch_capacity;
      x[i] = static_cast<float>(radius * share * std::cos(40 * share));
      y[i] = static_cast<float>(radius * share * std::sin(40 * share));
      z[i] = static_cast<float>(height * std::sin(7 * share));
    }
  }
  Points points() const { return {x.data(), y.data(), z.data(), batch_capacity}; }
};

/// Densities for rays that resolve all and for wider rays, then the largest Phi of components.
std::vector<float> densities_of(const Galaxy& galaxy) {
  const std::size_t components = galaxy.components().size();
  const SpiralPoints spiral(0.6, 0.01);
  RayBatch rays{};
  for (std::size_t i = 0; i < batch_capacity; ++i) {
    const double share = static_cast<double>(i) / batch_capacity;
    rays.footprint[i] = static_cast<float>(0.3 * share);
    rays.obliquity[i] = static_cast<float>(2 * share);
  }
  std::vector<float> all;
  EvaluationCounts counts;
  const auto take = [&](const RayBatch* seen_by, std::span<const double> deviations) {
    std::vector<BatchArray> densities(components * std::max<std::size_t>(deviations.size(), 1));
    galaxy.evaluate(spiral.points(), 1e-4f, seen_by, deviations, densities, counts);
    for (std::size_t k = 0; k < densities.size(); ++k) {
      const bool varies = galaxy.components()[k % components]->absorbs();
      if (k >= components && !varies) continue;
      all.insert(all.end(), densities[k].data(), densities[k].data() + batch_capacity);
    }
  };
  take(nullptr, {});
  take(&rays, {});
  take(&rays, dust_deviations);
  for (const double phi : galaxy.calibration().largest_phi) {
    all.push_back(static_cast<float>(phi));
  }
  return all;
}

/// Measures copies of a galaxy as processes do: each measures some parts and takes all parts.
/// `slices` becomes the number of slices of larger clouds.
void measure_together(std::span<Galaxy* const> galaxies, std::size_t& slices) {
  std::vector<GalaxyStatistics> statistics;
  for (Galaxy* const galaxy : galaxies) statistics.emplace_back(*galaxy);
  const std::size_t processes = galaxies.size();
  const std::size_t numbers = statistics.front().most_numbers();
  for (const GalaxyStatistics::Round round : GalaxyStatistics::rounds) {
    const std::size_t parts = statistics.front().parts(round);
    std::vector<std::vector<double>> measured(parts, std::vector<double>(numbers));
    // From the last to the first.
    for (std::size_t part = parts; part-- > 0;) {
      statistics[part % processes].measure(round, part, measured[part]);
    }
    if (round == GalaxyStatistics::Round::larger) slices = parts;
    for (GalaxyStatistics& own : statistics) {
      EXPECT_EQ(own.parts(round), parts);
      for (std::size_t part = 0; part < parts; ++part) own.take(round, part, measured[part]);
      own.finish(round);
    }
  }
  for (GalaxyStatistics& own : statistics) own.adopt();
}

/// Copies of a galaxy, one for each process, measured together with their references.
std::vector<std::shared_ptr<Galaxy>> measured_apart(const std::string& text,
                                                    const GalaxySettings& settings,
                                                    std::size_t processes, std::size_t& slices) {
  std::vector<std::shared_ptr<Galaxy>> galaxies;
  for (std::size_t p = 0; p < processes; ++p) galaxies.push_back(read_galaxy(text, settings));
  std::vector<Galaxy*> references, own;
  for (const auto& galaxy : galaxies) {
    if (galaxy->reference() != nullptr) references.push_back(galaxy->reference().get());
    own.push_back(galaxy.get());
  }
  if (!references.empty()) measure_together(references, slices);
  measure_together(own, slices);
  return galaxies;
}

TEST(GalaxyStatistics, PartsMeasuredApartMakeTheSameGalaxy) {
  const std::vector<float> expected = densities_of(*parse_galaxy(all_parts, quick_settings()));
  for (const std::size_t processes : {1u, 2u, 5u}) {
    std::size_t slices = 0;
    for (const auto& galaxy : measured_apart(all_parts, quick_settings(), processes, slices)) {
      EXPECT_EQ(densities_of(*galaxy), expected) << processes;
    }
  }
}

// Followed and following textures that need large clouds: one follower has no texture, and one has
// the seed of the followed texture.
const std::string sparse_parts =
    "[[component]]\nclass = \"disk\"\nname = \"clumps\"\nsed = \"flat\"\nz0 = 0.02\nrh = 0.2\n"
    "noise = {octaves = 3, frequency_scale = 9, theta = \"linear\", exponent = 6, seed = 4}\n"
    "[[component]]\nclass = \"stars\"\nname = \"own\"\nsed = \"flat\"\nz0 = 0.02\nrh = 0.25\n"
    "noise = {octaves = 2, frequency_scale = 9, theta = \"linear\", exponent = 2}\n"
    "follows = \"clumps\"\n"
    "[[component]]\nclass = \"stars\"\nname = \"plain\"\nsed = \"flat\"\nz0 = 0.02\nrh = 0.15\n"
    "noise = false\nfollows = \"clumps\"\n"
    "[[component]]\nclass = \"stars\"\nname = \"alike\"\nsed = \"flat\"\nz0 = 0.02\nrh = 0.2\n"
    "noise = {octaves = 3, frequency_scale = 9, theta = \"linear\", exponent = 2, seed = 4}\n"
    "follows = \"clumps\"\n";

TEST(GalaxyStatistics, SlicesOfLargeCloudsMakeTheMeansOfTheWhole) {
  GalaxySettings settings = settings_with(3);
  settings.most_cloud_points = std::size_t{1} << 19;
  const auto whole = parse_galaxy(sparse_parts, settings);
  std::size_t slices = 0;
  for (const auto& galaxy : measured_apart(sparse_parts, settings, 3, slices)) {
    EXPECT_EQ(densities_of(*galaxy), densities_of(*whole));
  }
  // Each component has several slices.
  EXPECT_GE(slices, 4u * 2);
  // <Phi> = 1 over other points of each component, within a radius of 0.75. The limit is twice the
  // largest of the four differences. Each contains the errors of both clouds.
  constexpr double lengths[] = {0.2, 0.25, 0.15, 0.2};
  for (std::size_t c = 0; c < std::size(lengths); ++c) {
    const double z0 = 0.02, rh = lengths[c];
    const double reach = 0.75 / rh;
    double sum = 0;
    constexpr std::size_t points = std::size_t{1} << 20;
    for (std::size_t first = 0; first < points; first += batch_capacity) {
      BatchArray x, y, z, density;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        double u[3];
        R3Sequence().point(first + i, u);
        // Newton's steps to the q where 1 - (1 + q) e^-q is u[0] times its value at `reach`.
        double q = 1.7;
        const double share = u[0] * (1 - (1 + reach) * std::exp(-reach));
        for (int n = 0; n < 30; ++n) {
          const double error = 1 - (1 + q) * std::exp(-q) - share;
          q = std::clamp(q - error / (q * std::exp(-q)), 0.5 * q, 0.5 * (q + reach));
        }
        const double angle = 2 * std::numbers::pi * u[1];
        x[i] = static_cast<float>(rh * q * std::cos(angle));
        y[i] = static_cast<float>(rh * q * std::sin(angle));
        z[i] = static_cast<float>(z0 * std::atanh(1.9999 * (u[2] - 0.5)));
      }
      EvaluationCounts counts;
      whole->evaluate_component(c, {x.data(), y.data(), z.data(), batch_capacity}, 0, density,
                                counts);
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const double r = std::hypot(double{x[i]}, double{y[i]});
        sum += double{density[i]} * std::pow(std::cosh(double{z[i]} / z0), 2) * std::exp(r / rh);
      }
    }
    EXPECT_NEAR(sum / points, 1, 0.01) << c;
  }
}

TEST(GalaxyStatistics, AMeanThatIsZeroOrInfiniteOverALargeCloudIsAnError) {
  GalaxySettings settings = settings_with(3);
  settings.most_cloud_points = std::size_t{1} << 19;
  using Round = GalaxyStatistics::Round;
  for (const double light : {0.0, HUGE_VAL}) {
    const auto galaxy = read_galaxy(sparse_parts, settings);
    GalaxyStatistics statistics(*galaxy);
    std::vector<double> numbers(statistics.most_numbers());
    for (const Round round : {Round::textures, Round::means}) {
      for (std::size_t part = 0; part < statistics.parts(round); ++part) {
        statistics.measure(round, part, numbers);
        statistics.take(round, part, numbers);
      }
      statistics.finish(round);
    }
    // The sum of weights is 1, and all sums with the texture are `light`.
    std::fill(numbers.begin(), numbers.end(), light);
    numbers[0] = 1;
    for (std::size_t part = 0; part < statistics.parts(Round::larger); ++part) {
      statistics.take(Round::larger, part, numbers);
    }
    EXPECT_EQ(error_text([&] { statistics.finish(Round::larger); }),
              "g.toml:1:1: component 'clumps': its texture is zero or infinite; change the noise's "
              "offset, contrast, exponent or floor");
  }
}

TEST(GalaxyStatistics, WhatARayMeetsDoesNotDependOnItsNeighbours) {
  // Tables are looked up once where all rays have one footprint and direction.
  const auto galaxy = parse_galaxy(all_parts, quick_settings());
  const std::size_t components = galaxy->components().size();
  const SpiralPoints spiral(0.5, 0);
  const auto densities = [&](const RayBatch& rays) {
    EvaluationCounts counts;
    std::vector<BatchArray> all(components * dust_deviations.size());
    galaxy->evaluate(spiral.points(), 1e-4f, &rays, dust_deviations, all, counts);
    return all;
  };
  constexpr std::size_t last = batch_capacity - 1;
  // Obliquities on both sides of that of a table, ln 2.5, and this one.
  for (const float obliquity : {0.4f, static_cast<float>(std::log(2.5)), 1.2f, 3.0f}) {
    RayBatch alike{};
    std::fill_n(alike.footprint.data(), batch_capacity, 0.03f);
    std::fill_n(alike.obliquity.data(), batch_capacity, obliquity);
    const std::vector<BatchArray> expected = densities(alike);
    for (const auto& [other_footprint, other_obliquity] :
         {std::pair(0.1f, obliquity), {0.002f, obliquity}, {0.03f, 0.1f}, {0.03f, 2.5f}}) {
      RayBatch rays = alike;
      rays.footprint[last] = other_footprint;
      rays.obliquity[last] = other_obliquity;
      const std::vector<BatchArray> with_another = densities(rays);
      for (std::size_t k = 0; k < expected.size(); ++k) {
        if (k >= components && !galaxy->components()[k % components]->absorbs()) continue;
        EXPECT_TRUE(
            std::equal(expected[k].data(), expected[k].data() + last, with_another[k].data()))
            << k << ", obliquity " << obliquity << " beside " << other_obliquity << ", footprint "
            << other_footprint;
      }
    }
  }
}

/// The number of a galaxy's parts, by round. Measures them.
std::vector<std::size_t> measured_parts_of(Galaxy& galaxy, FootprintRange footprints = {}) {
  GalaxyStatistics statistics(galaxy, footprints);
  std::vector<double> numbers(statistics.most_numbers());
  std::vector<std::size_t> parts;
  for (const auto round : GalaxyStatistics::rounds) {
    parts.push_back(statistics.parts(round));
    for (std::size_t part = 0; part < parts.back(); ++part) {
      const Component& component = *galaxy.components()[statistics.component(round, part)];
      EXPECT_NE(component.kind(), "bulge");
      statistics.measure(round, part, numbers);
      statistics.take(round, part, numbers);
    }
    statistics.finish(round);
  }
  return parts;
}

TEST(GalaxyStatistics, HasPartsOfTexturedComponents) {
  const auto galaxy = read_galaxy(all_parts, quick_settings());
  // Six textures: a follower, a disk, associations, a star field and two kinds of dust. Two kinds
  // of dust have means and closures, each for three obliquities.
  EXPECT_EQ(measured_parts_of(*galaxy->reference()), (std::vector<std::size_t>{6, 2, 0, 2 * 3}));
  // Textures are those of the reference, which has the same seed. Seven means: those of the
  // textures and of the follower without one. One number more: the star field's largest Phi.
  const std::vector<std::size_t> parts = measured_parts_of(*galaxy);
  EXPECT_EQ(parts[0], 0u);
  EXPECT_EQ(parts[1], 7u);
  EXPECT_EQ(parts[3], 1u);
  const auto smooth = read_galaxy(
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n", quick_settings());
  EXPECT_EQ(measured_parts_of(*smooth), (std::vector<std::size_t>{0, 0, 0, 0}));
  EXPECT_EQ(smooth->reference(), nullptr);
}

TEST(GalaxyStatistics, OfFixedFluxHaveScalesOfTheReference) {
  GalaxySettings settings = quick_settings();
  settings.accuracy = Accuracy::from_tolerance(1e-2);
  settings.seed = 5;
  const auto statistics_of = [](const Galaxy& galaxy) {
    std::vector<std::vector<double>> all;
    for (const auto& component : galaxy.components()) {
      if (component->texture() != nullptr) all.push_back(component->texture()->statistics());
    }
    return all;
  };
  FootprintRange of_fixed_flux;
  of_fixed_flux.needs_light_means = false;
  const auto galaxy = read_galaxy(all_parts, settings);
  std::vector<bool> only_scale;
  for (const auto& component : galaxy->components()) {
    const Texture* texture = component->texture();
    if (texture != nullptr) only_scale.push_back(texture->statistics_only_scale());
  }
  EXPECT_THROW(measured_parts_of(*galaxy, of_fixed_flux), std::logic_error);
  measured_parts_of(*galaxy->reference(), of_fixed_flux);
  // Associations and veins take their scale from the reference. Only dust has means.
  EXPECT_EQ(measured_parts_of(*galaxy, of_fixed_flux), (std::vector<std::size_t>{4, 2, 0, 0}));
  const auto of_galaxy = statistics_of(*galaxy), of_reference = statistics_of(*galaxy->reference());
  for (std::size_t k = 0; k < of_galaxy.size(); ++k) {
    EXPECT_EQ(of_galaxy[k] == of_reference[k], only_scale[k]) << k;
  }
  // In relative units each seed has scales of its own.
  EXPECT_EQ(measured_parts_of(*galaxy)[0], 6u);
  const auto in_relative_units = statistics_of(*galaxy);
  for (std::size_t k = 0; k < of_galaxy.size(); ++k) {
    EXPECT_NE(in_relative_units[k], of_reference[k]) << k;
  }
}

/// The parts of a galaxy and its reference, by name, without zeros at their end.
std::map<std::string, std::vector<double>> measured_parts(const std::string& text,
                                                          const GalaxySettings& settings) {
  std::map<std::string, std::vector<double>> result;
  const std::shared_ptr<Galaxy> own = read_galaxy(text, settings);
  for (Galaxy* const galaxy : {own->reference().get(), own.get()}) {
    if (galaxy == nullptr) continue;
    GalaxyStatistics statistics(*galaxy);
    for (const auto round : GalaxyStatistics::rounds) {
      for (std::size_t part = 0; part < statistics.parts(round); ++part) {
        std::vector<double> numbers(statistics.most_numbers(), 0.0);
        statistics.measure(round, part, numbers);
        const std::string name = statistics.name(round, part);
        statistics.take(round, part, numbers);
        while (!numbers.empty() && numbers.back() == 0) numbers.pop_back();
        result.emplace(name, numbers);
      }
      statistics.finish(round);
    }
    statistics.adopt();
  }
  return result;
}

TEST(GalaxyStatistics, PartsOfEqualNamesAreEqualInAllGalaxies) {
  // Edits, and whether they leave a part as it was, or all parts.
  struct Edit {
    std::string before, after;
    bool keeps_some;
    bool keeps_all = false;
  };
  const std::string veins_end = "octaves = 2\n[[component]]\nclass = \"associations\"";
  const Edit edits[] = {
      {"octaves = 3, comb", "octaves = 2, comb", true},
      {"effective_radius = 0.1", "effective_radius = 0.2", true, true},
      {"name = \"plain\"", "name = \"plain\"\nrh = 0.3", true},
      {"class = \"dust\"", "class = \"dust\"\nz0 = 0.03", true},
      {"class = \"associations\"", "class = \"associations\"\nnumber = 100", true},
      {"number = 1e4", "number = 1e4\nrh = 0.3", true},
      {veins_end, "seed = 4\n" + veins_end, true},
      {"model = \"logarithmic\"", "model = \"logarithmic\"\npitch_angle = 20", false},
      {"[arms]", "[galaxy]\naxis = [1, 1, 2]\n[arms]", false},
  };
  for (const double tolerance : {1e-1, 1e-3}) {
    GalaxySettings settings = quick_settings();
    settings.accuracy = Accuracy::from_tolerance(tolerance);
    // Closures over few points do not depend on light.
    if (tolerance < 1e-2) settings.most_cloud_points = std::size_t{1} << 13;
    const auto known = measured_parts(all_parts, settings);
    for (const auto& [before, after, keeps_some, keeps_all] : edits) {
      std::string edited = all_parts;
      edited.replace(edited.find(before), before.size(), after);
      std::size_t kept = 0;
      const auto parts = measured_parts(edited, settings);
      for (const auto& [name, numbers] : parts) {
        const auto found = known.find(name);
        if (found == known.end()) continue;
        ++kept;
        EXPECT_EQ(numbers, found->second) << after << ": " << name;
      }
      EXPECT_EQ(kept > 0, keeps_some) << after;
      EXPECT_EQ(kept == parts.size(), keeps_all) << after;
    }
  }
}

TEST(GalaxyStatistics, TheLargestPhiOfStarsDoesNotDependOnTheTolerance) {
  const std::string text =
      "[[component]]\nclass = \"starfield\"\nnumber = 1e4\nz0 = 0.02\nrh = 0.2\n"
      "noise = {octaves = 3, frequency_scale = 9, theta = \"linear\", exponent = 2}\n";
  const auto measured = [&](double tolerance) {
    GalaxySettings settings = settings_with(3);
    settings.accuracy = Accuracy::from_tolerance(tolerance);
    std::shared_ptr<Galaxy> galaxy = read_galaxy(text, settings);
    GalaxyStatistics(*galaxy).measure_all();
    return galaxy;
  };
  const auto coarse = measured(1e-1), fine = measured(1e-3);
  EXPECT_NE(coarse->calibration().means[0].narrowest(), fine->calibration().means[0].narrowest());
  EXPECT_EQ(coarse->largest_phi(0), fine->largest_phi(0));
}

TEST(GalaxyStatistics, SeedsShareTheClosureOfTheirReferenceAtCoarseTolerances) {
  GalaxySettings settings = quick_settings();
  settings.accuracy = Accuracy::from_tolerance(1e-2);
  const auto first = read_galaxy(all_parts, settings);
  settings.seed = 8;
  settings.reference = first->reference();
  const auto second = read_galaxy(all_parts, settings);
  ASSERT_EQ(second->reference(), first->reference());
  EXPECT_FALSE(first->reference()->calibration().closure_range.covers({}));
  GalaxyStatistics(*first).measure_all();
  EXPECT_TRUE(first->reference()->calibration().closure_range.covers({}));
  GalaxyStatistics(*second).measure_all();
  // The result is that with a reference of its own.
  settings.reference = nullptr;
  EXPECT_EQ(densities_of(*second), densities_of(*parse_galaxy(all_parts, settings)));
  EXPECT_NE(densities_of(*second), densities_of(*first));
}

TEST(GalaxyStatistics, SeedsHaveClosuresOfTheirOwnAtFineTolerances) {
  GalaxySettings settings = quick_settings();
  settings.accuracy = Accuracy::from_tolerance(1e-3);
  const auto first = read_galaxy(all_parts, settings);
  settings.seed = 8;
  const auto alone = parse_galaxy(all_parts, settings);
  settings.reference = first->reference();
  const auto second = read_galaxy(all_parts, settings);
  EXPECT_NE(second->reference(), first->reference());
  GalaxyStatistics(*second).measure_all();
  EXPECT_EQ(densities_of(*second), densities_of(*alone));
}

TEST(GalaxyStatistics, TablesAreTheSameWhateverTheRangeOfFootprints) {
  const GalaxySettings settings = quick_settings();
  const SpiralPoints spiral(0.5, 0.01);
  const auto densities = [&](const FootprintRange& range, float footprint) {
    const auto galaxy = read_galaxy(all_parts, settings);
    GalaxyStatistics(*galaxy, range).measure_all();
    RayBatch rays{};
    std::fill_n(rays.footprint.data(), batch_capacity, footprint);
    std::fill_n(rays.obliquity.data(), batch_capacity, 0.4f);
    EvaluationCounts counts;
    const std::size_t components = galaxy->components().size();
    std::vector<BatchArray> all(components * dust_deviations.size());
    galaxy->evaluate(spiral.points(), 1e-4f, &rays, dust_deviations, all, counts);
    std::vector<float> result;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (k >= components && !galaxy->components()[k % components]->absorbs()) continue;
      result.insert(result.end(), all[k].data(), all[k].data() + batch_capacity);
    }
    return result;
  };
  for (const float footprint : {0.003f, 0.02f, 0.09f}) {
    const std::vector<float> expected = densities({}, footprint);
    const auto width = double{footprint};
    EXPECT_EQ(densities({width, width}, footprint), expected) << footprint;
    EXPECT_EQ(densities({0.5 * width, width}, footprint), expected) << footprint;
    EXPECT_EQ(densities({width, 0.3}, footprint), expected) << footprint;
  }
  // Drawn stars and the dust in front of them need the whole texture.
  const auto whole = [&](const FootprintRange& range) {
    const auto galaxy = read_galaxy(all_parts, settings);
    GalaxyStatistics(*galaxy, range).measure_all();
    EvaluationCounts counts;
    std::vector<float> result;
    for (std::size_t c = 0; c < galaxy->components().size(); ++c) {
      BatchArray density;
      galaxy->evaluate_component(c, spiral.points(), 1e-4f, density, counts);
      result.insert(result.end(), density.data(), density.data() + batch_capacity);
    }
    return result;
  };
  EXPECT_EQ(whole({0.03, 0.03, true}), whole({.sees_whole = true}));
}

TEST(GalaxyStatistics, EveryPartTellsOfATextureThatCannotBeNormalised) {
  const auto galaxy = read_galaxy(
      "[[component]]\nclass = \"disk\"\nname = \"dark\"\nsed = \"flat\"\n"
      "noise = {theta = \"linear\", offset = -10}\n"
      "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nfollows = \"dark\"\n",
      quick_settings());
  GalaxyStatistics statistics(*galaxy);
  std::vector<double> numbers(statistics.most_numbers());
  constexpr auto first = GalaxyStatistics::Round::textures;
  ASSERT_EQ(statistics.parts(first), 2u);
  for (const std::size_t part : {1u, 0u}) {
    EXPECT_EQ(error_text([&] {
                statistics.measure(first, part, numbers);
              }).find("g.toml:1:1: component 'dark': the noise is zero or infinite"),
              0u);
  }
}

}  // namespace
}  // namespace gamer::galaxy_statistics_test
