#include "processing/rgb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "image/image_test_util.h"
#include "image/read_png.h"

namespace gamer::rgb_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr Limits unit = {0, 1};

std::array<int, 3> bytes_of(const Rgb& rgb) {
  return {static_cast<int>(255 * rgb[0]), static_cast<int>(255 * rgb[1]),
          static_cast<int>(255 * rgb[2])};
}

double unit_random(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

// ---- Lupton ------------------------------------------------------------------------------------

/// The colour of one pixel, computed as rows are.
Rgb colour_of(const ColourOf& colour, Rgb rgb) {
  colour({&rgb[0], &rgb[1], &rgb[2]}, 1);
  return rgb;
}

/// The formula that LuptonTone documents.
Rgb lupton(const LuptonTone& tone, const Rgb& rgb) {
  Rgb colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = tone.scale[c] * (rgb[c] - tone.minimum[c]);
  const double intensity = (colour[0] + colour[1] + colour[2]) / 3;
  if (!(intensity > 0)) return {};
  const double value =
      0.1 * std::asinh(tone.q * intensity / tone.stretch) / std::asinh(0.1 * tone.q);
  const double largest = *std::max_element(colour.begin(), colour.end()) * value / intensity;
  for (double& c : colour) c = std::max(c * value / intensity / std::max(largest, 1.0), 0.0);
  return colour;
}

TEST(LuptonTone, KnownBytes) {
  LuptonTone tone;
  tone.stretch = 0.5;
  EXPECT_EQ(bytes_of(colour_of(tone, {0.2, 0.1, 0.05})), (std::array{82, 41, 20}));
  // F(I)/I = 1.481106 is the paper's value, times Q 0.1/asinh(0.1 Q).
  EXPECT_NEAR(colour_of(tone, {0.2, 0.1, 0.05})[0], 0.2 * 1.481106 * 0.8 / std::asinh(0.8), 1e-6);
}

TEST(ColourOf, IsTheTone) {
  LuptonTone tone;
  tone.minimum = {0.01, 0.02, 0.03};
  tone.scale = {1, 0.5, 2};
  tone.stretch = 0.5;
  std::mt19937_64 random(3);
  std::array<std::vector<double>, 3> rows;
  for (int i = 0; i < 1001; ++i) {
    for (auto& row : rows) row.push_back(std::pow(10, 6 * unit_random(random) - 4) - 0.05);
  }
  const auto values = rows;
  ColourOf{tone}({rows[0].data(), rows[1].data(), rows[2].data()}, 1001);
  int bright = 0, black = 0;
  for (std::size_t i = 0; i < 1001; ++i) {
    const Rgb colour = lupton(tone, {values[0][i], values[1][i], values[2][i]});
    for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(rows[c][i], colour[c], 1e-15) << i;
    bright += *std::max_element(colour.begin(), colour.end()) == 1 ? 1 : 0;
    black += colour == Rgb{} ? 1 : 0;
  }
  EXPECT_GT(bright, 50);
  EXPECT_GT(black, 5);
  const ColourOf turned = [](const Rgb& rgb) { return Rgb{rgb[1], rgb[2], rgb[0]}; };
  EXPECT_EQ(colour_of(turned, {1, 2, 3}), (Rgb{2, 3, 1}));
}

TEST(LuptonTone, BytesOfAstropy) {
  struct Case {
    Rgb rgb;
    std::array<int, 3> bytes;
  };
  // astropy.visualization.make_lupton_rgb 5.2.1, minimum=[.01, .02, .03], stretch=.5, Q=8.
  const std::vector<Case> cases = {
      {{0.016, 1.361, 0.132}, {1, 255, 19}},  {{0.024, 2.753, 1.051}, {1, 255, 95}},
      {{0.076, 0.147, 0.763}, {17, 32, 190}}, {{0.077, -0.02, 2.457}, {7, 0, 254}},
      {{2.212, 2.784, 1.2}, {156, 196, 83}},  {{-0.1, -0.2, 0.25}, {0, 0, 0}},
      {{0.781, 0.365, 0.165}, {167, 74, 29}}, {{0.4, -0.3, -0.2}, {0, 0, 0}},
      {{3.458, 0.066, 0.081}, {254, 3, 3}},   {{0.458, 2.528, 0.309}, {45, 255, 28}},
      {{2.218, 0.032, 0.891}, {254, 1, 99}},  {{5.023, 0.551, 6.752}, {190, 20, 254}}};
  LuptonTone tone;
  tone.minimum = {0.01, 0.02, 0.03};
  tone.stretch = 0.5;
  for (const Case& known : cases) {
    std::array<int, 3> expected = known.bytes;
    // Astropy computes a saturated 255 as x * 255/x, truncated.
    std::replace(expected.begin(), expected.end(), 254, 255);
    EXPECT_EQ(bytes_of(colour_of(tone, known.rgb)), expected);
  }
}

TEST(LuptonTone, KeepsHueHoweverBright) {
  LuptonTone tone;
  tone.minimum = {1, 2, 3};
  tone.scale = {1, 0.5, 2};
  for (const double light : {1e-6, 0.1, 10.0, 1e3, 1e9}) {
    const Rgb colour = colour_of(tone, {1 + 4 * light, 2 + 4 * light, 3 + 0.5 * light});
    EXPECT_NEAR(colour[1] / colour[0], 0.5, 4e-10);
    EXPECT_NEAR(colour[2] / colour[0], 0.25, 1e-9);
  }
  EXPECT_EQ(colour_of(tone, {1e9, 2, 3})[0], 1);
  EXPECT_EQ(colour_of(tone, {1, 2, 3}), (Rgb{0, 0, 0}));
}

TEST(LuptonTone, Rises) {
  LuptonTone tone;
  Rgb last{};
  for (double light = 1e-3; light < 1e4; light *= 1.1) {
    const Rgb colour = colour_of(tone, {light, 0.7 * light, 0.3 * light});
    for (int c = 0; c < 3; ++c) {
      if (last[0] < 1) {
        ASSERT_GT(colour[c], last[c]);
      } else {
        ASSERT_NEAR(colour[c], last[c], 1e-15);
      }
    }
    last = colour;
  }
  EXPECT_EQ(last[0], 1);
}

// A disk with a nucleus on a sky, in three colours.
std::vector<PlanePtr> galaxy(int size) {
  std::vector<PlanePtr> planes;
  for (int c = 0; c < 3; ++c) {
    std::mt19937_64 random(c);
    std::vector<double> values;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double r = std::hypot(x - size / 2.0, y - size / 2.0) / size;
        values.push_back(5 + (3 - c) * std::exp(-r / 0.05) + 40 * std::exp(-r * r * 4e3) +
                         0.01 * (unit_random(random) + unit_random(random) - 1));
      }
    }
    planes.push_back(std::make_shared<MemoryPlane>(size, size, values));
  }
  return planes;
}

TEST(ChooseLupton, IsTheAutomaticPicture) {
  const auto channels = galaxy(96);
  const LuptonTone tone = choose_lupton(channels, {}, 1);
  const PictureTone automatic = automatic_tone(channels, 1);
  std::vector<double> values[3];
  for (int c = 0; c < 3; ++c) {
    values[c].resize(96 * 96);
    channels[c]->read(channels[c]->whole(), values[c].data());
  }
  int compared = 0;
  for (int i = 0; i < 96 * 96; ++i) {
    const Rgb rgb = {values[0][i], values[1][i], values[2][i]};
    // The automatic picture cuts pixels below black, which are left out here.
    if (rgb[0] < tone.minimum[0] || rgb[1] < tone.minimum[1] || rgb[2] < tone.minimum[2]) continue;
    const Rgb a = colour_of(tone, rgb), b = automatic.colour(rgb);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(a[c], b[c], 4e-15);
    ++compared;
  }
  EXPECT_GT(compared, 2000);
}

TEST(ChooseLupton, WhatIsGivenStaysAndWhiteStaysWhite) {
  const auto channels = galaxy(96);
  const LuptonTone automatic = choose_lupton(channels, {}, 1);
  const auto grey = [&](const LuptonTone& tone, double light) {
    Rgb rgb;
    for (int c = 0; c < 3; ++c) rgb[c] = tone.minimum[c] + light / tone.scale[c];
    return colour_of(tone, rgb)[0];
  };
  double white = 1;
  while (grey(automatic, white) < 1) white *= 1.0001;
  for (const double q : {0.01, 1.0, 8.0, 100.0, 1e10}) {
    LuptonChoice choice;
    choice.q = q;
    const LuptonTone tone = choose_lupton(channels, choice, 1);
    EXPECT_EQ(tone.q, q);
    EXPECT_EQ(tone.minimum, automatic.minimum);
    EXPECT_LT(grey(tone, white * 0.99), 1) << q;
    EXPECT_GE(grey(tone, white * 1.001), 1 - 1e-9) << q;
  }
  LuptonChoice choice;
  choice.stretch = 3;
  EXPECT_EQ(choose_lupton(channels, choice, 1).stretch, 3);
  EXPECT_EQ(choose_lupton(channels, choice, 1).q, 8);
  choice.minimum = Rgb{1, 2, 3};
  EXPECT_EQ(choose_lupton(channels, choice, 1).minimum, (Rgb{1, 2, 3}));
  choice.scale = Rgb{4, 5, 6};
  EXPECT_EQ(choose_lupton({}, choice, 1).scale, (Rgb{4, 5, 6}));
}

TEST(ChooseLupton, NothingToSeeIsBlack) {
  const std::vector<PlanePtr> channels(
      3, std::make_shared<MemoryPlane>(4, 4, std::vector<double>(16, 7.0)));
  const LuptonTone tone = choose_lupton(channels, {}, 1);
  EXPECT_EQ(colour_of(tone, {7, 7, 7}), (Rgb{0, 0, 0}));
}

// ---- STIFF, plain ------------------------------------------------------------------------------

/// The recipe of the manual, with differences from the two other channels.
Rgb stiff_recipe(const Rgb& x, double gamma, double luminance_gamma, double saturation) {
  const double y = (std::max(x[0], 0.0) + std::max(x[1], 0.0) + std::max(x[2], 0.0)) / 3;
  const double most = std::pow(y, 1 - 1 / luminance_gamma);
  Rgb limited, result;
  for (int c = 0; c < 3; ++c) limited[c] = std::min(x[c], most);
  for (int c = 0; c < 3; ++c) {
    const double difference = 2 * limited[c] - limited[(c + 1) % 3] - limited[(c + 2) % 3];
    const double coloured = std::max(y + saturation / 3 * difference, 0.0);
    result[c] = std::pow(coloured / y * std::pow(y, 1 / luminance_gamma), 1 / gamma);
    result[c] = std::min(result[c], 1.0);
  }
  return result;
}

TEST(StiffTone, FollowsTheRecipe) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 2000; ++i) {
    Rgb x, rgb;
    StiffTone tone;
    for (int c = 0; c < 3; ++c) {
      tone.limits[c] = {-1.0 * c, 2.0 + c};
      x[c] = unit_random(random) * 1.5 - 0.2;
      rgb[c] = -c + x[c] * (2 + 2 * c);
    }
    if (x[0] + x[1] + x[2] < 0.01) continue;
    tone.gamma = 1 + 2 * unit_random(random);
    tone.luminance_gamma = 0.5 + unit_random(random);
    tone.saturation = 3 * unit_random(random);
    const Rgb expected = stiff_recipe(x, tone.gamma, tone.luminance_gamma, tone.saturation);
    const Rgb colour = tone(rgb);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(colour[c], expected[c], 1e-14) << i;
  }
}

TEST(StiffTone, PlainFacts) {
  StiffTone tone;
  tone.limits = {unit, unit, unit};
  const Rgb colour = tone({0.25, 0.5, 0.125});
  EXPECT_NEAR(colour[0], std::pow(0.25, 1 / 2.2), 1e-15);
  EXPECT_NEAR(colour[1], std::pow(0.5, 1 / 2.2), 1e-15);
  EXPECT_EQ(tone({-1, 0, -3}), (Rgb{0, 0, 0}));
  tone.saturation = 0;
  const Rgb grey = tone({0.2, 0.5, 0.8});
  EXPECT_DOUBLE_EQ(grey[0], std::pow(0.5, 1 / 2.2));
  EXPECT_DOUBLE_EQ(grey[1], grey[0]);
  EXPECT_DOUBLE_EQ(grey[2], grey[0]);
  tone.luminance_gamma = 2;
  tone.gamma = 1;
  EXPECT_DOUBLE_EQ(tone({0.25, 0.25, 0.25})[0], 0.5);
}

TEST(PlainTone, EachChannelOnItsOwn) {
  const PlainTone tone = {{Limits{0, 4}, Limits{1, 3}, Limits{-1, 0}}, 2};
  const Rgb colour = tone({1, 1.5, 5});
  EXPECT_DOUBLE_EQ(colour[0], 0.5);
  EXPECT_DOUBLE_EQ(colour[1], 0.5);
  EXPECT_EQ(colour[2], 1);
  EXPECT_EQ(tone({-1, -1, -2}), (Rgb{0, 0, 0}));
}

// ---- Files -------------------------------------------------------------------------------------

PictureFileOptions options_for(const std::filesystem::path& path, int bits) {
  PictureFileOptions options;
  options.name = path.string();
  options.format = *picture_format(options.name);
  options.bits = bits;
  return options;
}

/// Three planes of values i/(count - 1), the first of which begins at 0.
std::vector<PlanePtr> ramps(int width, int height) {
  std::vector<PlanePtr> planes;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    const int count = width * height;
    for (int i = 0; i < count; ++i) values.push_back((i + c * 7) % count / (count - 1.0));
    planes.push_back(std::make_shared<MemoryPlane>(width, height, values));
  }
  return planes;
}

TEST(WriteRgb, EveryValueAtItsPlace) {
  TemporaryFolder folder;
  const int width = 301, height = 1000;  // more than one tile
  const auto channels = ramps(width, height);
  const ColourOf same = [](const Rgb& rgb) { return rgb; };
  write_rgb(options_for(folder / "a.png", 16), channels, same, ByteRounding::down, 1);
  write_rgb(options_for(folder / "down.png", 8), channels, same, ByteRounding::down, 3);
  write_rgb(options_for(folder / "near.png", 8), channels, same, ByteRounding::nearest, 3);
  const ReadPng wide = read_png(folder / "a.png"), down = read_png(folder / "down.png"),
                near = read_png(folder / "near.png");
  EXPECT_EQ(wide.bits, 16);
  EXPECT_EQ(down.bits, 8);
  const double count = width * height;
  for (int row = 0; row < height; ++row) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int i = (height - 1 - row) * width + x + c * 7;
        const double value = i % (width * height) / (count - 1);
        ASSERT_EQ(wide.at(x, row, c), std::lround(65535 * value));
        ASSERT_EQ(down.at(x, row, c), static_cast<int>(255 * value));
        ASSERT_EQ(near.at(x, row, c), (wide.at(x, row, c) + 128) / 257);
      }
    }
  }
  write_rgb(options_for(folder / "b.png", 16), channels, same, ByteRounding::down, 4);
  EXPECT_EQ(file_bytes(folder / "a.png"), file_bytes(folder / "b.png"));
}

TEST(WriteRgb, BmpHasTheBytesOfThePng) {
  TemporaryFolder folder;
  const auto channels = ramps(5, 4);
  const ColourOf same = [](const Rgb& rgb) { return rgb; };
  write_rgb(options_for(folder / "a.png", 8), channels, same, ByteRounding::down, 1);
  write_rgb(options_for(folder / "a.bmp", 8), channels, same, ByteRounding::down, 1);
  const ReadPng png = read_png(folder / "a.png");
  const std::string bmp = file_bytes(folder / "a.bmp");
  ASSERT_EQ(bmp.size(), 54U + 16 * 4);
  for (int row = 0; row < 4; ++row) {
    for (int x = 0; x < 5; ++x) {
      for (int c = 0; c < 3; ++c) {
        const auto byte = static_cast<unsigned char>(bmp[54 + 16 * (3 - row) + 3 * x + 2 - c]);
        EXPECT_EQ(byte, png.at(x, row, c));
      }
    }
  }
}

TEST(WriteRgb, MissingPixelsAreBlackAndOnePlaneIsGrey) {
  TemporaryFolder folder;
  const ColourOf white = [](const Rgb& rgb) { return Rgb{rgb[0], rgb[1], 2}; };
  const auto row = [](std::vector<double> values) {
    const int width = static_cast<int>(values.size());
    return std::make_shared<MemoryPlane>(width, 1, std::move(values));
  };
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<PlanePtr> channels = {
      row({1, nan_value, 1, 1, -5}), row({1, 1, infinity, 1, 1}), row({1, 1, 1, nan_value, 1})};
  write_rgb(options_for(folder / "a.png", 8), channels, white, ByteRounding::down, 1);
  EXPECT_EQ(read_png(folder / "a.png").values,
            (std::vector<std::uint16_t>{255, 255, 255, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255}));
  const ColourOf same = [](const Rgb& rgb) { return rgb; };
  const std::vector<PlanePtr> grey = {row({0.2, nan_value, 0.6})};
  write_rgb(options_for(folder / "grey.png", 8), grey, same, ByteRounding::nearest, 1);
  EXPECT_EQ(read_png(folder / "grey.png").values,
            (std::vector<std::uint16_t>{51, 51, 51, 0, 0, 0, 153, 153, 153}));
}

}  // namespace
}  // namespace gamer::rgb_test
