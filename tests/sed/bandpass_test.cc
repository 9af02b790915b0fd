#include "gamer/sed/bandpass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/error_text.h"
#include "sed/shipped.h"

namespace gamer::bandpass_test {
namespace {

const std::string head = "# wavelength: Angstrom\n# response: photons\n";

std::string text_error(const std::string& text) {
  return error_text([&] { parse_bandpass(text, "x.band", "x"); });
}

double integral(const Bandpass& band, double (*f)(double)) {
  double sum = 0;
  const Bandpass::Nodes nodes = band.nodes();
  for (std::size_t k = 0; k < nodes.wavelength.size(); ++k) {
    sum += nodes.weight[k] * f(nodes.wavelength[k]);
  }
  return sum;
}

struct Shipped {
  std::string name;
  double pivot, mean,
      width;  // docs/facts.md section 3, Angstrom; mean and width 0 where it gives none
  // Values for the rows as shipped, by Gauss quadrature of order 8 between all rows in NumPy.
  double exact_pivot, exact_mean, exact_width, exact_log_width;
  double throughput;
};

const std::vector<Shipped> shipped_bands = {
    {"sdss_u", 3550, 3555, 564, 3550.107812, 3555.406364, 564.15, 0.1591478418, 1},
    {"sdss_g", 4806, 4825, 1266, 4806.416421, 4824.608874, 1267.175, 0.2646402621, 1},
    {"sdss_r", 6248, 6261, 1330, 6247.990641, 6261.251595, 1332.7, 0.2137532922, 1},
    {"sdss_i", 7660, 7674, 1340, 7660.276762, 7673.929594, 1347.425, 0.1762111923, 1},
    {"sdss_z", 9082, 9098, 1309, 9081.318127, 9097.443825, 1309.9, 0.1444973044, 1},
    {"bessell_b", 4399, 4413, 959, 4398.711232, 4413.08382, 959.2, 0.218776385, 1},
    {"bessell_v", 5500, 5512, 893, 5500.332468, 5512.103908, 893.1, 0.1627195006, 1},
    {"bessell_rc", 6564, 6595, 1591, 6563.484156, 6594.720302, 1591, 0.2435553524, 1},
    {"bessell_ic", 8046, 8060, 1495, 8046.50852, 8059.882282, 1495.1, 0.1861161197, 1},
    {"lsst_u", 3665, 0, 0, 3665.208069, 3670.640847, 546.62, 0.1493585687, 0.137},
    {"lsst_g", 4808, 0, 0, 4807.77057, 4826.855933, 1336.74, 0.2791411164, 0.407},
    {"lsst_r", 6210, 0, 0, 6209.752342, 6223.168134, 1338.785, 0.2160597218, 0.454},
    {"lsst_i", 7537, 0, 0, 7536.559472, 7545.970255, 1209.295, 0.1606575298, 0.452},
    {"lsst_z", 8686, 0, 0, 8685.489502, 8690.877823, 994.43, 0.1145642887, 0.444},
    {"lsst_y", 9705, 0, 0, 9704.305292, 9710.159791, 809.81, 0.08349887239, 0.284},
    {"hst_f435w", 4327, 4337, 866, 4327.200298, 4337.399688, 866.05, 0.2006126955, 0.38},
    {"hst_f606w", 5919, 5958, 1996, 5919.396805, 5957.971051, 1996.6, 0.3394959111, 0.479},
    {"hst_f814w", 8060, 8087, 1738, 8059.836176, 8087.299177, 1737.125, 0.2162629641, 0.45},
    {"euclid_vis", 7104, 7181, 3433, 7103.81225, 7180.969704, 3432.75, 0.4884749766, 0.76},
    // This band is GAMER's own.
    {"red_halpha", 7046, 0, 0, 7045.896346, 7079.213788, 387.3, 0.05522809017, 1}};

TEST(ShippedBandpasses, AreThoseOfTheTable) {
  std::vector<std::string> names;
  for (const Shipped& band : shipped_bands) names.push_back(band.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(shipped_names("bandpasses", ".band"), names);
}

TEST(ShippedBandpasses, CheckValues) {
  for (const Shipped& expected : shipped_bands) {
    const auto band = shipped_band(expected.name);
    EXPECT_EQ(band->name(), expected.name);
    EXPECT_EQ(band->throughput(), expected.throughput) << expected.name;
    // Ten digits are given.
    constexpr double digits = 5e-10;
    EXPECT_NEAR(band->pivot() / expected.exact_pivot, 1, digits) << expected.name;
    EXPECT_NEAR(band->mean() / expected.exact_mean, 1, digits) << expected.name;
    EXPECT_NEAR(band->width() / expected.exact_width, 1, digits) << expected.name;
    EXPECT_NEAR(band->log_width() / expected.exact_log_width, 1, digits) << expected.name;
    // The table has the longer curves, to 1 Angstrom, with widths of curves of peak 1.
    EXPECT_NEAR(band->pivot(), expected.pivot, 0.7) << expected.name;
    if (expected.mean == 0) continue;
    EXPECT_NEAR(band->mean(), expected.mean, 0.6) << expected.name;
    EXPECT_NEAR(band->width() / expected.width, 1, 6e-3) << expected.name;
  }
}

// These properties hold for any band.
TEST(ShippedBandpasses, NodesLieInsideTheRangeAndIntegrateTheResponse) {
  for (const std::string& name : shipped_names("bandpasses", ".band")) {
    const auto band = shipped_band(name);
    const auto [wavelength, weight] = band->nodes();
    ASSERT_EQ(wavelength.size(), weight.size());
    EXPECT_TRUE(std::is_sorted(wavelength.begin(), wavelength.end())) << name;
    EXPECT_GT(wavelength.front(), band->range().low) << name;
    EXPECT_LT(wavelength.back(), band->range().high) << name;
    for (std::size_t k = 0; k < wavelength.size(); ++k) {
      EXPECT_GT(band->response(wavelength[k]), 0) << name << " at " << wavelength[k];
      EXPECT_GT(weight[k], 0) << name << " at " << wavelength[k];
    }
    EXPECT_EQ(band->response(band->range().low), 0) << name;
    EXPECT_EQ(band->response(band->range().high), 0) << name;
    EXPECT_NEAR(std::accumulate(weight.begin(), weight.end(), 0.0) / band->width(), 1, 1e-15);
    EXPECT_LT(band->range().low, band->pivot()) << name;
    EXPECT_LT(band->pivot(), band->mean()) << name;
    EXPECT_LT(band->mean(), band->range().high) << name;
    EXPECT_NEAR(band->pivot() * band->pivot() * band->log_width() / (band->mean() * band->width()),
                1, 1e-15)
        << name;
  }
}

TEST(Bandpass, ResponseIsLinearAndZeroOutside) {
  const Bandpass band("b", {1000, 2000, 3000, 4000, 5000}, {0, 0.2, 1, 0, 0}, 0.5);
  EXPECT_EQ(band.response(1000), 0);
  EXPECT_DOUBLE_EQ(band.response(1500), 0.1);
  EXPECT_EQ(band.response(2000), 0.2);
  EXPECT_DOUBLE_EQ(band.response(2250), 0.4);
  EXPECT_EQ(band.response(3000), 1);
  EXPECT_DOUBLE_EQ(band.response(3500), 0.5);
  EXPECT_EQ(band.response(999), 0);
  EXPECT_EQ(band.response(5001), 0);
  EXPECT_EQ(band.throughput(), 0.5);
  EXPECT_EQ(band.range().low, 1000);
  EXPECT_EQ(band.range().high, 4000);
  const Bandpass open("open", {1000, 2000, 3000}, {0.5, 1, 0.5});
  EXPECT_EQ(open.range().low, 1000);
  EXPECT_EQ(open.range().high, 3000);
  EXPECT_EQ(open.throughput(), 1);
}

// A box from a to b: widths b - a and ln(b/a), mean (a + b)/2.
TEST(Bandpass, MomentsOfABox) {
  struct Box {
    double a, b;
  };
  for (const auto& [a, b] : std::vector<Box>{{3500, 4500}, {5, 50}, {1e4, 3e5}, {1e8, 1e10}}) {
    const Bandpass band("box", {a, b}, {0.25, 0.25});
    EXPECT_NEAR(band.width() / (0.25 * (b - a)), 1, 4e-15) << a;
    EXPECT_NEAR(band.log_width() / (0.25 * std::log(b / a)), 1, 6e-11) << a;
    EXPECT_NEAR(band.mean() / ((a + b) / 2), 1, 4e-15) << a;
    EXPECT_NEAR(band.pivot() / std::sqrt((b * b - a * a) / 2 / std::log(b / a)), 1, 6e-11) << a;
  }
}

// With T = (lambda - a)/h, integrals of f are exact up to the fourth power of wavelength.
TEST(Bandpass, NodesIntegratePolynomialsExactly) {
  constexpr double a = 1003;
  constexpr double h = 777;
  const Bandpass band("rise", {a, a + h}, {0, 1});
  EXPECT_NEAR(integral(band, [](double) { return 1.0; }) / (h / 2), 1, 5e-16);
  EXPECT_NEAR(integral(band, [](double x) { return x - a; }) / (h * h / 3), 1, 5e-16);
  EXPECT_NEAR(integral(band, [](double x) { return (x - a) * (x - a); }) / (h * h * h / 4), 1,
              5e-16);
  EXPECT_NEAR(integral(band, [](double x) { return std::pow(x - a, 4); }) / (std::pow(h, 5) / 6), 1,
              5e-16);
  // ln(1780/1003) in pieces of ln 1.01.
  EXPECT_EQ(band.nodes().wavelength.size(), 3 * 58);
}

TEST(Bandpass, PiecesEndAtKinks) {
  const Bandpass band("b", {1000, 1100, 1200}, {0, 1, 0});
  const auto integrate = [&](double kink) {
    const Bandpass::Nodes nodes = band.nodes(std::vector<double>{500, kink, kink, 1500});
    double sum = 0;
    for (std::size_t k = 0; k < nodes.wavelength.size(); ++k) {
      if (nodes.wavelength[k] < kink) sum += nodes.weight[k];
    }
    return sum;
  };
  for (const double kink : {1003.0, 1010.0, 1099.9, 1100.0}) {
    const double width = kink - 1000;
    EXPECT_NEAR(integrate(kink) / (width * width / 200), 1, 1e-14) << kink;
  }
  EXPECT_NEAR(integrate(1150) / 87.5, 1, 1e-14);
}

TEST(Bandpass, NodesLeaveOutWhatDoesNotRespond) {
  const Bandpass band("gap", {1000, 2000, 2010, 3000, 3010, 4000}, {0, 0, 1, 0, 0, 0});
  EXPECT_EQ(band.nodes().wavelength.front(), 2005 - 5 * std::sqrt(0.6));
  EXPECT_LT(band.nodes().wavelength.back(), 3000);
}

TEST(ParseBandpass, ReadsPhotonsAndThroughput) {
  const auto band = parse_bandpass(
      "# wavelength: nm\n# response: photons\n# Throughput: 0.45 \n500 0\n600 1\n800 0\n", "x.band",
      "mine");
  EXPECT_EQ(band->name(), "mine");
  EXPECT_EQ(band->throughput(), 0.45);
  EXPECT_DOUBLE_EQ(band->response(5500), 0.5);
  EXPECT_EQ(band->range().high, 8000);
  EXPECT_DOUBLE_EQ(band->width(), 1500);
  EXPECT_EQ(parse_bandpass(head + "500 0\n600 1\n", "x.band", "x")->throughput(), 1);
}

// A response per energy E becomes one per photon as E/lambda, with the largest value unchanged.
TEST(ParseBandpass, ConvertsEnergy) {
  const auto band = parse_bandpass(
      "# wavelength: um\n# response: energy\n0.5 0\n0.6 0.9\n0.8 0.8\n0.9 0\n", "x.band", "x");
  EXPECT_DOUBLE_EQ(band->response(6000), 0.9);
  EXPECT_DOUBLE_EQ(band->response(8000), 0.8 * 6 / 8);
  EXPECT_EQ(band->response(9000), 0);
  EXPECT_EQ(band->throughput(), 1);
}

TEST(ParseBandpass, Errors) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"500 0\n600 1\n",
       "x.band:1:1: the head does not say the wavelength; add the line "
       "'# wavelength: Angstrom' (or nm, um)"},
      {"# wavelength: nm\n500 0\n600 1\n",
       "x.band:1:1: the head does not say the response; add the line "
       "'# response: photons' (or energy)"},
      {"# wavelength: nm\n# response: photon\n500 0\n600 1\n",
       "x.band:2:13: unknown response 'photon', known: photons, energy; did you mean 'photons'?"},
      {head + "# throughput: 45%\n500 0\n600 1\n", "x.band:3:15: '45%' is not a number"},
      {head + "# throughput: 45\n500 0\n600 1\n", "x.band:3:15: throughput 45 is outside ]0, 1]"},
      {head + "# throughput: 0\n500 0\n600 1\n", "x.band:3:15: throughput 0 is outside ]0, 1]"},
      {head + "# throughput: 0.1\n# throughput: 0.2\n500 0\n600 1\n",
       "x.band:4:15: 'throughput' is given twice, first in line 3"},
      {head + "500 0\n600 x\n", "x.band:4:5: 'x' is not a number"},
      {head + "500 0\n600 -0.1\n", "x.band:4:5: negative response: -0.1"},
      {head + "500 0\n500 1\n", "x.band:4:1: wavelengths are not ascending: 500 after 500"},
      {head + "500 0\n600 0\n", "x.band:3:5: the response is zero in all rows"},
      {head + "500 1\n", "x.band:3:1: 1 row where at least 2 are needed"},
      {head + "0.5 0\n600 1\n",
       "x.band:3:1: wavelength 0.5 Angstrom is outside [1, 10000000000], where bandpasses lie"},
      {head + "500 0\n1e300 1\n",
       "x.band:4:1: wavelength 1e+300 Angstrom is outside [1, 10000000000], where bandpasses lie"},
      {head + "500 0\n600 1e308\n",
       "x.band:3:1: the response is too large or too small to integrate"},
      {head + "500 0\n600 1e-320\n",
       "x.band:3:1: the response is too large or too small to integrate"}};
  for (const auto& [text, message] : cases) EXPECT_EQ(text_error(text), message);
}

TEST(FindBandpass, NamesAndRecords) {
  Resources resources = Resources::from_record(
      {{"bandpasses/narrow", "bandpasses/narrow.band", head + "5000 0\n5010 1\n5020 0\n"},
       {"bandpasses/bad", "bandpasses/bad.band", head + "5000 0\n5010 -1\n"}});
  EXPECT_EQ(find_bandpass("narrow", "", resources)->name(), "narrow");
  EXPECT_EQ(error_text([&] { find_bandpass("bad", "", resources); }),
            "bandpasses/bad.band:4:6: negative response: -1");
  const std::string unknown = error_text([&] { find_bandpass("narow", "", resources); });
  EXPECT_TRUE(unknown.starts_with("unknown bandpass")) << unknown;
  EXPECT_TRUE(unknown.ends_with(" 'narow'; did you mean 'narrow'?")) << unknown;
}

}  // namespace
}  // namespace gamer::bandpass_test
