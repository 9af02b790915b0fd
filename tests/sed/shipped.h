#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/sed.h"

namespace gamer {

inline std::shared_ptr<const Sed> shipped_sed(const std::string& name) {
  Resources resources({GAMER_TEST_SOURCE_DIR});
  return find_sed(name, "", resources);
}

/// A spectrum that needs no file.
inline std::shared_ptr<const Sed> analytic(const std::string& name) {
  Resources none = Resources::from_record({});
  return find_sed(name, "", none);
}

inline std::shared_ptr<const Bandpass> shipped_band(const std::string& name) {
  Resources resources({GAMER_TEST_SOURCE_DIR});
  return find_bandpass(name, "", resources);
}

inline std::vector<std::string> shipped_names(const std::string& kind, const std::string& suffix) {
  return Resources({GAMER_TEST_SOURCE_DIR}).names(kind, std::vector<std::string>{suffix});
}

}  // namespace gamer
