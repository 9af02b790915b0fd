#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gamer/image/wcs.h"
#include "processing/galaxy_shape.h"
#include "processing/plane_operation.h"

namespace gamer {

// The shared parts of operations that measure one galaxy: its planes, centre and sky.

/// --planes, --center, --position, --sky and --annulus.
ParameterTable galaxy_parameters();

/// One plane in memory, from which the sky is subtracted.
struct GalaxyPlane {
  Image image;
  double sky = 0;                   ///< value that was subtracted from each pixel
  std::optional<PlanePoint> start;  ///< the given centre, from 0
  std::optional<CelestialWcs> wcs;
  double pixel_area = 1;  ///< arcsec^2; NaN without celestial coordinates
};

/// The planes of `input` that --planes names, in the file's order; all where it is not given.
/// Planes of variances are left out. Throws InputError where there is no such plane.
std::vector<PlaneTask> chosen_planes(const OperationCall& call, const FitsInput& input);

/// Reads a plane and subtracts its sky. Throws InputError for options that contradict each other, a
/// centre outside the image, an empty annulus and magnitudes.
GalaxyPlane galaxy_plane(const OperationCall& call, const PlaneTask& task);

/// The centre of profiles and disks: the given one, else the nucleus. Throws what nucleus_of() and
/// brightest_place() throw.
PlanePoint centre_of(const GalaxyPlane& galaxy, int threads);

/// The file with the number of the plane where it has several, for messages.
std::string plane_label(const PlaneTask& task);

/// The position angle, deg in [0, 180[, of a direction on the pixels at (x, y), given as `angle`
/// (rad from +x towards +y). It counts from North towards East, or from +y towards -x without
/// celestial coordinates.
double position_angle_of(const GalaxyPlane& galaxy, double x, double y, double angle);
/// The inverse: the angle on the pixels, rad, of a position angle in deg.
double angle_of_position(const GalaxyPlane& galaxy, double x, double y, double position_angle);

/// The columns of a table that are printed for people; all of them with --json.
DataTable printed_columns(const OperationCall& call, const DataTable& table,
                          const std::vector<std::string>& names);

/// Appends the columns x, y, ra and dec of a centre, which counts from 0.
void put_centre(DataTable& table, const GalaxyPlane& galaxy, double x, double y);

}  // namespace gamer
