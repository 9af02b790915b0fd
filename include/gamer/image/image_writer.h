#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/picture_style.h"

namespace gamer {

enum class ImageLayout {
  cube,
  extensions,
  files,
  stamps  ///< a cube for each object; see StampWriter
};

struct OutputOptions {
  std::filesystem::path path;  ///< its suffix selects the format: .fits, .fits.fz, .png, .bmp
  int bitpix = -32;            ///< -32 or -64
  ImageLayout layout = ImageLayout::cube;
  bool overwrite = false;
  /// PictureTone::numbers() of a picture; if none, the picture's own tone.
  std::optional<std::array<double, 8>> tone = {};
  PictureStyle style = {};
};

/// A writer takes rows in any order, and leaves a complete file or none. The file is written beside
/// its final name and renamed in finish(); a writer destroyed earlier removes it. One thread may
/// use a writer.
class ImageWriter {
 public:
  virtual ~ImageWriter() = default;
  /// Writes rows [first, first + count): values[(row * planes + plane) * width + x], with row
  /// counted from `first`. Throws RunError (disk full...).
  virtual void write_rows(int first, int count, std::span<const double> values) = 0;
  /// Adds cards to the first header of each file, before finish(). Pictures have none.
  virtual void add_cards(const std::vector<Card>& /*cards*/) {}
  /// Completes the file. Throws RunError, also when a row is missing or a file that must not be
  /// overwritten has appeared.
  virtual void finish() = 0;
};

/// The files that `options` will make: one per plane in layout `files`, otherwise one.
std::vector<std::filesystem::path> output_files(const OutputOptions& options,
                                                const ImageHeader& header);

/// Throws InputError when the suffix of OutputOptions::path is not one of those listed there.
void check_output_suffix(const OutputOptions& options);

/// Checks everything that can be known before rendering and leaves nothing behind. Throws
/// InputError for an unknown suffix, an existing file (unless overwrite), equal labels and more
/// files than can be open. Other errors are a folder that is missing, not writable or too full, and
/// a picture too large for memory or (BMP) for its format.
void check_output(const OutputOptions& options, const ImageHeader& header);

/// A writer that passes the first `first_planes` planes of each row to `first` and the others to
/// `rest`, two images of equal width.
std::unique_ptr<ImageWriter> make_split_writer(std::unique_ptr<ImageWriter> first, int first_planes,
                                               std::unique_ptr<ImageWriter> rest, int planes,
                                               int width);

/// Makes the writer for the suffix; call check_output() before. A picture is one file in any
/// layout.
std::unique_ptr<ImageWriter> make_image_writer(const OutputOptions& options,
                                               const ImageHeader& header);

}  // namespace gamer
