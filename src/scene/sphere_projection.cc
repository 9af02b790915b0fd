#include "gamer/scene/sphere_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <stdexcept>

#include "gamer/scene/render_parameters.h"

namespace gamer {
namespace {

using std::numbers::pi;

// Of an angle, beyond rounding.
constexpr double slack = 1e-12;

// Just below the upper edge of a face, which is the lower one of the next.
constexpr double most = 1 - slack;

double middle(int size) { return 0.5 * (size - 1); }

class Fisheye final : public SphereProjection {
 public:
  Fisheye(int width, int height, double fov)
      : SphereProjection(width, height), limit_(fov / 2), step_(fov / width) {}

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const double u = step_ * (x - middle(width())), v = step_ * (y - middle(height()));
    const double angle = std::hypot(u, v);
    if (angle > limit_ * (1 + slack)) return std::nullopt;
    const double across = sine_ratio(angle);
    return glm::dvec3(u * across, v * across, std::cos(angle));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double across = std::hypot(direction.x, direction.y);
    const double angle = std::atan2(across, direction.z);
    if (angle > limit_ * (1 + slack)) return std::nullopt;
    // Straight behind: any place of the circle.
    const glm::dvec2 way = across > 0 ? glm::dvec2(direction.x, direction.y) / across
                                      : glm::dvec2(0, angle > 0 ? -1 : 0);
    return glm::dvec2(middle(width()), middle(height())) + angle / step_ * way;
  }

  double solid_angle(double x, double y) const override {
    if (!direction(x, y)) return 0;
    // Gauss-Legendre: sin(angle)/angle is smooth.
    constexpr double node = 0.3872983346207417;  // sqrt(3/5)/2
    constexpr std::array<double, 3> nodes = {-node, 0, node};
    constexpr std::array<double, 3> weights = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double sum = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (std::size_t j = 0; j < nodes.size(); ++j) {
        const double u = step_ * (x + nodes[i] - middle(width()));
        const double v = step_ * (y + nodes[j] - middle(height()));
        // Beyond the point behind there is nothing.
        sum += weights[i] * weights[j] * std::max(sine_ratio(std::hypot(u, v)), 0.0);
      }
    }
    return step_ * step_ * sum;
  }

  double pixel_angle() const override { return step_; }

 private:
  static double sine_ratio(double angle) { return angle > 0 ? std::sin(angle) / angle : 1; }

  double limit_;  ///< angle from forward
  double step_;   ///< rad per pixel
};

class Equirectangular final : public SphereProjection {
 public:
  Equirectangular(int width, int height)
      : SphereProjection(width, height), across_(2 * pi / width), along_(pi / height) {}

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const double left = across_ * (middle(width()) - x), up = along_ * (y - middle(height()));
    return glm::dvec3(-std::cos(up) * std::sin(left), std::sin(up), std::cos(up) * std::cos(left));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double up = std::atan2(direction.y, std::hypot(direction.x, direction.z));
    return glm::dvec2(middle(width()) + std::atan2(direction.x, direction.z) / across_,
                      middle(height()) + up / along_);
  }

  double solid_angle(double, double y) const override {
    // sin b2 - sin b1.
    return across_ * 2 * std::cos(along_ * (y - middle(height()))) * std::sin(along_ / 2);
  }

  double pixel_angle() const override { return std::max(across_, along_); }

  glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const override {
    const glm::ivec2 inside = SphereProjection::neighbour(at, x, y);
    return {(x % width() + width()) % width(), inside.y};
  }

 private:
  double across_, along_;  ///< sides of a pixel at the equator
};

/// A side of the cube, in the view's axes.
struct Side {
  glm::dvec3 right, up, forward;
  const char* name;
  double longitude, latitude;  ///< of its middle, deg
  int column, row;             ///< in a picture of all, which is a cross
};

constexpr int side_count = 6;

const std::array<Side, side_count>& sides() {
  static const std::array<Side, side_count> all = {{
      {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, "UP", 0, 90, 1, 2},
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, "FRONT", 0, 0, 1, 1},
      {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, "LEFT", 90, 0, 0, 1},
      {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}, "BACK", 180, 0, 3, 1},
      {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}, "RIGHT", 270, 0, 2, 1},
      {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}, "DOWN", 0, -90, 1, 0},
  }};
  return all;
}

/// Number of the face that a row stands in.
int face_of(double y, int face_rows, int faces) {
  return std::clamp(static_cast<int>(std::floor((y + 0.5) / face_rows)), 0, faces - 1);
}

class Cubemap final : public SphereProjection {
 public:
  explicit Cubemap(int size)
      : SphereProjection(size, side_count * size), size_(size), step_(2.0 / size) {}

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const int face = face_of(y, size_, side_count);
    const Side& side = sides()[static_cast<std::size_t>(face)];
    const double u = step_ * (x - middle(size_)), v = step_ * (y - face * size_ - middle(size_));
    return glm::normalize(u * side.right + v * side.up + side.forward);
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < side_count; ++k) {
      const double along = glm::dot(direction, sides()[k].forward);
      if (along > glm::dot(direction, sides()[nearest].forward)) nearest = k;
    }
    const Side& side = sides()[nearest];
    const glm::dvec3 onto = direction / glm::dot(direction, side.forward);
    return glm::dvec2(middle(size_) + glm::dot(onto, side.right) / step_,
                      static_cast<int>(nearest) * size_ + middle(size_) +
                          std::min(glm::dot(onto, side.up), most) / step_);
  }

  double solid_angle(double x, double y) const override {
    const int face = face_of(y, size_, side_count);
    const double u = step_ * (x - middle(size_)), v = step_ * (y - face * size_ - middle(size_));
    // Of the rectangle from the middle to (u, v).
    const auto corner = [](double a, double b) {
      return std::atan2(a * b, std::sqrt(1 + a * a + b * b));
    };
    const double left = u - step_ / 2, right = u + step_ / 2;
    const double below = v - step_ / 2, above = v + step_ / 2;
    return corner(right, above) - corner(left, above) - corner(right, below) + corner(left, below);
  }

  double pixel_angle() const override { return step_; }
  int face_rows() const override { return size_; }

 private:
  int size_;
  double step_;  ///< at unit distance
};

constexpr int base_pixels = 12;

class Healpix final : public SphereProjection {
 public:
  explicit Healpix(int nside) : SphereProjection(nside, base_pixels * nside), nside_(nside) {
    if (nside < 1 || !std::has_single_bit(static_cast<unsigned>(nside))) {
      throw std::invalid_argument(fmt::format("HEALPix: nside = {} is not a power of 2", nside));
    }
  }

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const int face = face_of(y, nside_, base_pixels);
    const double east = (x + 0.5) / nside_, west = (y + 0.5) / nside_ - face;
    // Rows of base pixels: their southern corners stand 2, 3, 4 half diagonals below the North
    // pole; their middles at so many eighths of a turn.
    const double down = 2 + face / 4 - east - west;
    const int middle_eighth = 2 * (face % 4) + (face / 4 == 1 ? 0 : 1);
    // Towards a pole: sigma = sqrt(3 (1 - |sin b|)).
    const double sigma = std::min({down, 4 - down, 1.0});
    double sine = 2.0 / 3 * (2 - down);
    double cosine = 0;
    if (sigma < 1) {
      const double cap = sigma * sigma / 3;
      sine = std::copysign(1 - cap, 2 - down);
      cosine = std::sqrt(cap * (2 - cap));
    } else {
      cosine = std::sqrt((1 - sine) * (1 + sine));
    }
    // Eighths from the middle of the face, in units of sigma.
    const double away = sigma > 0 ? (east - west) / sigma : 0;
    const double longitude = pi / 4 * (middle_eighth + away);
    return glm::dvec3(-cosine * std::sin(longitude), sine, cosine * std::cos(longitude));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double longitude = std::atan2(-direction.x, direction.z);
    const double sine = std::clamp(direction.y, -1.0, 1.0);
    // Quarter turns, [0, 4).
    double turns = longitude / (pi / 2);
    if (turns < 0) turns += 4;
    if (turns >= 4) turns = 0;
    int face = 0;
    double east = 0, west = 0;
    if (std::abs(sine) <= 2.0 / 3) {
      // Lines of constant y rise, of constant x fall with the longitude.
      const double falling = 0.5 + turns + 0.75 * sine, rising = 0.5 + turns - 0.75 * sine;
      const int f = static_cast<int>(std::floor(falling)), r = static_cast<int>(std::floor(rising));
      face = f == r ? f % 4 + 4 : f > r ? r % 4 : f % 4 + 8;
      east = falling - f;
      west = 1 - (rising - r);
    } else {
      const int quarter = std::min(static_cast<int>(turns), 3);
      const double within = turns - quarter;
      const double across = std::hypot(direction.x, direction.z);
      // 1 - |sin b|, also near the pole.
      const double sigma = std::sqrt(3 * across * across / (1 + std::abs(sine)));
      const double first = std::min(within * sigma, 1.0);
      const double second = std::min((1 - within) * sigma, 1.0);
      face = sine > 0 ? quarter : quarter + 8;
      east = sine > 0 ? 1 - second : first;
      west = sine > 0 ? 1 - first : second;
    }
    return glm::dvec2(nside_ * east - 0.5, nside_ * (face + std::min(west, most)) - 0.5);
  }

  double solid_angle(double, double) const override {
    return 4 * pi / (static_cast<double>(base_pixels) * nside_ * nside_);
  }

  /// Of the rhombus at the equator, of half diagonals pi/4 and 2/3, it is 1.03/nside; the longest
  /// sides, of the pixels at the poles, are 1.2/nside.
  double pixel_angle() const override { return 1.2 / nside_; }

  int face_rows() const override { return nside_; }

 private:
  int nside_;
};

struct FrameName {
  SphereFrame frame;
  const char *longitude, *latitude;  ///< as CTYPE has them, four letters
  char letter;                       ///< of COORDSYS
};

constexpr FrameName frames[] = {
    {SphereFrame::galactic, "GLON", "GLAT", 'G'},
    {SphereFrame::equatorial, "RA--", "DEC-", 'C'},
    {SphereFrame::ecliptic, "ELON", "ELAT", 'E'},
};

const FrameName& name_of(SphereFrame frame) {
  return *std::find_if(std::begin(frames), std::end(frames),
                       [&](const FrameName& name) { return name.frame == frame; });
}

}  // namespace

glm::ivec2 SphereProjection::neighbour(const glm::dvec2& at, int x, int y) const {
  const int rows = face_rows();
  const int first = face_of(at.y, rows, height_ / rows) * rows;
  return {std::clamp(x, 0, width_ - 1), std::clamp(y, first, first + rows - 1)};
}

std::unique_ptr<SphereProjection> make_fisheye(int width, int height, double fov) {
  return std::make_unique<Fisheye>(width, height, fov);
}

std::unique_ptr<SphereProjection> make_equirectangular(int width, int height) {
  return std::make_unique<Equirectangular>(width, height);
}

std::unique_ptr<SphereProjection> make_cubemap(int size) { return std::make_unique<Cubemap>(size); }

std::unique_ptr<SphereProjection> make_healpix(int nside) {
  return std::make_unique<Healpix>(nside);
}

std::unique_ptr<SphereProjection> make_sphere_projection(const RenderParameters& parameters) {
  switch (parameters.projection) {
    case Projection::fisheye:
      return make_fisheye(parameters.width, parameters.height, glm::radians(parameters.fov));
    case Projection::equirectangular:
      return make_equirectangular(parameters.width, parameters.height);
    case Projection::cubemap:
      return make_cubemap(parameters.width);
    case Projection::healpix:
      return make_healpix(parameters.width);
    default:
      return nullptr;
  }
}

void set_sphere_axes(const RenderParameters& parameters, ImageHeader& header) {
  const FrameName& name = name_of(parameters.frame);
  const auto axes = [&](const std::string& projection, int width, int height, double step_x,
                        double step_y) {
    return std::pair(LinearAxis{fmt::format("{}-{}", name.longitude, projection), "deg",
                                middle(width) + 1, 0, -glm::degrees(step_x)},
                     LinearAxis{fmt::format("{}-{}", name.latitude, projection), "deg",
                                middle(height) + 1, 0, glm::degrees(step_y)});
  };
  const int width = parameters.width, height = parameters.height;
  switch (parameters.projection) {
    case Projection::fisheye: {
      const double step = glm::radians(parameters.fov) / width;
      std::tie(header.x, header.y) = axes("ARC", width, height, step, step);
      return;
    }
    case Projection::equirectangular:
      std::tie(header.x, header.y) = axes("CAR", width, height, 2 * pi / width, pi / height);
      return;
    case Projection::cubemap:
      for (const Side& side : sides()) {
        auto [x, y] = axes("TAN", width, width, 2.0 / width, 2.0 / width);
        x.reference_value = side.longitude;
        y.reference_value = side.latitude;
        // Needed where the middle is a pole.
        header.faces.push_back({side.name,
                                x,
                                y,
                                {{"LONPOLE", 180.0, "[deg] of the native pole"}},
                                side.column,
                                side.row});
      }
      return;
    case Projection::healpix:
      header.healpix = HealpixHeader{width, parameters.is_nested, name.letter};
      return;
    default:
      return;
  }
}

}  // namespace gamer
