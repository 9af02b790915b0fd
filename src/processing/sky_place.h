#pragma once

#include <string>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs.h"
#include "gamer/processing/operation.h"

namespace gamer {

/// Reads "RA,DEC": each in decimal degrees, or sexagesimal with colons (RA in hours, "10:00:24.0",
/// Dec in degrees, "-2:12:00"). Throws InputError without a context for other texts, RA outside
/// [-360, 360] deg and Dec outside [-90, 90] deg.
SkyPosition parse_sky_position(const std::string& text);

/// The value of --position, see parse_sky_position(). Throws InputError "gutil <operation>: ...".
SkyPosition sky_position(const OperationCall& call);

/// The declaration of --position.
Parameter position_parameter(const char* description);

/// The pixel at `sky` in an image of width x height pixels. Throws InputError "gutil <operation>:
/// ..." with `label` where the position lies beyond the outer sides of the image's pixels.
PixelPosition pixel_within(const OperationCall& call, const CelestialWcs& wcs,
                           const SkyPosition& sky, int width, int height, const std::string& label);

}  // namespace gamer
