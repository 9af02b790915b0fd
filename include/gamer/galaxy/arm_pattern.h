#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/core/parameter.h"

namespace gamer {

class ArmCourses;

/// The spiral pattern of a galaxy: the winding angle theta(r), number and offsets of its arms. Arm
/// i is centred at phi = theta(r) + offset_i (+ a component's shift).
///
///   ringermacher-mead: theta = 2N atan(exp(A/r)/B), evaluated as N pi - 2N atan(B exp(-A/r)),
///     which cannot overflow (Ringermacher & Mead 2009; GAMER Eq. 10 with A = 1).
///   logarithmic: r = A exp(theta tan p), theta = ln(sqrt(r^2 + c^2)/A)/tan p; the core
///     c = A/100 ends the winding at the centre.
///   none: no arms, theta = 0.
class ArmPattern {
 public:
  enum class Model { none, ringermacher_mead, logarithmic };

  ArmPattern() = default;  ///< no arms
  /// Reads the table [arms], declared by table(). `list` is the list of [[arm]], declared by
  /// ArmCourses::arm_table(), or null. Throws InputError if keys, values or arms are wrong.
  static ArmPattern read(const ConfigNode& node, const ConfigNode* list = nullptr);
  static ParameterTable table();
  static ParameterTable arm_table();

  bool has_arms() const { return model_ != Model::none && !offsets_.empty(); }
  Model model() const { return model_; }
  int count() const { return static_cast<int>(offsets_.size()); }
  /// Offset of each arm, radians.
  const std::vector<double>& offsets() const { return offsets_; }
  /// Whether the arms stand at equal angles.
  bool is_even() const { return even_; }
  /// Courses of the single arms; null where all arms are alike.
  const ArmCourses* courses() const { return courses_.get(); }

  /// theta(r) with its sign of handedness, radians; r in galaxy radii, >= 0.
  double winding(double r) const;
  /// winding() of a batch of radii. The absolute error is below 2.5e-7 (1 + |theta| + cot p); the
  /// last term is for the logarithmic law only.
  void winding(const float* r, std::size_t size, float* theta) const;
  /// r dtheta/dr over a batch, relative error below 1e-5.
  void shear(const float* r, std::size_t size, float* out) const;
  /// r dtheta/dr at one radius above 0, in double precision.
  double shear(double r) const;
  /// Largest |r dtheta/dr|, the cotangent of the smallest pitch angle, over [r_min, 1].
  double steepest_winding(double r_min) const;
  /// An upper bound of |r dtheta/dr| at all radii up to 1. The bound exceeds the largest value by
  /// at most a relative 1e-4.
  double largest_shear() const;

 private:
  Model model_ = Model::none;
  double winding_b_ = 0.5;
  double winding_n_ = 4;
  double scale_ = 1;
  double pitch_ = 0;  ///< radians
  double handedness_ = 1;
  bool even_ = true;
  std::vector<double> offsets_;
  std::shared_ptr<const ArmCourses> courses_;
};

}  // namespace gamer
