#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/image/image.h"
#include "gamer/job/look.h"
#include "gamer/job/record.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/render/renderer.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"
#include "gamer/scene/spectrum.h"

namespace gamer {

class CalibrationMemory;

/// A user's request: the two files of a job, or an image to be made again, with changes to either.
struct JobRequest {
  std::filesystem::path parameters;   ///< *.par
  std::filesystem::path scene;        ///< *.lst
  std::filesystem::path from_header;  ///< an image with a record, instead of the two files
  std::optional<Look> look;           ///< a galaxy to look at, instead of the two files
  std::vector<std::string> settings;  ///< "section.key=value"
  std::optional<std::filesystem::path> output;  ///< instead of image.output
  std::vector<int> region;                      ///< instead of image.region; empty: not given
  bool stamps = false;                          ///< image.layout is "stamps"
  bool overwrite = false;
  /// Render a quarter of the size on each side, with one ray per pixel and at least
  /// `preview_tolerance`.
  bool preview = false;
};

inline constexpr int preview_reduction = 4;
inline constexpr double preview_tolerance = 1e-2;

/// All data from which an image is made.
struct RenderJob {
  RenderParameters parameters;
  Camera camera;
  Spectrum spectrum;
  std::shared_ptr<Scene> scene;
  Record record;  ///< includes the resolved parameters

  /// Work that complete() must do before the job is rendered.
  struct Pending {
    std::vector<std::shared_ptr<Galaxy>> galaxies;  ///< galaxies to be measured
    std::vector<FootprintRange> footprints;         ///< [galaxy] range of their footprints
    /// The band in which magnitudes include the galaxies' dust; null for none.
    std::shared_ptr<const Bandpass> attenuation;
    bool is_draft = false;   ///< whether all is measured for a coarse view
    bool star_tone = false;  ///< whether discs of stars need find_star_tone()
    bool truth = false;      ///< whether the job makes a truth table
    /// Called on rank 0 when the observed light of `more` galaxies, of `total`, has been measured;
    /// may be empty.
    std::function<void(int more, int total)> progress = {};
    /// Keeps the galaxies, measured for these footprints, for later jobs; may be empty.
    std::function<void(std::span<const FootprintRange> footprints)> keep = {};
  };
  Pending pending = {};
  /// Layers that complete() made of galaxies of fixed flux; null if none.
  std::shared_ptr<const GalaxyLayers> layers = {};
  /// Number of rays of these layers, on all ranks, that did not reach the tolerance.
  double unconverged_rays = 0;
  RenderCounts layer_counts = {};  ///< of this rank's share of the layers
  /// [galaxy] What complete() measured for the truth table; empty if nothing.
  std::vector<std::optional<GalaxyMeasure>> measures = {};
  /// Files that this rank read from disk, without the image of JobRequest::from_header.
  std::vector<std::filesystem::path> input_files = {};
};

/// Makes the changes of JobRequest::preview.
void make_preview(RenderParameters& parameters);

/// The source of a job's texts: the disk, a look, or the image that is made again. Throws
/// InputError if that image holds no record, or if the look's name is wrong.
Resources open_resources(const JobRequest& request,
                         const std::vector<std::filesystem::path>& folders);

/// Reads the parameters and applies the changes of the request. Throws InputError if the file or a
/// change is wrong.
RenderParameters load_parameters(const JobRequest& request, Resources& resources);

/// The text of column_mapping() for the request's catalogue. Throws InputError if the parameters
/// are wrong or the catalogue cannot be read.
std::string mapping_text(const JobRequest& request, Resources& resources);
/// Reads everything. Throws InputError if parameters, scene or galaxies are wrong.
RenderJob read_job(const JobRequest& request, Resources& resources);
/// Reads a job from its record, on any machine.
RenderJob read_job(const Record& record);

/// Completes a job that has been read. Every rank has the job and calls this function. Each galaxy
/// is measured once, in `threads` threads per rank. A process alone may give a memory of earlier
/// measurements. Throws InputError where a texture cannot be normalised.
void complete(RenderJob& job, const Ranks& ranks, int threads, CalibrationMemory* memory = nullptr);

/// The renderer of a completed job's image, with the images of `truth`.
Renderer image_renderer(const RenderJob& job, const TruthSettings& truth = {});

/// Reads and completes a job in this process.
RenderJob load_job(const JobRequest& request, Resources& resources);

/// The resolved parameters of a record. Throws InputError if the record has none, or wrong ones.
RenderParameters recorded_render_parameters(const Record& record);

/// AB magnitude of the value 1 of each plane; none for relative light and for magnitudes.
std::vector<double> zero_points(const RenderJob& job);

/// The header of a job's image: its axes, units and photometric calibration, every resolved
/// parameter, the scene's objects (table SCENE) and the record.
ImageHeader make_image_header(const RenderJob& job);

/// The header of the images of [truth].
ImageHeader make_truth_header(const RenderJob& job);

/// The file of the images of [truth], with one extension each: truth.output, or beside the image
/// with _truth before the suffix.
OutputOptions truth_output(const RenderParameters& parameters);

/// Throws InputError if the rows that rank 0 holds (row_memory()) exceed the available memory.
void check_row_memory(const ImageHeader& header, int planes, int ranks, int threads);

}  // namespace gamer
