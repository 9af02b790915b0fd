#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/core/resources.h"
#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/job/job.h"
#include "gamer/job/measure_galaxies.h"
#include "gamer/job/schedule.h"
#include "gamer/parallel/executor.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/scene/render_parameters.h"
#include "job/make_job.h"

namespace gamer {

/// The measurements of this program's galaxies. Each part of a galaxy is measured once.
inline CalibrationMemory& measurements() {
  static CalibrationMemory memory(std::size_t{1} << 30);
  return memory;
}

/// A scene list as a job whose galaxies are measured as in the program, for the footprints that its
/// camera sees. Magnitudes are those without dust.
inline RenderJob measured_job(RenderParameters parameters, const std::string& list,
                              const std::string& label, Resources& resources) {
  const Catalogue catalogue = Catalogue::parse(list, label, parameters.catalogue.format);
  GalaxyLibrary library(parameters, label, resources);
  RenderJob job = make_job(std::move(parameters), catalogue, resources, library);
  const RenderJob::Pending pending = std::exchange(job.pending, {});
  measure_galaxies(pending.galaxies, pending.footprints, Ranks(), &measurements());
  return job;
}

/// The image of a job, made by one thread.
inline Image image_of(const RenderJob& job) {
  ThreadExecutor executor(1);
  return render_image(image_renderer(job), executor);
}

/// The names of the files in a folder with this suffix, in alphabetical order.
inline std::vector<std::string> names_in(const std::filesystem::path& folder,
                                         const std::string& suffix) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == suffix) names.push_back(entry.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// A shipped scene of `project`, with changed parameters ("section.key=value"). `is_row` decides
/// which lines of its list are taken.
inline RenderJob shipped_job(const std::filesystem::path& project, const std::string& name,
                             const std::vector<std::string>& settings,
                             const std::function<bool(const std::string&)>& is_row = {}) {
  const auto contents = [&](const std::string& suffix) {
    std::stringstream text;
    text << std::ifstream(project / "scenes" / (name + suffix)).rdbuf();
    return text.str();
  };
  ConfigNode root = parse_toml(contents(".par"), name + ".par");
  for (const std::string& setting : settings) set_from_text(root, setting);
  std::string list;
  std::istringstream lines(contents(".lst"));
  for (std::string line; std::getline(lines, line);) {
    if (!is_row || is_row(line)) list += line + '\n';
  }
  Resources resources({project});
  return measured_job(RenderParameters::read(root), list,
                      (project / "scenes" / (name + ".lst")).string(), resources);
}

}  // namespace gamer
