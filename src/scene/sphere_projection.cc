#include "gamer/scene/sphere_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <stdexcept>

#include "gamer/scene/render_parameters.h"

namespace gamer {
namespace {

using std::numbers::pi;

// Margin for angles, larger than rounding errors.
constexpr double slack = 1e-12;

// The largest coordinate within a face; its upper edge is the next face's lower edge.
constexpr double most_coordinate = 1 - slack;

class Fisheye final : public SphereProjection {
 public:
  Fisheye(int width, int height, double fov)
      : SphereProjection(width, height), limit_(fov / 2), step_(fov / width) {}

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const double u = step_ * (x - middle_pixel(width())), v = step_ * (y - middle_pixel(height()));
    const double angle = std::hypot(u, v);
    if (angle > limit_ * (1 + slack)) return std::nullopt;
    const double across = sine_ratio(angle);
    return glm::dvec3(u * across, v * across, std::cos(angle));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double across = std::hypot(direction.x, direction.y);
    const double angle = std::atan2(across, direction.z);
    if (angle > limit_ * (1 + slack)) return std::nullopt;
    // The point straight behind the camera is the whole circle; any place on it serves.
    const glm::dvec2 way = across > 0 ? glm::dvec2(direction.x, direction.y) / across
                                      : glm::dvec2(0, angle > 0 ? -1 : 0);
    return glm::dvec2(middle_pixel(width()), middle_pixel(height())) + angle / step_ * way;
  }

  double solid_angle(double x, double y) const override {
    if (!direction(x, y)) return 0;
    // Gauss-Legendre quadrature; sin(angle)/angle is smooth.
    constexpr double node = 0.3872983346207417;  // sqrt(3/5)/2
    constexpr std::array<double, 3> nodes = {-node, 0, node};
    constexpr std::array<double, 3> weights = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double sum = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (std::size_t j = 0; j < nodes.size(); ++j) {
        const double u = step_ * (x + nodes[i] - middle_pixel(width()));
        const double v = step_ * (y + nodes[j] - middle_pixel(height()));
        // Angles above pi do not exist and add nothing.
        sum += weights[i] * weights[j] * std::max(sine_ratio(std::hypot(u, v)), 0.0);
      }
    }
    return step_ * step_ * sum;
  }

  double density(double x, double y) const override {
    const double u = step_ * (x - middle_pixel(width())), v = step_ * (y - middle_pixel(height()));
    const double angle = std::hypot(u, v);
    return angle > limit_ * (1 + slack) ? 0 : step_ * step_ * std::max(sine_ratio(angle), 0.0);
  }

  double pixel_angle() const override { return step_; }

  glm::ivec2 neighbour(const glm::dvec2&, int x, int y) const override {
    const glm::dvec2 centre(middle_pixel(width()), middle_pixel(height()));
    const glm::dvec2 way = glm::dvec2(x, y) - centre;
    const double length = glm::length(way), rim = limit_ / step_;
    glm::dvec2 place(x, y);
    if (is_whole() && length > rim) {
      // The way continues through the point behind the camera, to the nearest pixel whose middle is
      // in the circle.
      double left = 2 * rim - length;
      do {
        place = glm::round(centre - std::max(left, 0.0) / length * way);
        left -= 0.5;
      } while (left > 0 && glm::distance(place, centre) > rim);
    }
    return {static_cast<int>(place.x), static_cast<int>(place.y)};
  }

  bool is_near_seam(const glm::dvec2& at, double reach) const override {
    const double length =
        glm::distance(at, glm::dvec2(middle_pixel(width()), middle_pixel(height())));
    return is_whole() && length + std::numbers::sqrt2 * reach > limit_ / step_;
  }

 private:
  /// Whether the circle is the whole sphere; its rim is then the point behind the camera.
  bool is_whole() const { return limit_ > pi * (1 - slack); }
  static double sine_ratio(double angle) { return angle > 0 ? std::sin(angle) / angle : 1; }

  double limit_;  ///< largest angle from forward, rad
  double step_;   ///< rad per pixel
};

class Equirectangular final : public SphereProjection {
 public:
  Equirectangular(int width, int height)
      : SphereProjection(width, height), across_(2 * pi / width), along_(pi / height) {}

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const double left = across_ * (middle_pixel(width()) - x),
                 up = along_ * (y - middle_pixel(height()));
    return glm::dvec3(-std::cos(up) * std::sin(left), std::sin(up), std::cos(up) * std::cos(left));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double up = std::atan2(direction.y, std::hypot(direction.x, direction.z));
    return glm::dvec2(middle_pixel(width()) + std::atan2(direction.x, direction.z) / across_,
                      middle_pixel(height()) + up / along_);
  }

  double solid_angle(double, double y) const override {
    // The difference sin b2 - sin b1.
    return across_ * 2 * std::cos(along_ * (y - middle_pixel(height()))) * std::sin(along_ / 2);
  }

  double density(double, double y) const override {
    return across_ * along_ * std::cos(along_ * (y - middle_pixel(height())));
  }

  double pixel_angle() const override { return std::max(across_, along_); }

  glm::ivec2 neighbour(const glm::dvec2&, int x, int y) const override {
    // Beyond a pole, the longitude changes by half a turn.
    if (y < 0 || y >= height()) {
      x += width() / 2;
      y = y < 0 ? -1 - y : 2 * height() - 1 - y;
    }
    return {(x % width() + width()) % width(), std::clamp(y, 0, height() - 1)};
  }

 private:
  double across_, along_;  ///< sides of a pixel at the equator
};

/// A side of the cube, in the view's axes.
struct Side {
  glm::dvec3 right, up, forward;
  const char* name;
  double longitude, latitude;  ///< of the side's middle, deg
  int column, row;             ///< in a picture of all sides, which is a cross
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

/// Number of the face that contains a row.
int face_of(double y, int face_rows, int faces) {
  return std::clamp(static_cast<int>(std::floor((y + 0.5) / face_rows)), 0, faces - 1);
}

/// Square faces that join along their edges, pixel by pixel.
class Faces : public SphereProjection {
 public:
  int face_rows() const final { return width(); }

  glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const final {
    const int size = width();
    int face = face_of(at.y, size, height() / size);
    y -= face * size;
    // A way around a corner crosses two edges.
    constexpr int most_edges = 3;
    for (int i = 0; i < most_edges; ++i) {
      const int edge = x < 0       ? left_edge
                       : x >= size ? right_edge
                       : y < 0     ? lower_edge
                       : y >= size ? upper_edge
                                   : no_edge;
      if (edge == no_edge) break;
      const Seam& seam = seams_[static_cast<std::size_t>(face * edge_count + edge)];
      const int beyond = edge == left_edge    ? -1 - x
                         : edge == right_edge ? x - size
                         : edge == lower_edge ? -1 - y
                                              : y - size;
      const int along = edge == left_edge || edge == right_edge ? y : x;
      const int depth = std::min(beyond, size - 1);
      const int place = seam.is_reversed ? size - 1 - along : along;
      const int from_edge =
          seam.edge == left_edge || seam.edge == lower_edge ? depth : size - 1 - depth;
      const bool is_side = seam.edge == left_edge || seam.edge == right_edge;
      x = is_side ? from_edge : place;
      y = is_side ? place : from_edge;
      face = seam.face;
    }
    return {std::clamp(x, 0, size - 1), face * size + std::clamp(y, 0, size - 1)};
  }

 protected:
  Faces(int size, int faces) : SphereProjection(size, faces * size) {}

  /// Finds which edges join, from their directions.
  void join() {
    // A place on each edge, away from its middle, and a step across it; in units of the side.
    constexpr double place = 0.3, step = 1e-3, end = 1e-9;
    const int size = width();
    const auto direction_at = [&](int face, const glm::dvec2& local) {
      return *direction(size * local.x - 0.5, size * (face + local.y) - 0.5);
    };
    for (int face = 0; face < height() / size; ++face) {
      for (int edge = 0; edge < edge_count; ++edge) {
        const bool is_side = edge == left_edge || edge == right_edge;
        const double across = edge == left_edge || edge == lower_edge ? end : 1 - end;
        const double inside = edge == left_edge || edge == lower_edge ? step : 1 - step;
        const glm::dvec3 at =
            direction_at(face, is_side ? glm::dvec2(across, place) : glm::dvec2(place, across));
        const glm::dvec3 before =
            direction_at(face, is_side ? glm::dvec2(inside, place) : glm::dvec2(place, inside));
        const glm::dvec2 beyond =
            (*pixel(glm::normalize(2 * glm::dot(at, before) * at - before)) + 0.5) /
            static_cast<double>(size);
        const int other = face_of(size * beyond.y - 0.5, size, height() / size);
        const glm::dvec2 local(beyond.x, beyond.y - other);
        const double distances[edge_count] = {local.x, 1 - local.x, local.y, 1 - local.y};
        const auto nearest = static_cast<int>(
            std::min_element(std::begin(distances), std::end(distances)) - std::begin(distances));
        const double along = nearest == left_edge || nearest == right_edge ? local.y : local.x;
        seams_.push_back({other, nearest, along > 0.5});
      }
    }
  }

 private:
  enum Edge : int { left_edge, right_edge, lower_edge, upper_edge, no_edge };
  static constexpr int edge_count = 4;
  struct Seam {
    int face, edge;
    bool is_reversed;
  };
  std::vector<Seam> seams_;  ///< [face * edge_count + edge]
};

class Cubemap final : public Faces {
 public:
  explicit Cubemap(int size) : Faces(size, side_count), size_(size), step_(2.0 / size) { join(); }

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const int face = face_of(y, size_, side_count);
    const Side& side = sides()[static_cast<std::size_t>(face)];
    const double u = step_ * (x - middle_pixel(size_)),
                 v = step_ * (y - face * size_ - middle_pixel(size_));
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
    return glm::dvec2(middle_pixel(size_) + glm::dot(onto, side.right) / step_,
                      static_cast<int>(nearest) * size_ + middle_pixel(size_) +
                          std::min(glm::dot(onto, side.up), most_coordinate) / step_);
  }

  double solid_angle(double x, double y) const override {
    const int face = face_of(y, size_, side_count);
    const double u = step_ * (x - middle_pixel(size_)),
                 v = step_ * (y - face * size_ - middle_pixel(size_));
    // Solid angle of the rectangle from the middle to (u, v).
    const auto corner = [](double a, double b) {
      return std::atan2(a * b, std::sqrt(1 + a * a + b * b));
    };
    const double left = u - step_ / 2, right = u + step_ / 2;
    const double below = v - step_ / 2, above = v + step_ / 2;
    return corner(right, above) - corner(left, above) - corner(right, below) + corner(left, below);
  }

  double density(double x, double y) const override {
    const int face = face_of(y, size_, side_count);
    const double u = step_ * (x - middle_pixel(size_)),
                 v = step_ * (y - face * size_ - middle_pixel(size_));
    return step_ * step_ / std::pow(1 + u * u + v * v, 1.5);
  }

  double pixel_angle() const override { return step_; }

 private:
  int size_;
  double step_;  ///< pixel size at unit distance
};

constexpr int base_pixels = 12;

class Healpix final : public Faces {
 public:
  explicit Healpix(int nside) : Faces(nside, base_pixels), nside_(nside) {
    if (nside < 1 || !std::has_single_bit(static_cast<unsigned>(nside))) {
      throw std::invalid_argument(fmt::format("HEALPix: nside = {} is not a power of 2", nside));
    }
    join();
  }

  std::optional<glm::dvec3> direction(double x, double y) const override {
    const int face = face_of(y, nside_, base_pixels);
    const double east = (x + 0.5) / nside_, west = (y + 0.5) / nside_ - face;
    // Distance below the North pole in half diagonals; base pixels have their southern corners at
    // 2, 3, 4. The longitude of a base pixel's middle is in eighths of a turn.
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
    // Distance from the middle of the face, in eighths of a turn and units of sigma.
    const double away = sigma > 0 ? (east - west) / sigma : 0;
    const double longitude = pi / 4 * (middle_eighth + away);
    return glm::dvec3(-cosine * std::sin(longitude), sine, cosine * std::cos(longitude));
  }

  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const override {
    const double longitude = std::atan2(-direction.x, direction.z);
    const double sine = std::clamp(direction.y, -1.0, 1.0);
    // Longitude in quarter turns, [0, 4).
    double turns = longitude / (pi / 2);
    if (turns < 0) turns += 4;
    if (turns >= 4) turns = 0;
    int face = 0;
    double east = 0, west = 0;
    if (std::abs(sine) <= 2.0 / 3) {
      // Towards larger longitudes, lines of constant y rise and lines of constant x fall.
      const double falling = 0.5 + turns + 0.75 * sine, rising = 0.5 + turns - 0.75 * sine;
      const int f = static_cast<int>(std::floor(falling)), r = static_cast<int>(std::floor(rising));
      face = f == r ? f % 4 + 4 : f > r ? r % 4 : f % 4 + 8;
      east = falling - f;
      west = 1 - (rising - r);
    } else {
      const int quarter = std::min(static_cast<int>(turns), 3);
      const double within = turns - quarter;
      const double across = std::hypot(direction.x, direction.z);
      // Here 1 - |sin b| keeps its digits near the pole.
      const double sigma = std::sqrt(3 * across * across / (1 + std::abs(sine)));
      const double first = std::min(within * sigma, 1.0);
      const double second = std::min((1 - within) * sigma, 1.0);
      face = sine > 0 ? quarter : quarter + 8;
      east = sine > 0 ? 1 - second : first;
      west = sine > 0 ? 1 - first : second;
    }
    return glm::dvec2(nside_ * east - 0.5, nside_ * (face + std::min(west, most_coordinate)) - 0.5);
  }

  double solid_angle(double, double) const override {
    return 4 * pi / (static_cast<double>(base_pixels) * nside_ * nside_);
  }
  double density(double x, double y) const override { return solid_angle(x, y); }
  bool is_equal_area() const override { return true; }

  /// The longest sides are those of the pixels at the poles, 1.2/nside. For comparison, the rhombus
  /// at the equator, with half diagonals pi/4 and 2/3, has sides of 1.03/nside.
  double pixel_angle() const override { return 1.2 / nside_; }

 private:
  int nside_;
};

struct FrameName {
  SphereFrame frame;
  const char *longitude, *latitude;  ///< four letters of CTYPE
  char letter;                       ///< COORDSYS
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

bool SphereProjection::is_near_seam(const glm::dvec2& at, double reach) const {
  const int rows = face_rows();
  const double y = at.y - face_of(at.y, rows, height_ / rows) * rows;
  return std::min(at.x, y) < reach || at.x > width_ - 1 - reach || y > rows - 1 - reach;
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
  switch (parameters.camera.projection) {
    case Projection::fisheye:
      return make_fisheye(parameters.width, parameters.height, glm::radians(parameters.camera.fov));
    case Projection::equirectangular:
      return make_equirectangular(parameters.width, parameters.height);
    case Projection::cubemap: return make_cubemap(parameters.width);
    case Projection::healpix: return make_healpix(parameters.width);
    default: return nullptr;
  }
}

void set_sphere_axes(const RenderParameters& parameters, ImageHeader& header) {
  const FrameName& name = name_of(parameters.camera.frame);
  const auto axes = [&](const std::string& projection, int width, int height, double step_x,
                        double step_y) {
    return std::pair(LinearAxis{fmt::format("{}-{}", name.longitude, projection), "deg",
                                middle_pixel(width) + 1, 0, -glm::degrees(step_x)},
                     LinearAxis{fmt::format("{}-{}", name.latitude, projection), "deg",
                                middle_pixel(height) + 1, 0, glm::degrees(step_y)});
  };
  const int width = parameters.width, height = parameters.height;
  switch (parameters.camera.projection) {
    case Projection::fisheye: {
      const double step = glm::radians(parameters.camera.fov) / width;
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
        // Sides whose middle is a pole need these cards.
        header.faces.push_back({side.name,
                                x,
                                y,
                                {{"LONPOLE", 180.0, "[deg] of the native pole"}},
                                side.column,
                                side.row});
      }
      return;
    case Projection::healpix:
      header.healpix = HealpixHeader{width, parameters.camera.is_nested, name.letter};
      return;
    default: return;
  }
}

}  // namespace gamer
