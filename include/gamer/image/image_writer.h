#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

enum class ImageLayout { cube, extensions, files };

struct OutputOptions {
  std::filesystem::path path;  ///< suffix decides: .fits, .fits.fz, .png, .bmp
  int bitpix = -32;            ///< -32 or -64
  ImageLayout layout = ImageLayout::cube;
  bool overwrite = false;
  /// A picture's PictureTone::numbers(); chosen from the picture itself where not given.
  std::optional<std::array<double, 8>> tone = {};
};

/// Takes rows in any order and leaves a complete file, or none: it writes beside the final name and
/// moves there in finish(). Destroyed before that, it removes what it wrote. For one thread.
class ImageWriter {
 public:
  virtual ~ImageWriter() = default;
  /// Rows [first, first + count): for each row, each plane, each x: values[(row * planes + plane) *
  /// width + x]. Throws RunError (disk full...).
  virtual void write_rows(int first, int count, std::span<const double> values) = 0;
  /// Adds cards to the first header of each file, before finish(). Pictures have none.
  virtual void add_cards(const std::vector<Card>& /*cards*/) {}
  /// Throws RunError, also when a row was never written or a file that may not be overwritten has
  /// appeared meanwhile.
  virtual void finish() = 0;
};

/// The files that `options` will make, in order of planes. One unless the layout is `files`.
std::vector<std::filesystem::path> output_files(const OutputOptions& options,
                                                const ImageHeader& header);

/// Throws InputError when the suffix is not one of those above.
void check_output_suffix(const OutputOptions& options);

/// Checks all that can be known before rendering and throws InputError: unknown suffix, folder that
/// does not exist or cannot be written or has too little space, a file that exists (unless
/// overwrite), labels that cannot be told apart, more files than can be open, a picture that is too
/// large for memory or (BMP) for its format. Leaves nothing behind.
void check_output(const OutputOptions& options, const ImageHeader& header);

/// Gives the first `first_planes` planes of each row to `first` and the others to `rest`, two
/// images of one width.
std::unique_ptr<ImageWriter> make_split_writer(std::unique_ptr<ImageWriter> first, int first_planes,
                                               std::unique_ptr<ImageWriter> rest, int planes,
                                               int width);

/// Makes the writer for the suffix, after check_output(). A picture is one file whatever the
/// layout.
std::unique_ptr<ImageWriter> make_image_writer(const OutputOptions& options,
                                               const ImageHeader& header);

}  // namespace gamer
