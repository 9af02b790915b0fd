#include "gamer/galaxy/key_use.h"

#include <algorithm>

namespace gamer {
namespace {

const std::vector<std::string> zero = {"0"};

bool has_key(const ComponentKind& kind, const std::string& key) {
  return std::ranges::any_of(kind.parameters,
                             [&](const Parameter& one) { return one.name == key; });
}

/// Uses of keys that kinds share, by their names.
std::vector<KeyUse> shared_uses() {
  return {{"arm_width", "arms.model", {"none"}, true},
          {"shift", "arms.model", {"none"}, true},
          {"twirl", "arms.model", {"none"}, true},
          {"twirl", "noise", {"true"}},
          {"outer_rh", "break_radius", zero, true},
          {"break_sharpness", "break_radius", zero, true},
          {"ring_width", "ring_radius", zero, true},
          {"ring_outer_width", "ring_radius", zero, true},
          {"lopsided_angle", "lopsidedness", zero, true},
          {"warp_begin", "warp_height", zero, true},
          {"warp_power", "warp_height", zero, true},
          {"warp_angle", "warp_height", zero, true},
          {"warp_twist", "warp_height", zero, true},
          {"peanut_radius", "peanut", zero, true},
          {"peanut_width", "peanut", zero, true},
          {"r_v", "extinction", {"ccm89"}},
          {"luminosity_low", "luminosity_function", {"powerlaw"}},
          {"luminosity_high", "luminosity_function", {"powerlaw"}},
          {"luminosity_slope", "luminosity_function", {"powerlaw"}},
          {"displacement_frequency", "displacement", zero, true},
          {"displacement_octaves", "displacement", zero, true}};
}

std::vector<KeyUse> noise_uses() {
  const std::vector<std::string> densities = {"multiplicative", "ridged"};
  std::vector<KeyUse> uses;
  for (const char* key : {"exponent", "theta", "offset", "contrast", "floor"}) {
    uses.push_back({key, "combination", densities, true});
  }
  uses.push_back({"floor", "theta", {"inverse"}});
  uses.push_back({"ridge_offset", "combination", {"ridged"}});
  uses.push_back({"ridge_gain", "combination", {"ridged"}});
  uses.push_back({"amplitude", "combination", {"multiplicative"}});
  uses.push_back({"spectral_index", "combination", {"multiplicative"}, true});
  uses.push_back({"warp_frequency", "warp", zero, true});
  uses.push_back({"warp_octaves", "warp", zero, true});
  return uses;
}

}  // namespace

std::vector<KeyUse> component_key_uses(const ComponentKind& kind) {
  std::vector<KeyUse> uses;
  for (KeyUse& use : shared_uses()) {
    const bool is_elsewhere = use.selector.find('.') != std::string::npos;
    const bool is_there = is_elsewhere || has_key(kind, use.selector) || use.selector == "noise";
    if (has_key(kind, use.key) && is_there) uses.push_back(std::move(use));
  }
  // A layer of axis ratio 1 is round, and has no position angle. A bar of axis ratio 1 is not
  // round.
  if (has_key(kind, "position_angle") && has_key(kind, "break_radius")) {
    uses.push_back({"position_angle", "axis_ratio", {"1"}, true});
  }
  if (!kind.noise) return uses;
  for (const Parameter& parameter : kind.noise->table()) {
    uses.push_back({"noise." + parameter.name, "noise", {"true"}});
  }
  for (const KeyUse& use : noise_uses()) {
    uses.push_back({"noise." + use.key, "noise." + use.selector, use.values, use.is_excluded});
  }
  return uses;
}

std::vector<KeyUse> arm_key_uses() {
  std::vector<KeyUse> uses;
  for (const Parameter& parameter : ArmPattern::table()) {
    const std::string& key = parameter.name;
    if (key == "model") continue;
    if (key == "winding_b" || key == "winding_n") {
      uses.push_back({key, "model", {"ringermacher-mead"}});
    } else if (key == "pitch_angle") {
      uses.push_back({key, "model", {"logarithmic"}});
    } else {
      uses.push_back({key, "model", {"none"}, true});
    }
  }
  uses.push_back({"segment_length", "pitch_variation", zero, true});
  uses.push_back({"beat_length", "strength_variation", zero, true});
  uses.push_back({"count", "arm", zero});
  uses.push_back({"offsets", "arm", zero});
  return uses;
}

}  // namespace gamer
