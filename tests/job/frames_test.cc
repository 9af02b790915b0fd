#include "gamer/job/frames.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/image/image_writer.h"
#include "job/completed.h"

namespace gamer::frames_test {
namespace {

namespace fs = std::filesystem;
using test::completed;

const char* const parameters_text =
    "[image]\nsize = [24, 18]\noutput = \"film.fits\"\n[sampling]\ntolerance = 0.01\n"
    "[animation]\nframes = 3\nposition = [0, -3, 0.5, 0.5, -1, 1]\n";
// The third row shares the first row's galaxy, the fourth has another seed, and the last is a star.
const char* const scene_text =
    "galaxy x y z inclination pa size seed apparent_magnitude\n"
    "noisy 0 0 0 50 30 1 1 10\nsmooth 0.5 2 0.1 10 0 0.5 1 12\n"
    "noisy -1 1 0 20 0 0.5 1 12\nnoisy 1 1 0 20 0 0.5 2 12\nstar 0.2 0 0.3 - - - - 15\n";
const char* const noisy =
    "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = {octaves = 2}\n"
    "[[component]]\nclass = \"dust\"\nnoise = {octaves = 2}\n";
const char* const smooth = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";
const char* const band =
    "# wavelength: Angstrom\n# response: photons\n4000 0\n5000 1\n6000 1\n7000 0\n";

RenderJob animation(const std::vector<std::string>& settings = {}) {
  Resources data = Resources::from_record({{"render.par", "film.par", parameters_text},
                                           {"scene.lst", "scene.lst", scene_text},
                                           {"galaxies/noisy", "noisy.toml", noisy},
                                           {"galaxies/smooth", "smooth.toml", smooth},
                                           {"bandpasses/sdss_r", "sdss_r.band", band}});
  JobRequest request;
  request.settings = settings;
  return load_job(request, data);
}

RenderParameters frame(const RenderJob& film, int number) {
  return frame_parameters(film.parameters, CameraPath(film.parameters), number);
}

std::vector<double> pixels(const RenderJob& job) {
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  std::vector<double> values(static_cast<std::size_t>(renderer.width()) *
                             static_cast<std::size_t>(renderer.height()));
  renderer.render_rows({0, renderer.height()}, values);
  return values;
}

TEST(FrameJobs, AreTheJobsOfTheFramesAlone) {
  const RenderJob film = animation();
  FrameJobs jobs(film), from_record(film.record);
  // Frames are made from the last to the first; nothing of a former frame may remain.
  for (int number = 2; number >= 0; --number) {
    const RenderJob shared = jobs.make(frame(film, number));
    FrameJobs fresh(film.record);
    const RenderJob alone = fresh.make(frame(film, number));
    EXPECT_EQ(pack_record(shared.record), pack_record(alone.record));
    EXPECT_EQ(pack_record(from_record.make(frame(film, number)).record), pack_record(alone.record));
    EXPECT_EQ(pixels(shared), pixels(alone));
    EXPECT_EQ(pixels(shared), pixels(completed(shared.record)));
  }
}

TEST(FrameJobs, ShareGalaxies) {
  const RenderJob film = animation();
  FrameJobs jobs(film);
  const RenderJob first = jobs.make(frame(film, 0)), last = jobs.make(frame(film, 2));
  ASSERT_EQ(first.scene->galaxies.size(), 4u);
  for (std::size_t g = 0; g < 4; ++g) {
    EXPECT_EQ(first.scene->galaxies[g].galaxy, film.scene->galaxies[g].galaxy);
    EXPECT_EQ(last.scene->galaxies[g].galaxy, film.scene->galaxies[g].galaxy);
  }
  EXPECT_EQ(first.scene->galaxies[0].galaxy, first.scene->galaxies[2].galaxy);
  EXPECT_NE(first.scene->galaxies[0].galaxy, first.scene->galaxies[3].galaxy);
}

// Second moments of a thin disk give the cosine of the angle between its axis and the view.
TEST(FrameJobs, CamerasAroundADiskSeeItFromAllSides) {
  const char* const around =
      "[image]\nsize = 96\noutput = \"film.fits\"\n[sampling]\ntolerance = 1e-3\n"
      "[camera]\nprojection = \"orthographic\"\nwidth = 2\n[animation]\nframes = 4\n"
      "position = [0, -3, 0, 3, 0, 0, 0, 3, 0, -3, 0, 0]\n";
  // The line of nodes is vertical, so that the axis lies in the plane of the cameras.
  Resources data = Resources::from_record(
      {{"render.par", "film.par", around},
       {"scene.lst", "scene.lst", "galaxy x y z inclination pa\ndisk 0 0 0 60 0\n"},
       {"galaxies/disk", "disk.toml",
        "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\nz0 = 0.01\n"}});
  const RenderJob film = load_job({}, data);
  FrameJobs jobs(film);
  for (int number = 0; number < 4; ++number) {
    const RenderJob job = jobs.make(frame(film, number));
    const std::vector<double> values = pixels(job);
    const int width = job.camera.width();
    double xx = 0, yy = 0;
    for (int y = 0; y < width; ++y) {
      for (int x = 0; x < width; ++x) {
        const double value = values[static_cast<std::size_t>(y * width + x)];
        const double half = 0.5 * (width - 1);
        xx += value * (x - half) * (x - half);
        yy += value * (y - half) * (y - half);
      }
    }
    const double expected = number % 2 == 0 ? 0.5 : std::sqrt(0.75);
    EXPECT_NEAR(std::sqrt(xx / yy), expected, 5e-3) << number;
  }
}

TEST(FrameJobs, FirstFrameSeesTheInclinationOfTheScene) {
  const RenderJob film = animation();
  FrameJobs jobs(film);
  RenderParameters parameters = frame(film, 0);
  Resources data = Resources::from_record({{"render.par", "one.par", parameters.toml()},
                                           {"scene.lst", "scene.lst", scene_text},
                                           {"galaxies/noisy", "noisy.toml", noisy},
                                           {"galaxies/smooth", "smooth.toml", smooth},
                                           {"bandpasses/sdss_r", "sdss_r.band", band}});
  const RenderJob alone = load_job({}, data);
  const RenderJob own = jobs.make(std::move(parameters));
  for (std::size_t g = 0; g < 4; ++g) {
    const glm::dmat3 difference = own.scene->galaxies[g].to_ball - alone.scene->galaxies[g].to_ball;
    for (int i = 0; i < 3; ++i) EXPECT_LT(glm::length(difference[i]), 1e-14) << g;
  }
}

TEST(FramesApart, ShareOutEvenly) {
  EXPECT_EQ(frames_apart(10, 1), 0);
  EXPECT_EQ(frames_apart(10, 3), 9);
  EXPECT_EQ(frames_apart(2, 3), 0);
}

class SameFrame : public testing::Test {
 protected:
  SameFrame() {
    std::string name = (fs::temp_directory_path() / "frames.XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~SameFrame() override { fs::remove_all(folder_); }

  /// An image with the record of a frame.
  fs::path write(const std::string& name, const RenderJob& job) const {
    OutputOptions options;
    options.path = folder_ / name;
    const ImageHeader header = make_image_header(job);
    const auto writer = make_image_writer(options, header);
    const std::vector<double> values(
        static_cast<std::size_t>(header.width * header.height * header.planes()), 1.0);
    writer->write_rows(0, header.height, values);
    writer->finish();
    return options.path;
  }

  fs::path folder_;
};

TEST_F(SameFrame, IsToldByFitsFilesAndPngPictures) {
  const RenderJob film = animation();
  FrameJobs jobs(film);
  const RenderJob changed = animation({"noise.seed=7", "sampling.tolerance=0.02"});
  for (const char* name : {"x.fits", "x.png"}) {
    const fs::path image = write(name, jobs.make(frame(film, 1)));
    EXPECT_EQ(check_same_frame(image, film.record, frame(film, 1)), std::nullopt);
    EXPECT_EQ(error_text([&] { check_same_frame(image, changed.record, frame(changed, 1)); }),
              image.string() +
                  ": the job has changed since it began: noise.seed was 1, is 7; "
                  "sampling.tolerance was 0.01, is 0.02; --overwrite starts anew");
    EXPECT_NE(error_text([&] {
                check_same_frame(image, film.record, frame(film, 2));
              }).find("camera.position was ["),
              std::string::npos);
  }
  const fs::path image = write("x.bmp", jobs.make(frame(film, 1)));
  EXPECT_EQ(check_same_frame(image, changed.record, frame(changed, 1)), std::nullopt);
}

TEST_F(SameFrame, MayHaveAToneThatTheFilmLeavesOpen) {
  const RenderJob film = animation();
  FrameJobs jobs(film);
  RenderParameters parameters = frame(film, 1);
  parameters.set("image", "tone", std::vector<double>{0, 0, 0, 1, 1, 1, 2, 3});
  const fs::path image = write("x.png", jobs.make(parameters));
  const auto tone = check_same_frame(image, film.record, frame(film, 1));
  ASSERT_TRUE(tone);
  EXPECT_EQ((*tone)[7], 3);
  parameters.set("image", "tone", std::vector<double>{0, 0, 0, 1, 1, 1, 2, 4});
  EXPECT_NE(error_text([&] {
              check_same_frame(image, film.record, parameters);
            }).find("image.tone was [0, 0, 0, 1, 1, 1, 2, 3], is [0, 0, 0, 1, 1, 1, 2, 4]"),
            std::string::npos);
}

}  // namespace
}  // namespace gamer::frames_test
