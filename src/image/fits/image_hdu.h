#pragma once

#include <vector>

#include "gamer/image/image.h"
#include "image/fits/fits_file.h"

namespace gamer {

/// The part of an image's ImageHeader that one HDU shows, and the HDU's own cards.
struct ImageHdu {
  std::vector<Card> names;          ///< EXTNAME, EXTVER
  std::vector<Card> common;         ///< common_cards()
  const ImageFace* face = nullptr;  ///< the face that it shows; null for none
  int first = 0, count = 1;         ///< its planes [first, first + count)
  std::vector<Card> more;           ///< at the end
};

/// Writes the header of the current HDU: names, unit, world coordinates, and the cards of its
/// planes. Throws std::invalid_argument where the planes differ in unit.
void write_image_header(FitsFile& file, const ImageHeader& header, const ImageHdu& hdu);

}  // namespace gamer
