#pragma once

#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// Finds the galaxies that rays of a camera may meet, without looking at the others.
///
/// A camera's rays are points here: their origins in an orthographic view, else their directions of
/// length 1. A galaxy is a ball around the ray to its centre, which holds all rays that meet it.
/// Its radius is the bounding radius R or, seen from the distance d, the chord 2 sin(asin(R/d)/2).
/// The balls stand in a binary tree of balls, split at the median of the longer side.
class GalaxyIndex {
 public:
  struct Ball {
    glm::dvec3 centre{0};
    double radius = 0;
  };
  /// Galaxies that were found, with their balls.
  struct Found {
    std::vector<int> galaxies;
    std::vector<double> x, y, z, radius;
    void clear();
    bool empty() const { return galaxies.empty(); }
  };

  GalaxyIndex(const Scene& scene, const Camera& camera);

  /// Holds all rays of the pixels [left, right) x [bottom, top); nothing where none shows sky.
  std::optional<Ball> pixels(int left, int right, int bottom, int top) const;
  /// False where surely none of these pixels' rays meets a galaxy. It is quick for many pixels.
  bool may_meet(int left, int right, int bottom, int top) const;
  /// Holds what passes a ray within that many pixels, as Camera::pixel_size() knows them.
  Ball around(const Ray& ray, double pixels) const;

  /// Holds all rays that meet a ball of the scene.
  Ball ball_of(const glm::dvec3& centre, double radius) const;

  /// Replaces `out` by the galaxies that a ray in the ball may meet, and some near them.
  void find(const Ball& rays, Found& out) const;
  /// Finds them among galaxies that were found before.
  static void find(const Ball& rays, const Found& among, std::vector<int>& out);

 private:
  struct Node {
    Ball ball;
    int first;  ///< its galaxies are order_[first, first + count)
    int count;
    int behind;  ///< the node that follows where this one is passed over
  };
  /// Holds all rays of an area of the image that is no more than a face.
  std::optional<Ball> rays(double left, double right, double bottom, double top) const;
  void build(int first, int count);
  /// Whether find() would find any.
  bool finds(const Ball& rays) const;

  Camera camera_;
  std::vector<int> order_;
  std::vector<Ball> balls_;  ///< in that order
  std::vector<Node> nodes_;  ///< a parent before its children
};

bool overlap(const GalaxyIndex::Ball& a, const GalaxyIndex::Ball& b);

}  // namespace gamer
