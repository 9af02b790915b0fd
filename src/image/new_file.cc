#include "gamer/image/new_file.h"

#include <string>
#include <system_error>

#include "core/message.h"
#include "image/private_folder.h"
#include "image/standard_stream.h"

namespace gamer {

bool is_there(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(path, error));
}

void check_new_file(const std::filesystem::path& path, bool overwrite) {
  namespace fs = std::filesystem;
  if (path == standard_stream) return check_standard_output();
  const auto fail = [&path](const std::string& message) -> void {
    throw input_error("output '{}': {}", path.string(), message);
  };
  std::error_code error;
  const fs::path folder = fs::absolute(path, error).parent_path();
  const std::string folder_name = path.has_parent_path() ? path.parent_path().string() : ".";
  const fs::file_status folder_status = fs::status(folder, error);
  if (folder_status.type() == fs::file_type::not_found) {
    fail(fmt::format("folder '{}' does not exist", folder_name));
  }
  if (!fs::exists(folder_status)) {
    fail(fmt::format("folder '{}': {}", folder_name, error.message()));
  }
  if (!fs::is_directory(folder_status)) fail(fmt::format("'{}' is not a folder", folder_name));
  const fs::file_status status = fs::symlink_status(path, error);
  if (status.type() != fs::file_type::not_found) {
    if (!fs::exists(status)) fail(error.message());
    if (fs::is_directory(path, error)) fail(fmt::format("'{}' is a folder", path.string()));
    if (!overwrite) {
      fail(fmt::format("'{}' exists already; --overwrite replaces it", path.string()));
    }
  }
  try {
    PrivateFolder::make(path);
  } catch (const RunError& cannot_write) {
    throw input_error("output {}", cannot_write.what());
  }
}

}  // namespace gamer
