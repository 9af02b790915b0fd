#include "gamer/scene/animation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "gamer/scene/camera.h"
#include "scene/scene_checks.h"

namespace gamer::animation_test {
namespace {

using test::distance;
using test::parameters_of;

CameraPath path_of(const std::string& text) { return CameraPath(parameters_of(text)); }

std::string message_of(const std::string& text) {
  try {
    path_of(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

const std::vector<double> times = {0, 0.5, 2, 2.25, 5};

TEST(SmoothPath, MeetsItsValues) {
  const std::vector<double> values = {3, -1, 4, 4, -2};
  const SmoothPath<double> path(times, values);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(path.at(times[i]), values[i], 1e-14);
    EXPECT_NEAR(path.at(times[i] - 1e-9 * (i > 0 ? 1 : 0)), values[i], 1e-7);
  }
}

TEST(SmoothPath, HasOneSlopeOnBothSidesOfAValue) {
  const SmoothPath<double> path(times, {3, -1, 4, 4, -2});
  constexpr double step = 1e-5;
  for (std::size_t i = 1; i + 1 < times.size(); ++i) {
    const double t = times[i];
    // One-sided differences of second order.
    const double before =
        (3 * path.at(t) - 4 * path.at(t - step) + path.at(t - 2 * step)) / (2 * step);
    const double after =
        (-3 * path.at(t) + 4 * path.at(t + step) - path.at(t + 2 * step)) / (2 * step);
    EXPECT_NEAR(before, after, 1e-6) << t;
    EXPECT_GT(std::abs(before), 0.1) << t;
  }
}

TEST(SmoothPath, FollowsParabolasExactly) {
  const auto parabola = [](double t) { return 2 - 3 * t + 0.7 * t * t; };
  std::vector<double> values;
  for (const double t : times) values.push_back(parabola(t));
  const SmoothPath<double> path(times, values);
  for (double t = 0; t <= 5; t += 0.1) EXPECT_NEAR(path.at(t), parabola(t), 1e-13) << t;
  const SmoothPath<double> line({1, 3}, {5, 9});
  EXPECT_DOUBLE_EQ(line.at(1.5), 6);
  EXPECT_DOUBLE_EQ(SmoothPath<double>({4}, {7}).at(4), 7);
}

TEST(CameraPath, PassesThroughItsKeys) {
  const CameraPath path = path_of(
      "[animation]\nframes = 11\ntimes = [0, 4, 10]\nposition = [0, -3, 0, 3, 0, 1, 0, 3, 0.5]\n"
      "target = [0, 0, 0, 0.5, 0, 0, 0, 0, 0]\nfov = [10, 20, 80]\n");
  EXPECT_EQ(path.frames(), 11);
  const CameraPath::View middle = path.at(path.time(4));
  EXPECT_LT(distance(middle.position, {3, 0, 1}), 1e-14);
  EXPECT_LT(distance(middle.target, {0.5, 0, 0}), 1e-14);
  EXPECT_NEAR(middle.fov, 20, 1e-13);
  EXPECT_LT(distance(path.at(path.time(0)).position, {0, -3, 0}), 1e-14);
  EXPECT_LT(distance(path.at(path.time(10)).position, {0, 3, 0.5}), 1e-14);
}

TEST(CameraPath, ZoomsEvenly) {
  const CameraPath path = path_of("[animation]\nframes = 5\nfov = [10, 40]\n");
  for (int frame = 0; frame < 5; ++frame) {
    EXPECT_NEAR(path.at(path.time(frame)).fov, 10 * std::pow(4.0, frame / 4.0), 1e-12);
  }
}

TEST(CameraPath, HorizonStaysLevelWithoutKeysOfUp) {
  const CameraPath path =
      path_of("[animation]\nframes = 9\nposition = [0, -3, 1, 3, 0, 2, 0, 3, -1]\n");
  for (int frame = 0; frame < 9; ++frame) {
    EXPECT_EQ(path.at(path.time(frame)).up, glm::dvec3(0, 0, 1));
  }
}

/// The largest turn (rad) of the image's up between neighbouring frames.
double largest_turn(const std::string& animation, int frames) {
  const RenderParameters parameters =
      parameters_of("[animation]\nframes = " + std::to_string(frames) + "\n" + animation);
  const CameraPath path(parameters);
  double largest = 0;
  std::vector<glm::dvec3> ups;
  for (int frame = 0; frame < frames; ++frame) {
    const Camera camera(frame_parameters(parameters, path, frame));
    ups.push_back(camera.up());
    if (frame > 0) {
      largest =
          std::max(largest, std::acos(std::min(1.0, glm::dot(ups[ups.size() - 2], ups.back()))));
    }
  }
  return largest;
}

// The camera passes straight over the pole of the target.
TEST(CameraPath, DoesNotRollSuddenlyAbovePoles) {
  const std::string over =
      "position = [0, -3, 0.5, 0, 0, 3, 0, 3, 0.5]\nup = [0, 0, 1, 0, 1, 0, 0, 0, -1]\n";
  const double coarse = largest_turn(over, 51), fine = largest_turn(over, 101);
  EXPECT_LT(coarse, 0.13);
  EXPECT_NEAR(coarse / fine, 2, 0.1);
  // The quaternions of these keys have opposite signs.
  const std::string roll = "up = [0, 0, 1, 1, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0, 1, 1, 0, 0]\n";
  EXPECT_LT(largest_turn(roll, 101), 0.1);
}

TEST(CameraPath, UpKeysAreMet) {
  const CameraPath path = path_of(
      "[animation]\nframes = 3\nposition = [0, -3, 0.5, 0, 0, 3, 0, 3, 0.5]\n"
      "up = [0, 0, 1, 0, 1, 0, 0, 0, -1]\n");
  const CameraPath::View view = path.at(1);
  EXPECT_LT(distance(view.up, {0, 1, 0}), 1e-14);
}

// The keys may have any length.
TEST(CameraPath, UpKeysAreDirections) {
  const auto ups = [](const char* numbers) {
    return path_of(std::string("[animation]\nframes = 2\nposition = [0, -3, 0, 0, -3, 1]\nup = ") +
                   numbers)
        .at(1)
        .up;
  };
  const glm::dvec3 expected = ups("[0, 0, 1, 1, 0, 1]");
  EXPECT_NEAR(glm::length(expected), 1, 1e-15);
  EXPECT_LT(glm::distance(ups("[0, 0, 1e200, 1e200, 0, 1e200]"), expected), 1e-15);
  EXPECT_LT(glm::distance(ups("[0, 0, 1e-200, 1e-200, 0, 1e-200]"), expected), 1e-15);
}

TEST(FrameParameters, AreThoseOfASingleImage) {
  const RenderParameters film = parameters_of(
      "[image]\noutput = \"a/film.fits.fz\"\n[camera]\nup = [0, 1, 1]\n"
      "[animation]\nframes = 12\nposition = [0, -3, 0, 3, -1, 1]\nfov = [20, 30]\n");
  const CameraPath path(film);
  const RenderParameters frame = frame_parameters(film, path, 6);
  EXPECT_EQ(frame.animation.frames, 0);
  EXPECT_EQ(frame.image.output.path, "a/film_0007.fits.fz");
  EXPECT_EQ(frame.camera.position, path.at(path.time(6)).position);
  EXPECT_EQ(frame.camera.fov, path.at(path.time(6)).fov);
  // Numbers survive as text, too.
  const RenderParameters again = RenderParameters::read(parse_toml(frame.toml(), "again"));
  EXPECT_EQ(again.toml(), frame.toml());
  EXPECT_EQ(again.camera.position, frame.camera.position);
  EXPECT_EQ(again.animation.frames, 0);
}

TEST(FrameParameters, HaveTheirOwnGrain) {
  const std::string text = "grain_seed = 5\n[animation]\nframes = 12\nfov = [20, 30]\n";
  const RenderParameters film = parameters_of("[image]\ngrain = 0.01\n" + text);
  const CameraPath path(film);
  EXPECT_EQ(frame_parameters(film, path, 0).image.output.style.grain_seed, 5U);
  EXPECT_EQ(frame_parameters(film, path, 6).image.output.style.grain_seed, 11U);
  const RenderParameters last = parameters_of(
      "[image]\ngrain = 0.01\ngrain_seed = 1000000000\n[animation]\nframes = 12\nfov = [20, 30]\n");
  EXPECT_EQ(frame_parameters(last, path, 6).image.output.style.grain_seed, 5U);
  const RenderParameters plain = parameters_of("[image]\n" + text);
  EXPECT_EQ(frame_parameters(plain, path, 6).image.output.style.grain_seed, 5U);
}

TEST(FramePath, NumbersFrames) {
  EXPECT_EQ(frame_path("out.png", 0, 10), "out_0001.png");
  EXPECT_EQ(frame_path("x/out.fits", 99999, 123456), "x/out_100000.fits");
}

struct BadAnimation {
  const char *text, *message;
};

class BadAnimations : public testing::TestWithParam<BadAnimation> {};

TEST_P(BadAnimations, SayWhereAndWhat) {
  EXPECT_EQ(message_of(GetParam().text), std::string("render.par:") + GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadAnimations,
    testing::Values(
        BadAnimation{"[animation]\nfov = [10, 20]", "2:7: animation.fov needs animation.frames"},
        BadAnimation{"[animation]\nframes = 3\nposition = [1, 2, 3, 4]",
                     "3:12: position has 4 numbers; each key frame has three"},
        BadAnimation{"[animation]\nframes = 3\nposition = []", "3:12: position is empty"},
        BadAnimation{"[animation]\nframes = 3\nposition = [1, 2, 3, 4, 5, 6]\nfov = [1, 2, 3]",
                     "4:7: fov has 3 key frames, but position has 2"},
        BadAnimation{"[animation]\nframes = 3\ntimes = [0, 2, 2]",
                     "3:9: times[2] = 2 is not after times[1] = 2"},
        BadAnimation{"[animation]\nframes = 3\nwidth = [1, 2]",
                     "3:9: animation.width belongs to an orthographic view"},
        BadAnimation{"[animation]\nframes = 3\nposition = [-1, 0, 0, 1, 0, 0]",
                     "2:10: in frame 2 the camera stands on its target: the view has no direction"},
        BadAnimation{"[animation]\nframes = 3\nposition = [-1, 0, 3, 1, 0, 3]",
                     "2:10: in frame 2 the view is parallel to camera.up, about which the image "
                     "would spin; give animation.up, the direction that is up in each key frame"},
        BadAnimation{"[animation]\nframes = 7\nfov = [100, 178, 178, 100]",
                     "3:7: in frame 4 fov is 191.303, outside ]0, 180[ (deg): the path through the "
                     "key frames swings beyond them; more of them hold it"},
        BadAnimation{"[animation]\nframes = 3\nfov = [10, 20]\ntimes = [-1e308, 1e308]",
                     "4:9: in frame 1 the camera leaves the range of numbers: the key frames lie "
                     "too far apart, or their times too near"},
        BadAnimation{"[animation]\nframes = 3\nposition = [0, 0, 1e308, 0, 0, -1e308]",
                     "2:10: in frame 1 the camera leaves the range of numbers: the key frames lie "
                     "too far apart, or their times too near"},
        BadAnimation{"[animation]\nframes = 3\nup = [0, 0, 1, 0, 0, 0]",
                     "3:6: up of key frame 2 is none or parallel to the view"},
        BadAnimation{"[camera]\nprojection = \"sky\"\n[animation]\nframes = 3",
                     "4:10: frames: an animation moves a camera with a target; a sky view has "
                     "none"},
        BadAnimation{"[animation]\nframes = 3\ntone_frame = 4",
                     "3:14: tone_frame = 4 is beyond the last frame, 3"}));

}  // namespace
}  // namespace gamer::animation_test
