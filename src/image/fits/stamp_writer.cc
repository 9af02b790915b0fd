#include "gamer/image/stamp_writer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "image/fits/fits_cards.h"
#include "image/fits/image_hdu.h"
#include "image/image_suffix.h"
#include "image/pixel_sum.h"
#include "image/temporary_file.h"
#include "image/write_file.h"

namespace gamer {
namespace {

class FitsStampWriter final : public StampWriter {
 public:
  FitsStampWriter(const OutputOptions& options, const ImageHeader& header, std::size_t count,
                  const std::function<StampHeader(std::size_t)>& describe)
      : options_(options),
        planes_(header.planes()),
        temporary_(options.path),
        file_(FitsFile::create(temporary_.path(), options.path.string())),
        sizes_(count),
        written_(count, false) {
    const std::vector<Card> common = common_cards(header.cards);
    std::vector<Card> first = common;
    const std::vector<Card> others = without_common_cards(header.cards);
    first.insert(first.end(), others.begin(), others.end());
    file_.call(fits_create_img, BYTE_IMG, 0, nullptr);
    write_cards(file_, first);
    for (std::size_t i = 0; i < count; ++i) begin_stamp(header, common, describe(i), sizes_[i]);
    for (const DataTable& table : header.data_tables) write_data_table(file_, table, common);
    for (const TextTable& table : header.tables) write_text_table(file_, table, common);
  }

  void write(std::size_t stamp, std::span<const double> values) override {
    const auto [width, height] = sizes_.at(stamp);
    const std::size_t size = static_cast<std::size_t>(width) * height * planes_;
    if (values.size() != size || written_[stamp]) {
      throw std::invalid_argument("FITS writer: a stamp of another size, or twice");
    }
    file_.move_to(static_cast<int>(stamp) + 2);
    if (options_.bitpix == FLOAT_IMG) {
      write_pixels(width, height, values, floats_, fits_write_img_flt);
    } else {
      write_pixels(width, height, values, doubles_, fits_write_img_dbl);
    }
    written_[stamp] = true;
  }

  void add_cards(const std::vector<Card>& cards) override {
    more_cards_.insert(more_cards_.end(), cards.begin(), cards.end());
  }

  void finish() override {
    check_all_written(written_, options_.path, "stamp", 1);
    const int hdus = file_.hdu_count();
    for (int hdu = static_cast<int>(sizes_.size()) + 2; hdu <= hdus; ++hdu) {
      file_.move_to(hdu);
      write_checksum(file_);
    }
    file_.move_to(1);
    write_cards(file_, more_cards_);
    write_checksum(file_);
    file_.close();
    temporary_.move_to_final(options_.overwrite);
  }

 private:
  void begin_stamp(const ImageHeader& shared, const std::vector<Card>& common,
                   const StampHeader& stamp, std::pair<int, int>& size) {
    size = {stamp.width, stamp.height};
    ImageHeader header;
    header.unit = shared.unit;
    header.wavelengths = shared.wavelengths;
    header.labels = shared.labels;
    header.plane_cards = shared.plane_cards;
    header.wcs_records = stamp.wcs_records;
    LONGLONG sizes[] = {stamp.width, stamp.height, planes_};
    file_.call(fits_create_imgll, options_.bitpix, planes_ > 1 ? 3 : 2, sizes);
    write_image_header(
        file_, header,
        {{{"EXTNAME", stamp.name, ""}, {"EXTVER", static_cast<long long>(stamp.version), ""}},
         common,
         nullptr,
         0,
         planes_,
         stamp.cards});
    reserve_checksum(file_);
    file_.reserve_data();
  }

  template <class Value, class Write>
  void write_pixels(int width, int height, std::span<const double> values,
                    std::vector<Value>& pixels, Write function) {
    pixels.resize(values.size());
    const auto columns = static_cast<std::size_t>(width);
    for (int row = 0; row < height; ++row) {
      for (int plane = 0; plane < planes_; ++plane) {
        const std::size_t from = static_cast<std::size_t>(row) * planes_ + plane;
        const std::size_t to = static_cast<std::size_t>(plane) * height + row;
        std::transform(values.begin() + static_cast<std::ptrdiff_t>(from * columns),
                       values.begin() + static_cast<std::ptrdiff_t>((from + 1) * columns),
                       pixels.begin() + static_cast<std::ptrdiff_t>(to * columns),
                       [](double value) { return static_cast<Value>(value); });
      }
    }
    PixelSum sum;
    sum.add(pixels.data(), pixels.size());
    file_.call(function, 1L, LONGLONG{1}, static_cast<LONGLONG>(pixels.size()), pixels.data());
    write_checksum(file_, sum.value());
  }

  OutputOptions options_;
  int planes_;
  TemporaryFile temporary_;
  FitsFile file_;
  std::vector<std::pair<int, int>> sizes_;  ///< width and height, by stamp
  std::vector<bool> written_;
  std::vector<float> floats_;    ///< a stamp
  std::vector<double> doubles_;  ///< a stamp
  std::vector<Card> more_cards_;
};

}  // namespace

std::unique_ptr<StampWriter> make_stamp_writer(
    const OutputOptions& options, const ImageHeader& header, std::size_t count,
    const std::function<StampHeader(std::size_t)>& describe) {
  return std::make_unique<FitsStampWriter>(options, header, count, describe);
}

void check_stamp_output(const OutputOptions& options, const ImageHeader& header, double pixels) {
  check_output_suffix(options);
  if (image_suffix(options.path) != ImageSuffix::fits) {
    throw input_error("output '{}': stamps are written to a .fits file", options.path.string());
  }
  // The space on disk is that of an image with as many pixels.
  ImageHeader whole = header;
  constexpr int columns = 1 << 15;
  whole.width = columns;
  whole.height = static_cast<int>(std::min(std::ceil(pixels / columns), 1e9));
  check_output(options, whole);
}

}  // namespace gamer
