#include "gamer/image/fits/fits.h"

#include <fmt/chrono.h>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "gamer/image/fits/fits_stream.h"
#include "image/fits/fits_cards.h"
#include "image/fits/fits_file.h"
#include "image/fits/image_hdu.h"
#include "image/image_suffix.h"
#include "image/memory.h"
#include "image/output_file.h"
#include "image/pixel_sum.h"
#include "image/temporary_file.h"
#include "image/write_file.h"

namespace gamer {
namespace {

// ---- Header ------------------------------------------------------------------------------------

/// Whether the header's cards are in an empty primary HDU.
bool has_empty_primary(const OutputOptions& options, const ImageHeader& header) {
  return options.layout == ImageLayout::extensions || !header.faces.empty();
}

bool writes_compressed(const OutputOptions& options) {
  return image_suffix(options.path) == ImageSuffix::fits_compressed;
}

/// Structure of one FITS file: its HDUs and their headers, but no pixels.
class FitsLayout {
 public:
  FitsLayout(const OutputOptions& options, ImageHeader header)
      : options_(options), header_(std::move(header)), common_(common_cards(header_.cards)) {
    header_.cards = without_common_cards(header_.cards);
  }

  const ImageHeader& header() const { return header_; }

  /// Place of the first pixel of a plane's row.
  struct Place {
    std::size_t file = 0;
    int hdu = 1;
    LONGLONG element = 1;
  };
  Place place(int plane, int row) const {
    const int face = row / face_height();
    const LONGLONG first = static_cast<LONGLONG>(row % face_height()) * header_.width + 1;
    // The empty primary HDU comes first.
    const int hdu = header_.faces.empty() ? 1 : face + 2;
    switch (options_.layout) {
      case ImageLayout::cube:
        return {0, hdu, static_cast<LONGLONG>(plane) * header_.width * face_height() + first};
      case ImageLayout::extensions: return {0, face * header_.planes() + plane + 2, first};
      case ImageLayout::files: return {static_cast<std::size_t>(plane), hdu, first};
      case ImageLayout::stamps: break;
    }
    throw std::invalid_argument("unknown image layout");
  }

  /// Number of faces, at least one.
  int faces() const { return std::max(1, static_cast<int>(header_.faces.size())); }
  int face_height() const { return header_.height / faces(); }

  /// Makes the HDUs of file number `index`. After each new HDU of planes, and before the next HDU,
  /// it calls `fill(face, first, count)`.
  template <class Fill>
  void make(FitsFile& file, int index, bool compressed, Fill fill) const {
    const bool extensions = options_.layout == ImageLayout::extensions;
    if (has_head() || compressed) {
      file.call(fits_create_img, BYTE_IMG, 0, nullptr);
      std::vector<Card> cards = common_;
      if (has_head()) cards.insert(cards.end(), header_.cards.begin(), header_.cards.end());
      write_cards(file, cards);
    }
    if (compressed) {
      file.call(fits_set_compression_type, GZIP_2);
      // Level 0 switches quantisation off.
      file.call(fits_set_quantize_level, 0.0F);
    }
    const bool cube = options_.layout == ImageLayout::cube;
    const int first = cube || extensions ? 0 : index;
    const int last = cube || extensions ? header_.planes() : index + 1;
    const int step = cube ? last - first : 1;
    for (int face = 0; face < faces(); ++face) {
      for (int plane = first; plane < last; plane += step) {
        LONGLONG sizes[] = {header_.width, face_height(), step};
        file.call(fits_create_imgll, options_.bitpix, step > 1 ? 3 : 2, sizes);
        write_image_header(file, header_, hdu_of(face, plane, step));
        if (!compressed) {
          reserve_checksum(file);
          file.reserve_data();
        }
        fill(face, plane, step);
      }
    }
    for (const DataTable& table : header_.data_tables) write_data_table(file, table, common_);
    for (const TextTable& table : header_.tables) write_text_table(file, table, common_);
  }

 private:
  bool has_head() const { return has_empty_primary(options_, header_); }

  /// EXTNAME of the HDU with the planes from `first` on; empty for none.
  std::string name_of(const ImageFace* face, int first) const {
    if (options_.layout == ImageLayout::cube) return face != nullptr ? face->label : "";
    return face != nullptr ? face->label + "_" + header_.labels[first] : header_.labels[first];
  }

  /// The content of the header of the HDU with the planes [first, first + count).
  ImageHdu hdu_of(int face_number, int first, int count) const {
    ImageHdu hdu{{}, common_, nullptr, first, count, {}};
    if (!header_.faces.empty()) hdu.face = &header_.faces[face_number];
    if (const std::string name = name_of(hdu.face, first); !name.empty()) {
      hdu.names.push_back({"EXTNAME", name, ""});
    }
    if (!has_head()) hdu.more = header_.cards;
    return hdu;
  }

  OutputOptions options_;
  ImageHeader header_;
  std::vector<Card> common_;
};

// ---- Writer ------------------------------------------------------------------------------------

class FitsWriter final : public ImageWriter {
 public:
  FitsWriter(const OutputOptions& options, const ImageHeader& header)
      : options_(options),
        layout_(options, header),
        width_(header.width),
        height_(header.height),
        planes_(header.planes()),
        sums_(static_cast<std::size_t>(header.planes()) *
              static_cast<std::size_t>(layout_.faces())),
        written_(static_cast<std::size_t>(header.height)) {
    const auto is_per_plane = [this](std::size_t size) {
      return size == 0 || size == static_cast<std::size_t>(planes_);
    };
    if (!is_per_plane(header.wavelengths.size()) || !is_per_plane(header.plane_units.size()) ||
        !is_per_plane(header.plane_cards.size())) {
      throw std::invalid_argument(
          "FITS writer: wavelengths, units or cards of planes and labels differ in number");
    }
    for (const auto& path : output_files(options, header)) {
      outputs_.push_back(std::make_unique<Output>(path));
      layout_.make(outputs_.back()->file, static_cast<int>(outputs_.size()) - 1, false,
                   [](int, int, int) {});
    }
  }

  void write_rows(int first, int count, std::span<const double> values) override {
    const auto width = static_cast<std::size_t>(width_);
    if (first < 0 || count < 0 || first > height_ - count ||
        values.size() != static_cast<std::size_t>(count) * planes_ * width) {
      throw std::invalid_argument("FITS writer: rows outside the image");
    }
    const auto begin = written_.begin() + first;
    has_rewritten_ = has_rewritten_ || std::find(begin, begin + count, true) != begin + count;
    for (int plane = 0; plane < planes_; ++plane) {
      if (options_.bitpix == FLOAT_IMG) {
        write_plane(plane, first, count, values, floats_);
      } else {
        write_plane(plane, first, count, values, doubles_);
      }
    }
    std::fill_n(begin, count, true);
  }

  void add_cards(const std::vector<Card>& cards) override {
    more_cards_.insert(more_cards_.end(), cards.begin(), cards.end());
  }

  void finish() override {
    check_all_written(written_, options_.path, "row", 0);
    if (writes_compressed(options_)) compress();
    for (auto& output : outputs_) {
      const int hdus = output->file.hdu_count();
      for (int hdu = 1; hdu <= hdus; ++hdu) {
        output->file.move_to(hdu);
        if (hdu == 1) write_cards(output->file, more_cards_);
        write_checksum(output->file, data_sum(output.get(), hdu));
      }
      output->file.close();
    }
    for (auto& output : outputs_) output->place.deliver(options_.overwrite);
  }

 private:
  /// One unfinished file.
  struct Output {
    explicit Output(const std::filesystem::path& name)
        : place(name), file(FitsFile::create(place.path(), place.label())) {}

    OutputFile place;
    FitsFile file;
  };

  /// Writes one plane of the rows. Rows of zeros are skipped, since unwritten parts of a file are
  /// zero; a mostly empty image thus costs little.
  template <class Value>
  void write_plane(int plane, int first, int count, std::span<const double> values,
                   std::vector<Value>& row) {
    using Bits =
        std::conditional_t<sizeof(Value) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;
    const auto width = static_cast<std::size_t>(width_);
    FitsFile& file = outputs_[layout_.place(plane, first).file]->file;
    row.resize(width);
    int current = 0;
    for (int y = 0; y < count; ++y) {
      const double* from = values.data() + (static_cast<std::size_t>(y) * planes_ + plane) * width;
      Bits any = 0;
      for (std::size_t x = 0; x < width; ++x) {
        row[x] = static_cast<Value>(from[x]);
        any |= std::bit_cast<Bits>(row[x]);
      }
      if (any == 0 && !written_[first + y]) continue;
      const FitsLayout::Place place = layout_.place(plane, first + y);
      sum_of(plane, (first + y) / layout_.face_height()).add(row.data(), width);
      if (place.hdu != current) file.move_to(place.hdu);
      current = place.hdu;
      if constexpr (sizeof(Value) == sizeof(float)) {
        file.call(fits_write_img_flt, 1L, place.element, LONGLONG{width_}, row.data());
      } else {
        file.call(fits_write_img_dbl, 1L, place.element, LONGLONG{width_}, row.data());
      }
    }
  }

  PixelSum& sum_of(int plane, int face) { return sums_[plane * layout_.faces() + face]; }

  /// The checksum of an HDU's pixels, if known.
  std::optional<std::uint32_t> data_sum(const Output* output, int hdu) {
    PixelSum sum;
    bool is_image = false;
    for (int plane = 0; plane < planes_; ++plane) {
      for (int face = 0; face < layout_.faces(); ++face) {
        const FitsLayout::Place place = layout_.place(plane, face * layout_.face_height());
        if (outputs_[place.file].get() != output || place.hdu != hdu) continue;
        is_image = true;
        sum.add(sum_of(plane, face));
      }
    }
    if (!is_image || writes_compressed(options_) || has_rewritten_) return std::nullopt;
    return sum.value();
  }

  /// Replaces the plain files by compressed files. This waits for all rows, so that the bytes do
  /// not depend on the rows' order. It does not use CFITSIO's fits_img_compress(), which turns
  /// infinity into NaN and the smallest numbers into 0 (4.2).
  void compress() {
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      FitsFile& plain = outputs_[i]->file;
      auto packed = std::make_unique<Output>(outputs_[i]->place.label());
      std::vector<double> row(static_cast<std::size_t>(width_));
      const auto fill = [&](int face, int first_plane, int count) {
        const int first_row = face * layout_.face_height();
        LONGLONG to = 1;
        for (int plane = first_plane; plane < first_plane + count; ++plane) {
          plain.move_to(layout_.place(plane, first_row).hdu);
          for (int y = 0; y < layout_.face_height(); ++y, to += width_) {
            constexpr double keep_all = 0;
            plain.call(fits_read_img_dbl, 1L, layout_.place(plane, first_row + y).element,
                       LONGLONG{width_}, keep_all, row.data(), nullptr);
            packed->file.call(fits_write_img_dbl, 1L, to, LONGLONG{width_}, row.data());
          }
        }
      };
      layout_.make(packed->file, static_cast<int>(i), true, fill);
      outputs_[i] = std::move(packed);
    }
  }

  OutputOptions options_;
  FitsLayout layout_;
  int width_, height_, planes_;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<PixelSum> sums_;   ///< [plane][face]
  bool has_rewritten_ = false;   ///< whether rows came twice, which spoils the sums
  std::vector<float> floats_;    ///< a row
  std::vector<double> doubles_;  ///< a row
  std::vector<bool> written_;
  std::vector<Card> more_cards_;
};

}  // namespace

std::unique_ptr<ImageWriter> make_fits_writer(const OutputOptions& options,
                                              const ImageHeader& header) {
  return std::make_unique<FitsWriter>(options, header);
}

int fits_hdus(const OutputOptions& options, const ImageHeader& header) {
  const auto tables = static_cast<int>(header.tables.size() + header.data_tables.size());
  // The map is a table after an empty primary HDU.
  if (header.healpix) return 2 + tables;
  const int empty = has_empty_primary(options, header) || writes_compressed(options) ? 1 : 0;
  const int faces = std::max(1, static_cast<int>(header.faces.size()));
  const int images = options.layout == ImageLayout::extensions ? header.planes() : 1;
  return empty + faces * images + tables;
}

std::string fits_date() {
  std::time_t seconds = std::time(nullptr);
  if (const char* text = std::getenv("SOURCE_DATE_EPOCH")) {
    std::from_chars(text, text + std::strlen(text), seconds);
  }
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(seconds));
}

void write_fits_table(const std::filesystem::path& path, const DataTable& table,
                      const std::vector<Card>& cards) {
  TemporaryFile temporary(path);
  FitsFile file = FitsFile::create(temporary.path(), path.string());
  const std::vector<Card> common = common_cards(cards);
  file.call(fits_create_img, BYTE_IMG, 0, nullptr);
  write_cards(file, common);
  write_data_table(file, table, common);
  for (int hdu = 1; hdu <= 2; ++hdu) {
    file.move_to(hdu);
    write_checksum(file);
  }
  file.close();
  temporary.move_to_final(true);
}

FitsImage read_fits(const std::filesystem::path& path) {
  const FitsInput input(path.string());
  FitsFile file = FitsFile::open(path, path.string());
  FitsImage result;
  const FitsHdu* first = nullptr;
  int planes = 0;
  for (const FitsHdu& hdu : input.hdus()) {
    file.move_to(hdu.number + 1);
    if (hdu.is_image()) {
      if (first == nullptr) {
        first = &hdu;
        for (Card& card : read_cards(file)) {
          const bool known = std::ranges::any_of(result.cards, [&](const Card& other) {
            return is_common_card(card.key) && other.key == card.key;
          });
          if (!known) result.cards.push_back(std::move(card));
        }
      } else if (hdu.width != first->width || hdu.height != first->height) {
        file.fail(fmt::format("images of different size: {} x {} and, in HDU {}, {} x {}",
                              first->width, first->height, hdu.number, hdu.width, hdu.height));
      }
      planes += hdu.planes;
    } else if (hdu.number == 0) {
      result.cards = read_cards(file);
    } else if (is_text_table(file)) {
      result.tables.push_back(read_text_table(file));
    }
  }
  if (first == nullptr) file.fail("no image in it");

  const double bytes = static_cast<double>(first->width) * first->height * planes * sizeof(double);
  if (const std::uint64_t available = available_memory(); bytes > static_cast<double>(available)) {
    file.fail(fmt::format("{} x {} x {} pixels need {} of memory, {} is available", first->width,
                          first->height, planes, bytes_text(static_cast<std::uint64_t>(bytes)),
                          bytes_text(available)));
  }
  result.image = Image(first->width, first->height, planes);
  int next = 0;
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    for (int plane = 0; plane < input.hdus()[i].planes; ++plane, ++next) {
      const PlanePtr source = input.plane(i, plane);
      source->read(source->whole(), result.image.plane(next));
    }
  }
  return result;
}

TextTable read_fits_table(const std::filesystem::path& path, const std::string& name) {
  FitsFile file = FitsFile::open(path, path.string());
  const int hdus = file.hdu_count();
  for (int hdu = 2; hdu <= hdus; ++hdu) {
    file.move_to(hdu);
    if (file.text("EXTNAME") != name || !is_text_table(file)) continue;
    file.check_sums();
    return read_text_table(file);
  }
  file.fail(fmt::format("no table '{}' in it", name));
}

}  // namespace gamer
