#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gamer {

/// A PSF that varies over an image, as PSFEx writes it (Bertin 2011, ASP Conf. 442, 435; table
/// PSF_DATA of a .psf file). The PSF at a place is the sum over components c of values[c] t_c. The
/// t_c are the monomials x^i y^j with i + j <= degree, i running fastest. x and y are the axes'
/// values less `zero`, divided by `scale`. Without axes there is one component.
struct PsfexFile {
  struct Axis {
    std::string name;  ///< "X_IMAGE" or "Y_IMAGE": FITS pixels
    double zero = 0;
    double scale = 1;
  };

  int width = 1, height = 1, components = 1;
  double sampling = 1;  ///< step of the PSF's samples, in image pixels
  int degree = 0;
  std::vector<Axis> axes;      ///< none or two
  std::vector<double> values;  ///< [component][y][x]
};

/// Reads a file; nothing where it has no table PSF_DATA. Throws InputError for sizes that are not
/// positive or too large, polynomials of several groups, axes other than X_IMAGE and Y_IMAGE, and
/// values that are not finite.
std::optional<PsfexFile> read_psfex_file(const std::filesystem::path& path);

}  // namespace gamer
