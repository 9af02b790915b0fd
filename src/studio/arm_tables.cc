#include "studio/arm_tables.h"

#include <algorithm>
#include <cmath>

#include "core/message.h"
#include "gamer/core/units.h"
#include "gamer/galaxy/arm_pattern.h"

namespace gamer {
namespace {

constexpr double turn = 360;

/// The angle of an arm in [0, 360[ degrees, where it has one.
std::optional<double> angle_of(const ConfigNode& arm) {
  const ConfigNode* node = arm.find("offset");
  if (node == nullptr) return std::nullopt;
  double angle = 0;
  if (const auto* whole = std::get_if<std::int64_t>(&node->data)) {
    angle = static_cast<double>(*whole);
  } else if (const auto* real = std::get_if<double>(&node->data)) {
    angle = *real;
  } else {
    return std::nullopt;
  }
  return angle - turn * std::floor(angle / turn);
}

}  // namespace

ConfigNode::Array& arms_of(ConfigNode& root) {
  ConfigNode* const list = root.find("arm");
  if (list == nullptr || !list->is_array()) {
    throw InputError(root.where, "the galaxy has no [[arm]]");
  }
  return list->array();
}

ConfigNode& arm_at(ConfigNode& root, int arm) {
  ConfigNode::Array& arms = arms_of(root);
  if (arm < 0 || arm >= static_cast<int>(arms.size())) {
    throw input_error(root.where, "there is no [[arm]] {}; the galaxy has {}", arm, arms.size());
  }
  return arms[static_cast<std::size_t>(arm)];
}

std::optional<int> arm_left_by(const ConfigNode& arm) {
  constexpr std::int64_t most = 1000;
  const ConfigNode* leaves = arm.find("leaves");
  const auto* number = leaves != nullptr ? std::get_if<std::int64_t>(&leaves->data) : nullptr;
  if (number == nullptr || *number < 1 || *number > most) return std::nullopt;
  return static_cast<int>(*number) - 1;
}

void refuse_left_arm(ConfigNode& root, int arm) {
  const ConfigNode::Array& arms = arms_of(root);
  for (std::size_t i = 0; i < arms.size(); ++i) {
    if (arm_left_by(arms[i]) != arm) continue;
    throw input_error(root.where, "arm {} leaves arm {}: delete arm {} first", i + 1, arm + 1,
                      i + 1);
  }
}

std::vector<double> pattern_angles(const ConfigNode& root) {
  constexpr double digits = 1e6;
  const ConfigNode* arms = root.find("arms");
  const ArmPattern pattern = ArmPattern::read(arms != nullptr ? *arms : ConfigNode{});
  std::vector<double> angles;
  for (const double offset : pattern.offsets()) {
    angles.push_back(std::round(offset / degree * digits) / digits);
  }
  if (angles.empty()) angles.push_back(0);
  return angles;
}

std::optional<double> free_angle(ConfigNode& root) {
  std::vector<double> angles;
  for (const ConfigNode& arm : arms_of(root)) {
    if (const auto angle = angle_of(arm)) angles.push_back(*angle);
  }
  if (angles.empty()) return std::nullopt;
  std::ranges::sort(angles);
  angles.push_back(angles.front() + turn);
  double middle = 0, widest = 0;
  for (std::size_t i = 0; i + 1 < angles.size(); ++i) {
    const double gap = angles[i + 1] - angles[i];
    if (gap <= widest) continue;
    widest = gap;
    middle = angles[i] + gap / 2;
  }
  return middle < turn ? middle : middle - turn;
}

}  // namespace gamer
