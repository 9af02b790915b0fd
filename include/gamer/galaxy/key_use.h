#pragma once

#include <string>
#include <vector>

#include "gamer/galaxy/component.h"

namespace gamer {

/// A condition under which a key matters: the key `selector` has one of `values` or, if
/// `is_excluded`, none of them. Otherwise the key is refused or has no effect. `selector` may be in
/// another table: "arms.model"; "arm" is the number of tables [[arm]]. Values are texts as in the
/// file, without quotes; a key without a value has the empty text.
struct KeyUse {
  std::string key;
  std::string selector;
  std::vector<std::string> values;
  bool is_excluded = false;
};

/// The uses of the keys of a kind. Keys of its noise have names like "noise.floor". A key with
/// several uses needs all of them.
std::vector<KeyUse> component_key_uses(const ComponentKind& kind);

std::vector<KeyUse> arm_key_uses();

}  // namespace gamer
