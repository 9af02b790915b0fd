#include "gamer/job/calibration_cache.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "gamer/core/build_identity.h"
#include "gamer/core/resources.h"
#include "gamer/core/simd.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/job/measure_galaxies.h"
#include "gamer/noise/noise.h"
#include "image/image_test_util.h"

namespace gamer::calibration_cache_test {
namespace {

namespace fs = std::filesystem;

const CalibrationParts some = {{"a", {}}, {"b c", {1, 0, -2.5}}, {"", {1e300}}};

TEST(PackedParts, ComeBack) {
  EXPECT_EQ(unpack_parts(pack_parts(some)), some);
  EXPECT_EQ(unpack_parts(pack_parts({})), CalibrationParts());
}

TEST(PackedParts, AreNoneWhereBytesAreWrong) {
  const std::string bytes = pack_parts(some);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_TRUE(unpack_parts(bytes.substr(0, size)).empty()) << size;
  }
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    EXPECT_TRUE(unpack_parts(changed).empty()) << at;
  }
}

TEST(BuildIdentity, NamesTheInstructionSet) {
  const std::string name = simd_target_name(current_simd_target());
  EXPECT_NE(build_identity().find(" " + name + " "), std::string::npos);
  // SHA-1 in hexadecimal digits.
  EXPECT_EQ(build_identity().find(' '), 40u);
}

class CalibrationCacheTest : public testing::Test {
 protected:
  ~CalibrationCacheTest() override { use_calibration_cache(nullptr); }

  fs::path path() const { return folder_ / ""; }

 private:
  TemporaryFolder folder_;
};

TEST_F(CalibrationCacheTest, KeepsPartsOfItsBuild) {
  const CalibrationCache cache(path(), "build one");
  EXPECT_TRUE(cache.load("0123").empty());
  cache.save("0123", some);
  EXPECT_EQ(cache.load("0123"), some);
  EXPECT_TRUE(cache.load("0124").empty());
  EXPECT_TRUE(CalibrationCache(path(), "build two").load("0123").empty());
  const CalibrationParts others = {{"d", {4}}};
  cache.save("0123", others);
  EXPECT_EQ(cache.load("0123"), others);
}

TEST_F(CalibrationCacheTest, ForgetsWhatWasNotUsedForLongest) {
  const CalibrationCache cache(path(), "build");
  const auto now = fs::file_time_type::clock::now();
  constexpr int most = CalibrationCache::most_files / 16;
  const auto name = [](int i) { return "a" + std::to_string(i); };
  for (int i = 0; i < most; ++i) {
    cache.save(name(i), some);
    fs::last_write_time(cache.folder() / "a" / name(i), now - std::chrono::hours(most - i));
  }
  EXPECT_EQ(cache.load(name(0)), some);
  cache.save("a new one", some);
  EXPECT_EQ(cache.load("a new one"), some);
  EXPECT_EQ(cache.load(name(0)), some);
  EXPECT_TRUE(cache.load(name(1)).empty());
  EXPECT_EQ(cache.load(name(most - 1)), some);
}

TEST_F(CalibrationCacheTest, ForgetsOldBuilds) {
  const CalibrationCache old(path(), "old"), recent(path(), "recent");
  old.save("0", some);
  recent.save("0", some);
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(old.folder(), now - std::chrono::hours(31 * 24));
  fs::last_write_time(recent.folder(), now - std::chrono::hours(29 * 24));
  CalibrationCache(path(), "new").save("0", some);
  EXPECT_TRUE(old.load("0").empty());
  EXPECT_EQ(recent.load("0"), some);
}

std::shared_ptr<Galaxy> noisy_galaxy(
    std::size_t most_cloud_points = GalaxySettings().most_cloud_points) {
  GalaxySettings settings;
  settings.noise_kind = &simplex_noise();
  settings.most_cloud_points = most_cloud_points;
  Resources resources({});
  return Galaxy::read(parse_toml("[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = "
                                 "{octaves = 2, contrast = 0.1}\n",
                                 "noisy.toml"),
                      settings, resources);
}

TEST_F(CalibrationCacheTest, IsUsedByMeasurements) {
  const auto mean_of = [] {
    const std::shared_ptr<Galaxy> galaxy = noisy_galaxy();
    measure_galaxies(std::span(&galaxy, 1), {}, Ranks());
    return galaxy->calibration().means[0].narrowest();
  };
  const double mean = mean_of();
  auto cache = std::make_unique<CalibrationCache>(path(), "build");
  const CalibrationCache& own = *cache;
  use_calibration_cache(std::move(cache));
  EXPECT_EQ(mean_of(), mean);
  EXPECT_EQ(mean_of(), mean);
  // Changed means in the cache show whether measurements use them.
  const std::string shape = noisy_galaxy()->shape();
  CalibrationParts parts = own.load(shape);
  ASSERT_FALSE(parts.empty());
  for (auto& [name, numbers] : parts) {
    if (name.find(" mean") == std::string::npos) continue;
    for (double& number : numbers) number *= 2;
  }
  own.save(shape, parts);
  EXPECT_EQ(mean_of(), 2 * mean);
  // Measurements for drafts are not kept.
  const std::shared_ptr<Galaxy> draft = noisy_galaxy(2000);
  measure_galaxies(std::span(&draft, 1), {}, Ranks());
  EXPECT_TRUE(own.load(draft->shape()).empty());
}

}  // namespace
}  // namespace gamer::calibration_cache_test
