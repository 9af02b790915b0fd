#include "gamer/job/stamps.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer::stamps_test {
namespace {

const char* const stamps_parameters =
    "[image]\nsize = [50, 30]\nlayout = \"stamps\"\n[camera]\nprojection = \"sky\"\n"
    "pixel_scale = 0.5\n[spectrum]\nbands = [\"box\"]\n[photometry]\nreference_band = \"box\"\n"
    "[stamps]\nsmallest = 5\n";
const char* const stamps_scene =
    "galaxy px py size_arcsec apparent_magnitude\nstar 10.4 7.6 - 20\nsmooth 25 15 2.4 18\n"
    "star 50 1 - 21\n";
const char* const stamps_galaxy =
    "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";
const char* const band_text = "# wavelength: Angstrom\n# response: photons\n5000 1\n6000 1\n";

Resources inputs_of_stamps() {
  return Resources::from_record({{"render.par", "in/render.par", stamps_parameters},
                                 {"scene.lst", "in/scene.lst", stamps_scene},
                                 {"bandpasses/box", "bandpasses/box.band", band_text},
                                 {"galaxies/smooth", "galaxies/smooth.toml", stamps_galaxy}});
}

RenderJob load_stamps(const std::vector<std::string>& settings = {}) {
  Resources data = inputs_of_stamps();
  JobRequest request;
  request.settings = settings;
  return load_job(request, data);
}

void expect_region(const ImageRegion& region, int left, int bottom, int side) {
  EXPECT_EQ(region.left, left);
  EXPECT_EQ(region.bottom, bottom);
  EXPECT_EQ(region.width, side);
  EXPECT_EQ(region.height, side);
}

TEST(Stamps, StandAroundThePixelOfTheCentre) {
  const std::vector<ImageRegion> regions = stamp_regions(load_stamps());
  ASSERT_EQ(regions.size(), 3u);
  // The star at the FITS pixel (10.4, 7.6) is in the pixel (9, 7), counted from 0.
  expect_region(regions[0], 7, 5, 5);
  // The ball's radius is 4.8 pixels.
  expect_region(regions[1], 24 - 5, 14 - 5, 11);
  // This stamp reaches beyond the image's corner.
  expect_region(regions[2], 47, -2, 5);
  for (const ImageRegion& region : stamp_regions(load_stamps({"stamps.size=7"}))) {
    EXPECT_EQ(region.width, 7);
  }
}

TEST(Stamps, HoldTheLightOfTheirObject) {
  const RenderJob job = load_stamps();
  const StampRenderer stamps(job);
  EXPECT_EQ(stamps.values(1), 121u);
  EXPECT_EQ(stamps.most_bytes(), 121 * sizeof(double));
  for (const int threads : {1, 3}) {
    ThreadExecutor executor(threads);
    RankReport report;
    std::vector<double> sums(3, 0.0);
    stamps.run(
        executor,
        [&](std::size_t stamp, std::span<const double> values, double rays) {
          EXPECT_EQ(values.size(), stamps.values(stamp));
          EXPECT_EQ(rays, 0);
          sums[stamp] += std::accumulate(values.begin(), values.end(), 0.0);
        },
        report);
    // A star of magnitude 31.4 has 1 nJy.
    EXPECT_NEAR(sums[0] / 36307.805, 1, 1e-7);
    EXPECT_NEAR(sums[1] / 229086.77, 1, 4e-3);
    EXPECT_NEAR(sums[2] / 14454.398, 1, 1e-7);
  }
}

TEST(Stamps, ARegionIsThatOfTheRequest) {
  JobRequest request;
  request.region = {3, 4, 20, 10};
  request.settings = {"image.layout=cube"};
  Resources data = inputs_of_stamps();
  const RenderJob job = load_job(request, data);
  ASSERT_TRUE(job.parameters.image.region);
  EXPECT_EQ(job.parameters.image.region->left, 2);
  const ImageHeader header = make_image_header(job);
  EXPECT_EQ(header.width, 20);
  EXPECT_EQ(header.height, 10);
  // The last star is outside the region, and does not count as an object.
  EXPECT_EQ(job.scene->objects, 2u);
}

TEST(StampPiece, PiecesFitAnInteger) {
  EXPECT_EQ(stamp_piece(std::vector<std::size_t>{}, 10), 256U);
  EXPECT_EQ(stamp_piece(std::vector<std::size_t>{256 * 9, 1}, 10), 256U);
  EXPECT_EQ(stamp_piece(std::vector<std::size_t>{256 * 9 + 1, 1}, 10), 512U);
  // Each piece then holds at most one stamp.
  EXPECT_EQ(stamp_piece(std::vector<std::size_t>{1000, 1000, 1000}, 2), 1024U);
  // 10^6 stamps of 1001 x 1001 pixels in 6 bands.
  const std::vector<std::size_t> many(1'000'000, std::size_t{1001} * 1001 * 6 + 1);
  const std::size_t piece = stamp_piece(many, 2'147'483'647);
  EXPECT_LE((many.front() + piece - 1) / piece * many.size(), 2'147'483'647U);
  EXPECT_GT((many.front() + piece / 2 - 1) / (piece / 2) * many.size(), 2'147'483'647U);
}

}  // namespace
}  // namespace gamer::stamps_test
