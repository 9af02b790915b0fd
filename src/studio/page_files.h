#pragma once

#include <span>
#include <string_view>

namespace gamer {

/// A file of the page, embedded when the program is built.
struct PageFile {
  std::string_view name;  ///< "index.html"
  std::string_view content;
};

/// All files of the page.
std::span<const PageFile> page_files();

}  // namespace gamer
