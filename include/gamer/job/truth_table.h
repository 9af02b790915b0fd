#pragma once

#include <filesystem>
#include <functional>

#include "gamer/image/data_table.h"
#include "gamer/job/job.h"
#include "gamer/parallel/executor.h"

namespace gamer {

/// Checks before rendering that the table can be written: to `path` (.fits or .ecsv), or to the
/// image's file if `path` is empty. Throws InputError if it cannot.
void check_truth_table(const std::filesystem::path& path, const OutputOptions& image);
/// Writes the table to `path`; the DATE of a FITS file is `date`. Throws RunError if writing fails.
void write_truth_table(const std::filesystem::path& path, const DataTable& table,
                       const std::string& date);

/// Table TRUTH, one row per object in the order of the scene's list:
///   object, id, galaxy, x, y (FITS pixels), ra, dec (sky views), redshift, seed, inclination
///   (0 to 90 deg), radius (arcsec or scene units), then per plane mag_<label> and
///   mag_dustfree_<label> (flux_... in relative images: pixel sums of a fine image, in units of
///   brightness times scene units^2), half_light_radius, e1, e2, bulge_to_total (without dust,
///   first plane), optical_depth. Values that a star lacks are NaN.
/// Every rank calls this function; rank 0 gets the table. On rank 0 `count` is called with the
/// number of objects that are finished.
DataTable truth_table(const RenderJob& job, Executor& executor,
                      const std::function<void(int objects)>& count = {});

/// The properties of a galaxy for its row, as complete() measured them. If complete() did not
/// measure the galaxy, this function does.
GalaxyMeasure measure_for_truth(const RenderJob& job, std::size_t galaxy);

}  // namespace gamer
