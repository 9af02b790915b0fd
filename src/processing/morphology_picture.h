#pragma once

#include <filesystem>

#include "processing/morphology.h"

namespace gamer {

/// Writes a PNG picture of an image in inverted grey with an asinh stretch, enlarged to at least
/// 800 pixels where it is smaller. Blue: the circles of the Petrosian radius and of 1.5 of them,
/// and the centre. Green: the circles r20 and r80. Orange: the Petrosian ellipse. Purple: the
/// outline of the pixels of Gini and M20. The file is complete or absent. Throws RunError.
void write_morphology_picture(const std::filesystem::path& path, const Image& image,
                              const Morphology& morphology, bool overwrite);

}  // namespace gamer
