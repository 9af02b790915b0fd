#include "gamer/image/wcs_affine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::wcs_affine_test {
namespace {

using Cards = std::vector<std::pair<std::string, double>>;

FitsHeader header_of(const std::string& projection, const Cards& cards) {
  FitsHeader header;
  header.set("CTYPE1", "RA---" + projection);
  header.set("CTYPE2", "DEC--" + projection);
  for (const auto& [key, value] : cards) header.set({key, value, "of " + key});
  return header;
}

const Cards reference = {{"CRPIX1", 60.25}, {"CRPIX2", 41.5}, {"CRVAL1", 150.1}, {"CRVAL2", 2.2}};

FitsHeader with(const std::string& projection, Cards cards) {
  cards.insert(cards.begin(), reference.begin(), reference.end());
  return header_of(projection, cards);
}

FitsHeader steps() { return with("TAN", {{"CDELT1", -5e-5}, {"CDELT2", 6e-5}}); }

FitsHeader sip() {
  FitsHeader header =
      with("TAN-SIP", {{"CD1_1", -4e-5}, {"CD1_2", 3e-5}, {"CD2_1", 2.9e-5}, {"CD2_2", 4.1e-5}});
  header.set({"A_ORDER", 3LL, {}});
  header.set({"B_ORDER", 2LL, {}});
  for (const auto& [key, value] : Cards{{"A_0_2", 2e-4},
                                        {"A_1_1", -1e-4},
                                        {"A_2_0", 3e-4},
                                        {"A_3_0", 1e-6},
                                        {"A_1_2", -2e-6},
                                        {"B_0_2", -1e-4},
                                        {"B_2_0", 1.5e-4},
                                        {"A_DMAX", 2.0},
                                        {"B_DMAX", 0.5}}) {
    header.set(key, value);
  }
  return header;
}

struct NamedHeader {
  std::string name;
  FitsHeader header;
};
std::vector<NamedHeader> headers() {
  FitsHeader swapped = header_of("TAN", reference);
  swapped.set("CTYPE1", std::string("DEC--TAN"));
  swapped.set("CTYPE2", std::string("RA---TAN"));
  swapped.set("CRVAL1", 2.2);
  swapped.set("CRVAL2", 150.1);
  swapped.set("CDELT1", 6e-5);
  swapped.set("CDELT2", -5e-5);
  swapped.set("CROTA1", -25.0);
  return {
      {"steps", steps()},
      {"pc", with("SIN", {{"CDELT1", -5e-5},
                          {"CDELT2", 6e-5},
                          {"PC1_1", 0.8},
                          {"PC1_2", -0.6},
                          {"PC2_1", 0.6},
                          {"PC2_2", 0.8}})},
      {"cd",
       with("TAN", {{"CD1_1", -4e-5}, {"CD1_2", 3e-5}, {"CD2_1", 2.9e-5}, {"CD2_2", 4.1e-5}})},
      {"cd with zeros", with("STG", {{"CD1_1", -4e-5}, {"CD2_2", 4.1e-5}})},
      {"crota", with("TAN", {{"CDELT1", -5e-5}, {"CDELT2", 6e-5}, {"CROTA2", 31.0}})},
      {"crota of swapped axes", swapped},
      {"old matrix", with("TAN", {{"CDELT1", -5e-5},
                                  {"CDELT2", 6e-5},
                                  {"PC001001", 0.8},
                                  {"PC001002", -0.6},
                                  {"PC002001", 0.6},
                                  {"PC002002", 0.8}})},
      {"tpv", with("TPV", {{"CD1_1", -4e-5},
                           {"CD2_2", 4.1e-5},
                           {"PV1_0", 1e-4},
                           {"PV1_1", 1.01},
                           {"PV1_4", 0.1},
                           {"PV2_1", 0.99},
                           {"PV2_5", 0.2}})},
      {"sip", sip()},
  };
}

std::vector<std::pair<std::string, PixelMap>> maps() {
  const double angle = 33 * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
  return {{"move", {1, 0, 0, 1, -7, 12}},
          {"flip x", {-1, 0, 0, 1, 101, 0}},
          {"flip y", {1, 0, 0, -1, 0, 81}},
          {"quarter turn", {0, -1, 1, 0, 81, 0}},
          {"three", {0, 1, -1, 0, 0, 101}},
          {"half turn", {-1, 0, 0, -1, 101, 81}},
          {"bin", {0.5, 0, 0, 1.0 / 3, 0.25, 1.0 / 3}},
          {"scale", {1.7, 0, 0, 1.7, -0.35, -0.35}},
          {"rotate", {c, -s, s, c, 20, -4}},
          {"shear", {1.1, 0.2, -0.4, 0.7, 1, 2}}};
}

std::string text_of(const FitsHeader& header) {
  std::string text;
  for (const std::string& record : header.records()) text += record;
  return text;
}

double separation(const SkyPosition& a, const SkyPosition& b) {
  return std::hypot((a.ra - b.ra) * std::cos(a.dec * std::numbers::pi / 180), a.dec - b.dec);
}

/// For every header and every map, each pixel keeps its place on the sky.
TEST(MapPixels, KeepsTheSky) {
  constexpr double some_pixel = 5e-5;  // deg
  for (const NamedHeader& old : headers()) {
    const CelestialWcs before = CelestialWcs::from_header(text_of(old.header), old.name);
    for (const auto& [name, map] : maps()) {
      SCOPED_TRACE(old.name + ", " + name);
      FitsHeader header = old.header;
      map_pixels(header, map, "test");
      const CelestialWcs after = CelestialWcs::from_header(text_of(header), "test");
      double worst = 0;
      for (double x = -50; x <= 150; x += 25) {
        for (double y = -40; y <= 120; y += 20) {
          const auto a = before.sky({x, y}), b = after.sky(map({x, y}));
          ASSERT_TRUE(a && b);
          worst = std::max(worst, separation(*a, *b));
        }
      }
      // The last digit of 150 deg corresponds to 6e-10 pixels.
      EXPECT_LT(worst / some_pixel, 1e-9);
      const bool has_rotation = header.has("CROTA1") || header.has("CROTA2");
      EXPECT_EQ(has_rotation, old.name.starts_with("crota") && map.moves_only());
    }
  }
}

TEST(MapPixels, ThereAndBackGivesTheHeaderBack) {
  FitsHeader header = sip();
  const PixelMap there = {0, -1, 1, 0, 81, 0}, back = {0, 1, -1, 0, 0, 81};
  map_pixels(header, there, "test");
  EXPECT_EQ(header.number("A_ORDER"), 2);
  EXPECT_EQ(header.number("B_ORDER"), 3);
  // With u' = -v and v' = u, A' = -B(v', -u') and B' = A(v', -u').
  EXPECT_EQ(header.number("A_2_0"), 1e-4);
  EXPECT_EQ(header.number("B_1_1"), 1e-4);
  EXPECT_EQ(header.number("B_0_3"), 1e-6);
  EXPECT_EQ(header.number("B_3_0"), std::nullopt);
  EXPECT_EQ(header.number("A_DMAX"), 0.5);
  map_pixels(header, back, "test");
  const FitsHeader old = sip();
  for (const std::string& record : old.records()) {
    const std::string key = FitsHeader::key_of(record);
    if (key.starts_with("CTYPE")) continue;
    EXPECT_EQ(header.number(key), old.number(key)) << key;
  }
}

TEST(MapPixels, TidyCards) {
  // A scale or flip of axes with CDELT keeps the cards and their places.
  FitsHeader header = steps();
  map_pixels(header, {-0.5, 0, 0, 0.25, 50.5, 0}, "test");
  const FitsHeader old = steps();
  ASSERT_EQ(header.records().size(), old.records().size());
  for (std::size_t i = 0; i < old.records().size(); ++i) {
    EXPECT_EQ(FitsHeader::key_of(header.records()[i]), FitsHeader::key_of(old.records()[i]));
  }
  EXPECT_EQ(header.number("CDELT1"), 1e-4);
  EXPECT_EQ(header.number("CDELT2"), 24e-5);
  EXPECT_EQ(header.card("CDELT2")->comment, "of CDELT2");
  EXPECT_EQ(header.number("CRPIX1"), 50.5 - 0.5 * 60.25);
  // A turn adds PC cards alone; a scale of turned axes changes the steps.
  map_pixels(header, {0, -2, 2, 0, 0, 0}, "test");
  EXPECT_EQ(header.number("CDELT1"), 5e-5);
  EXPECT_EQ(header.number("PC1_1"), 0);
  EXPECT_EQ(header.number("PC1_2"), 1);
  EXPECT_EQ(header.number("PC2_1"), -1);
  EXPECT_FALSE(header.has("CD1_1"));
  // A move changes CRPIX alone, and the identity changes nothing.
  const FitsHeader turned = header;
  map_pixels(header, {}, "test");
  EXPECT_EQ(header.records(), turned.records());
  map_pixels(header, {1, 0, 0, 1, 3, 0}, "test");
  EXPECT_EQ(header.number("CRPIX1"), *turned.number("CRPIX1") + 3);
  EXPECT_EQ(header.number("PC1_2"), 1);
  // A header without coordinates stays without.
  FitsHeader none;
  none.set("OBJECT", std::string("M 100"));
  map_pixels(none, {0, -2, 2, 0, 0, 0}, "test");
  EXPECT_EQ(none.records().size(), 1);
}

TEST(MapPixels, StepsBesideAMatrixGo) {
  FitsHeader header = with("TAN", {{"CD1_1", -4e-5}, {"CD2_2", 4e-5}, {"CDELT1", -4e-5}});
  map_pixels(header, {0.5, 0, 0, 0.5, 0, 0}, "test");
  EXPECT_EQ(header.number("CD1_1"), -8e-5);
  EXPECT_FALSE(header.has("CDELT1"));
  EXPECT_FALSE(header.has("CD1_2"));
}

TEST(MapPixels, LinearAxesLettersAndTheThirdAxis) {
  FitsHeader header;
  for (const std::string letter : {"", "B"}) {
    header.set("CTYPE1" + letter, std::string("x"));
    header.set("CTYPE2" + letter, std::string("y"));
    header.set("CRPIX1" + letter, 10.5);
    header.set("CRPIX2" + letter, 20.5);
    header.set("CDELT1" + letter, 0.1);
    header.set("CDELT2" + letter, 0.2);
    header.set("CRPIX3" + letter, 1.0);
    header.set("CRVAL3" + letter, 5500.0);
    header.set("CDELT3" + letter, 100.0);
  }
  // Where further axes share a matrix with the first two, the steps stay and the columns change.
  header.set("PC1_3B", 0.25);
  map_pixels(header, {0, -0.5, 0.5, 0, 20, 1}, "test");
  EXPECT_EQ(header.number("CRPIX1"), 20 - 0.5 * 20.5);
  EXPECT_EQ(header.number("CRPIX2"), 0.5 * 10.5 + 1);
  EXPECT_EQ(header.number("CDELT1"), 0.2);
  EXPECT_EQ(header.number("PC1_2"), 1);
  EXPECT_EQ(header.number("CRPIX1B"), header.number("CRPIX1"));
  EXPECT_EQ(header.number("CDELT1B"), 0.1);
  EXPECT_EQ(header.number("PC1_2B"), 2);
  EXPECT_EQ(header.number("PC2_1B"), -2);
  EXPECT_EQ(header.number("PC1_3B"), 0.25);
  for (const std::string letter : {"", "B"}) {
    EXPECT_EQ(header.number("CRPIX3" + letter), 1);
    EXPECT_EQ(header.number("CDELT3" + letter), 100);
    EXPECT_FALSE(header.has("PC3_3" + letter));
  }
  EXPECT_FALSE(header.has("CRPIX1A"));
}

TEST(MapPixels, PhysicalCoordinates) {
  FitsHeader header;
  header.set("LTV1", -100.0);
  header.set("LTV2", -50.0);
  header.set("LTM1_1", 0.5);
  header.set("LTM2_2", 0.5);
  const PixelMap map = {0, -1, 1, 0, 81, 3};
  map_pixels(header, map, "test");
  // Physical (300, 200) is image (50, 50).
  const PixelPosition image = map({50, 50});
  const auto value = [&](const char* key) { return header.number(key).value_or(0); };
  EXPECT_EQ(value("LTM1_1") * 300 + value("LTM1_2") * 200 + value("LTV1"), image.x);
  EXPECT_EQ(value("LTM2_1") * 300 + value("LTM2_2") * 200 + value("LTV2"), image.y);
}

std::string error_text(FitsHeader header, const PixelMap& map) {
  const auto old = header.records();
  try {
    map_pixels(header, map, "in.fits");
  } catch (const InputError& error) {
    EXPECT_EQ(header.records(), old);
    return error.what();
  }
  return "none";
}

TEST(MapPixels, Errors) {
  FitsHeader header = steps();
  header.set("CPDIS2", std::string("LOOKUP"));
  EXPECT_EQ(error_text(header, {1, 0, 0, 1, 5, 0}),
            "in.fits: CPDIS2: this distortion of the coordinates cannot follow the pixels; delete "
            "its cards first if it does not matter");
  EXPECT_EQ(error_text(header, {}), "none");
  header = sip();
  header.set({"B_ORDER", 12LL, {}});
  EXPECT_EQ(error_text(header, {2, 0, 0, 2, 0, 0}),
            "in.fits: B_ORDER = 12; SIP polynomials have an order from 0 to 9");
  EXPECT_THROW(map_pixels(header, {1, 1, 1, 1, 0, 0}, ""), std::invalid_argument);
}

}  // namespace
}  // namespace gamer::wcs_affine_test
