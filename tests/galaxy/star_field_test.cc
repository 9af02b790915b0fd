// Stars of a field: their number, places and light.

#include "gamer/galaxy/kinds/star_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "core/error_text.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/stars_of.h"

namespace gamer::star_field_test {
namespace {

std::string field_text(const std::string& rest) {
  return "[[component]]\nclass = \"starfield\"\nname = \"f\"\n" + rest + "\n";
}

/// Deviation of chi-square from its mean in units of its standard deviation.
double chi_square_deviation(const std::vector<double>& found, const std::vector<double>& expected) {
  double chi2 = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    chi2 += (found[i] - expected[i]) * (found[i] - expected[i]) / expected[i];
  }
  const auto n = static_cast<double>(found.size());
  return (chi2 - n) / std::sqrt(2 * n);
}

const std::string spiral = "[arms]\nmodel = \"logarithmic\"\n";

TEST(StellarPopulation, PowerLawInClosedForm) {
  const auto galaxy = parse_galaxy(field_text(
      "luminosity_low = 1e-2\nluminosity_high = 1e4\nluminosity_slope = 1.7\nnoise = false"));
  const StellarPopulation& population = field_of(*galaxy).population();
  const auto number = [](double from) {
    return (std::pow(from, -0.7) - std::pow(1e4, -0.7)) / 0.7;
  };
  const double light = (std::pow(1e4, 0.3) - std::pow(1e-2, 0.3)) / 0.3;
  EXPECT_NEAR(population.mean_luminosity() / (light / number(1e-2)), 1, 1e-12);
  for (const double l : {0.02, 1.0, 37.0, 9000.0}) {
    EXPECT_NEAR(population.number_above(l) / (number(l) / number(1e-2)), 1, 1e-10);
  }
  EXPECT_EQ(population.number_above(2e4), 0);
  EXPECT_NEAR(population.number_above(1e-3), 1, 1e-12);
  double shares = 0;
  for (std::size_t k = 0; k < population.size(); ++k) {
    EXPECT_LE(population.at(k).high, 2.0000001 * population.at(k).low);
    shares += population.at(k).light;
  }
  EXPECT_NEAR(shares, 1, 1e-12);
  EXPECT_NEAR(population.light([](double l) { return l < 1 ? 1.0 : 0.0; }),
              (1 - std::pow(1e-2, 0.3)) / 0.3 / light, 0.002);
}

TEST(StellarPopulation, BoundsAreNotBelowLuminositiesAndClose) {
  for (const std::string slope : {"-10", "1", "1.7", "10"}) {
    const auto galaxy = parse_galaxy(field_text("noise = false\nluminosity_slope = " + slope));
    const StellarPopulation& population = field_of(*galaxy).population();
    for (std::size_t k = 0; k < population.size(); ++k) {
      for (int i = 0; i <= 1000; ++i) {
        const double u = std::min(i / 1000.0, 1 - 0x1p-53);
        const double luminosity = population.luminosity(k, u);
        const double bound = population.luminosity_bound(k, u);
        EXPECT_GE(bound, luminosity) << slope << ' ' << k << ' ' << u;
        // The bound is at most the upper end of the class.
        EXPECT_LE(bound, population.at(k).high * (1 + 1e-11));
      }
      // The bound at u = 0.5 is the luminosity at the end of the step that begins there.
      const double bound = population.luminosity_bound(k, 0.5);
      EXPECT_NEAR(bound / population.luminosity(k, 0.5 + 1.0 / 32), 1, 1e-11);
    }
  }
}

// The luminosities of stars follow the given law, in 40 bins.
TEST(StarField, LuminositiesFollowTheLaw) {
  for (const std::string slope : {"1", "1.7", "2.4"}) {
    const auto galaxy = parse_galaxy(
        field_text("number = 200000\nluminosity_low = 0.1\nluminosity_high = 1000\nnoise = false\n"
                   "luminosity_slope = " +
                   slope));
    const StellarPopulation& population = field_of(*galaxy).population();
    constexpr int bins = 40;
    std::vector<double> found(bins), expected;
    for (const FoundStar& star : stars_of(*galaxy)) {
      const double u = std::log(star.luminosity / 0.1) / std::log(1e4);
      found[std::min(static_cast<std::size_t>(u * bins), std::size_t{bins - 1})] += 1;
    }
    for (int i = 0; i < bins; ++i) {
      const auto edge = [&](int k) { return 0.1 * std::pow(1e4, double(k) / bins); };
      expected.push_back(200000 *
                         (population.number_above(edge(i)) - population.number_above(edge(i + 1))));
    }
    // The emptiest bins have a few stars.
    EXPECT_LT(std::abs(chi_square_deviation(found, expected)), 3.5) << slope;
  }
}

// The numbers of stars in cells of r, phi and z are the integrals of envelope and noise over the
// cells.
TEST(StarField, NumbersFollowTheDensity) {
  const std::string shape = "z0 = 0.05\nrh = 0.25\narm_width = 2\ninner = 0.1\ntwirl = 0.4\n";
  for (const std::string noise : {"noise = false", "noise = {octaves = 3}",
                                  "noise = {octaves = 2, theta = \"linear\", exponent = 3}"}) {
    const double number = 300000;
    const auto galaxy = parse_galaxy(spiral + field_text(shape +
                                                         "number = 300000\nluminosity_low = 1\n"
                                                         "luminosity_high = 10\n" +
                                                         noise));
    constexpr int radial = 12, azimuthal = 12, vertical = 4;
    std::vector<double> found(radial * azimuthal * vertical), expected(found.size());
    const auto cell_of = [&](const Vector& p) {
      const double r = std::hypot(p[0], p[1]), phi = std::atan2(p[1], p[0]);
      const int i = std::min(static_cast<int>(r * radial), radial - 1);
      const int j = std::min(static_cast<int>((phi / (2 * std::numbers::pi) + 0.5) * azimuthal),
                             azimuthal - 1);
      const int k = p[2] < -0.04 ? 0 : p[2] < 0 ? 1 : p[2] < 0.04 ? 2 : 3;
      return static_cast<std::size_t>((i * azimuthal + j) * vertical + k);
    };
    const std::vector<FoundStar> stars = stars_of(*galaxy);
    EXPECT_NEAR((static_cast<double>(stars.size()) - number) / std::sqrt(number), 0,
                noise == "noise = false" ? 3.5 : 12);
    for (const FoundStar& star : stars) found[cell_of(star.place)] += 1;
    // The integrals, as sums over points of a sequence.
    constexpr std::uint64_t points = 2'000'000;
    std::vector<Vector> places;
    std::vector<double> volumes;
    for (std::uint64_t n = 0; n < points; ++n) {
      double u[3];
      R3Sequence().point(n, u);
      const double r = u[0], phi = 2 * std::numbers::pi * u[1];
      const double v = 2 * u[2] - 1;
      places.push_back({r * std::cos(phi), r * std::sin(phi), 0.06 * std::atanh(v)});
      volumes.push_back(2 * std::numbers::pi * r * 0.12 / (1 - v * v) / double(points));
    }
    const auto densities = evaluate(*galaxy, places)[0];
    const double scale = number / galaxy->luminosity(0);
    for (std::size_t n = 0; n < points; ++n) {
      expected[cell_of(places[n])] += scale * double{densities[n]} * volumes[n];
    }
    std::vector<double> f, e;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (expected[i] < 10) continue;
      f.push_back(found[i]);
      e.push_back(expected[i]);
    }
    EXPECT_GT(e.size(), 200u);
    EXPECT_LT(std::abs(chi_square_deviation(f, e)), 3.5) << noise << ", " << e.size() << " cells";
  }
}

// The bounds of random cells hold in layers of every profile. Some bounds are nearly reached.
TEST(StarField, BoundsAreNotBelowTheEnvelope) {
  for (const std::string keys :
       {"rh = 0.3\ninner = 0.2", "rh = 0.2\nbreak_radius = 0.4\nouter_rh = 0.4",
        "ring_radius = 0.5\nring_width = 0.05\nring_outer_width = 0.1",
        "ring_radius = 0.4\naxis_ratio = 0.5\nposition_angle = 30\ninner = 0.3",
        "rh = 0.3\nflare = 3\nlopsidedness = 0.8\nlopsided_angle = 120",
        "rh = 0.4\nwarp_height = 0.4\nwarp_begin = 0.2\nwarp_twist = 200\nflare = 0.5"}) {
    SCOPED_TRACE(keys);
    const auto galaxy = parse_galaxy(field_text(keys + "\nz0 = 0.05\nnoise = false"));
    const StarField& field = field_of(*galaxy);
    double closest = 0;
    for (std::uint64_t i = 0; i < 3000; ++i) {
      const auto u = [&](std::uint64_t k) { return 2 * to_unit(hash_words({i, k})) - 1; };
      StarField::Cell cell{{u(0), u(1), 0.2 * u(2)}, std::exp2(-4 - 2 * u(3)), 0, 0};
      const double bound = field.bound(cell);
      SampleBatch batch;
      BatchArray x{}, y{}, z{}, envelope;
      constexpr std::size_t points = 20;
      for (std::size_t k = 0; k < points; ++k) {
        x[k] = static_cast<float>(cell.centre[0] + cell.half * u(10 + 3 * k));
        y[k] = static_cast<float>(cell.centre[1] + cell.half * u(11 + 3 * k));
        z[k] = static_cast<float>(cell.centre[2] + cell.half * u(12 + 3 * k));
      }
      galaxy->fill_batch({x.data(), y.data(), z.data(), points}, false, batch);
      field.envelope(batch, envelope.data());
      for (std::size_t k = 0; k < points; ++k) {
        ASSERT_LE(envelope[k], bound * (1 + 1e-5) + 1e-12);
        if (bound > 1e-3) closest = std::max(closest, envelope[k] / bound);
      }
    }
    EXPECT_GT(closest, 0.7);
  }
}

// Stars are spread evenly within cells of any level: as many are near a cell's wall as in its
// middle.
TEST(StarField, CellsLeaveNoTrace) {
  const auto galaxy = parse_galaxy(
      field_text("number = 300000\nz0 = 0.3\nrh = 1\nluminosity_low = 1\nluminosity_high = 10\n"
                 "noise = false"));
  const std::vector<FoundStar> stars = stars_of(*galaxy);
  // Within cells of these sides the density is nearly constant.
  for (const double side : {1.0 / 32, 1.0 / 64}) {
    for (const std::size_t axis : {0u, 1u, 2u}) {
      std::vector<double> found(20);
      for (const FoundStar& star : stars) {
        const double u = star.place[axis] / side;
        found[std::min(static_cast<std::size_t>((u - std::floor(u)) * 20), std::size_t{19})] += 1;
      }
      const std::vector<double> expected(20, static_cast<double>(stars.size()) / 20);
      EXPECT_LT(chi_square_deviation(found, expected), 4) << side << ", axis " << axis;
    }
  }
}

// The number in a region over many seeds is a Poisson variate: its variance is its mean.
TEST(StarField, NumbersAreIndependent) {
  double sum = 0, square = 0;
  constexpr int seeds = 300;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const auto galaxy = parse_galaxy(
        field_text("number = 400\nluminosity_low = 1\nluminosity_high = 10\nnoise = false"),
        settings_with(seed));
    double inside = 0;
    for (const FoundStar& star : stars_of(*galaxy)) inside += star.place[0] > 0.05 ? 1 : 0;
    sum += inside / seeds;
    square += inside * inside / seeds;
  }
  const double variance = square - sum * sum;
  EXPECT_NEAR(variance / sum, 1, 3.5 * std::sqrt(2.0 / seeds));
}

TEST(StarField, StarsAreThoseOfTheirSeedAndName) {
  const std::string text = "number = 1000\nnoise = false\n";
  const auto set_of = [](const Galaxy& galaxy) {
    std::set<Vector> result;
    for (const FoundStar& star : stars_of(galaxy)) result.insert(star.place);
    return result;
  };
  const auto first = set_of(*parse_galaxy(field_text(text)));
  EXPECT_EQ(set_of(*parse_galaxy(field_text(text))), first);
  const auto shares = [&](const std::set<Vector>& other) {
    return std::any_of(other.begin(), other.end(),
                       [&](const Vector& p) { return first.contains(p); });
  };
  EXPECT_FALSE(shares(set_of(*parse_galaxy(field_text(text), settings_with(2)))));
  EXPECT_FALSE(
      shares(set_of(*parse_galaxy("[[component]]\nclass = \"starfield\"\nname = \"g\"\n" + text))));
  // Another component of the galaxy changes no star.
  const auto two =
      parse_galaxy("[[component]]\nclass = \"disk\"\nsed = \"flat\"\n" + field_text(text));
  std::set<Vector> places;
  for (const FoundStar& star : stars_of(*two, 1)) places.insert(star.place);
  EXPECT_EQ(places, first);
}

// Skipped cells leave out their stars and change no other star.
TEST(StarField, PartsOfSpaceHaveTheStarsOfTheWhole) {
  const auto galaxy = parse_galaxy(field_text("number = 20000\nnoise = false"));
  const StarField& field = field_of(*galaxy);
  for (const std::size_t k : {0u, 3u, 10u}) {
    std::vector<std::uint64_t> whole, part, within;
    const auto is_inside = [](const double* p) { return p[0] > 0.1 && p[1] < 0.2; };
    field.walk(
        k, galaxy->largest_phi(0), [](const StarField::Cell&) { return true; },
        [&](const StarField::Candidate& c) {
          if (is_inside(c.position)) whole.push_back(c.key);
        });
    field.walk(
        k, galaxy->largest_phi(0),
        [](const StarField::Cell& cell) {
          return cell.centre[0] + cell.half > 0.1 && cell.centre[1] - cell.half < 0.2;
        },
        [&](const StarField::Candidate& c) {
          if (is_inside(c.position)) part.push_back(c.key);
        });
    EXPECT_EQ(part, whole);
  }
}

// The field's spectrum is the mean of its stars' blackbodies, weighted with their light.
TEST(StarField, SpectrumIsTheMeanOfItsStars) {
  const auto galaxy = parse_galaxy(field_text(
      "number = 100000\nluminosity_low = 1\nluminosity_high = 30\nluminosity_slope = 1.2\n"
      "temperature = 4500\ntemperature_slope = 0.15\ntemperature_scatter = 0.1\nnoise = false"));
  std::map<double, double> sums;
  std::map<double, double> squares;
  double light = 0;
  for (const FoundStar& star : stars_of(*galaxy)) {
    const auto sed = blackbody_sed(star.temperature);
    light += star.luminosity;
    for (const double wavelength : {3000.0, 4400.0, 7000.0, 22000.0}) {
      const double flux = star.luminosity * sed->flux(wavelength);
      sums[wavelength] += flux;
      squares[wavelength] += flux * flux;
    }
  }
  for (const auto& [wavelength, sum] : sums) {
    const double expected = galaxy->components()[0]->sed()->flux(wavelength);
    const double error = std::sqrt(squares[wavelength]) / light;
    EXPECT_NEAR(sum / light, expected, 3 * error + 1e-3 * expected) << wavelength;
    EXPECT_LT(error, 0.012 * expected);
  }
  EXPECT_NEAR(galaxy->components()[0]->sed()->flux(5500), 1, 1e-12);
}

// No place of many has a Phi above the largest Phi of the calibration.
TEST(StarField, LargestPhiIsNotExceeded) {
  for (const std::string noise :
       {"{}", "{theta = \"linear\", exponent = 4, octaves = 5}", "{octaves = 8, floor = 0.1}"}) {
    const auto galaxy = parse_galaxy(spiral + field_text("noise = " + noise));
    const auto smooth = parse_galaxy(spiral + field_text("noise = false"));
    std::vector<Vector> places;
    for (std::uint64_t i = 0; i < 200000; ++i) {
      const auto u = [&](std::uint64_t k) { return to_unit(hash_words({i, k})); };
      const double r = -0.2 * std::log(1 - u(0)), phi = 2 * std::numbers::pi * u(1);
      places.push_back({r * std::cos(phi), r * std::sin(phi), 0.04 * (2 * u(2) - 1)});
    }
    const auto textured = evaluate(*galaxy, places)[0];
    const auto plain = evaluate(*smooth, places)[0];
    const double largest = galaxy->largest_phi(0);
    const double scale =
        smooth->components()[0]->amplitude() / galaxy->components()[0]->amplitude();
    double most = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!(plain[i] > 0)) continue;
      most = std::max(most, scale * double{textured[i]} / double{plain[i]});
    }
    EXPECT_LT(most, largest) << noise;
    EXPECT_GT(most, 0.3 * largest) << noise;
  }
}

TEST(StarField, TablesOfLuminosities) {
  const auto parse = [](const std::string& table, const std::string& more = "") {
    Resources resources = Resources::from_record({{"luminosities/lf", "lf.lf", table}});
    return Galaxy::parse(field_text("luminosity_function = \"lf\"\nnoise = false\n" + more),
                         "g.toml", settings_with(1), resources);
  };
  const auto galaxy = parse("# L  dN/dlnL\n1 8\n2 4\n8, 1  # steep\n", "number = 50000");
  // dN/dlnL = 8/L all over: a power law of slope 2.
  const auto same = parse_galaxy(
      field_text("luminosity_low = 1\nluminosity_high = 10\nluminosity_slope = 2\nnoise = false"));
  const double part = 1 - field_of(*same).population().number_above(8);
  for (const double l : {1.1, 2.0, 3.0, 7.0}) {
    EXPECT_NEAR(field_of(*galaxy).population().number_above(l),
                1 - (1 - field_of(*same).population().number_above(l)) / part, 1e-9);
  }
  const auto coloured = parse("1 8 3000\n10 4 12000\n", "temperature_scatter = 0\nnumber = 3000");
  const StarField& field = field_of(*coloured);
  int done = 0;
  field.walk(
      0, coloured->largest_phi(0), [](const StarField::Cell& cell) { return cell.centre[0] < 0.1; },
      [&](const StarField::Candidate& c) {
        if (done++ > 100) return;
        const double l = field.luminosity(0, c);
        EXPECT_NEAR(field.temperature(l, c), 3000 * std::pow(l, std::log10(4.0)), 1e-6 * 3000);
      });

  // Neighbouring luminosities with numbers as far apart as a file may have them.
  const auto extreme = parse("1.9999999999999998 1e-12\n2 1e30\n");
  EXPECT_TRUE(std::isfinite(extreme->components()[0]->sed()->flux(8000)));

  const auto error = [&](const std::string& table, const std::string& more = "") {
    return error_text([&] { parse(table, more); });
  };
  EXPECT_EQ(error("1 2\n"), "lf.lf: fewer than two rows of L and dN/dlnL");
  EXPECT_EQ(error("1 2\n0.5 3\n"), "lf.lf:2:1: luminosities must ascend; 0.5 follows 1");
  EXPECT_EQ(error("1 2\n 2 x\n"), "lf.lf:2:4: 'x' is no number in [1e-12, 1e30]");
  EXPECT_EQ(error("1 2\n2 0\n"), "lf.lf:2:3: '0' is no number in [1e-12, 1e30]");
  EXPECT_EQ(error("1\n2 3\n"), "lf.lf:1:1: a row needs L and dN/dlnL");
  EXPECT_EQ(error("1 1 5000\n2 3\n"), "lf.lf:2:1: some rows have a temperature and some have none");
  EXPECT_EQ(error("1 1 5000\n2 3 400\n"),
            "lf.lf:2:5: temperature 400 is outside [1000, 100000] (K)");
  EXPECT_EQ(error("1 1 5000 3\n"), "lf.lf:1:10: a fourth column; known are L, dN/dlnL and T");
  EXPECT_EQ(error("1 1\n2 3\n", "luminosity_low = 0.1"),
            "g.toml:6:18: component 'f': 'luminosity_low' belongs to luminosity_function = "
            "\"powerlaw\"");
  EXPECT_EQ(error("1 1 5000\n2 3 4000\n", "temperature = 5000"),
            "g.toml:6:15: component 'f': 'temperature' has no meaning: the luminosity function's "
            "file gives temperatures");
}

// With an SED and temperatures, stars have colours, and their mean is the SED.
TEST(StarField, ColoursLieAboutTheSpectrum) {
  const std::string keys =
      "sed = \"powerlaw(-1)\"\nluminosity_low = 1\nluminosity_high = 1e4\n"
      "luminosity_slope = 2.4\n";
  const std::string temperatures =
      "temperature = 8000\ntemperature_slope = 0.02\ntemperature_scatter = 0.16\n";
  const auto even = parse_galaxy(field_text(keys + "noise = false"));
  EXPECT_TRUE(field_of(*even).has_one_sed());
  const auto galaxy = parse_galaxy(field_text(keys + temperatures + "noise = false"));
  const StarField& field = field_of(*galaxy);
  ASSERT_FALSE(field.has_one_sed());
  const StellarPopulation& population = field.population();
  std::vector<double> parts;
  const double light = population.light([](double) { return 1.0; }, &parts);
  // Drawn stars, to three standard deviations of their number.
  double sum = 0, square = 0, drawn = 0;
  for (const FoundStar& star :
       stars_of(*parse_galaxy(field_text(keys + temperatures + "number = 20000\nnoise = false")))) {
    const double flux = field.spectrum(blackbody_sed(star.temperature))->flux(4400);
    drawn += star.luminosity;
    sum += star.luminosity * flux;
    square += std::pow(star.luminosity * (flux - 1.25), 2);
  }
  EXPECT_NEAR(sum / drawn, 1.25, 3 * std::sqrt(square) / drawn);
  EXPECT_LT(std::sqrt(square) / drawn, 0.02);
  const auto cold = field.spectrum(blackbody_sed(4000)), hot = field.spectrum(blackbody_sed(16000));
  for (const double wavelength : {1500.0, 3000.0, 4400.0, 5500.0, 8000.0, 22000.0}) {
    double mean = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const auto own = field.spectrum(blackbody_sed(population.grid()[i]));
      mean += parts[i] / light * own->flux(wavelength);
    }
    const double whole = 5500 / wavelength;
    EXPECT_NEAR(mean / whole, 1, wavelength < 3000 ? 3e-5 : 1e-5) << wavelength;
    const double tint =
        blackbody_sed(16000)->flux(wavelength) / blackbody_sed(4000)->flux(wavelength);
    EXPECT_NEAR(hot->flux(wavelength) / cold->flux(wavelength) / tint, 1, 1e-12);
  }
}

}  // namespace
}  // namespace gamer::star_field_test
