#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/data_table.h"
#include "gamer/image/fits/card.h"

namespace gamer {

/// A stack of planes of equal size. Row 0 is the bottom of the picture, as in FITS.
class Image {
 public:
  Image() = default;
  Image(int width, int height, int planes)
      : width_(width),
        height_(height),
        planes_(planes),
        values_(static_cast<std::size_t>(width) * height * planes) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int planes() const { return planes_; }

  double& at(int x, int y, int plane = 0) { return values_[index(x, y, plane)]; }
  double at(int x, int y, int plane = 0) const { return values_[index(x, y, plane)]; }
  /// width * height values of one plane, row 0 first.
  double* plane(int plane) { return &values_[index(0, 0, plane)]; }
  const double* plane(int plane) const { return &values_[index(0, 0, plane)]; }

 private:
  std::size_t index(int x, int y, int plane) const {
    return (static_cast<std::size_t>(plane) * height_ + y) * width_ + x;
  }
  int width_ = 0, height_ = 0, planes_ = 0;
  std::vector<double> values_;
};

/// One linear axis of the world coordinates: value = crval + cdelt (pixel - crpix), pixels from 1.
struct LinearAxis {
  std::string type;
  std::string unit;
  double reference_pixel = 1;
  double reference_value = 0;
  double step = 1;
};

/// A table of texts and numbers, written as a FITS binary table.
struct TextTable {
  std::string name;  ///< EXTNAME
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `columns`
  std::vector<Card> cards;

  using TakeRow = std::function<void(std::span<const std::string_view>)>;
  /// A source of rows instead of `rows`, for large tables. The function calls its argument with
  /// each row in turn. It must give the same rows each time.
  std::function<void(const TakeRow&)> made_rows = {};

  /// Calls `take` with each row of `rows` or of `made_rows`.
  void for_each_row(const TakeRow& take) const;
};

/// One face of an image whose faces stand one above the other. Each face is an HDU of its own.
struct ImageFace {
  std::string label;  ///< "FRONT": start of EXTNAME; a plane's label follows in extensions
  LinearAxis x, y;
  std::vector<Card> cards;
  /// Place of the face in a picture of all faces, counted in faces from the lower left.
  int column = 0, row = 0;
};

/// The description of an image that is a HEALPix map. The image has `nside` columns, and `nside`
/// rows for each of the twelve base pixels in HEALPix order.
struct HealpixHeader {
  int nside = 1;
  bool is_nested = false;  ///< ORDERING of the file is NESTED (otherwise RING)
  char frame = 'G';        ///< COORDSYS
};

/// The description of an image without its pixels.
struct ImageHeader {
  int width = 0;
  int height = 0;
  std::string unit;  ///< BUNIT
  LinearAxis x, y;
  /// 80-character records of a celestial WCS (CelestialWcs::records()), which replace x and y.
  std::vector<std::string> wcs_records;
  /// The image's faces from its bottom, of equal height, which replace x and y; empty for none.
  std::vector<ImageFace> faces;
  std::optional<HealpixHeader> healpix;
  /// Wavelengths of the planes, Angstrom; the third axis of a cube.
  std::vector<double> wavelengths;
  /// One label per plane, e.g. "5500A": EXTNAME and suffix of the file name.
  std::vector<std::string> labels;
  /// BUNIT of each plane's HDU; empty where all are `unit`. The planes of a cube have one unit.
  std::vector<std::string> plane_units;
  /// Empty, or one list per plane: cards that differ from plane to plane. In an HDU of several
  /// planes the key gets the plane's number (from 1), as in WAVELENn.
  std::vector<std::vector<Card>> plane_cards;
  std::vector<Card> cards;
  std::vector<TextTable> tables;
  std::vector<DataTable> data_tables;  ///< before `tables` in a file

  int planes() const { return static_cast<int>(labels.size()); }
};

}  // namespace gamer
