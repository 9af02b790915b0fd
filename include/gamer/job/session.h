#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gamer/core/cancellation.h"
#include "gamer/core/resources.h"
#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/image/data_table.h"
#include "gamer/image/image.h"
#include "gamer/job/job.h"
#include "gamer/parallel/executor.h"
#include "gamer/parallel/team.h"
#include "gamer/scene/measured_galaxies.h"

namespace gamer {

/// The texts of a render, in memory. Names that it does not hold are searched in the folders of
/// the session.
struct RenderInput {
  /// A scene list, or any other format of catalogue that is text.
  struct Text {
    std::string content;
  };

  std::string parameters;  ///< text of a parameter file
  /// The scene: a text, a table with the columns of a catalogue, or a file.
  std::variant<Text, DataTable, std::filesystem::path> scene;
  std::map<std::string, std::string> galaxies = {};  ///< texts of galaxy files by their names
  std::vector<std::string> settings = {};            ///< "section.key=value", as --set
  /// Label of parameters and scene in messages. Files that they name are searched beside it.
  std::string label = "input";
  /// Whether galaxies are measured as for a draft (GalaxyLibrary::measure_as_draft()).
  bool is_draft = false;
};

/// The progress of a render.
struct RenderProgress {
  enum class Stage {
    measuring,  ///< the galaxies' textures; its parts are not counted
    truth,      ///< objects of table TRUTH
    rows,       ///< rows of the image
    stamps
  };
  Stage stage = Stage::measuring;
  int done = 0;
  int total = 0;
};

struct Rendering;

/// The results that a render makes besides pixels, and the caller's means to watch and end it.
struct RenderControl {
  bool truth = false;         ///< make table TRUTH and the images of [truth]
  bool truth_images = false;  ///< make those images even without the table
  /// Called in the thread that called Session::render(). Its exceptions end the render.
  std::function<void(const RenderProgress&)> progress = {};
  /// Called in that thread with finished rows of an image. Without a team rows come from the middle
  /// outwards, at most Renderer::tile_rows at once. Its exceptions end the render.
  std::function<void(RowRange rows, const Rendering& rendering)> finished = {};
  /// Ends the render at the next tile; Session::render() then throws Cancelled. May be null.
  const Cancellation* cancellation = nullptr;
  /// Processes that render the image together. Each calls Session::render() with an equal job and
  /// gets the whole rendering. They share the rays, but each measures the galaxies itself.
  std::optional<Team> team = {};
};

/// A finished render: pixels and their header.
struct Rendering {
  /// An object's image. It shows the pixels of `region` in the whole image, or beyond it.
  struct Stamp {
    ImageRegion region;
    Image image;
  };

  std::shared_ptr<const RenderJob> job;
  Image image;                     ///< the planes of job->spectrum; empty where there are stamps
  Image truth_images;              ///< the planes of make_truth_header(); mostly empty
  std::vector<Stamp> stamps;       ///< by object, in layout "stamps"
  std::optional<DataTable> truth;  ///< table TRUTH, where it was asked for
  std::optional<DataTable> stars;  ///< table STARS, where stars.table asks for it
  double unconverged_rays = 0;     ///< rays whose error may exceed the tolerance
  std::vector<std::string> warnings = {};

  /// Size, axes, units, photometric calibration and parameters of the image, as in its file.
  ImageHeader header() const;
  /// Writes the file that the program makes of the job; the suffix of the path selects the format.
  /// Throws InputError if the path suits no format or is taken, RunError if writing fails.
  void write(const std::filesystem::path& path, bool overwrite = false) const;
};

/// Renders into memory, any number of times. A session keeps its galaxies and their calibrations.
/// Renders that differ only in camera, spectra, magnitudes or places need no new measurements.
/// Exceptions are galaxies of fixed flux, and a camera that is nearer or farther than the cameras
/// of all earlier renders. Pixels equal those of the program, bit for bit, whatever was rendered
/// before.
///
/// Several threads may use a session at the same time; each render has threads of its own.
class Session {
 public:
  /// Throws std::invalid_argument when threads < 1.
  explicit Session(int threads = available_cores(),
                   std::vector<std::filesystem::path> folders = default_data_folders());

  /// Reads and checks everything; the work is left to render(). Throws InputError if anything in
  /// the input is wrong.
  RenderJob load(const RenderInput& input) const;
  RenderJob load(const JobRequest& request) const;

  /// Renders the image or the stamps of a job, once for each job. Throws Cancelled, InputError
  /// where a texture cannot be normalised or the job is a film, and RunError. When one process of a
  /// team fails, the others throw RunError.
  Rendering render(RenderJob job, const RenderControl& control = {}) const;

  int threads() const { return threads_; }
  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  /// All measurements so far.
  const CalibrationMemory& memory() const { return *memory_; }

 private:
  int threads_;
  std::vector<std::filesystem::path> folders_;
  std::shared_ptr<CalibrationMemory> memory_ = std::make_shared<CalibrationMemory>();
  std::shared_ptr<MeasuredGalaxies> galaxies_ = std::make_shared<MeasuredGalaxies>();
};

}  // namespace gamer
