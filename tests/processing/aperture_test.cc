#include "processing/aperture.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "gamer/core/error.h"

namespace gamer::aperture_test {
namespace {

constexpr double pi_value = std::numbers::pi;
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// The overlap as an integral of the ellipse's chords over the pixel, piece by piece between kinks.
double overlap_by_chords(double x, double y, double x0, double y0, double a, double ratio,
                         double angle) {
  // A dx^2 + 2 B dx dy + C dy^2 = a^2
  const double c = std::cos(angle), s = std::sin(angle), q2 = ratio * ratio;
  const double xx = c * c + s * s / q2, xy = c * s * (1 - 1 / q2), yy = s * s + c * c / q2;
  const double reach = a * std::sqrt(yy / (xx * yy - xy * xy));
  const double left = std::max(x - 0.5 - x0, -reach), right = std::min(x + 0.5 - x0, reach);
  if (left >= right) return 0;
  std::vector<double> kinks = {left, right};
  for (const double dy : {y - 0.5 - y0, y + 0.5 - y0}) {
    const double root = xy * xy * dy * dy - xx * (yy * dy * dy - a * a);
    if (root <= 0) continue;
    for (const double sign : {-1, 1}) {
      const double kink = (-xy * dy + sign * std::sqrt(root)) / xx;
      if (kink > left && kink < right) kinks.push_back(kink);
    }
  }
  std::sort(kinks.begin(), kinks.end());
  const auto chord = [&](double dx) {
    const double root = std::sqrt(std::max(0.0, xy * xy * dx * dx - yy * (xx * dx * dx - a * a)));
    const double low = std::max(y - 0.5 - y0, (-xy * dx - root) / yy);
    const double high = std::min(y + 0.5 - y0, (-xy * dx + root) / yy);
    return std::max(0.0, high - low);
  };
  double area = 0;
  for (std::size_t i = 0; i + 1 < kinks.size(); ++i) {
    // The substitution by a sine removes the square roots at the ends.
    const double middle = (kinks[i] + kinks[i + 1]) / 2, half = (kinks[i + 1] - kinks[i]) / 2;
    area += boost::math::quadrature::gauss_kronrod<double, 31>::integrate(
        [&](double t) { return half * std::cos(t) * chord(middle + half * std::sin(t)); },
        -pi_value / 2, pi_value / 2, 10, 1e-13);
  }
  return area;
}

TEST(Ellipses, OverlapIsExact) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const double ratio = i % 3 == 0 ? 1 : 0.1 + 0.9 * unit(random), angle = pi_value * unit(random);
    const double a = std::pow(10, 4 * unit(random) - 1);
    const double x0 = unit(random), y0 = unit(random);
    // The pixel lies near the rim.
    const double t = 2 * pi_value * unit(random), c = std::cos(angle), s = std::sin(angle);
    const double u = a * std::cos(t), v = a * ratio * std::sin(t);
    const int x = static_cast<int>(std::lround(x0 + u * c - v * s + 2 * unit(random) - 1));
    const int y = static_cast<int>(std::lround(y0 + u * s + v * c + 2 * unit(random) - 1));
    EXPECT_NEAR(Ellipses(x0, y0, ratio, angle).overlap(x, y, a),
                overlap_by_chords(x, y, x0, y0, a, ratio, angle), 1e-10)
        << x << ' ' << y << ' ' << x0 << ' ' << y0 << ' ' << a << ' ' << ratio << ' ' << angle;
  }
}

TEST(Ellipses, OverlapOfPlainCases) {
  const Ellipses circles(0, 0);
  EXPECT_NEAR(circles.overlap(0, 0, 0.5), pi_value / 4, 1e-15);
  EXPECT_NEAR(circles.overlap(0, 0, 1e-7), pi_value * 1e-14, 1e-24);
  EXPECT_EQ(circles.overlap(0, 0, 0), 0);
  EXPECT_EQ(circles.overlap(0, 0, std::sqrt(0.5)), 1);
  EXPECT_EQ(circles.overlap(5, 5, 4), 0);
  // The ellipse's centre is on a corner or an edge of the pixel, or its rim passes through corners.
  EXPECT_NEAR(Ellipses(0.5, 0.5).overlap(0, 0, 1), pi_value / 4, 1e-15);
  EXPECT_NEAR(Ellipses(0.5, 0).overlap(0, 0, 0.5), pi_value / 8, 1e-15);
  EXPECT_NEAR(Ellipses(-0.5, -0.5).overlap(0, 0, 1), pi_value / 4, 1e-15);
  // The overlaps with all pixels add up to the ellipse.
  const Ellipses tilted(10.3, 9.8, 0.3, 0.7);
  double area = 0;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) area += tilted.overlap(x, y, 8);
  }
  EXPECT_NEAR(area, pi_value * 8 * 8 * 0.3, 1e-12);
  EXPECT_NEAR(tilted.area(8), pi_value * 8 * 8 * 0.3, 1e-12);
}

/// The image of a profile, integrated over pixels by Gauss's rule, with more nodes near the centre.
MemoryPlane profile_plane(int size, double x0, double y0, const std::function<double(double)>& f,
                          double ratio = 1, double angle = 0) {
  std::vector<double> values;
  const double c = std::cos(angle), s = std::sin(angle);
  using Rule = boost::math::quadrature::gauss<double, 7>;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double r = std::hypot(x - x0, y - y0);
      const int parts = r < 3 ? 64 : r < 30 ? 2 : 1;
      double sum = 0;
      for (int part = 0; part < parts * parts; ++part) {
        const double left = x - x0 - 0.5 + static_cast<double>(part % parts) / parts;
        const double low = y - y0 - 0.5 + static_cast<double>(part / parts) / parts;
        sum += Rule::integrate(
            [&](double dy) {
              return Rule::integrate(
                  [&](double dx) {
                    return f(std::hypot(dx * c + dy * s, (dy * c - dx * s) / ratio));
                  },
                  left, left + 1.0 / parts);
            },
            low, low + 1.0 / parts);
      }
      values.push_back(sum);
    }
  }
  return MemoryPlane(size, size, std::move(values));
}

/// Pixels average light twice, each time with a variance of 1/12 for each axis, which adds to
/// sigma^2.
TEST(Aperture, Gaussian) {
  constexpr double true_sigma = 8, seen = 64 + 1.0 / 6, true_x = 100.3, true_y = 99.6;
  const MemoryPlane plane = profile_plane(201, true_x, true_y, [](double r) {
    return std::exp(-r * r / (2 * true_sigma * true_sigma)) /
           (2 * pi_value * true_sigma * true_sigma);
  });
  const Ellipses circles(true_x, true_y);
  const std::vector<double> radii = {40, 6, 12, 12, 20};
  const std::vector<ApertureSum> sums = aperture_sums(plane, circles, radii, 0, 2);
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const double wanted = 1 - std::exp(-radii[i] * radii[i] / (2 * seen));
    EXPECT_NEAR(sums[i].flux / wanted, 1, 2e-4) << radii[i];
    EXPECT_NEAR(sums[i].area, pi_value * radii[i] * radii[i], 1e-9);
    EXPECT_EQ(sums[i].missing, 0);
  }
  EXPECT_EQ(sums[2].flux, sums[3].flux);
  EXPECT_NEAR(radius_of_flux(plane, circles, 0.5, 90, 0, 2) / (1.1774100226 * std::sqrt(seen)), 1,
              6e-5);
}

// Pixels average the light f twice, which gives f + (d2f/dx2 + d2f/dy2)/12. An ellipse's flux thus
// changes by the flux of grad(f)/12 through its rim. The tests add this term to the flux of the
// sharp profile. It is up to 2e-4 for the exponential and 4.5e-4 for the other profile.

TEST(Aperture, EllipticalExponential) {
  constexpr double scale = 20, true_ratio = 0.5, true_angle = 0.6;
  const double total = 2 * pi_value * scale * scale * true_ratio;
  const MemoryPlane plane = profile_plane(
      401, 200, 200.4, [](double r) { return std::exp(-r / scale); }, true_ratio, true_angle);
  const Ellipses ellipses(200, 200.4, true_ratio, true_angle);
  constexpr double pixel_count = (1 + 1 / (true_ratio * true_ratio)) / (2 * scale * scale) / 12;
  for (const double h : {1, 2, 4, 9}) {
    const double flux = aperture_sums(plane, ellipses, std::array{h * scale}, 0, 2)[0].flux;
    EXPECT_NEAR(flux / total, 1 - (1 + h + pixel_count * h) * std::exp(-h), 1e-5) << h;
  }
  constexpr double one_half = 1.678347;
  EXPECT_NEAR(radius_of_flux(plane, ellipses, total / 2, 190, 0, 2) / (one_half * scale),
              1 + pixel_count / one_half, 1.7e-5);
}

TEST(Aperture, DeVaucouleurs) {
  constexpr double true_radius = 30, sersic_b = 7.669249443;
  const MemoryPlane plane = profile_plane(401, 200, 200, [](double r) {
    return std::exp(-sersic_b * (std::pow(r / true_radius, 0.25) - 1));
  });
  // 8 pi exp(b) b^-8 Gamma(8) = 22.66523 R_e^2.
  const double total = 22.66523 * true_radius * true_radius;
  const Ellipses circles(200, 200);
  for (const double radius : {15, 30, 60, 180}) {
    const double wanted =
        boost::math::gamma_p(8.0, sersic_b * std::pow(radius / true_radius, 0.25));
    const double flux = aperture_sums(plane, circles, std::array{radius}, 0, 2)[0].flux;
    const double root = std::pow(radius / true_radius, 0.25);
    const double pixels =
        2 * pi_value / 12 * sersic_b / 4 * root * std::exp(-sersic_b * (root - 1));
    EXPECT_NEAR((flux + pixels) / total / wanted, 1, 5.2e-5) << radius;
  }
  EXPECT_NEAR(radius_of_flux(plane, circles, total / 2, 200, 0, 2) / true_radius,
              1 + sersic_b / 4 / 12 / (true_radius * true_radius), 1.5e-5);
}

TEST(Aperture, UniformLightFillsTheEllipse) {
  const MemoryPlane plane(64, 48, std::vector<double>(64 * 48, 3.0));
  const Ellipses ellipses(30.25, 20.5, 0.6, 2);
  const ApertureSum sum = aperture_sums(plane, ellipses, std::array{15.0}, 1, 2)[0];
  EXPECT_NEAR(sum.flux, 2 * pi_value * 225 * 0.6, 1e-9);
  EXPECT_NEAR(radius_of_flux(plane, ellipses, pi_value * 100 * 0.6 * 3, 15, 0, 1), 10, 1e-10);
  // There is no light outside the plane.
  const ApertureSum all = aperture_sums(plane, ellipses, std::array{1000.0}, 0, 2)[0];
  EXPECT_NEAR(all.area, 64 * 48, 1e-9);
  EXPECT_EQ(aperture_sums(plane, ellipses.moved_to(-500, 7), std::array{20.0}, 0, 1)[0].area, 0);
  EXPECT_TRUE(std::isnan(radius_of_flux(plane, ellipses, 1e9, 15, 0, 1)));
}

TEST(Aperture, MissingPixelsAddNothing) {
  std::vector<double> values(21 * 21, 1.0);
  values[10 * 21 + 10] = nan_value;
  values[10 * 21 + 15] = std::numeric_limits<double>::infinity();
  values[0] = nan_value;
  const MemoryPlane plane(21, 21, values);
  const std::vector<ApertureSum> sums =
      aperture_sums(plane, Ellipses(10, 10), std::array{3.0, 5.0}, 0, 1);
  EXPECT_EQ(sums[0].missing, 1);
  EXPECT_NEAR(sums[0].flux, pi_value * 9 - 1, 1e-12);
  EXPECT_EQ(sums[1].missing, 2);
  EXPECT_NEAR(sums[1].area, pi_value * 25 - 1 - Ellipses(10, 10).overlap(15, 10, 5), 1e-12);
}

/// Where a growth curve falls again, the smallest radius counts.
TEST(Aperture, GrowthThatFalls) {
  std::vector<double> values(101 * 101);
  for (int y = 0; y < 101; ++y) {
    for (int x = 0; x < 101; ++x) values[y * 101 + x] = std::hypot(x - 50, y - 50) < 20 ? 1 : -0.2;
  }
  const double radius =
      radius_of_flux(MemoryPlane(101, 101, values), Ellipses(50, 50), 600, 50, 0, 1);
  EXPECT_NEAR(radius, std::sqrt(600 / pi_value), 1e-10);
}

/// The radius is equal whether the ring fits into memory at once or needs several passes.
TEST(Aperture, HalfLightOfALargePlane) {
  class Exponential final : public Plane {
   public:
    Exponential() : Plane(4000, 4000) {}
    void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
      for (int y = 0; y < area.height; ++y) {
        for (int x = 0; x < area.width; ++x) {
          const double r = std::hypot(area.x + x - 1999.5, area.y + y - 1999.5);
          out[y * stride + x] = std::exp(-r / 400);
        }
      }
    }
  };
  const double total = 2 * pi_value * 400 * 400;
  EXPECT_NEAR(radius_of_flux(Exponential(), Ellipses(1999.5, 1999.5), total / 2, 1990, 0, 2),
              1.678346990 * 400, 2e-4);
}

TEST(Aperture, BackgroundOfAnAnnulus) {
  std::vector<double> values(101 * 101);
  double count = 0, sum = 0, squares = 0;
  for (int y = 0; y < 101; ++y) {
    for (int x = 0; x < 101; ++x) {
      double& value = values[y * 101 + x];
      const double r = std::hypot(x - 50, y - 50);
      value = r < 20 || r > 40 ? 1000 : 5 + (x + 2 * y) % 3;
      if (y == 50 && x == 80) value = nan_value;
      if (y == 50 && x == 20) value = 1e6;
      if (value < 10) {
        count += 1;
        sum += value;
        squares += value * value;
      }
    }
  }
  const MemoryPlane plane(101, 101, values);
  const Ellipses circles(50, 50);
  const Background clipped =
      annulus_background(plane, circles, 20, 40, BackgroundMethod::clipped, 2);
  EXPECT_EQ(static_cast<double>(clipped.count), count);
  EXPECT_NEAR(clipped.level, sum / count, 1e-12);
  EXPECT_NEAR(clipped.sigma, std::sqrt(squares / count - std::pow(sum / count, 2)), 1e-12);
  const Background mean = annulus_background(plane, circles, 20, 40, BackgroundMethod::mean, 1);
  EXPECT_EQ(static_cast<double>(mean.count), count + 1);
  EXPECT_NEAR(mean.level, (sum + 1e6) / (count + 1), 1e-9);
  const Background middle = annulus_background(plane, circles, 20, 40, BackgroundMethod::median, 1);
  EXPECT_EQ(middle.level, 6);
  EXPECT_NEAR(middle.sigma, 1.4826, 1e-4);
  EXPECT_TRUE(
      std::isnan(annulus_background(plane, circles, 300, 400, BackgroundMethod::mean, 1).level));
}

MemoryPlane elliptical_gaussian(double x0, double y0, double major, double ratio, double angle) {
  return profile_plane(
      161, x0, y0, [&](double r) { return std::exp(-r * r / (2 * major * major)); }, ratio, angle);
}

TEST(Moments, OfAnEllipticalGaussian) {
  const double major = 7, ratio = 0.6, angle = 0.4;
  const MemoryPlane plane = elliptical_gaussian(80.3, 79.1, major, ratio, angle);
  const double a = major * major, b = a * ratio * ratio;
  const double xx = a * std::pow(std::cos(angle), 2) + b * std::pow(std::sin(angle), 2) + 1.0 / 12;
  const double yy = a * std::pow(std::sin(angle), 2) + b * std::pow(std::cos(angle), 2) + 1.0 / 12;
  const double xy = (a - b) * std::sin(2 * angle) / 2;
  const LightMoments plain = moments(plane, Ellipses(78, 81), 70, 0, 2);
  const auto adaptive = adaptive_moments(plane, Ellipses(81, 79), 70, 3, 0, 2);
  ASSERT_TRUE(adaptive.has_value());
  // A Gaussian integrated over pixels is not quite a Gaussian.
  for (const auto& [result, tolerance] : {std::pair(plain, 1e-14), std::pair(*adaptive, 2e-6)}) {
    EXPECT_NEAR(result.x, 80.3, 80 * tolerance);
    EXPECT_NEAR(result.y, 79.1, 80 * tolerance);
    EXPECT_NEAR(result.flux / (2 * pi_value * a * ratio), 1, tolerance);
    EXPECT_NEAR(result.xx, xx, 100 * tolerance);
    EXPECT_NEAR(result.yy, yy, 100 * tolerance);
    EXPECT_NEAR(result.xy, xy, 100 * tolerance);
    EXPECT_NEAR(result.angle(), angle, 5 * tolerance);
    EXPECT_NEAR(result.size(), std::sqrt(xx + yy), 10 * tolerance);
    EXPECT_NEAR(result.e1(), (xx - yy) / (xx + yy), tolerance);
    EXPECT_NEAR(result.e2(), 2 * xy / (xx + yy), tolerance);
    EXPECT_NEAR(result.axis_ratio(), std::sqrt((b + 1.0 / 12) / (a + 1.0 / 12)), tolerance);
  }
}

TEST(Moments, RecenterFindsTheLight) {
  const MemoryPlane plane = elliptical_gaussian(80.3, 79.1, 5, 0.8, 1);
  const Ellipses found = recentered(plane, Ellipses(74, 85), 20, 0, 2);
  EXPECT_NEAR(found.x(), 80.3, 5e-6);
  EXPECT_NEAR(found.y(), 79.1, 5e-6);
  EXPECT_THROW(recentered(MemoryPlane(9, 9, std::vector<double>(81)), Ellipses(4, 4), 3, 0, 1),
               InputError);
  EXPECT_FALSE(
      adaptive_moments(MemoryPlane(9, 9, std::vector<double>(81)), Ellipses(4, 4), 3, 1, 0, 1)
          .has_value());
}

TEST(Ellipses, OnTheSky) {
  SkyView view;
  view.center = {150, 60};
  view.pixel_scale = 0.2;
  view.rotation = 25;
  view.width = view.height = 101;
  const CelestialWcs wcs(view);
  // The major axis has a position angle of 40 deg. This is 15 deg from +y, which itself is 25 deg
  // from North towards East, that is towards -x.
  const double degree = pi_value / 180;
  const Ellipses ellipses(wcs, 50, 50, 0.5, 40 * degree);
  EXPECT_NEAR(ellipses.area(3), pi_value * 9 * 0.5 / 0.04, 2.3e-8);
  const double dx = -std::sin(15 * degree), dy = std::cos(15 * degree);
  EXPECT_NEAR(ellipses.radius(50 + 10 * dx, 50 + 10 * dy), 2, 1.5e-10);
  EXPECT_NEAR(ellipses.radius(50 + 10 * dy, 50 - 10 * dx), 4, 1.5e-10);
  EXPECT_NEAR(position_angle_on_sky(wcs, 50, 50, 105 * degree), 40 * degree, 5e-10);
  EXPECT_NEAR(position_angle_on_sky(wcs, 50, 50, -75 * degree), 40 * degree, 5e-10);
  EXPECT_NEAR(angle_on_pixels(wcs, 50, 50, 40 * degree), 105 * degree, 5e-10);
}

TEST(Moments, OfASinglePixelAreZero) {
  std::vector<double> values(41 * 41);
  values[20 * 41 + 17] = 0.7;
  const LightMoments light = moments(MemoryPlane(41, 41, values), Ellipses(19.3, 20.1), 15, 0, 1);
  EXPECT_NEAR(light.x, 17, 1e-14);
  EXPECT_EQ(light.size(), 0);
  EXPECT_TRUE(std::isnan(light.axis_ratio()));
}

/// The ellipse's moments are on the sky, where the pixels are stretched and sheared.
TEST(Moments, PositionAngleOnSkyOfStretchedPixels) {
  const auto card = [](const char* key, const std::string& value) {
    std::string text = fmt::format("{:<8}= {:>20}", key, value);
    text.resize(80, ' ');
    return text;
  };
  // Degrees east and north per pixel along x and y.
  const double east_x = -3e-5, east_y = 4e-6, north_x = 6e-6, north_y = 1e-4;
  const CelestialWcs wcs = CelestialWcs::from_header(
      card("CTYPE1", "'RA---TAN'") + card("CTYPE2", "'DEC--TAN'") + card("CRPIX1", "51.0") +
          card("CRPIX2", "51.0") + card("CRVAL1", "150.0") + card("CRVAL2", "40.0") +
          card("CD1_1", fmt::format("{}", east_x)) + card("CD1_2", fmt::format("{}", east_y)) +
          card("CD2_1", fmt::format("{}", north_x)) + card("CD2_2", fmt::format("{}", north_y)),
      "test");
  const double determinant = east_x * north_y - east_y * north_x;
  for (const double degrees : {0.0, 30.0, 75.0, 120.0, 179.0}) {
    const double angle = degrees * pi_value / 180, c = std::cos(angle), s = std::sin(angle);
    // Variances on the sky, major axis 3, minor 2, then on the pixels.
    const double ee = 9 * s * s + 4 * c * c, nn = 9 * c * c + 4 * s * s, en = 5 * s * c;
    const double xe = north_y / determinant, xn = -east_y / determinant;
    const double ye = -north_x / determinant, yn = east_x / determinant;
    LightMoments light;
    light.xx = xe * xe * ee + 2 * xe * xn * en + xn * xn * nn;
    light.yy = ye * ye * ee + 2 * ye * yn * en + yn * yn * nn;
    light.xy = xe * ye * ee + (xe * yn + xn * ye) * en + xn * yn * nn;
    const double found = position_angle_on_sky(wcs, 50, 50, light);
    EXPECT_NEAR(std::remainder(found - angle, pi_value), 0, 2e-8) << degrees;
  }
}

}  // namespace
}  // namespace gamer::aperture_test
