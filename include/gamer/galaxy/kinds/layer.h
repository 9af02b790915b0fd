#pragma once

#include <vector>

#include "gamer/galaxy/component.h"

namespace gamer {

/// Shape of a disk-like component; lengths in galaxy radii, angles in radians.
struct LayerShape {
  double z0 = 0.02;
  double rh = 0.2;
  double inner = 0;  ///< radius of the central hole; 0 for none
  double arm_width = 0.5;
  double shift = 0;  ///< delta
};

/// The base of disk, stars and dust: an exponential layer wound along the arms,
///   envelope = sech^2(z/z0) exp(-r/rh) (1 - exp(-(r/inner)^4)) taper (1 - Delta/pi)^A_w,
/// where Delta in [0, pi] is the angle to the nearest arm centre theta(r) + offset_i + delta. Arms
/// with courses of their own have the factor F of ArmCourses instead.
/// [GAMER Eqs. 11, 13, without hole and taper]
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
  double texture_frequency() const override;
  bool hides_texture(double footprint) const override;
  double face_on_column() const override { return 2 * shape_.z0 * peak_; }
  double peak() const override { return peak_; }
  bool needs_azimuth() const override { return follows_arms(); }
  bool needs_winding() const override {
    return follows_arms() || (texture() != nullptr && texture()->twirl() != 0);
  }

  const LayerShape& shape() const { return shape_; }

  /// Declarations of z0 ... twirl, shared by the kinds.
  static ParameterTable parameters();
  /// The shape given by these parameters. A kind without `arm_width` ignores the arms.
  static LayerShape read_shape(const ParameterSet& values, bool has_arm_width = true);

 private:
  struct Cells;
  Cells cells(std::size_t radial, std::size_t azimuthal, std::size_t vertical) const;
  bool follows_arms() const { return arms_.has_arms() && shape_.arm_width > 0; }
  bool follows_courses() const { return follows_arms() && arms_.courses() != nullptr; }
  /// The means of ArmCourses' factor around circles of evenly spaced radii.
  std::vector<double> mean_course_factors() const;
  /// The mean of the arm modifier around a circle, of arms that are alike.
  double mean_arm_modifier() const;

  LayerShape shape_;
  ArmPattern arms_;
  double steepest_winding_;  ///< steepest winding of the arms where the layer is bright
  double largest_shear_;
  double peak_;      ///< largest exp(-r/rh) (1 - exp(-(r/inner)^4)) taper
  double log_peak_;  ///< its logarithm
};

}  // namespace gamer
