#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/plane.h"

namespace gamer {

/// One HDU of a file, as FitsInput finds it.
struct FitsHdu {
  int number = 0;    ///< from 0, the primary
  std::string name;  ///< EXTNAME, empty for none
  FitsHeader header;
  /// Size of an image of two axes or more; 0 planes where the HDU is a table or holds no pixels.
  /// Axes beyond the second make planes, the third running fastest.
  int width = 0, height = 0, planes = 0;
  std::vector<long long> further_axes;  ///< pixels of the third axis, the fourth...
  /// BITPIX of the values. Integers with BSCALE or BZERO count as floating-point numbers.
  int bitpix = 0;
  bool has_integers = false;  ///< in the file

  bool is_image() const { return planes > 0; }
};

/// An open FITS file: its HDUs, and its planes without loading them. Copies share the file.
///
/// Names are paths, "-" for standard input (spooled to a temporary file), or extended
/// names where no file is called so: "a.fits[1]", "a.fits[SCI]" (that HDU alone, with the table of
/// its third axis), "a.fits[1][10:90,10:90]" (a section of it). Compressed files are read as what
/// they hold.
class FitsInput {
 public:
  /// Throws InputError: no such file, no FITS, truncated, sizes that the file cannot hold.
  explicit FitsInput(const std::string& name);

  /// What messages call it.
  const std::string& name() const;
  const std::vector<FitsHdu>& hdus() const;

  /// Plane number `plane` of an image HDU (its place in hdus()). Infinities and NaN are kept; blank
  /// integers are NaN. Reads of several threads take turns.
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

/// A FITS file in the making, HDU after HDU; complete or absent. Standard output gets the bytes
/// when all are there.
class FitsOutput {
 public:
  /// Throws InputError: unknown suffix, a folder that cannot be written, a file that exists (unless
  /// overwrite), standard output that is a terminal.
  explicit FitsOutput(const FitsOutputOptions& options);
  ~FitsOutput();

  /// The HDU as it is in the input.
  void copy(const FitsInput& input, std::size_t hdu);
  /// Pixels as they are, with another header.
  void copy(const FitsInput& input, std::size_t hdu, const FitsHeader& header);
  /// An HDU without pixels, for what goes before extensions.
  void write_empty(const FitsHeader& header);
  /// A new image HDU of planes of one size, written band after band. bitpix -32 or -64. A first HDU
  /// becomes the primary one (in compressed files, the first extension). DATE becomes now. Throws
  /// RunError.
  /// The third axis counts the planes unless `further_axes` says how they are laid out.
  void write(const FitsHeader& header, const std::vector<PlanePtr>& planes, int bitpix, int threads,
             const std::vector<long long>& further_axes = {});
  /// Writes planes of different wavelengths (Angstrom; empty where they have none). The header gets
  /// the third axis, WAVE or PLANE, and cards WAVELENn, as in
  /// gamer/image/fits.h.
  void write_cube(const FitsHeader& header, const std::vector<PlanePtr>& planes,
                  const std::vector<double>& wavelengths, int bitpix, int threads);
  /// Checksums; all is on disk then but the final name. Throws RunError.
  void complete();
  /// complete() where that was not called, then the final name. Throws RunError.
  void finish();

 private:
  class File;
  std::unique_ptr<File> file_;
};

}  // namespace gamer
