#include "gamer/render/galaxy_index.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>

namespace gamer {

namespace {

// Largest number of galaxies in a leaf of the tree.
constexpr int most_in_leaf = 8;

// Distance, in pixels, of the rays that sample a region.
constexpr double grid_spacing = 4.5;

// Largest ratio of successive steps of a projection without a seam.
constexpr double smooth_ratio = 2;

// Number of steps by which the sky may extend beyond the last sample before its edge. Steps grow as
// a root towards the limb of an orthographic projection.
constexpr double beyond_edge = 2.5;

// Half the diagonal of the grid's cells on the sphere, in steps.
constexpr double half_diagonal = 0.75;

// Largest chord of the sphere between neighbouring samples, for which the ball holds the sky
// between them.
constexpr double longest_chord = 0.5;

// Distance that rays keep from the upper edge of a face, since the edge belongs to the next face.
constexpr double face_end = 1e-9;

// Margin of a ball's radius and place, beyond rounding.
constexpr double slack = 1e-12;

/// A ball that holds both balls.
GalaxyIndex::Ball around_both(const GalaxyIndex::Ball& a, const GalaxyIndex::Ball& b) {
  const glm::dvec3 centre = 0.5 * (a.centre + b.centre);
  return {centre, std::max(glm::distance(a.centre, centre) + a.radius,
                           glm::distance(b.centre, centre) + b.radius)};
}

/// The rays of a grid of places in the image.
class Grid {
 public:
  Grid(const Camera& camera, double left, double right, double bottom, double top, double step) {
    const auto count = [&](double length) { return static_cast<int>(std::ceil(length / step)); };
    const int columns = count(right - left), rows = count(top - bottom);
    const auto at = [](double begin, double end, int i, int steps) {
      return begin + (end - begin) * i / steps;
    };
    const bool is_orthographic = camera.projection() == Projection::orthographic;
    is_sphere_ = is_sphere(camera.projection());
    std::vector<Line> upward(static_cast<std::size_t>(columns) + 1);
    for (int j = 0; j <= rows; ++j) {
      Line across;
      for (int i = 0; i <= columns; ++i) {
        const auto ray = camera.ray(at(left, right, i, columns), at(bottom, top, j, rows));
        std::optional<glm::dvec3> here;
        if (ray) here = is_orthographic ? ray->origin : ray->direction;
        if (here) points_.push_back(*here);
        add(here, across);
        add(here, upward[static_cast<std::size_t>(i)]);
      }
    }
  }

  bool empty() const { return points_.empty(); }
  /// Whether the sky is seen everywhere, without seams.
  bool is_smooth() const { return is_smooth_ && (!is_sphere_ || longest_ <= longest_chord); }

  /// A ball that holds the samples and the rays between them.
  GalaxyIndex::Ball ball() const {
    GalaxyIndex::Ball ball;
    for (const glm::dvec3& point : points_) ball.centre += point;
    ball.centre /= static_cast<double>(points_.size());
    for (const glm::dvec3& point : points_) {
      ball.radius = std::max(ball.radius, glm::distance(point, ball.centre));
    }
    ball.radius += (!is_smooth() ? beyond_edge : is_sphere_ ? half_diagonal : 0.5) * longest_;
    return ball;
  }

 private:
  /// The last place along a row or a column, and the step to it.
  struct Line {
    std::optional<glm::dvec3> place;
    std::optional<double> step;
  };

  void add(const std::optional<glm::dvec3>& here, Line& line) {
    std::optional<double> step;
    if (here && line.place) step = glm::distance(*here, *line.place);
    if (!here) is_smooth_ = false;
    if (step) longest_ = std::max(longest_, *step);
    if (step && line.step) {
      const auto [shorter, longer] = std::minmax(*step, *line.step);
      if (longer > smooth_ratio * shorter) is_smooth_ = false;
    }
    line = {here, step};
  }

  std::vector<glm::dvec3> points_;
  bool is_smooth_ = true, is_sphere_ = false;
  double longest_ = 0;
};

}  // namespace

bool overlap(const GalaxyIndex::Ball& a, const GalaxyIndex::Ball& b) {
  const glm::dvec3 way = a.centre - b.centre;
  const double reach = a.radius + b.radius;
  return glm::dot(way, way) <= reach * reach;
}

void GalaxyIndex::Found::clear() {
  galaxies.clear();
  for (auto* values : {&x, &y, &z, &radius}) values->clear();
}

GalaxyIndex::GalaxyIndex(const Scene& scene, const Camera& camera) : camera_(camera) {
  const std::size_t count = scene.galaxies.size();
  balls_.reserve(count);
  for (const PlacedGalaxy& galaxy : scene.galaxies) {
    balls_.push_back(ball_of(galaxy.centre, galaxy.bounding_radius));
  }
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  if (count == 0) return;
  build(0, static_cast<int>(count));
  std::vector<Ball> sorted;
  sorted.reserve(count);
  for (const int galaxy : order_) sorted.push_back(balls_[static_cast<std::size_t>(galaxy)]);
  balls_ = std::move(sorted);
}

GalaxyIndex::Ball GalaxyIndex::ball_of(const glm::dvec3& centre, double radius) const {
  Ball ball;
  double room = 1;
  if (camera_.projection() == Projection::orthographic) {
    room = glm::distance(centre, camera_.origin());
    const glm::dvec3& back = camera_.back();
    ball.centre = centre - glm::dot(centre - camera_.origin(), back) * back;
    ball.radius = radius;
  } else {
    ball.centre = -camera_.towards(centre);
    const double sine = radius / camera_.distance(centre);
    // From inside a galaxy all rays meet it.
    ball.radius = sine < 1 ? sine * std::sqrt(2 / (1 + std::sqrt(1 - sine * sine))) : 2;
  }
  ball.radius = ball.radius * (1 + slack) + slack * room;
  return ball;
}

void GalaxyIndex::build(int first, int count) {
  const auto ball = [&](int i) -> const Ball& {
    return balls_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
  };
  glm::dvec3 low = ball(first).centre, high = low;
  for (int i = first; i < first + count; ++i) {
    low = glm::min(low, ball(i).centre);
    high = glm::max(high, ball(i).centre);
  }
  Node node{{0.5 * (low + high), 0}, first, count, 0};
  for (int i = first; i < first + count; ++i) {
    const double reach = glm::distance(ball(i).centre, node.ball.centre) + ball(i).radius;
    node.ball.radius = std::max(node.ball.radius, reach * (1 + slack));
  }
  const std::size_t place = nodes_.size();
  nodes_.push_back(node);
  if (count > most_in_leaf) {
    const glm::dvec3 sides = high - low;
    int axis = 0;
    for (int k = 1; k < 3; ++k) axis = sides[k] > sides[axis] ? k : axis;
    const int half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](int a, int b) {
      return balls_[static_cast<std::size_t>(a)].centre[axis] <
             balls_[static_cast<std::size_t>(b)].centre[axis];
    });
    nodes_[place].count = 0;
    build(first, half);
    build(first + half, count - half);
  }
  nodes_[place].behind = static_cast<int>(nodes_.size());
}

std::optional<GalaxyIndex::Ball> GalaxyIndex::pixels(int left, int right, int bottom,
                                                     int top) const {
  const int rows = camera_.face_rows();
  if (rows >= camera_.height()) {
    // The area has a margin of a pixel beyond the edges.
    return rays(left - 1.5, right + 0.5, bottom - 1.5, top + 0.5);
  }
  // Faces are separate, because adjoining faces show different parts of the sky.
  std::optional<Ball> all;
  for (int first = bottom - bottom % rows; first < top; first += rows) {
    const std::optional<Ball> part = rays(
        std::max(left - 1.5, -0.5), std::min(right + 0.5, camera_.width() - 0.5),
        std::max(bottom - 1.5, first - 0.5), std::min(top + 0.5, first + rows - 0.5 - face_end));
    if (!part) continue;
    all = all ? around_both(*all, *part) : *part;
  }
  return all;
}

std::optional<GalaxyIndex::Ball> GalaxyIndex::rays(double left, double right, double bottom,
                                                   double top) const {
  const auto grid_of = [&](double step) { return Grid(camera_, left, right, bottom, top, step); };
  if (const Grid grid = grid_of(grid_spacing); grid.is_smooth()) return grid.ball();
  // Centres and corners of the pixels.
  const Grid grid = grid_of(0.5);
  if (grid.empty()) return std::nullopt;
  return grid.ball();
}

template <class Use>
bool GalaxyIndex::any_of(const Ball& rays, const Use& use) const {
  for (std::size_t n = 0; n < nodes_.size();) {
    const Node& node = nodes_[n];
    if (!overlap(node.ball, rays)) {
      n = static_cast<std::size_t>(node.behind);
      continue;
    }
    for (auto i = static_cast<std::size_t>(node.first), end = i + node.count; i < end; ++i) {
      if (overlap(balls_[i], rays) && use(i)) return true;
    }
    ++n;
  }
  return false;
}

bool GalaxyIndex::may_meet(int left, int right, int bottom, int top) const {
  // A coarse grid may miss sky within an edge, and seams of projections of the sky.
  if (camera_.has_edge() || camera_.projection() == Projection::sky) return true;
  constexpr double steps = 8;
  const double step = std::max(grid_spacing, (right - left) / steps);
  const Grid grid(camera_, left - 1.5, right + 0.5, bottom - 1.5, top + 0.5, step);
  return any_of(grid.ball(), [](std::size_t) { return true; });
}

GalaxyIndex::Ball GalaxyIndex::around(const Ray& ray, double pixels) const {
  const bool is_orthographic = camera_.projection() == Projection::orthographic;
  const double pixel = camera_.pixel_size(camera_.origin() + ray.direction);
  return {is_orthographic ? ray.origin : ray.direction, pixels * pixel};
}

void GalaxyIndex::find(const Ball& rays, Found& out) const {
  out.clear();
  any_of(rays, [&](std::size_t i) {
    out.galaxies.push_back(order_[i]);
    out.x.push_back(balls_[i].centre.x);
    out.y.push_back(balls_[i].centre.y);
    out.z.push_back(balls_[i].centre.z);
    out.radius.push_back(balls_[i].radius);
    return false;
  });
}

void GalaxyIndex::find(const Ball& rays, const Found& among, std::vector<int>& out) {
  // The loop has no branches, since most galaxies are not met.
  const std::size_t count = among.galaxies.size();
  out.resize(count);
  std::size_t size = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = among.x[i] - rays.centre.x;
    const double dy = among.y[i] - rays.centre.y;
    const double dz = among.z[i] - rays.centre.z;
    const double reach = among.radius[i] + rays.radius;
    out[size] = among.galaxies[i];
    size += dx * dx + dy * dy + dz * dz <= reach * reach ? 1 : 0;
  }
  out.resize(size);
}

}  // namespace gamer
