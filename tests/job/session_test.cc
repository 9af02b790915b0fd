#include "gamer/job/session.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "core/error_text.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/job/schedule.h"
#include "gamer/job/stamps.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"

namespace gamer::session_test {
namespace {

const char* const view =
    "[image]\nsize = [30, 20]\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, 10]\n"
    "up = [0, 1, 0]\nwidth = 2.5\n[spectrum]\nwavelengths = [4400, 5500]\n[sampling]\n"
    "tolerance = 3e-2\n";
const char* const list = "galaxy x y z inclination pa\nmine 0 0 0 40 30\n";
const char* const clumpy =
    "[[component]]\nclass = \"disk\"\nname = \"disk\"\nsed = \"flat\"\n"
    "[[component]]\nclass = \"dust\"\nname = \"dust\"\noptical_depth = 2\n";

RenderInput input(const std::string& galaxy = clumpy, const std::string& parameters = view) {
  return {parameters, RenderInput::Text{list}, {{"mine", galaxy}}};
}

/// The pixels that the program renders of these texts, with a new calibration.
Image expected_image(const std::string& galaxy, const std::string& parameters,
                     const std::string& scene = list) {
  Resources resources = Resources::from_record({{"render.par", "render.par", parameters},
                                                {"scene.lst", "scene.lst", scene},
                                                {"galaxies/mine", "mine.toml", galaxy}});
  const RenderJob job = load_job(JobRequest(), resources);
  ThreadExecutor executor(1);
  return render_image(Renderer(job.parameters, job.camera, job.scene, job.spectrum), executor);
}

void expect_equal(const Image& a, const Image& b) {
  ASSERT_EQ(a.width(), b.width());
  ASSERT_EQ(a.height(), b.height());
  ASSERT_EQ(a.planes(), b.planes());
  int different = 0;
  double sum = 0;
  for (int plane = 0; plane < a.planes(); ++plane) {
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) {
        different += a.at(x, y, plane) != b.at(x, y, plane);
        sum += a.at(x, y, plane);
      }
    }
  }
  EXPECT_EQ(different, 0);
  EXPECT_GT(sum, 0);
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  const std::size_t place = text.find(old);
  if (place == std::string::npos) throw std::logic_error("no " + old);
  return text.replace(place, old.size(), by);
}

TEST(Session, RendersThePixelsOfTheProgram) {
  const Image expected = expected_image(clumpy, view);
  for (const int threads : {1, 3}) {
    const Session session(threads);
    const Rendering rendering = session.render(session.load(input()));
    expect_equal(rendering.image, expected);
    EXPECT_EQ(rendering.header().width, 30);
    EXPECT_EQ(rendering.header().labels, (std::vector<std::string>{"4400A", "5500A"}));
    EXPECT_FALSE(rendering.truth);
    EXPECT_TRUE(rendering.stamps.empty());
  }
}

TEST(Session, MeasuresNothingAgainForCamerasAndSpectra) {
  const Session session(2);
  session.render(session.load(input()));
  const std::size_t measured = session.memory().measured();
  EXPECT_GT(measured, 0u);
  const std::string turned = replaced(view, "position = [0, 0, 10]", "position = [3, 1, 10]");
  const std::string red = replaced(clumpy, "flat", "powerlaw(1)");
  const std::string curve = replaced(clumpy, "optical_depth", "r_v = 4\noptical_depth");
  expect_equal(session.render(session.load(input(clumpy, turned))).image,
               expected_image(clumpy, turned));
  expect_equal(session.render(session.load(input(red))).image, expected_image(red, view));
  expect_equal(session.render(session.load(input(curve))).image, expected_image(curve, view));
  EXPECT_EQ(session.memory().measured(), measured);
  EXPECT_GT(session.memory().recalled(), measured);
}

/// The brightness of the only galaxy of a rendering.
double brightness(const Rendering& rendering) {
  return rendering.job->scene->galaxies.at(0).brightness;
}

TEST(Session, CoarseViewsShareTheMeasurementOfAttenuation) {
  const auto observed = [](const std::string& tolerance, bool is_draft) {
    RenderInput own = input(
        clumpy,
        "[image]\nsize = 60\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\npixel_scale = 0.1\n"
        "[spectrum]\nbands = [\"bessell_v\"]\n[sampling]\ntolerance = " +
            tolerance + "\n");
    own.scene = RenderInput::Text{
        "galaxy ra dec redshift size_arcsec apparent_magnitude inclination pa\n"
        "mine 10 20 0.1 4 22 60 30\n"};
    own.is_draft = is_draft;
    return own;
  };
  const Session session(2);
  const double coarse = brightness(session.render(session.load(observed("5e-2", true))));
  const std::size_t measured = session.memory().measured();
  EXPECT_EQ(brightness(session.render(session.load(observed("2e-2", true)))), coarse);
  EXPECT_EQ(brightness(session.render(session.load(observed("1e-1", true)))), coarse);
  EXPECT_EQ(session.memory().measured(), measured);
  // The finest view needs its own measurement.
  const double fine = brightness(session.render(session.load(observed("1e-2", false))));
  EXPECT_GT(session.memory().measured(), measured);
  const Session alone(2);
  EXPECT_EQ(brightness(alone.render(alone.load(observed("1e-2", false)))), fine);
  // The tolerance is twice the difference that was measured.
  EXPECT_NEAR(coarse / fine, 1, 4.7e-3);
}

TEST(Session, MeasuresAgainWhatDependsOnAChange) {
  const Session session(2);
  session.render(session.load(input()));
  std::size_t measured = session.memory().measured();
  const std::vector<std::string> changed = {
      replaced(clumpy, "optical_depth = 2", "optical_depth = 4"),
      replaced(clumpy, "sed = \"flat\"", "sed = \"flat\"\nrh = 0.3"),
      replaced(clumpy, "optical_depth = 2", "optical_depth = 2\nnoise = {seed = 5}"),
      replaced(clumpy, "[[component]]", "[galaxy]\naxis = [1, 1, 1.5]\n[[component]]"),
  };
  for (const std::string& galaxy : changed) {
    expect_equal(session.render(session.load(input(galaxy))).image, expected_image(galaxy, view));
    EXPECT_GT(session.memory().measured(), measured) << galaxy;
    measured = session.memory().measured();
  }
  const std::string finer = replaced(view, "3e-2", "1e-2");
  expect_equal(session.render(session.load(input(clumpy, finer))).image,
               expected_image(clumpy, finer));
  EXPECT_GT(session.memory().measured(), measured);
}

TEST(Session, AnEditOfANoiseMeasuresThatComponentAlone) {
  const std::string both = std::string(clumpy) +
                           "[[component]]\nclass = \"disk\"\nname = \"other\"\nsed = \"flat\"\n"
                           "noise = {octaves = 3}\n";
  const auto measured_by_edit = [&](const std::string& before, const std::string& after) {
    const Session session(2);
    session.render(session.load(input(both)));
    const std::size_t measured = session.memory().measured();
    const std::string edited = replaced(both, before, after);
    expect_equal(session.render(session.load(input(edited))).image, expected_image(edited, view));
    return session.memory().measured() - measured;
  };
  // The edit measures sums, means and, where needed, larger clouds of one component.
  const std::size_t noise = measured_by_edit("octaves = 3", "octaves = 2");
  const std::size_t all =
      measured_by_edit("[[component]]", "[galaxy]\naxis = [1, 1, 1.5]\n[[component]]");
  EXPECT_GE(noise, 2u);
  EXPECT_LE(noise, all / 3);
}

/// The galaxy that a render used.
const Galaxy* galaxy_of(const Rendering& rendering) {
  return rendering.job->scene->galaxies.at(0).galaxy.get();
}

TEST(Session, KeepsEqualGalaxiesAsAWhole) {
  const Session session(2);
  const Rendering first = session.render(session.load(input()));
  const std::string turned = replaced(view, "position = [0, 0, 10]", "position = [3, 1, 10]");
  const Rendering second = session.render(session.load(input(clumpy, turned)));
  EXPECT_EQ(galaxy_of(first), galaxy_of(second));
  expect_equal(second.image, expected_image(clumpy, turned));
  // The record has all texts that made the image.
  const auto names = [](const Rendering& rendering) {
    std::vector<std::string> result;
    for (const Resources::Text& text : rendering.job->record) result.push_back(text.name);
    return result;
  };
  EXPECT_EQ(names(first), names(second));

  // Rays of another footprint need another measurement.
  const std::string near = replaced(view, "width = 2.5", "width = 0.2");
  const Rendering third = session.render(session.load(input(clumpy, near)));
  EXPECT_NE(galaxy_of(first), galaxy_of(third));
  expect_equal(third.image, expected_image(clumpy, near));

  const std::string seeded = std::string(view) + "[noise]\nseed = 3\n";
  EXPECT_NE(galaxy_of(first), galaxy_of(session.render(session.load(input(clumpy, seeded)))));
}

TEST(Session, NoticesChangedFiles) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "session_changed_files";
  std::filesystem::create_directories(folder / "seds");
  const auto write = [&](const char* rows) {
    std::ofstream(folder / "seds" / "own.sed") << "# wavelength: Angstrom\n# flux: flambda\n"
                                               << rows;
  };
  write("3000 1\n5500 1\n9000 1\n");
  const Session session(1, {folder});
  const std::string galaxy = replaced(clumpy, "flat", "own");
  const Rendering first = session.render(session.load(input(galaxy)));
  EXPECT_EQ(galaxy_of(session.render(session.load(input(galaxy)))), galaxy_of(first));
  write("3000 2\n5500 1\n9000 1\n");
  const Rendering second = session.render(session.load(input(galaxy)));
  EXPECT_NE(galaxy_of(second), galaxy_of(first));
  // f_lambda is linear in wavelength between the rows of a spectrum.
  EXPECT_NEAR(second.image.at(15, 10, 0) / first.image.at(15, 10, 0), 1 + 1100.0 / 2500, 1e-12);
}

TEST(Session, TakesTables) {
  DataTable table;
  table.columns.push_back({"galaxy", "", "", std::vector<std::string>{"mine"}});
  for (const char* zero : {"x", "y", "z"}) {
    table.columns.push_back({zero, "", "", std::vector<double>{0}});
  }
  table.columns.push_back({"inclination", "deg", "", std::vector<double>{40}});
  table.columns.push_back({"pa", "deg", "", std::vector<double>{30}});
  RenderInput own = input();
  own.scene = table;
  const Session session(1);
  expect_equal(session.render(session.load(own)).image, expected_image(clumpy, view));
}

TEST(Session, SaysWhatIsWrong) {
  const Session session(1);
  EXPECT_EQ(
      error_text([&] { session.load(input("[[component]]\nclass = \"disk\"\n")); }),
      "mine.toml:1:1: component 'disk1': missing key 'sed' in a [[component]] of class 'disk'");
  EXPECT_EQ(error_text([&] { session.load(input(clumpy, "[camera]\nfov = 200\n")); }).substr(0, 9),
            "input:2:7");
  RenderInput slash = input();
  slash.galaxies["a/b"] = clumpy;
  EXPECT_EQ(error_text([&] { session.load(slash); }), "galaxy 'a/b': a name in memory has no '/'");
  EXPECT_THROW(Session(0), std::invalid_argument);
}

TEST(Session, TellsOfProgressInTheCallersThread) {
  const Session session(2);
  std::vector<RenderProgress> told;
  bool is_own_thread = true;
  const std::thread::id own = std::this_thread::get_id();
  RenderControl control;
  control.truth = true;
  control.progress = [&](const RenderProgress& now) {
    told.push_back(now);
    is_own_thread = is_own_thread && std::this_thread::get_id() == own;
  };
  const Rendering rendering = session.render(session.load(input()), control);
  EXPECT_TRUE(is_own_thread);
  EXPECT_EQ(told.front().stage, RenderProgress::Stage::measuring);
  EXPECT_EQ(told.back().stage, RenderProgress::Stage::rows);
  EXPECT_EQ(told.back().done, 20);
  EXPECT_EQ(told.back().total, 20);
  ASSERT_TRUE(rendering.truth);
  EXPECT_EQ(rendering.truth->rows(), 1u);
}

TEST(Session, GivesFinishedRowsFromTheMiddle) {
  const int height = 100;
  const std::string tall = replaced(view, "[30, 20]", "[10, 100]");
  for (const int threads : {1, 2}) {
    const Session session(threads);
    RowRange first;
    int finished = 0, progress = 0;
    RenderControl control;
    control.progress = [&](const RenderProgress& now) { progress = now.done; };
    control.finished = [&](RowRange rows, const Rendering& rendering) {
      EXPECT_EQ(rendering.image.height(), height);
      EXPECT_LE(rows.size(), Renderer::tile_rows);
      EXPECT_EQ(progress, finished);
      if (finished == 0) first = rows;
      finished += rows.size();
    };
    const Rendering rendering = session.render(session.load(input(clumpy, tall)), control);
    EXPECT_EQ(finished, height);
    EXPECT_LE(std::abs(first.first + first.last - height), 2 * Renderer::tile_rows);
    expect_equal(rendering.image, expected_image(clumpy, tall));
  }
}

// Fixed fluxes that a session remembers, with or without the table of truth, change no pixel.
TEST(Session, TellsTheTruthWhateverItRenderedBefore) {
  const std::string sky =
      "[image]\nsize = 24\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\npixel_scale = 0.2\n"
      "[spectrum]\nbands = [\"sdss_g\", \"sdss_r\"]\n[sampling]\ntolerance = 1e-2\n";
  const std::string row =
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude\nmine 10 20 0.1 2 50 22\n";
  const auto render = [&](const Session& session, bool truth) {
    RenderControl control;
    control.truth = truth;
    return session.render(session.load({sky, RenderInput::Text{row}, {{"mine", clumpy}}}), control);
  };
  const auto radius = [](const Rendering& rendering) {
    for (const DataColumn& column : rendering.truth->columns) {
      if (column.name == "half_light_radius") {
        return std::get<std::vector<double>>(column.values).front();
      }
    }
    return 0.0;
  };
  const Session fresh(1, {GAMER_TEST_SOURCE_DIR}), used(1, {GAMER_TEST_SOURCE_DIR});
  const Rendering expected = render(fresh, true);
  EXPECT_GT(radius(expected), 0);
  for (const bool truth : {false, true, true, false}) {
    const Rendering rendering = render(used, truth);
    expect_equal(rendering.image, expected.image);
    if (truth) {
      EXPECT_EQ(radius(rendering), radius(expected));
    }
  }
}

TEST(Session, SmallAndLargeGalaxiesTakeStatisticsOfTheirOwn) {
  const auto render = [&](const Session& session, double scale) {
    RenderInput sky =
        input(clumpy,
              fmt::format("[image]\nsize = 24\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\n"
                          "pixel_scale = {}\n[spectrum]\nbands = [\"sdss_g\", \"sdss_r\"]\n"
                          "[sampling]\ntolerance = 1e-2\n",
                          scale));
    sky.scene = RenderInput::Text{
        "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
        "mine 10 20 0.1 2 50 22 7\n"};
    return session.render(session.load(sky)).image;
  };
  const double small = 0.2, large = 0.01;  // arcsec a pixel
  const auto fresh = [&](double scale) { return render(Session(1), scale); };
  const Image expected_small = fresh(small), expected_large = fresh(large);
  const Session used(1);
  for (int round = 0; round < 2; ++round) {
    expect_equal(render(used, small), expected_small);
    expect_equal(render(used, large), expected_large);
  }
}

TEST(Session, EndsWhenTheCallBackThrows) {
  for (const int threads : {1, 2}) {
    const Session session(threads);
    RenderControl control;
    control.progress = [&](const RenderProgress& now) {
      if (now.stage == RenderProgress::Stage::rows) throw std::runtime_error("enough");
    };
    EXPECT_THROW(session.render(session.load(input()), control), std::runtime_error);
    expect_equal(session.render(session.load(input())).image, expected_image(clumpy, view));
  }
}

TEST(Session, IsCancelledAtAnyTime) {
  const Session session(2);
  Cancellation cancellation;
  RenderControl control;
  control.cancellation = &cancellation;
  // The first render is cancelled between tiles, the second before it measures its galaxies.
  control.progress = [&](const RenderProgress& now) {
    if (now.stage == RenderProgress::Stage::rows) cancellation.request();
  };
  EXPECT_THROW(session.render(session.load(input()), control), Cancelled);
  const std::size_t measured = session.memory().measured();
  control.progress = {};
  const std::string other = replaced(clumpy, "optical_depth = 2", "noise = {seed = 9}");
  EXPECT_THROW(session.render(session.load(input(other)), control), Cancelled);
  EXPECT_EQ(session.memory().measured(), measured);
}

TEST(Session, MakesStamps) {
  const std::string sky =
      "[image]\nsize = 40\nlayout = \"stamps\"\n[camera]\nprojection = \"sky\"\npixel_scale = 0.5\n"
      "[spectrum]\nwavelengths = [5500]\n[stamps]\nsmallest = 5\n";
  RenderInput own = input(clumpy, sky);
  own.scene = RenderInput::Text{"galaxy px py size_arcsec inclination pa\nmine 12 9 2 30 0\n"};
  const Session session(2);
  const Rendering rendering = session.render(session.load(own));
  ASSERT_EQ(rendering.stamps.size(), 1u);
  const ImageRegion region = stamp_regions(*rendering.job).front();
  EXPECT_EQ(rendering.stamps[0].region.left, region.left);
  EXPECT_EQ(rendering.stamps[0].image.width(), region.width);
  // In the whole image, too, the galaxy is alone in these pixels.
  const Image whole = expected_image(clumpy, replaced(sky, "layout = \"stamps\"\n", ""),
                                     std::get<RenderInput::Text>(own.scene).content);
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      if (region.left + x < 0 || region.bottom + y < 0) continue;
      EXPECT_EQ(rendering.stamps[0].image.at(x, y), whole.at(region.left + x, region.bottom + y));
    }
  }
}

TEST(Session, RefusesFilms) {
  const Session session(1);
  const std::string film =
      std::string(view) + "[animation]\nframes = 2\nposition = [0, 0, 9, 1, 0, 9]\n";
  EXPECT_EQ(error_text([&] { session.render(session.load(input(clumpy, film))); }),
            "a film has many images; render its frames, each with its own camera");
}

TEST(Session, ServesThreadsAtOnce) {
  const Session session(2);
  const Image expected = expected_image(clumpy, view);
  std::vector<Rendering> made(3);
  std::vector<std::thread> threads;
  for (Rendering& own : made) {
    threads.emplace_back([&] { own = session.render(session.load(input())); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Rendering& own : made) expect_equal(own.image, expected);
}

TEST(CalibrationMemory, ForgetsWhatWasNotUsedForLongest) {
  CalibrationMemory memory(2000);
  std::vector<double> numbers(8);
  const std::vector<double> kept = {1, 0, 3, 0, 0};
  memory.keep("first", kept);
  ASSERT_TRUE(memory.recall("first", numbers));
  EXPECT_EQ(numbers, (std::vector<double>{1, 0, 3, 0, 0, 0, 0, 0}));
  for (int i = 0; i < 100; ++i) {
    memory.keep("part " + std::to_string(i), kept);
    EXPECT_TRUE(memory.recall("first", numbers)) << i;
  }
  EXPECT_FALSE(memory.recall("part 0", numbers));
  EXPECT_TRUE(memory.recall("part 99", numbers));
  EXPECT_EQ(memory.measured(), 101u);
  // A part with more numbers than there is room for is not recalled.
  EXPECT_FALSE(memory.recall("first", std::span(numbers).first(2)));
}

#ifdef __GLIBC__

std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

TEST(CalibrationMemory, TakesNoMoreThanItsLimit) {
  constexpr std::size_t most = std::size_t{8} << 20;
  const std::size_t before = bytes_in_use();
  CalibrationMemory memory(most);
  const std::vector<double> numbers(20, 1.5);
  std::size_t largest = 0;
  for (int i = 0; i < 200000; ++i) {
    memory.keep("a name as long as those of parts of galaxies are " + std::to_string(i), numbers);
    if (i % 100 == 0) largest = std::max(largest, bytes_in_use() - before);
  }
  // The measured ratio is 1.09; the last block of each half may still be empty.
  EXPECT_LT(static_cast<double>(largest), 1.2 * most);
  EXPECT_GT(static_cast<double>(largest), 0.5 * most);
}

#endif

}  // namespace
}  // namespace gamer::session_test
