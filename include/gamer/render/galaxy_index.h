#pragma once

#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// An index of a scene's galaxies, which finds the galaxies that rays of a camera may meet.
///
/// The index describes a ray by a point: its origin in an orthographic view, otherwise its
/// direction of length 1. A galaxy becomes a ball around the point of the ray to its centre. This
/// ball holds the points of all rays that meet the galaxy. Its radius is the bounding radius R in
/// an orthographic view. Seen from the distance d it is the chord 2 sin(asin(R/d)/2). The balls
/// form a binary tree of balls, split at the median of the longer side.
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

  /// The ball that holds all rays of the pixels [left, right) x [bottom, top); nothing if no pixel
  /// shows sky.
  std::optional<Ball> pixels(int left, int right, int bottom, int top) const;
  /// Whether a ray of these pixels may meet a galaxy. The result is false only if certainly no ray
  /// does. The check is quick for many pixels.
  bool may_meet(int left, int right, int bottom, int top) const;
  /// The ball that holds all rays within `pixels` pixels of a ray, in the pixels of
  /// Camera::pixel_size().
  Ball around(const Ray& ray, double pixels) const;

  /// The ball that holds all rays that meet a ball of the scene.
  Ball ball_of(const glm::dvec3& centre, double radius) const;

  /// Replaces `out` by the galaxies that a ray in the ball may meet. `out` may also hold galaxies
  /// that such rays pass closely.
  void find(const Ball& rays, Found& out) const;
  /// Finds galaxies among those of an earlier search.
  static void find(const Ball& rays, const Found& among, std::vector<int>& out);

 private:
  struct Node {
    Ball ball;
    int first;  ///< the node's galaxies are order_[first, first + count)
    int count;
    int behind;  ///< next node if this node is skipped
  };
  /// The ball that holds all rays of an area of the image, at most one face.
  std::optional<Ball> rays(double left, double right, double bottom, double top) const;
  void build(int first, int count);
  /// Calls use(i) for each galaxy order_[i] that a ray in the ball may meet, until a call returns
  /// true. Returns whether one did.
  template <class Use>
  bool any_of(const Ball& rays, const Use& use) const;

  Camera camera_;
  std::vector<int> order_;
  std::vector<Ball> balls_;  ///< in the order of order_
  std::vector<Node> nodes_;  ///< parents before their children
};

bool overlap(const GalaxyIndex::Ball& a, const GalaxyIndex::Ball& b);

}  // namespace gamer
