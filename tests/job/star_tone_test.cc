#include "gamer/job/star_tone.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "completed.h"
#include "gamer/job/schedule.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer::star_tone_test {
namespace {

const char* const bulge_with_stars =
    "[[component]]\nclass = \"sersic\"\nsed = \"flat\"\nindex = 2\neffective_radius = 0.1\naxis = "
    "[1, 1, 0.3]\nfraction = 0.9\n"
    "[[component]]\nclass = \"starfield\"\nsed = \"flat\"\nz0 = 0.05\n"
    "fraction = 0.1\nnumber = 30000\n";

const char* const bright =
    "[[component]]\nclass = \"sersic\"\nsed = \"flat\"\nindex = 1\neffective_radius = 0.1\n"
    "intensity = 1e4\n";

/// A disk with clumps of young stars, of which the brightest are finer than a pixel.
const char* const clumpy =
    "[[component]]\nclass = \"starfield\"\nsed = \"flat\"\nz0 = 0.03\nrh = 0.2\n"
    "fraction = 0.9\nnumber = 30000\n"
    "[[component]]\nclass = \"associations\"\nsed = \"flat\"\nz0 = 0.02\nrh = 0.2\n"
    "number = 5000\nluminosity_slope = 1.9\nluminosity_range = 200\nlargest = 0.045\n"
    "size_exponent = 4\ncores = 0.7\ndiffuse = 0\nfraction = 0.1\nseed = 3\n";

RenderJob job_of(const std::string& size, const std::string& rows) {
  const std::string parameters =
      "[image]\nsize = " + size +
      "\noutput = \"out.png\"\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, 10]\n"
      "up = [0, 1, 0]\nwidth = 2.5\n[spectrum]\nwavelengths = [5500]\n[sampling]\n"
      "tolerance = 1e-2\n";
  return test::completed({{"render.par", "render.par", parameters},
                          {"scene.lst", "scene.lst", "galaxy x y z size inclination pa\n" + rows},
                          {"galaxies/mine", "mine.toml", bulge_with_stars},
                          {"galaxies/clumpy", "clumpy.toml", clumpy},
                          {"galaxies/bright", "bright.toml", bright}});
}

/// The share of pixels with light that are brighter than white if all stars are smooth light.
double share_above_white(const RenderJob& job) {
  RenderParameters parameters = job.parameters;
  parameters.sampling.stars_per_pixel = 0;
  ThreadExecutor executor(1);
  const Image image =
      render_image(Renderer(parameters, job.camera, job.scene, job.spectrum), executor);
  const PictureTone tone = PictureTone::of_numbers(job.parameters.stars.tone.value());
  const double white = tone.black[0] + picture_white(tone, 1, {}).at(0);
  int count = 0, lit = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      count += image.at(x, y, 0) > white;
      lit += image.at(x, y, 0) > 0;
    }
  }
  return count / double(lit);
}

TEST(StarTone, NucleiAreWhiteWhereverTheyLie) {
  const std::pair<std::string, std::string> views[] = {
      {"[480, 480]", "mine 0 0 0 1 0 0\n"},
      {"[480, 400]", "mine 0.3 -0.21 0 0.7 0 0\n"},
      {"[480, 480]", "mine -0.6 0.5 0 0.5 0 0\nmine 0.52 0.3 0 0.5 0 0\nmine 0 -0.5 0 0.5 0 0\n"},
      {"[480, 480]", "mine 0.1 0.35 0 0.3 0 0\n"},
      {"[480, 480]", "mine 0 0 0 1 90 0\n"},
      {"[480, 480]", "mine 0 0 0 1 90 90\n"},
      {"[480, 480]", "mine -0.6 0 0 0.5 0 0\nmine 0.6 0.01 0 0.45 0 0\n"},
      {"[480, 480]", "mine 1.24 0 0 1 0 0\n"},
      {"[90, 480]", "mine 0 0 0 1 0 0\n"},
      {"[480, 480]", "mine 0.2 0.3 0 30 0 0\n"},
  };
  for (const auto& [size, rows] : views) {
    const double share = share_above_white(job_of(size, rows));
    EXPECT_GT(share, 0.5e-5) << size << rows;
    EXPECT_LT(share, 2.5e-4) << size << rows;
  }
}

TEST(StarTone, BrightNucleiOfTheBackgroundAreNoWhite) {
  const auto white = [](const std::string& other) {
    const RenderJob job = job_of("[480, 480]", "mine 0 0 0 1 0 0\n" + other);
    return picture_white(PictureTone::of_numbers(job.parameters.stars.tone.value()), 1, {}).at(0);
  };
  EXPECT_NEAR(white("bright 0.9 0.9 0 0.1 0 0\n") / white(""), 1, 1e-3);
  EXPECT_GT(white("bright 0.9 0.9 0 0.3 0 0\n") / white(""), 1.5);
}

double white_of(const std::string& size, const std::string& rows) {
  const RenderJob job = job_of(size, rows);
  return picture_white(PictureTone::of_numbers(job.parameters.stars.tone.value()), 1, {}).at(0);
}

TEST(StarTone, WhiteOfClumpsIsThatOfOtherSizes) {
  for (const char* rows : {"clumpy 0 0 0 1 0 0\n", "clumpy 0.3 -0.2 0 0.6 60 20\n"}) {
    const double white = white_of("[500, 500]", rows);
    for (const char* size : {"[300, 300]", "[400, 400]", "[700, 700]", "[1024, 1024]"}) {
      EXPECT_NEAR(white_of(size, rows) / white, 1, 0.05) << size << rows;
    }
  }
}

}  // namespace
}  // namespace gamer::star_tone_test
