#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// The part of a stamp's description that differs from stamp to stamp.
struct StampHeader {
  int width = 1, height = 1;
  std::string name;                      ///< EXTNAME
  int version = 1;                       ///< EXTVER
  std::vector<std::string> wcs_records;  ///< of its world coordinates
  std::vector<Card> cards;
};

/// Takes the stamps of one FITS file in any order and leaves a complete file or none, as
/// ImageWriter does. An empty primary HDU has the cards. An image HDU for each stamp follows, with
/// all planes as in a cube. The tables come last. Pixels go to disk at once. One thread may use a
/// writer.
class StampWriter {
 public:
  virtual ~StampWriter() = default;
  /// Writes the values[(row * planes + plane) * width + x] of a stamp, each stamp once. Throws
  /// RunError.
  virtual void write(std::size_t stamp, std::span<const double> values) = 0;
  /// Adds cards to the primary header, before finish().
  virtual void add_cards(const std::vector<Card>& cards) = 0;
  /// Completes the file. Throws RunError, also when a stamp is missing.
  virtual void finish() = 0;
};

/// Makes the writer of `count` stamps. `describe` is called once for each stamp, in order. `header`
/// describes what stamps share; its size, axes and faces do not count. Throws RunError if the file
/// cannot be made.
std::unique_ptr<StampWriter> make_stamp_writer(
    const OutputOptions& options, const ImageHeader& header, std::size_t count,
    const std::function<StampHeader(std::size_t)>& describe);

/// Checks all that can be known beforehand, as check_output() does. `pixels` is the number of
/// pixels of all stamps in one plane. Throws InputError, also for another suffix than .fits.
void check_stamp_output(const OutputOptions& options, const ImageHeader& header, double pixels);

}  // namespace gamer
