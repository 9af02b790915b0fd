#pragma once

#include <filesystem>
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
#include "gamer/render/renderer.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"
#include "gamer/scene/spectrum.h"

namespace gamer {

/// A user's request: two files, or an image to be made again, and the changes to them.
struct JobRequest {
  std::filesystem::path parameters;             ///< *.par
  std::filesystem::path scene;                  ///< *.lst
  std::filesystem::path from_header;            ///< an image with a record, instead of the two
  std::optional<Look> look;                     ///< instead of the two
  std::vector<std::string> settings;            ///< "section.key=value"
  std::optional<std::filesystem::path> output;  ///< instead of image.output
  std::vector<int> region;                      ///< instead of image.region; empty: not given
  bool stamps = false;                          ///< image.layout is "stamps"
  bool overwrite = false;
  /// A quarter of the size on each side, one ray per pixel and `preview_tolerance` at least.
  bool preview = false;
};

inline constexpr int preview_reduction = 4;
inline constexpr double preview_tolerance = 1e-2;

/// Everything that an image is made from.
struct RenderJob {
  RenderParameters parameters;
  Camera camera;
  Spectrum spectrum;
  std::shared_ptr<Scene> scene;
  Record record;  ///< with the resolved parameters

  /// What complete() still has to do before the job is rendered.
  struct Pending {
    std::vector<std::shared_ptr<Galaxy>> galaxies;  ///< are to be measured
    std::vector<FootprintRange> footprints;         ///< for these, by galaxy
    /// The band in which galaxies are to be as bright with their dust as without it; null for none.
    std::shared_ptr<const Bandpass> attenuation;
  };
  Pending pending = {};
  /// Files that were read from disk, on the rank that read them. The image that is made again is
  /// not among them.
  std::vector<std::filesystem::path> input_files = {};
};

/// Makes the changes of JobRequest::preview.
void make_preview(RenderParameters& parameters);

/// Where a job's texts come from: the disk, or the image that is to be made again. Throws
/// InputError.
Resources open_resources(const JobRequest& request,
                         const std::vector<std::filesystem::path>& folders);

/// Reads the parameters and applies what the request changes. Throws InputError.
RenderParameters load_parameters(const JobRequest& request, Resources& resources);

/// Which columns of the request's catalogue serve as which of a scene (column_mapping()). Throws
/// InputError.
std::string mapping_text(const JobRequest& request, Resources& resources);
/// Reads everything. Throws InputError.
RenderJob read_job(const JobRequest& request, Resources& resources);
/// Reads a job from its record, on any machine.
RenderJob read_job(const Record& record);

/// Completes a job that has been read. Every rank has the job and calls this. Each galaxy is
/// measured once, in so many threads a rank. Throws InputError where a texture cannot be
/// normalised.
void complete(RenderJob& job, const Ranks& ranks, int threads);

/// Reads and completes a job in this process.
RenderJob load_job(const JobRequest& request, Resources& resources);
RenderJob job_from_record(const Record& record);

/// Measures galaxies with all ranks. Every rank calls it with the same galaxies and ranges of
/// footprints, one for each galaxy. Without ranges it measures all footprints.
void measure_galaxies(std::span<const std::shared_ptr<Galaxy>> galaxies,
                      std::span<const FootprintRange> footprints, const Ranks& ranks);

/// The resolved parameters of a record. Throws InputError.
RenderParameters recorded_render_parameters(const Record& record);

/// The header of a job's image: its axes, units and photometric calibration, every resolved
/// parameter, the scene's objects (table SCENE) and the record.
ImageHeader make_image_header(const RenderJob& job);

/// The header of the images of [truth].
ImageHeader make_truth_header(const RenderJob& job);

/// Their file: truth.output, or beside the image with _truth before the suffix; one extension each.
OutputOptions truth_output(const RenderParameters& parameters);

/// Throws InputError when the rows that rank 0 holds (row_memory()) need more memory than there is.
void check_row_memory(const ImageHeader& header, int planes, int ranks, int threads);

}  // namespace gamer
