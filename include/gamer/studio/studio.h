#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "gamer/parallel/executor.h"

namespace gamer {

/// The options of gstudio.
struct StudioOptions {
  std::filesystem::path galaxy;      ///< a galaxy's file, or its type's name
  std::filesystem::path parameters;  ///< a parameter file, instead of a galaxy
  std::filesystem::path scene;       ///< the scene of the parameter file
  /// The folder of renders and of galaxies saved under new names. The page writes nothing else but
  /// the files that the program was started with. The folder is made when it is needed.
  std::filesystem::path folder = "gstudio-output";
  int port = 0;  ///< 0 for a free port
  /// File that keeps the secrets for later starts, so that an open page connects again. Without it
  /// each start has new secrets.
  std::filesystem::path token_file;
  int threads = available_cores();
  bool opens_browser = true;
};

/// Serves the page until a signal ends the process, and passes its address to `say`. Throws
/// InputError for files that cannot be opened, and RunError where the port is in use.
void run_studio(const StudioOptions& options, const std::function<void(const std::string&)>& say);

}  // namespace gamer
