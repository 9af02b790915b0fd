#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/processing/operation.h"
#include "processing/operation_groups.h"

namespace gamer::detector_operations_test {
namespace {

constexpr double scale = 0.2;  ///< arcsec per pixel

/// One image HDU to be written.
struct TestHdu {
  std::vector<std::vector<double>> planes;
  std::vector<Card> cards;
};

class NoiseOperation : public testing::Test {
 protected:
  NoiseOperation() {
    folder_ = std::filesystem::temp_directory_path() /
              ("gamer_noise_" + std::to_string(getpid()) + "_" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directory(folder_);
  }
  ~NoiseOperation() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }

  void write(const std::string& name, int width, int height, const std::vector<TestHdu>& hdus) {
    FitsOutput output({path(name), true});
    for (const TestHdu& hdu : hdus) {
      FitsHeader header;
      for (const Card& card : hdu.cards) header.set(card);
      std::vector<PlanePtr> planes;
      for (const auto& values : hdu.planes) {
        planes.push_back(std::make_shared<MemoryPlane>(width, height, values));
      }
      output.write(header, planes, -64, 1);
    }
    output.finish();
  }

  /// An image of 4 x 3 equal pixels.
  void write_small(const std::vector<Card>& cards, double value = 1) {
    write("in.fits", 4, 3, {{{std::vector<double>(12, value)}, cards}});
  }

  /// "noise" with these options.
  void noise(const std::string& options, const std::string& in = "in.fits",
             const std::string& out = "out.fits") {
    std::vector<std::string> arguments;
    std::istringstream words(options);
    for (std::string word; words >> word;) arguments.push_back(word);
    arguments.insert(arguments.end(), {"--overwrite", path(in), path(out)});
    const Operation operation = detector_operations().front();
    operation.run(parse_call(operation, arguments));
  }

  std::string error(const std::string& options) {
    try {
      noise(options);
    } catch (const InputError& e) {
      std::string text = e.what();
      const std::size_t at = text.find(folder_.string() + "/");
      return at == std::string::npos ? text : text.erase(at, folder_.string().size() + 1);
    }
    return "none";
  }

  FitsInput output(const std::string& name = "out.fits") { return FitsInput(path(name)); }

  static std::vector<double> pixels(const FitsInput& file, std::size_t hdu = 0, int plane = 0) {
    const Image image = evaluate(*file.plane(hdu, plane));
    const std::size_t size = static_cast<std::size_t>(image.width()) * image.height();
    return {image.plane(0), image.plane(0) + size};
  }

  std::filesystem::path folder_;
};

std::vector<Card> celestial() {
  return {{"CTYPE1", std::string("RA---TAN"), ""},
          {"CTYPE2", std::string("DEC--TAN"), ""},
          {"CRPIX1", 1.0, ""},
          {"CRPIX2", 1.0, ""},
          {"CRVAL1", 10.0, ""},
          {"CRVAL2", 20.0, ""},
          {"CDELT1", -scale / 3600, ""},
          {"CDELT2", scale / 3600, ""},
          {"CUNIT1", std::string("deg"), ""},
          {"CUNIT2", std::string("deg"), ""}};
}

std::vector<Card> with(std::vector<Card> cards, const std::vector<Card>& more) {
  cards.insert(cards.end(), more.begin(), more.end());
  return cards;
}

std::vector<Card> nanojansky() {
  return with(celestial(), {{"BUNIT", std::string("nJy"), ""}, {"MAGZERO", 31.4, ""}});
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

double variance(const std::vector<double>& values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double v : values) sum += (v - middle) * (v - middle);
  return sum / static_cast<double>(values.size() - 1);
}

/// The text of a number with all its digits.
std::string digits(double value) { return fmt::format("{}", value); }

/// The largest relative error of values.
template <class Expected>
double largest_error(const std::vector<double>& values, Expected expected) {
  double largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    largest = std::max(largest, std::abs(values[i] / expected(i) - 1));
  }
  return largest;
}

/// The relative error of a pixel's size, which the WCS gives between points half a pixel apart.
constexpr double sky_error = 2e-9;

constexpr int side_length = 500;
constexpr double pixel_count = side_length * side_length;
const std::vector<double> flat(side_length* side_length, 50.0);

constexpr const char* ccd =
    "--exposure 300 --exposures 3 --zero-point 27 --sky 21 --dark 0.01 "
    "--read-noise 4 ";

/// Expected values for a pixel of 50 nJy with the options `ccd`.
const double electrons_per_unit = std::pow(10, -0.4 * (31.4 - 27)) * 300;
const double true_background = (std::pow(10, -0.4 * (21 - 27)) * scale * scale + 0.01) * 300;
const double true_variance = 50 * electrons_per_unit + true_background + 3 * 4 * 4;

TEST_F(NoiseOperation, KeepsUnitAndZeroPoint) {
  write("in.fits", side_length, side_length, {{{flat}, nanojansky()}});
  noise(ccd);
  const FitsInput out = output();
  const auto values = pixels(out);
  const double sigma = std::sqrt(true_variance) / electrons_per_unit;
  EXPECT_LT(std::abs(mean(values) - 50), 4 * sigma / side_length);
  EXPECT_LT(std::abs(variance(values) / (sigma * sigma) - 1), 4 * std::sqrt(2 / pixel_count));
  const FitsHeader& header = out.hdus().front().header;
  EXPECT_EQ(header.text("BUNIT"), "nJy");
  EXPECT_EQ(header.number("MAGZERO"), 31.4);
  EXPECT_NEAR(*header.number("GAIN"), electrons_per_unit, 1e-12 * electrons_per_unit);
  EXPECT_EQ(header.number("EXPTIME"), 300);
  EXPECT_NEAR(*header.number("RDNOISE"), 4 * std::sqrt(3.0), 1e-14);
  EXPECT_FALSE(header.has("SATURATE"));
  ASSERT_TRUE(header.has("HISTORY"));
  noise(std::string(ccd) + "--keep-sky");
  const auto kept = pixels(output());
  const double sky = true_background / electrons_per_unit;
  EXPECT_LT(largest_error(kept, [&](std::size_t i) { return values[i] + sky; }), sky_error);
}

TEST_F(NoiseOperation, WritesElectronsAndAdu) {
  write("in.fits", side_length, side_length,
        {{{flat}, with(nanojansky(), {{"PHOTZP", 31.4, ""}, {"PHOTFLAM", 2e-20, ""}})}});
  noise(ccd);
  const auto same = pixels(output());
  noise(std::string(ccd) + "--output-unit electron --keep-sky --full-well 1090");
  const FitsInput electrons = output();
  const auto counts = pixels(electrons);
  const double full = 1090 * 3;
  int clipped = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = same[i] * electrons_per_unit + true_background;
    if (expected > full) ++clipped;
  }
  EXPECT_LT(largest_error(counts,
                          [&](std::size_t i) {
                            return std::min(same[i] * electrons_per_unit + true_background, full);
                          }),
            sky_error);
  EXPECT_GT(clipped, 100);
  EXPECT_LT(clipped, side_length * side_length - 100);
  FitsHeader header = electrons.hdus().front().header;
  EXPECT_EQ(header.text("BUNIT"), "electron");
  EXPECT_EQ(header.number("SATURATE"), full);
  EXPECT_EQ(header.number("GAIN"), 1);
  // The zero point for one electron in 300 s, at 27 mag for 1 electron/s.
  EXPECT_NEAR(*header.number("MAGZERO"), 27 + 2.5 * std::log10(300), 1e-12);
  EXPECT_NEAR(*header.number("PHOTZP"), 27 + 2.5 * std::log10(300), 1e-12);
  EXPECT_NEAR(*header.number("PHOTFLAM") * electrons_per_unit / 2e-20, 1, 1e-12);

  noise(std::string(ccd) + "--output-unit ADU --gain 1.5 --bias 200 --full-well 1e6");
  const FitsInput adu = output();
  const auto units = pixels(adu);
  EXPECT_LT(
      largest_error(units, [&](std::size_t i) { return same[i] * electrons_per_unit / 1.5 + 200; }),
      1e-12);
  header = adu.hdus().front().header;
  EXPECT_EQ(header.text("BUNIT"), "adu");
  EXPECT_EQ(header.number("GAIN"), 1.5);
  EXPECT_NEAR(*header.number("SATURATE") / ((3e6 - true_background) / 1.5 + 200), 1, sky_error);
  EXPECT_NEAR(*header.number("MAGZERO"), 27 + 2.5 * std::log10(300 / 1.5), 1e-12);
}

TEST_F(NoiseOperation, MeasuresWhatTheVarianceSays) {
  std::vector<double> steps(flat.size());
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = i < steps.size() / 2 ? 0 : 200;
  write("in.fits", side_length, side_length,
        {{{steps, flat},
          with(celestial(), {{"BUNIT", std::string("nJy"), ""},
                             {"EXTNAME", std::string("SKY"), ""},
                             {"MAGZERO1", 31.4, ""},
                             {"MAGZERO2", 30.4, ""}})},
         {{flat}, with(nanojansky(), {{"EXTNAME", std::string("DEEP"), ""}})},
         {{flat}, nanojansky()},
         {{flat}, nanojansky()}});
  noise(std::string(ccd) + "--variance");
  const FitsInput out = output();
  ASSERT_EQ(out.hdus().size(), 8u);
  const char* names[] = {"SKY", "SKY_VARIANCE", "DEEP", "DEEP_VARIANCE",
                         "",    "VARIANCE",     "",     "VARIANCE"};
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.hdus()[i].name, names[i]);
  EXPECT_EQ(out.hdus()[7].header.number("EXTVER"), 2);
  const auto check = [&](std::size_t hdu, int plane) {
    const auto values = pixels(out, hdu, plane), variances = pixels(out, hdu + 1, plane);
    const auto half = static_cast<std::ptrdiff_t>(values.size() / 2);
    for (const auto& [first, last] : {std::pair{std::ptrdiff_t{0}, half}, {half, 2 * half}}) {
      const double v = variances[static_cast<std::size_t>(first)];
      EXPECT_EQ(variances[static_cast<std::size_t>(last) - 1], v);
      const double found = variance({values.begin() + first, values.begin() + last});
      EXPECT_LT(std::abs(found / v - 1), 4 * std::sqrt(4 / pixel_count)) << hdu << ' ' << plane;
    }
    return variances.back();
  };
  const double square = electrons_per_unit * electrons_per_unit;
  EXPECT_NEAR(check(0, 0) * square / (true_variance + 150 * electrons_per_unit), 1, sky_error);
  check(0, 1);
  EXPECT_NEAR(check(2, 0) * square / true_variance, 1, sky_error);
  check(4, 0);
  const FitsHeader& header = out.hdus()[1].header;
  EXPECT_EQ(header.text("BUNIT"), "nJy2");
  for (const char* key : {"MAGZERO1", "MAGZERO2", "GAIN1", "GAIN2", "GAIN"}) {
    EXPECT_FALSE(header.has(key)) << key;
  }
  // The electrons per unit differ between planes, and so do the cards.
  const FitsHeader& image = out.hdus()[0].header;
  EXPECT_NEAR(*image.number("GAIN2") / *image.number("GAIN1"), std::pow(10, 0.4), 1e-12);
  EXPECT_FALSE(image.has("GAIN"));
  EXPECT_EQ(image.number("EXPTIME"), 300);

  noise("--sigma 3 --variance", "in.fits", "sigma.fits");
  for (const double v : pixels(output("sigma.fits"), 3)) EXPECT_EQ(v, 9);
  const std::pair<const char*, const char*> units[] = {
      {"MJy/sr", "MJy2/sr2"},
      {"erg/(s.cm2.Angstrom.arcsec2)", "erg2/(s2.cm4.Angstrom2.arcsec4)"},
      {"10**-3 Jy sr^-1*m99999999999", "10**-6 Jy2 sr^-2*m99999999999"}};
  for (const auto& [unit, square_unit] : units) {
    write("in.fits", 2, 2,
          {{{{1, 2, 3, 4}}, {{"BUNIT", std::string(unit), ""}, {"DATAMAX", 4.0, ""}}}});
    noise("--sigma 3 --variance");
    EXPECT_EQ(output().hdus()[1].header.text("BUNIT"), square_unit);
    EXPECT_FALSE(output().hdus()[0].header.has("DATAMAX"));
  }
}

TEST_F(NoiseOperation, IsTheSameForAnyPlaneOrder) {
  const auto band = [](const char* name, int plane, int planes) {
    return Card{planes == 1 ? "BAND" : "BAND" + std::to_string(plane), std::string(name), ""};
  };
  const auto electrons = [&](const std::vector<Card>& bands) {
    return with({{"BUNIT", std::string("electron/s"), ""}}, bands);
  };
  write("gri.fits", side_length, side_length,
        {{{flat, flat, flat}, electrons({band("g", 1, 3), band("r", 2, 3), band("i", 3, 3)})}});
  write("ig.fits", side_length, side_length,
        {{{flat, flat}, electrons({band("i", 1, 2), band("g", 2, 2)})}});
  write("r.fits", side_length, side_length, {{{flat}, electrons({band("r", 1, 1)})}});
  write("gg.fits", side_length, side_length,
        {{{flat}, electrons({band("g", 1, 1)})}, {{flat}, electrons({band("g", 1, 1)})}});
  for (const char* options : {"--exposure 10 --read-noise 3", "--sigma 2", "--snr 30"}) {
    for (const char* name : {"gri", "ig", "r", "gg"}) {
      noise(options, std::string(name) + ".fits", std::string(name) + "_out.fits");
    }
    const auto g = pixels(output("gri_out.fits"), 0, 0);
    const auto r = pixels(output("gri_out.fits"), 0, 1);
    const auto i = pixels(output("gri_out.fits"), 0, 2);
    EXPECT_EQ(pixels(output("ig_out.fits"), 0, 0), i);
    EXPECT_EQ(pixels(output("ig_out.fits"), 0, 1), g);
    EXPECT_EQ(pixels(output("r_out.fits")), r);
    EXPECT_EQ(pixels(output("gg_out.fits"), 0), g);
    EXPECT_NE(pixels(output("gg_out.fits"), 1), g);
    EXPECT_NE(g, r);
    EXPECT_NE(g, i);
  }
}

TEST_F(NoiseOperation, RepeatsWithItsSeedAndThreads) {
  write("in.fits", side_length, side_length, {{{flat}, nanojansky()}});
  noise(ccd);
  const auto first = pixels(output());
  noise(std::string(ccd) + "--seed 1 --threads 3");
  EXPECT_EQ(pixels(output()), first);
  noise(std::string(ccd) + "--seed 2");
  EXPECT_NE(pixels(output()), first);
}

TEST_F(NoiseOperation, TakesSurfaceBrightnessAndElectronRates) {
  write("in.fits", side_length, side_length, {{{flat}, nanojansky()}});
  noise(std::string(ccd) + "--output-unit electron");
  const FitsInput flux = output();
  const auto expected = pixels(flux);
  const auto expect_same = [&](const std::vector<double>& values) {
    // Rounding may move a few means to another integer.
    int differ = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::abs(values[i] - expected[i]) > true_background * sky_error) ++differ;
    }
    EXPECT_LT(differ, 10);
  };
  // This image is in surface brightness, light per arcsec^2.
  constexpr double area = scale * scale;
  write("in.fits", side_length, side_length,
        {{{std::vector<double>(flat.size(), 50 / area)},
          with(celestial(), {{"BUNIT", std::string("nJy/arcsec2"), ""}, {"MAGZERO", 31.4, ""}})}});
  noise(std::string(ccd) + "--output-unit electron");
  expect_same(pixels(output()));
  EXPECT_NEAR(*output().hdus()[0].header.number("MAGZERO"),
              *flux.hdus()[0].header.number("MAGZERO"), 1e-9);
  // This image is in electron/s, with its zero point of 27 in the header.
  const double rate = electrons_per_unit / 300;
  write("in.fits", side_length, side_length,
        {{{std::vector<double>(flat.size(), 50 * rate)},
          with(celestial(), {{"BUNIT", std::string("electron/s"), ""}, {"MAGZERO", 27.0, ""}})}});
  const std::string rest = "--exposure 300 --exposures 3 --dark 0.01 --read-noise 4 ";
  noise(rest + "--sky 21 --output-unit electron");
  expect_same(pixels(output()));
  // This image is in relative units.
  write("in.fits", side_length, side_length,
        {{{std::vector<double>(flat.size(), 0.5)}, celestial()}});
  noise(rest + "--sky 21 --zero-point 27 --output-unit electron --electrons-per-unit " +
        digits(100 * rate));
  expect_same(pixels(output()));
  EXPECT_FALSE(output().hdus()[0].header.has("MAGZERO"));
  noise(rest + "--output-unit electron --electrons-per-unit " + digits(100 * rate) +
        " --sky-rate " + digits(true_background / 300 - 0.01));
  expect_same(pixels(output()));
}

TEST_F(NoiseOperation, GivesTheSignalToNoiseRatioAskedFor) {
  const std::vector<double> other(flat.size(), 2.0);
  write("in.fits", side_length, side_length, {{{flat, other}, {}}});
  noise("--snr 1000,200");
  const double n = pixel_count;
  const auto first = pixels(output(), 0, 0), second = pixels(output(), 0, 1);
  EXPECT_NEAR(std::sqrt(variance(first)) / (50 * side_length / 1000.0), 1, 4 / std::sqrt(2 * n));
  EXPECT_NEAR(std::sqrt(variance(second)) / (2 * side_length / 200.0), 1, 4 / std::sqrt(2 * n));
  noise("--sigma 0,0.5");
  EXPECT_EQ(pixels(output(), 0, 0), flat);
  EXPECT_NEAR(std::sqrt(variance(pixels(output(), 0, 1))) / 0.5, 1, 4 / std::sqrt(2 * n));
}

TEST_F(NoiseOperation, SaysWhichOptionsAreWrong) {
  write_small(nanojansky());
  const std::vector<std::pair<const char*, const char*>> cases = {
      {"",
       "gutil noise: which noise? --exposure (s) or --instrument for a detector, --sigma or "
       "--snr for plain Gaussian noise"},
      {"--sigma 1 --snr 3", "gutil noise: --sigma and --snr exclude each other; leave one out"},
      {"--exposure 1 --zero-point 25 --sky 20 --sky-rate 1",
       "gutil noise: --sky and --sky-rate exclude each other; leave one out"},
      {"--sigma 1 --exposure 3",
       "gutil noise: --exposure is of a detector and does not go with --sigma, plain Gaussian "
       "noise; leave one out"},
      {"--snr 1 --read-noise 3",
       "gutil noise: --read-noise is of a detector and does not go with --snr, plain Gaussian "
       "noise; leave one out"},
      {"--exposure 1 --zero-point 25 --gain 2",
       "gutil noise: --gain is of the converter to ADU; add --output-unit ADU"},
      {"--exposure 1 --zero-point 25 --output-unit electron --bias 2",
       "gutil noise: --bias is of the converter to ADU; add --output-unit ADU"},
      {"--exposure 1",
       "gutil noise: how many electrons is light? Give --zero-point (AB magnitude of 1 "
       "electron/s)"},
      {"--exposure 1 --zero-point 25 --electrons-per-unit 3",
       "gutil noise: in.fits has MAGZERO, so --zero-point and --electrons-per-unit exclude each "
       "other; leave one out"},
      {"--exposure 1 --zero-point 1e6",
       "gutil noise: a pixel of value 1 of in.fits would be inf electrons, and the sky 0; check "
       "the zero points, --sky and --exposure"},
      {"--exposure 1 --zero-point 25 --sky -1e6",
       "gutil noise: a pixel of value 1 of in.fits would be 0.00275423 electrons, and "
       "the sky inf; check the zero points, --sky and --exposure"},
      {"--sigma 1,2", "gutil noise: --sigma has 2 values for 1 plane; give one, or one for each"},
      {"--exposure 0", "gutil noise: --exposure[0] = 0 is outside ]0, inf[ (s)"},
  };
  for (const auto& [options, message] : cases) EXPECT_EQ(error(options), message) << options;
  EXPECT_FALSE(std::filesystem::exists(path("out.fits")));
}

TEST_F(NoiseOperation, SaysWhatTheImageLacks) {
  write_small({});
  EXPECT_EQ(error("--exposure 1"),
            "gutil noise: how many electrons is light? Give --zero-point (AB magnitude of 1 "
            "electron/s) or, as in.fits has no MAGZERO, --electrons-per-unit");
  EXPECT_EQ(error("--exposure 1 --zero-point 25"),
            "gutil noise: --zero-point needs MAGZERO, and in.fits has none; give "
            "--electrons-per-unit");
  EXPECT_EQ(error("--exposure 1 --electrons-per-unit 3 --sky 21"),
            "gutil noise: --sky needs --zero-point (AB magnitude of 1 electron/s), as in.fits has "
            "no MAGZERO; or give --sky-rate");
  write_small({{"MAGZERO", 30.0, ""}});
  const std::string no_wcs = error("--exposure 1 --zero-point 25 --sky 21");
  EXPECT_EQ(no_wcs.find("gutil noise: --sky needs the size of pixels: "), 0u) << no_wcs;
  EXPECT_NE(no_wcs.find("; give --sky-rate"), std::string::npos) << no_wcs;
  write_small({{"BUNIT", std::string("MJy/sr"), ""}, {"MAGZERO", 30.0, ""}});
  const std::string no_area = error("--exposure 1 --zero-point 25");
  EXPECT_EQ(no_area.find("gutil noise: a surface brightness (MJy/sr) becomes electrons by the size "
                         "of pixels: "),
            0u)
      << no_area;
  EXPECT_EQ(error("--exposure 1 --electrons-per-unit 3"), "none");
  std::filesystem::remove(path("out.fits"));
  write_small({{"BUNIT", std::string("mag/arcsec2"), ""}});
  EXPECT_EQ(error("--exposure 1 --electrons-per-unit 3"),
            "gutil noise: the pixels of in.fits are magnitudes (mag/arcsec2), which do not add "
            "up; a flux or surface brightness is needed");
  write_small({}, 0);
  EXPECT_EQ(error("--snr 5"),
            "gutil noise: --snr needs light: plane 1 of in.fits has none; --sigma needs none");
  write_small({}, INFINITY);
  EXPECT_EQ(error("--snr 5"),
            "gutil noise: --snr needs light: plane 1 of in.fits has infinite pixels; --sigma "
            "needs none");
  EXPECT_FALSE(std::filesystem::exists(path("out.fits")));
}

}  // namespace
}  // namespace gamer::detector_operations_test
