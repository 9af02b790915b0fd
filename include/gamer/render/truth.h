#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "gamer/image/data_table.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/job.h"

namespace gamer {

/// What a galaxy is, measured on rays through it alone: parallel to the line of sight, through its
/// own dust and nothing else, as finely as sampling.tolerance asks.
struct GalaxyMeasure {
  std::vector<double> attenuation;  ///< of each plane: light with dust over light without
  double half_light_radius = 0;     ///< scene units; around its centre, first plane, as seen
  /// Second moments of the light of the first plane, as seen, about its centroid: with the axes
  /// N (up in the image) and E (left), e1 + i e2 = (Q_NN - Q_EE + 2 i Q_NE)/(Q_NN + Q_EE), so that
  /// the position angle is half its phase.
  double e1 = 0, e2 = 0;
  double optical_depth = 0;  ///< through the centre, first plane
};

/// The footprints of the stamps on which galaxies are measured.
FootprintRange measure_footprints(const RenderParameters& parameters);

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum);

/// Checks before rendering that the table can be written: into the image's file where `path` is
/// empty, else to `path`, .fits or .ecsv. Throws InputError.
void check_truth_table(const std::filesystem::path& path, const OutputOptions& image);
/// Writes it to `path`; the DATE of a FITS file is `date`. Throws RunError.
void write_truth_table(const std::filesystem::path& path, const DataTable& table,
                       const std::string& date);

/// Makes magnitudes those of the galaxies as seen (photometry.attenuated): raises the brightness of
/// each by what its dust takes in the reference band, at rest for absolute magnitudes. Every rank
/// calls it with the same scene; each galaxy is measured once, in so many threads a rank.
void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, const Ranks& ranks, int threads, Scene& scene);

/// Table TRUTH, one row per object in the order of the scene's list:
///   object, id, galaxy, x, y (FITS pixels), ra, dec (sky views), redshift, seed, inclination
///   (0 to 90 deg), radius (arcsec or scene units), then per plane mag_<label> and
///   mag_dustfree_<label> (flux_... in relative images: pixel sums of a fine image, in units of
///   brightness times scene units^2), half_light_radius, e1, e2, bulge_to_total (without dust,
///   first plane), optical_depth. What a star has not is NaN.
/// Every rank calls it; the table is rank 0's.
DataTable truth_table(const RenderJob& job, Executor& executor);

}  // namespace gamer
