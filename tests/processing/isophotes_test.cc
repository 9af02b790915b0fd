#include "processing/isophotes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "galaxy_images.h"
#include "processing/disk_breaks.h"

namespace gamer::isophotes_test {
namespace {

constexpr int side = 401;
constexpr double centre_x = 200.3, centre_y = 199.6;

Image elliptical(const std::function<double(double)>& profile, double ratio, double angle) {
  return drawn_image(
      side, side,
      [&](double x, double y) {
        const double u = std::cos(angle) * (x - centre_x) + std::sin(angle) * (y - centre_y);
        const double v = std::cos(angle) * (y - centre_y) - std::sin(angle) * (x - centre_x);
        return profile(std::hypot(u, v / ratio));
      },
      centre_x, centre_y);
}

IsophoteOptions options_about_the_centre() {
  IsophoteOptions options;
  options.x = centre_x;
  options.y = centre_y;
  options.inner = 4;
  options.outer = 190;
  options.start_axis_ratio = 0.9;
  options.start_angle = 0.1;
  return options;
}

/// Isophotes of Sersic profiles on similar ellipses have their shape, brightness and growth.
TEST(Isophotes, OfSersicProfiles) {
  for (const double n : {0.7, 1.0, 2.5}) {
    SCOPED_TRACE(n);
    const double ratio = 0.6, angle = 2.2;
    const SersicProfile sersic{1000, n, 40};
    const auto profile = sersic.profile();
    const Image image = elliptical(profile, ratio, angle);
    const auto list = isophotes(image, options_about_the_centre());
    ASSERT_GT(list.size(), 35u);
    double worst_ratio = 0, worst_angle = 0, worst_brightness = 0, worst_flux = 0;
    for (const Isophote& one : list) {
      EXPECT_TRUE(one.is_fitted) << one.radius;
      if (one.radius < 15 || one.radius > 120) continue;
      worst_ratio = std::max(worst_ratio, std::fabs(one.axis_ratio - ratio));
      worst_angle = std::max(worst_angle, std::fabs(one.angle - angle));
      worst_brightness =
          std::max(worst_brightness, std::fabs(one.brightness / profile(one.radius) - 1));
      // `within` counts circles, so that the ellipse's flux is smaller by the axis ratio.
      worst_flux =
          std::max(worst_flux, std::fabs(one.flux / (ratio * sersic.within(one.radius)) - 1));
    }
    EXPECT_LT(worst_ratio, 0.0033);
    EXPECT_LT(worst_angle, 8e-5);
    EXPECT_LT(worst_brightness, 0.009);
    EXPECT_LT(worst_flux, 0.0011);
  }
}

/// A round bulge in a flat disk: the ellipticity grows outwards. If one of ellipticity and position
/// angle is given, the other one is fitted.
TEST(Isophotes, ShapesThatChange) {
  const auto bulge = SersicProfile{200, 1, 6}.profile();
  const auto disk = SersicProfile{1000, 1, 50}.profile();
  const Image image = drawn_image(
      side, side,
      [&](double x, double y) {
        const double dx = x - centre_x, dy = y - centre_y;
        return bulge(std::hypot(dx, dy)) + disk(std::hypot(dx / 0.4, dy));
      },
      centre_x, centre_y);
  IsophoteOptions options = options_about_the_centre();
  const auto list = isophotes(image, options);
  EXPECT_GT(list.front().axis_ratio, 0.95);
  EXPECT_NEAR(list.back().axis_ratio, 0.4, 1.2e-4);
  EXPECT_NEAR(list.back().angle, std::numbers::pi / 2, 1e-5);
  options.angle = std::numbers::pi / 2;
  const auto turned = isophotes(image, options);
  EXPECT_NEAR(turned.back().axis_ratio, 0.4, 1.2e-4);
  EXPECT_DOUBLE_EQ(turned.front().angle, std::numbers::pi / 2);
  options.axis_ratio = 0.4;
  const auto given = isophotes(image, options);
  EXPECT_FALSE(given.back().is_fitted);
  EXPECT_NEAR(given.front().axis_ratio, 0.4, 1e-12);
  const auto doubled = on_isophotes(image, options, given);
  EXPECT_EQ(doubled[3].brightness, given[3].brightness);
}

/// With white noise the errors are those of the brightness, and the list ends where noise hides the
/// light.
TEST(Isophotes, OfANoisyDisk) {
  const auto profile = [](double r) { return 50 * std::exp(-r / 22); };
  Image image = elliptical(profile, 0.7, 1.2);
  std::mt19937 generator(7);
  std::normal_distribution<double> noise(0, 1);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) image.at(x, y) += noise(generator);
  }
  IsophoteOptions options = options_about_the_centre();
  const auto free = isophotes(image, options);
  ASSERT_GT(free.size(), 20u);
  for (const Isophote& one : free) {
    if (one.radius < 15 || one.radius > 60) continue;
    EXPECT_TRUE(one.is_fitted);
    EXPECT_NEAR(one.axis_ratio, 0.7, 0.02);
    EXPECT_NEAR(one.angle, 1.2, 0.04);
  }
  options.axis_ratio = 0.7;
  options.angle = 1.2;
  options.inner = 20;
  options.step = 0.02;
  double squares = 0;
  const auto list = isophotes(image, options);
  for (const Isophote& one : list) {
    const double deviation = (one.brightness - profile(one.radius)) / one.error;
    squares += deviation * deviation;
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(list.size())), 1, 0.12);
  EXPECT_GT(list.back().radius, 120);
  EXPECT_LT(list.back().radius, 175);
}

/// The profile of two exponentials joined at a break.
std::vector<ProfilePoint> broken_profile(double inner, double outer, double radius) {
  std::vector<ProfilePoint> points;
  for (double r = 5; r < 200; r *= 1.05) {
    const double depth = r < radius ? r / inner : radius / inner + (r - radius) / outer;
    points.push_back({r, 7 * std::exp(-depth)});
  }
  return points;
}

TEST(DiskBreaks, FindsWhatWasMade) {
  const auto two = fit_disk(broken_profile(40, 18, 90));
  ASSERT_TRUE(two);
  EXPECT_EQ(two->type, DiskFit::Type::two);
  EXPECT_NEAR(two->inner_scale, 40, 0.037);
  EXPECT_NEAR(two->outer_scale, 18, 0.0055);
  EXPECT_NEAR(two->break_radius, 90, 0.08);
  EXPECT_NEAR(two->central, 7, 0.0054);
  const auto three = fit_disk(broken_profile(25, 45, 100));
  ASSERT_TRUE(three);
  EXPECT_EQ(three->type, DiskFit::Type::three);
  EXPECT_NEAR(three->inner_scale, 25, 0.0042);
  EXPECT_NEAR(three->outer_scale, 45, 0.0144);
  EXPECT_NEAR(three->break_radius, 100, 0.049);
  const auto one = fit_disk(broken_profile(30, 30, 100));
  ASSERT_TRUE(one);
  EXPECT_EQ(one->type, DiskFit::Type::one);
  EXPECT_NEAR(one->inner_scale, 30, 1e-9);
  EXPECT_TRUE(std::isnan(one->break_radius));
  EXPECT_TRUE(std::isnan(one->outer_scale));
  const auto few = broken_profile(30, 30, 100);
  EXPECT_FALSE(fit_disk(std::span(few).first(7)));
}

/// A break is found in the isophotes of a drawn image.
TEST(DiskBreaks, OfAnImage) {
  const double inner = 30, outer = 14, radius = 80;
  const Image image = elliptical(
      [&](double r) {
        return 100 * std::exp(r < radius ? -r / inner : -radius / inner - (r - radius) / outer);
      },
      0.8, 1.0);
  const auto list = isophotes(image, options_about_the_centre());
  std::vector<ProfilePoint> points;
  for (const Isophote& one : list) points.push_back({one.radius, one.brightness});
  const auto fit = fit_disk(points);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->type, DiskFit::Type::two);
  EXPECT_NEAR(fit->inner_scale, inner, 0.087);
  EXPECT_NEAR(fit->outer_scale, outer, 0.062);
  EXPECT_NEAR(fit->break_radius, radius, 0.041);
}

}  // namespace
}  // namespace gamer::isophotes_test
