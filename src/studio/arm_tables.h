#pragma once

#include <optional>
#include <vector>

#include "gamer/core/config.h"

namespace gamer {

/// The tables [[arm]] of a galaxy's text. Arms count from 0.

/// Throws InputError where the galaxy has none.
ConfigNode::Array& arms_of(ConfigNode& root);
/// The arm with this number. Throws InputError where the galaxy has no such arm.
ConfigNode& arm_at(ConfigNode& root, int arm);

/// The arm from which a branch begins; none for an arm that is no branch.
std::optional<int> arm_left_by(const ConfigNode& arm);
/// Throws InputError for an arm from which branches begin.
void refuse_left_arm(ConfigNode& root, int arm);

/// Angles of the arms of the pattern [arms], degrees; one arm where it has none. Throws InputError.
std::vector<double> pattern_angles(const ConfigNode& root);
/// The middle of the widest gap between arms with an angle, degrees; none where no arm has one.
std::optional<double> free_angle(ConfigNode& root);

}  // namespace gamer
