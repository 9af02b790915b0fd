#include "studio/view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/core/error.h"
#include "studio/known_paths.h"
#include "studio/output_folder.h"

namespace gamer::view_test {
namespace {

using Json = nlohmann::json;

constexpr const char* label = "input";
const char* const view_parameters_text =
    "[image]\nsize = [32, 24]\n[camera]\nposition = [0, -3, 1]\n"
    "[spectrum]\nwavelengths = [4400, 6500]\n[sampling]\ntolerance = 0.01\n";
const char* const galaxy =
    "[arms]\nmodel = \"logarithmic\"\n[[component]]\nclass = \"bulge\"\nsed = "
    "\"E\"\neffective_radius = 0.1\n"
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"Sbc\"\nnoise = {octaves = 2}\n"
    "[[component]]\nclass = \"dust\"\noptical_depth = 0.5\nnoise = {octaves = 2}\n";

struct Frame {
  Json head;
  std::vector<std::vector<float>> planes;
};

Frame decode(const std::string& bytes) {
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data(), sizeof(length));
  EXPECT_EQ(length % 4, 0u);
  Frame frame;
  frame.head = Json::parse(bytes.substr(sizeof(length), length));
  const std::size_t pixels =
      frame.head["width"].get<std::size_t>() * frame.head["rows"].get<std::size_t>();
  const char* from = bytes.data() + sizeof(length) + length;
  for (std::size_t p = 0; p < frame.head["planes"].size(); ++p) {
    std::vector<float>& plane = frame.planes.emplace_back(pixels);
    if (pixels > 0) std::memcpy(plane.data(), from, pixels * sizeof(float));
    from += pixels * sizeof(float);
  }
  EXPECT_EQ(from, bytes.data() + bytes.size());
  return frame;
}

class View : public testing::Test {
 protected:
  View() {
    request.document.parameters = view_parameters_text;
    request.document.scene =
        "galaxy x y z inclination pa size\nown 0 0 0 50 30 1\nown 1 2 0 9 0 .5\n";
    request.document.galaxies["own"] = galaxy;
    request.levels = {{32, 24, {}}};
  }

  std::vector<Frame> frames() {
    std::vector<Frame> result;
    const auto take = [&](const std::string& bytes, bool) { result.push_back(decode(bytes)); };
    take(render_view(session, label, 5, request, Cancellation(), take), true);
    return result;
  }

  /// The library's own render of the document.
  Image image(const PageDocument& document) {
    return session
        .render(session.load(RenderInput{document.parameters, RenderInput::Text{document.scene},
                                         document.galaxies, document.settings, label}))
        .image;
  }

  Session session{2, {GAMER_TEST_SOURCE_DIR}};
  ViewRequest request;
};

void expect_plane(const std::vector<float>& plane, const Image& image, int p) {
  const auto pixels = static_cast<std::size_t>(image.width()) * image.height();
  ASSERT_EQ(plane.size(), pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_EQ(plane[i], static_cast<float>(image.plane(p)[i])) << i;
  }
}

TEST_F(View, LastLevelHasTheScenesPixels) {
  request.levels = {{8, 6, 0.05}, {32, 24, {}}};
  request.document.settings = {"camera.fov=40"};
  const std::vector<Frame> all = frames();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].head["width"], 8);
  EXPECT_EQ(all[0].head["last"], false);
  EXPECT_EQ(all[1].head["id"], 5);
  EXPECT_EQ(all[1].head["level"], 1);
  EXPECT_EQ(all[1].head["last"], true);
  EXPECT_EQ(all[1].head["is_whole"], true);
  EXPECT_EQ(all[1].head["planes"][1]["wavelength"], 6500.0);
  EXPECT_EQ(all[1].head["planes"][1]["label"], "6500A");
  EXPECT_EQ(all[1].head["wcs"]["CTYPE1"], "XTAN");
  const Image own = image(request.document);
  expect_plane(all[1].planes[0], own, 0);
  expect_plane(all[1].planes[1], own, 1);
}

TEST_F(View, ComponentsAddUpToTheImage) {
  request.wants_components = true;
  const Frame frame = frames().front();
  EXPECT_EQ(frame.head["is_whole"], false);
  ASSERT_EQ(frame.planes.size(), 4u);
  EXPECT_EQ(frame.head["planes"][0]["component"], 0);
  EXPECT_EQ(frame.head["planes"][2]["component"], 1);
  EXPECT_EQ(frame.head["planes"][2]["name"], "arms");
  const Image own = image(request.document);
  // Sums have single precision: each number is rounded by half a unit in its last place.
  constexpr double rounding = 2.0 / (1 << 24);
  for (std::size_t i = 0; i < frame.planes[0].size(); ++i) {
    for (const std::size_t p : {0u, 1u}) {
      const double value = own.plane(static_cast<int>(p))[i];
      EXPECT_NEAR(double(frame.planes[p][i]) + frame.planes[2 + p][i], value, rounding * value);
    }
  }
}

TEST_F(View, OtherGalaxiesAreTheRest) {
  request.document.galaxies["other"] = galaxy;
  request.document.scene += "other -1 2 0 9 0 .5\n";
  request.document.chosen = "other";
  request.wants_components = true;
  const Frame frame = frames().front();
  ASSERT_EQ(frame.planes.size(), 6u);
  EXPECT_TRUE(frame.head["planes"][4]["component"].is_null());
  EXPECT_EQ(frame.head["planes"][4]["name"], "rest");
  const Image own = image(request.document);
  constexpr double rounding = 3.0 / (1 << 24);
  for (std::size_t i = 0; i < frame.planes[0].size(); ++i) {
    const double value = own.plane(0)[i];
    EXPECT_NEAR(double(frame.planes[0][i]) + frame.planes[2][i] + frame.planes[4][i], value,
                rounding * value);
  }
}

TEST_F(View, MutedLightIsTakenOffTheImage) {
  request.wants_components = true;
  const Frame parts = frames().front();
  request.wants_components = false;
  request.muted = {0};
  const Frame rest = frames().front();
  EXPECT_EQ(rest.head["is_whole"], true);
  EXPECT_EQ(rest.planes[0], parts.planes[2]);
  EXPECT_EQ(rest.planes[1], parts.planes[3]);
  request.muted = {0, 1};
  const Frame nothing = frames().front();
  for (const float value : nothing.planes[0]) EXPECT_EQ(value, 0);
}

TEST_F(View, MutedDustIsTransparent) {
  request.muted = {2};
  const Frame frame = frames().front();
  PageDocument clear = request.document;
  std::string& text = clear.galaxies["own"];
  text.replace(text.find("optical_depth = 0.5"), 19, "optical_depth = 0");
  expect_plane(frame.planes[0], image(clear), 0);
}

TEST_F(View, ManyPartsAreTheImageAlone) {
  for (int i = 0; i < 20; ++i)
    request.document.scene += "own 3 " + std::to_string(i) + " 0 9 0 .5\n";
  request.wants_components = true;
  const Frame frame = frames().front();
  EXPECT_EQ(frame.head["is_whole"], true);
  expect_plane(frame.planes[0], image(request.document), 0);
}

TEST_F(View, SkyKeepsItsField) {
  request.document.parameters =
      "[image]\nsize = [40, 20]\n[camera]\nprojection = \"sky\"\npixel_scale = 0.1\n"
      "[sampling]\ntolerance = 0.01\n";
  request.document.scene = "galaxy dx dy redshift size_kpc inclination pa\nown 0 0 0.3 10 50 30\n";
  request.levels = {{20, 10, 0.05}, {40, 20, {}}};
  const std::vector<Frame> all = frames();
  const auto number = [&](std::size_t level, const char* key) {
    return all[level].head["wcs"][key].get<double>();
  };
  EXPECT_NEAR(number(0, "CDELT1") * 20, number(1, "CDELT1") * 40, 1e-15);
  EXPECT_EQ(number(1, "CRPIX1"), 20.5);
  EXPECT_EQ(all[1].head["wcs"]["CTYPE1"], "RA---TAN");
  expect_plane(all[1].planes[0], image(request.document), 0);
}

TEST_F(View, StripsAreRowsOfTheImage) {
  request.document.parameters =
      "[image]\nsize = [16, 256]\n[camera]\nprojection = \"orthographic\"\nwidth = 0.2\n"
      "[sampling]\ntolerance = 0.05\n";
  request.levels = {{8, 128, {}}, {16, 256, {}}};
  request.wants_strips = true;
  request.wants_components = true;
  std::vector<std::string> frames_of_rows;
  std::vector<int> seen(256);
  const auto take = [&](const std::string& bytes, bool) { frames_of_rows.push_back(bytes); };
  take(render_view(session, label, 5, request, Cancellation(), take), true);
  ASSERT_GT(frames_of_rows.size(), 3u);
  // The last message has no rows, since all were sent.
  const Frame end = decode(frames_of_rows.back());
  EXPECT_EQ(end.head["rows"].get<int>(), 0);
  EXPECT_TRUE(end.head["last"].get<bool>());
  request.wants_strips = false;
  request.levels.erase(request.levels.begin());
  const Frame whole = decode(render_view(session, label, 5, request, Cancellation(), take));
  EXPECT_EQ(whole.head["rows"].get<int>(), 256);
  EXPECT_EQ(decode(frames_of_rows.front()).head["rows"].get<int>(), 128);
  for (std::size_t f = 1; f + 1 < frames_of_rows.size(); ++f) {
    const Frame strip = decode(frames_of_rows[f]);
    EXPECT_EQ(strip.head["level"].get<int>(), 1);
    const auto row = strip.head["row"].get<std::size_t>();
    for (std::size_t p = 0; p < strip.planes.size(); ++p) {
      for (std::size_t i = 0; i < strip.planes[p].size(); ++i) {
        ASSERT_EQ(strip.planes[p][i], whole.planes[p][16 * row + i]);
      }
    }
    for (std::size_t r = 0; r < strip.head["rows"].get<std::size_t>(); ++r) ++seen[row + r];
  }
  EXPECT_EQ(std::ranges::count(seen, 1), 256);
}

TEST_F(View, WithoutLightIsOneFrame) {
  request.document.parameters =
      "[image]\nsize = [16, 256]\n[camera]\nprojection = \"orthographic\"\nwidth = 0.2\n"
      "target = [50, 0, 0]\nposition = [50, 0, 10]\nup = [0, 1, 0]\n[sampling]\ntolerance = 0.05\n";
  request.levels = {{16, 256, {}}};
  request.wants_strips = true;
  int rows = 0;
  const auto take = [&](const std::string& bytes, bool) {
    const int strip = decode(bytes).head["rows"].get<int>();
    EXPECT_LT(strip, 256);
    rows += strip;
  };
  const Frame last = decode(render_view(session, label, 5, request, Cancellation(), take));
  EXPECT_EQ(last.head["rows"].get<int>(), rows == 256 ? 0 : 256);
  EXPECT_TRUE(last.head["last"].get<bool>());
}

TEST_F(View, IsCancelledBetweenLevels) {
  request.levels = {{8, 6, 0.05}, {32, 24, {}}};
  Cancellation cancellation;
  int sent = 0;
  EXPECT_THROW(render_view(session, label, 1, request, cancellation,
                           [&](const std::string&, bool) {
                             ++sent;
                             cancellation.request();
                           }),
               Cancelled);
  EXPECT_EQ(sent, 1);
}

TEST(LevelParameters, OfEveryProjection) {
  const auto at = [](const std::string& text, const ViewLevel& level) {
    return level_parameters(RenderParameters::read(parse_toml(text, "x.par")), level);
  };
  const std::string size = "[image]\nsize = [40, 20]\n";
  const RenderParameters own = at(size, {40, 20, {}});
  EXPECT_EQ(own.toml(), RenderParameters::read(parse_toml(size, "x.par")).toml());
  const RenderParameters coarse = at(size, {10, 5, 0.1});
  EXPECT_EQ(coarse.width, 10);
  EXPECT_EQ(coarse.sampling.tolerance, 0.1);
  EXPECT_EQ(coarse.camera.supersample, 1);
  EXPECT_FALSE(coarse.sampling.draws_stars());
  const RenderParameters finer = at(size, {40, 20, 1e-4});
  EXPECT_EQ(finer.sampling.tolerance, 1e-4);
  EXPECT_FALSE(finer.camera.supersample);
  EXPECT_TRUE(finer.sampling.draws_stars());
  EXPECT_FALSE(at(size + "[stars]\ntable = true\n", {40, 20, {}}).stars.table);
  EXPECT_EQ(at("[image]\nsize = 40\n[camera]\nprojection = \"cubemap\"\n", {10, 60, {}}).width, 10);
  EXPECT_EQ(at("[camera]\nprojection = \"healpix\"\nnside = 16\n", {8, 8, {}}).width, 16);
  const std::string region = size + "region = [1, 1, 10, 10]\n";
  EXPECT_EQ(at(region, {10, 5, 0.1}).width, 40);
  EXPECT_EQ(at(size + "[animation]\nframes = 3\n", {40, 20, {}}).animation.frames, 0);
}

TEST(KnownPaths, StrangePathsAreRefused) {
  PageDocument opened;
  opened.parameters = "[image]\noutput = \"/home/x.fits\"\nunit = \"MJy/sr\"\n";
  opened.scene = "# a/b\ngalaxy x\nsub/mine 1\n";
  opened.galaxies["mine"] = "[galaxy]\ndescription = \"a/b\"\n[[component]]\nsed = \"../own\"\n";
  const KnownPaths paths(opened);
  paths.check(opened);
  const auto refuses = [&](const auto& change) {
    PageDocument document = opened;
    change(document);
    try {
      paths.check(document);
    } catch (const InputError&) {
      return true;
    }
    return false;
  };
  EXPECT_TRUE(
      refuses([](PageDocument& d) { d.parameters = "[image]\noutput = \"/etc/x.fits\"\n"; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.parameters = "[spectrum]\nbands = [\"../x\"]\n"; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.settings = {"camera.header=/etc/passwd"}; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.settings = {"spectrum.bands=[\"a/b\"]"}; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.scene += "/etc/passwd 2\n"; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.scene += "\"../x\",2\n"; }));
  EXPECT_TRUE(refuses([](PageDocument& d) { d.galaxies["a/b"] = ""; }));
  EXPECT_TRUE(refuses([](PageDocument& d) {
    d.galaxies["mine"] = "[[component]]\nextinction = \"/etc/passwd\"\n";
  }));
  EXPECT_FALSE(
      refuses([](PageDocument& d) { d.galaxies["b"] = "[[component]]\nsed = \"../own\"\n"; }));
  EXPECT_FALSE(refuses([](PageDocument& d) { d.settings = {"image.unit=\"MJy/sr\""}; }));
  EXPECT_FALSE(refuses([](PageDocument& d) { d.settings = {"scene.unit=kpc", "no setting"}; }));
}

TEST(OutputFolder, NamesOfPlainFiles) {
  for (const char* name : {"x.fits", "a b.toml", "A-1_2+3.png", "0"}) {
    EXPECT_TRUE(OutputFolder::is_name(name)) << name;
  }
  for (const std::string name : {"", ".", "..", ".x", "-x", " x", "x ", "a/b", "/etc/passwd",
                                 "a\\b", "a\nb", "a:b", "\xc3\xa9", "a\x7f", "a%2fb"}) {
    EXPECT_FALSE(OutputFolder::is_name(name)) << name;
  }
  EXPECT_FALSE(OutputFolder::is_name(std::string(101, 'a')));
  EXPECT_THROW(OutputFolder("none").place("x.sh", {".fits"}), InputError);
  EXPECT_THROW(OutputFolder("none").place(".fits", {".fits"}), InputError);
  EXPECT_TRUE(OutputFolder("no such folder").list().empty());
}

}  // namespace
}  // namespace gamer::view_test
