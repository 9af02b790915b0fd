#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/plane.h"

namespace gamer {

/// One HDU of a file that FitsInput has open.
struct FitsHdu {
  int number = 0;    ///< from 0, the primary
  std::string name;  ///< EXTNAME, empty for none
  FitsHeader header;
  /// Size of an image of two axes or more; 0 planes where the HDU is a table or has no pixels. Axes
  /// beyond the second are counted as planes, the third running fastest.
  int width = 0, height = 0, planes = 0;
  std::vector<long long> further_axes;  ///< sizes of the third axis, the fourth...
  /// BITPIX of the values. Integers with BSCALE or BZERO count as floating-point numbers.
  int bitpix = 0;
  bool has_integers = false;  ///< the file stores integers

  bool is_image() const { return planes > 0; }
};

/// An open FITS file with its HDUs. Planes are read on demand. Copies share the file.
///
/// A name is a path, or "-" for standard input, which is copied to a temporary file. Where no file
/// has the name, it may be an extended one. "a.fits[1]" or "a.fits[SCI]" is that HDU alone, with
/// the table of its third axis; "a.fits[1][10:90,10:90]" is a section of the HDU. Compressed files
/// read as their contents.
class FitsInput {
 public:
  /// Throws InputError for a file that is missing, is no FITS file or is truncated, and for sizes
  /// that the file cannot hold.
  explicit FitsInput(const std::string& name);

  /// The file's name in messages.
  const std::string& name() const;
  const std::vector<FitsHdu>& hdus() const;

  /// Plane number `plane` of the image HDU hdus()[hdu]. Infinities and NaN are kept; blank integers
  /// become NaN. Reads from several threads take turns.
  PlanePtr plane(std::size_t hdu, int plane) const;

  class File;
  const std::shared_ptr<File>& file() const { return file_; }

 private:
  std::shared_ptr<File> file_;
};

struct FitsOutputOptions {
  std::string name;  ///< path ending in .fits or .fits.fz, or "-" for standard output
  bool overwrite = false;
};

/// A FITS file written HDU after HDU; it is complete or absent. Standard output gets the bytes when
/// the file is complete.
class FitsOutput {
 public:
  /// Throws InputError for an unknown suffix, a folder that cannot be written, an existing file
  /// (unless overwrite), or standard output that is a terminal.
  explicit FitsOutput(const FitsOutputOptions& options);
  ~FitsOutput();

  /// Copies an HDU unchanged.
  void copy(const FitsInput& input, std::size_t hdu);
  /// Copies an HDU's pixels unchanged, with another header.
  void copy(const FitsInput& input, std::size_t hdu, const FitsHeader& header);
  /// Writes an HDU without pixels, as a primary HDU before extensions.
  void write_empty(const FitsHeader& header);
  /// Writes an image HDU of planes of equal size, band after band; bitpix is -32 or -64. The first
  /// HDU is the primary one (in compressed files, the first extension). DATE becomes now. The third
  /// axis counts the planes unless `further_axes` gives the axes' sizes. Throws RunError if writing
  /// fails.
  void write(const FitsHeader& header, const std::vector<PlanePtr>& planes, int bitpix, int threads,
             const std::vector<long long>& further_axes = {});
  /// Writes planes of different wavelengths (Angstrom; empty for none). The header gets the third
  /// axis, WAVE or PLANE, and cards WAVELENn, as in gamer/image/fits.h.
  void write_cube(const FitsHeader& header, const std::vector<PlanePtr>& planes,
                  const std::vector<double>& wavelengths, int bitpix, int threads);
  /// Writes checksums and all data to disk; only the final name is then missing. Throws RunError if
  /// writing fails.
  void complete();
  /// Calls complete() if need be, then gives the file its final name. Throws RunError if the file
  /// cannot have it.
  void finish();

 private:
  class File;
  std::unique_ptr<File> file_;
};

}  // namespace gamer
