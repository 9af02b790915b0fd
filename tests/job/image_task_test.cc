#include "gamer/job/image_task.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "image/image_test_util.h"
#include "image/temporary_file.h"

namespace gamer::image_task_test {
namespace {

namespace fs = std::filesystem;

class WorkTest : public testing::Test {
 protected:
  static fs::path make_folder() {
    std::string name = (fs::temp_directory_path() / "work.XXXXXX").string();
    return mkdtemp(name.data());
  }
  ~WorkTest() override { fs::remove_all(folder_); }

  /// The job of a small image, written to x.fits of the folder.
  RenderJob job(const std::vector<std::string>& settings = {}) const {
    Resources data = Resources::from_record(
        {{"render.par", "render.par",
          "[image]\nsize = [6, 4]\n[spectrum]\nwavelengths = [5000, 6000]\n"},
         {"scene.lst", "scene.lst", "galaxy x y z\nsmooth 0 0 0\nsmooth 1 0 0\n"},
         {"galaxies/smooth", "smooth.toml",
          "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n"}});
    JobRequest request;
    request.settings = settings;
    request.output = image_;
    return load_job(request, data);
  }
  std::string hindrance_of(const JobOptions& options) const {
    return ImageTask(job(), options, 1, 1, nullptr).hindrance();
  }
  /// Runs the job, and returns its message.
  std::string work(const JobOptions& options) const {
    ImageTask work(job(), options, 1, 1, nullptr);
    if (!work.is_complete()) {
      ThreadExecutor executor(1);
      RankReport report;
      work.begin();
      work.render(executor, Progress::Style::none, report);
      // The report has the times of this job.
      EXPECT_GT(report.counts.rays, 0u);
      EXPECT_GE(report.runs.wall, report.runs.compute);
      EXPECT_GE(report.writing, report.runs.consume);
    }
    return work.text(0);
  }

  fs::path folder_ = make_folder();
  fs::path image_ = folder_ / "x.fits";
};

TEST_F(WorkTest, TextsNameFilesAndSizes) {
  const RenderJob cube = job();
  EXPECT_EQ(size_text(make_image_header(cube)), "6 x 4 pixels, 2 planes");
  EXPECT_EQ(files_text(cube.parameters.image.output, make_image_header(cube)), image_.string());
  EXPECT_EQ(objects_text(*cube.scene), "2 galaxies");
  const RenderJob files = job({"image.layout=files"});
  EXPECT_EQ(files_text(files.parameters.image.output, make_image_header(files)),
            (folder_ / "x_5000A.fits").string() + " and 1 more");
  const RenderJob map = job({"camera.projection=healpix", "camera.nside=2"});
  EXPECT_EQ(size_text(make_image_header(map)), "12 x 2 x 2 pixels, 2 planes");
  const RenderJob box = job({"camera.projection=cubemap", "image.size=5"});
  EXPECT_EQ(size_text(make_image_header(box)), "6 x 5 x 5 pixels, 2 planes");
}

TEST_F(WorkTest, ResultFilesAreAllThatAJobMakes) {
  const RenderJob truth = job({"truth.dust_free=true", "image.layout=files"});
  JobOptions options;
  const ImageHeader image = make_image_header(truth);
  const auto names = [&] {
    std::vector<std::string> result;
    for (const fs::path& file :
         result_files(truth.parameters, options, image, wanted_truth_header(truth, options))) {
      result.push_back(file.filename().string());
    }
    return result;
  };
  EXPECT_EQ(names(), (std::vector<std::string>{"x_5000A.fits", "x_6000A.fits"}));
  options.truth = true;
  options.truth_table = "t.ecsv";
  EXPECT_EQ(names(),
            (std::vector<std::string>{"x_5000A.fits", "x_6000A.fits", "x_truth.fits", "t.ecsv"}));
}

TEST_F(WorkTest, ExistingFilesHinderAllButDryRuns) {
  JobOptions options;
  EXPECT_EQ(hindrance_of(options), "");
  EXPECT_TRUE(work(options).starts_with(image_.string() + ": 6 x 4 pixels, 2 planes, "));
  const std::string exists = "output '" + image_.string() + "': '" + image_.string() +
                             "' exists already; --overwrite replaces it";
  EXPECT_EQ(error_text([&] { hindrance_of(options); }), exists);
  options.dry_run = true;
  EXPECT_EQ(hindrance_of(options), exists);
  options.resume = true;
  EXPECT_TRUE(ImageTask(job(), options, 1, 1, nullptr).is_complete());
  EXPECT_EQ(work(options), image_.string() + ": complete already");
  EXPECT_EQ(error_text([&] { ImageTask(job({"noise.seed=2"}), options, 1, 1, nullptr); }),
            image_.string() +
                ": the job has changed since it began: noise.seed was 1, is 2; "
                "--overwrite starts anew");
}

TEST_F(WorkTest, DamagedOutputsAreNotComplete) {
  JobOptions options;
  work(options);
  options.resume = true;
  std::string bytes = file_bytes(image_);
  constexpr std::size_t block_size = 2880;
  const std::size_t end = bytes.find("END" + std::string(77, ' '));
  bytes[(end / block_size + 1) * block_size] ^= 1;
  std::ofstream(image_, std::ios::binary) << bytes;
  EXPECT_EQ(error_text([&] { ImageTask(job(), options, 1, 1, nullptr); }),
            image_.string() +
                ": HDU 0 is damaged, or another program has changed it: its DATASUM is wrong; "
                "--overwrite starts anew");
}

TEST_F(WorkTest, WhatAKillLeftWhileTheJournalBeganIsRemoved) {
  const pid_t process = fork();
  if (process == 0) {
    const TemporaryFile journal(image_.string() + ".journal");
    std::ofstream(journal.path()) << "rows";
    _exit(0);
  }
  waitpid(process, nullptr, 0);
  const fs::path left = folder_ / ".x.fits.journal.1";
  ASSERT_TRUE(fs::exists(left));
  work({});
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(WorkTest, ARunningJobIsNotCalledInterrupted) {
  const fs::path path = image_.string() + ".journal";
  JobOptions options;
  {
    Journal running(path, JournalHead{}, 0);
    running.add_rows(0, {0, 1}, std::vector<double>{1}, false);
    EXPECT_EQ(error_text([&] { hindrance_of(options); }),
              "output '" + image_.string() + "': a job that is running makes it; 'gamer --status " +
                  path.string() + "' tells how far it is");
  }
  EXPECT_NE(error_text([&] { hindrance_of(options); }).find("interrupted"), std::string::npos);
}

TEST_F(WorkTest, JournalsHinderAllButDryRuns) {
  std::ofstream(image_.string() + ".journal") << "rows";
  JobOptions options;
  const std::string journal = "output '" + image_.string() + "': '" + image_.string() +
                              ".journal' holds finished rows of a job that was interrupted; "
                              "--resume goes on with it, --overwrite starts anew";
  EXPECT_EQ(error_text([&] { hindrance_of(options); }), journal);
  options.dry_run = true;
  EXPECT_EQ(hindrance_of(options), journal);
}

}  // namespace
}  // namespace gamer::image_task_test
