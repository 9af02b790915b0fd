#pragma once

#include <cmath>
#include <mutex>
#include <vector>

#include "gamer/galaxy/component.h"
#include "gamer/galaxy/kinds/layer_warp.h"
#include "gamer/galaxy/kinds/radial_law.h"

namespace gamer {

struct ArmProfile;

/// Shape of a disk-like component; lengths in galaxy radii, angles in radians.
struct LayerShape {
  double z0 = 0.02;
  double rh = 0.2;
  double inner = 0;  ///< radius of the central hole; 0 for none
  double arm_width = 0.5;
  double shift = 0;  ///< delta
  RadialShape radial = {};
  double flare = 0;         ///< per galaxy radius
  double lopsidedness = 0;  ///< per galaxy radius
  double lopsided_angle = 0;
  LayerWarp warp = {};

  bool operator==(const LayerShape&) const = default;
  /// h(r)/z0.
  double flare_at(double r) const { return flare == 0 ? 1 : std::exp(flare * r); }
  /// Whether the envelope, arms apart, is round and has the same height everywhere.
  bool is_even() const {
    return radial.is_round() && flare == 0 && lopsidedness == 0 && warp.is_flat();
  }
};

/// The base of disk, stars and dust: a layer wound along the arms,
///   envelope = (z0/h) sech^2((z - l)/h) f (1 - exp(-(m/inner)^4)) L taper (1 - Delta/pi)^A_w,
///   h = z0 exp(flare r),   L = 1 + lopsidedness r cos(phi - lopsided_angle),
/// where f(m) is the profile of RadialLaw, exp(-r/rh) by default, and Delta in [0, pi] is the angle
/// to the nearest arm centre theta(r) + offset_i + delta. The lift l(r, phi) is that of LayerWarp.
/// Arms with courses of their own have the factor F of ArmCourses instead of the last factor.
/// [GAMER Eqs. 11, 13, which have no hole, lift and taper]
class Layer : public Component {
 public:
  /// Smallest scale height, limited by single precision of places along oblique rays. Columns at
  /// this height err by 1.2e-4 rms, and at a tenth of this height by 2.4e-3.
  static constexpr double least_height = 1e-5;

  Layer(const LayerShape& shape, const ArmPattern& arms);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override;
  Cloud cloud(std::size_t size) const override;
  ColumnCloud columns(std::size_t size, std::size_t heights) const override;
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;
  double column_brightness(const double nearest[3], const double direction[3],
                           double reach) const override;
  double texture_frequency() const override;
  bool hides_texture(double footprint) const override;
  double face_on_column() const override { return 2 * shape_.z0 * law_.peak(); }
  double peak() const override { return law_.peak(); }
  bool needs_azimuth() const override {
    return follows_arms() || !shape_.radial.is_round() || shape_.lopsidedness > 0 || is_warped();
  }
  bool needs_winding() const override {
    return follows_arms() || (texture() != nullptr && texture()->twirl() != 0);
  }

  /// The envelope at points whose z are heights above the mid-plane. It is 0 outside the ball.
  void envelope_above_plane(const Points& points, float* out) const;
  bool is_warped() const override { return !shape_.warp.is_flat(); }
  void lift(const SampleBatch& batch, float* out) const override { shape_.warp.lift(batch, out); }

  const LayerShape& shape() const { return shape_; }
  const RadialLaw& law() const { return law_; }
  const ArmPattern& arms() const { return arms_; }

  /// Declarations of z0 ... twirl, shared by the kinds.
  static ParameterTable parameters();
  /// The shape given by these parameters. A kind without `arm_width` ignores the arms.
  static LayerShape read_shape(const ComponentInput& input, bool has_arm_width = true);

 private:
  /// The envelope where `heights` are those above the mid-plane.
  void envelope_at(const SampleBatch& batch, const float* heights, float* out) const;
  struct Cells;
  Cells cells(std::size_t radial, std::size_t azimuthal, std::size_t vertical) const;
  /// Converts the points of a cloud from (m, psi) to (r, azimuth), and multiplies their weights by
  /// h/z0.
  void place(SampleBatch& batch, BatchArray& weight) const;
  struct Path;
  /// Finds the part of a ray where the layer is bright; false where there is none.
  bool cut(const BallRay& ray, const Accuracy& accuracy, Path& path) const;
  /// Nodes per length that the texture needs on a ray of this speed.
  double texture_rate(const BallRay& ray, double speed) const;
  /// Approximate largest value of sech^2(z/h) f along a ray and its neighbours within `reach`, as a
  /// share of the peak of f. One function is for flat layers and one for warped layers.
  double flat_brightness(const double nearest[3], const double direction[3], double reach) const;
  double warped_brightness(const double nearest[3], const double direction[3], double reach) const;
  /// The scale height h at a radius m of RadialLaw.
  double height_at(double m) const;
  /// Narrows a path within a radius to the part within `limit` of the warped mid-plane; false where
  /// there is none.
  bool narrow(const BallRay& ray, double limit, double radius, Path& path) const;
  /// Adds the places where a ray passes the mid-plane, or comes closest to it.
  void add_plane(const BallRay& ray, const Path& path, RayPlan& out) const;
  void add_warped_plane(const BallRay& ray, const Path& path, RayPlan& out) const;
  /// The scale of arms and noise on rays that pass the mid-plane at the radius r.
  double texture_scale(double r) const;
  /// The scale length along the plane's minor axis, galaxy radii.
  double minor_length() const { return law_.length() * shape_.radial.axis_ratio; }
  /// The scale of the envelope on rays whose distance from the centre is at least `closest`.
  /// `cosine` is the cosine of the angle between the rays and the mid-plane's normal.
  double crossing_scale(double cosine, double closest) const;
  /// column_scale() of a warped layer.
  ColumnScale warped_column_scale(const double nearest[3], const double direction[3],
                                  double reach) const;
  /// Adds the places of a ring on a ray.
  void add_ring(const Path& path, RayPlan& out) const;
  bool follows_arms() const { return arms_.has_arms() && shape_.arm_width > 0; }
  bool follows_courses() const { return follows_arms() && arms_.courses() != nullptr; }
  /// The profile of arms with courses of their own.
  ArmProfile profile() const;
  /// The mean of the arm modifier around a circle, if all arms are alike.
  double mean_arm_modifier() const;
  /// The integral over the plane of the envelope's column, divided by 2 z0.
  double uneven_integral() const;
  /// The mean taper of a warped layer on the ellipse m of its mid-plane, at equal steps of psi from
  /// -pi to pi.
  std::vector<double> tapers_around(double m) const;

  LayerShape shape_;
  RadialLaw law_;
  ArmPattern arms_;
  double steepest_winding_;  ///< steepest winding of the arms where the layer is bright
  double largest_shear_;
  double log_peak_;         ///< ln of law_.peak()
  double texture_stretch_;  ///< largest stretch of the texture by the warp in the bright part
  mutable std::once_flag has_node_radius_;
  mutable std::vector<float> node_radius_;  ///< quantiles of law_ for clouds, made once needed
};

}  // namespace gamer
