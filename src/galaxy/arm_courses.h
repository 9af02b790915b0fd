#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/core/config.h"
#include "gamer/core/parameter.h"
#include "gamer/galaxy/arm_pattern.h"

namespace gamer {

/// Spiral arms that each have a course, a strength and a width of their own. Arm k has its crest at
///   phi = theta(r) + o_k(r) + delta,
/// where theta is the pattern's winding, delta a component's shift, and o_k the arm's offset. A
/// component's density is multiplied by
///   F = I + (1 - I) (1 - prod_k (1 - a_k(r) exp(-x_k^2/2))),  x_k = Delta_k/(w g_k(r)),
/// where Delta_k in [-pi, pi] is the angle from the crest and a_k in [0, 1] the arm's strength. The
/// width w is that of the component's arms; arm k is g_k times as wide. The floor I and the width w
/// follow from the component's `arm_width` (ArmProfile). F lies in [I, 1].
class ArmCourses {
 public:
  /// The course of one arm at one radius.
  struct Place {
    double offset;    ///< o_k, radians
    double strength;  ///< a_k
    double width;     ///< g_k
  };

  /// Number of intervals of the tables in r, which are linear between their nodes.
  static constexpr int intervals = 512;
  /// Floats of one node: offset, strength, 1/width, and padding.
  static constexpr int node_size = 4;

  /// Floats of the tables of one arm.
  static constexpr std::size_t arm_size = node_size * (intervals + 1);

  /// Declarations of the keys of [arms] that give all arms courses of their own.
  static ParameterTable common_table();
  /// Declarations of an [[arm]].
  static ParameterTable arm_table();

  /// Number of trunks of a list of [[arm]]. A trunk is an arm that does not branch off another arm
  /// (key `leaves`).
  static std::int64_t trunks(const ConfigNode& list);
  /// Whether a galaxy's [arms], or its list of [[arm]], asks for courses.
  static bool are_asked_for(const ParameterSet& common, const ConfigNode* list);
  /// `list` may be null: all arms of `pattern` are alike then. Throws InputError for an array that
  /// holds something else than tables. Other errors are a branch of a later arm of the list, and
  /// kinks that do not fit the pitch angles.
  ArmCourses(const ArmPattern& pattern, const ParameterSet& common, const ConfigNode* list);

  std::size_t size() const { return table_.size() / arm_size; }
  /// Number of trunks.
  int trunks() const { return trunks_; }
  /// The tables: node_size floats for each node, nodes of one arm together.
  const float* table() const { return table_.data(); }
  /// Course of arm k at a radius in [0, 1].
  Place at(std::size_t k, double r) const;

  /// Turns points about the axis so that the trunks become an even pattern. Trunk k then has the
  /// constant offset 2 pi k/trunks(). The arms are turned by `shift` (radians). The angle of the
  /// turn is a mean over the trunks, weighted with exp(-4.5 (Delta_k trunks/2 pi)^2). The arrays x,
  /// y hold the result.
  void straighten(const Points& points, const ArmPattern& pattern, double shift, float* x,
                  float* y) const;

 private:
  struct Arm;
  /// Fills the tables of the arm at `place`.
  void fill(std::size_t place, const ArmPattern& pattern, const Arm& arm);

  int trunks_ = 0;
  std::vector<float> table_;
};

/// The arms of one component, for kernels.
struct ArmFactorInput {
  const float* table;  ///< ArmCourses::table()
  std::size_t size;    ///< number of arms
  float floor, inverse_width;
};

/// The profile of a component's arms across their crests. The full width at half maximum is that of
/// (1 - Delta/pi)^A_w, at most half the distance of neighbouring arms. The floor is the value of
/// this power midway between two arms.
struct ArmProfile {
  ArmProfile(double arm_width, int trunks);

  double floor;
  double width;  ///< w, radians

  /// The mean of F around the circle of radius r.
  double mean(const ArmCourses& courses, double r) const;
  /// The means of F around circles, at `intervals` + 1 even steps of r in [0, 1].
  std::vector<double> means(const ArmCourses& courses, std::size_t intervals) const;

  ArmFactorInput input(const ArmCourses& courses) const;
};

}  // namespace gamer
