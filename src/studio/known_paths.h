#pragma once

#include <set>
#include <string>

#include "studio/message.h"

namespace gamer {

/// The paths that the program was started with. Documents of the page otherwise use only names of
/// the catalogue, so that any other path comes from a stranger.
class KnownPaths {
 public:
  /// Takes all paths of these texts.
  explicit KnownPaths(const PageDocument& opened);

  /// Throws InputError for a path in a document, or in the text of a galaxy or parameter file, that
  /// was not in those texts.
  void check(const PageDocument& document) const;
  void check_text(const std::string& text) const;

 private:
  void refuse_unknown(const std::string& text) const;

  std::set<std::string> known_;
};

}  // namespace gamer
