#include "image/fits/image_hdu.h"

#include <stdexcept>
#include <string>

#include "image/fits/fits_cards.h"
#include "image/wavelength_axis.h"

namespace gamer {
namespace {

/// Unit of the planes [first, first + count).
const std::string& unit_of(const ImageHeader& header, int first, int count) {
  const auto unit = [&](int plane) -> const std::string& {
    const bool own = !header.plane_units.empty() && !header.plane_units[plane].empty();
    return own ? header.plane_units[plane] : header.unit;
  };
  for (int i = 1; i < count; ++i) {
    if (unit(first + i) != unit(first)) {
      throw std::invalid_argument("FITS writer: planes of one cube differ in unit");
    }
  }
  return unit(first);
}

/// Writes axes 1 and 2.
void write_plane_axes(FitsFile& file, const ImageHeader& header, const ImageFace* face) {
  if (header.wcs_records.empty()) {
    std::vector<Card> cards;
    append_axis(cards, 1, face != nullptr ? face->x : header.x);
    append_axis(cards, 2, face != nullptr ? face->y : header.y);
    if (face != nullptr) cards.insert(cards.end(), face->cards.begin(), face->cards.end());
    write_cards(file, cards);
    return;
  }
  for (const std::string& record : header.wcs_records) file.call(fits_write_record, record.c_str());
}

}  // namespace

void write_image_header(FitsFile& file, const ImageHeader& header, const ImageHdu& hdu) {
  std::vector<Card> cards = hdu.names;
  cards.insert(cards.end(), hdu.common.begin(), hdu.common.end());
  const std::string& unit = unit_of(header, hdu.first, hdu.count);
  // Astropy's CCDData needs the card; an empty unit is dimensionless.
  cards.push_back({"BUNIT", unit, unit.empty() ? "dimensionless" : "unit of the pixels"});
  // The number of axes must be stated: a compressed image is a table of two axes.
  cards.push_back({"WCSAXES", hdu.count > 1 ? 3LL : 2LL, "number of world axes"});
  write_cards(file, cards);
  write_plane_axes(file, header, hdu.face);

  cards.clear();
  if (hdu.count > 1) append_third_axis(cards, header.wavelengths, header.wcs_records);
  append_plane_cards(cards, header, hdu.first, hdu.count);
  cards.insert(cards.end(), hdu.more.begin(), hdu.more.end());
  write_cards(file, cards);
}

}  // namespace gamer
