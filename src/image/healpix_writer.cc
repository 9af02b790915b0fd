#include "image/healpix_writer.h"

#include <chealpix.h>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "image/fits/fits_cards.h"
#include "image/fits/fits_file.h"
#include "image/output_file.h"
#include "image/write_file.h"

namespace gamer {
namespace {

constexpr std::int64_t base_pixels = 12;
/// Table rows written at a time.
constexpr std::int64_t rows_at_once = std::int64_t{1} << 16;

/// Every second bit, from the lowest on, packed together.
int even_bits(std::uint64_t bits) {
  bits &= 0x5555555555555555;
  bits = (bits | bits >> 1) & 0x3333333333333333;
  bits = (bits | bits >> 2) & 0x0F0F0F0F0F0F0F0F;
  bits = (bits | bits >> 4) & 0x00FF00FF00FF00FF;
  bits = (bits | bits >> 8) & 0x0000FFFF0000FFFF;
  bits = (bits | bits >> 16) & 0x00000000FFFFFFFF;
  return static_cast<int>(bits);
}

template <class Value>
class HealpixWriter final : public ImageWriter {
 public:
  HealpixWriter(const OutputOptions& options, const ImageHeader& header)
      : options_(options),
        header_(header),
        place_(options.path),
        file_(FitsFile::create(place_.path(), place_.label())),
        row_size_(static_cast<std::size_t>(header.width) *
                  static_cast<std::size_t>(header.planes())),
        values_(row_size_ * static_cast<std::size_t>(header.height)),
        written_(static_cast<std::size_t>(header.height)) {
    if (header.width != header.healpix->nside || header.height != base_pixels * header.width) {
      throw std::invalid_argument("HEALPix writer: not nside x 12 nside pixels");
    }
  }

  void write_rows(int first, int count, std::span<const double> values) override {
    if (first < 0 || count < 0 || first > header_.height - count ||
        values.size() != static_cast<std::size_t>(count) * row_size_) {
      throw std::invalid_argument("HEALPix writer: rows outside the map");
    }
    std::transform(values.begin(), values.end(),
                   values_.begin() + static_cast<std::ptrdiff_t>(first * row_size_),
                   [](double value) { return static_cast<Value>(value); });
    std::fill_n(written_.begin() + first, count, true);
  }

  void add_cards(const std::vector<Card>& cards) override {
    header_.cards.insert(header_.cards.end(), cards.begin(), cards.end());
  }

  void finish() override {
    check_all_written(written_, options_.path, "row", 0);
    const std::vector<Card> common = common_cards(header_.cards);
    file_.call(fits_create_img, BYTE_IMG, 0, nullptr);
    write_cards(file_, common);
    write_map(common);
    for (const DataTable& table : header_.data_tables) write_data_table(file_, table, common);
    for (const TextTable& table : header_.tables) write_text_table(file_, table, common);
    const int hdus = file_.hdu_count();
    for (int hdu = 1; hdu <= hdus; ++hdu) {
      file_.move_to(hdu);
      write_checksum(file_);
    }
    file_.close();
    place_.deliver(options_.overwrite);
  }

 private:
  static constexpr bool is_single = std::is_same_v<Value, float>;

  void write_map(const std::vector<Card>& common) {
    const HealpixHeader& map = *header_.healpix;
    const std::int64_t pixels = base_pixels * map.nside * map.nside;
    const auto planes = static_cast<std::size_t>(header_.planes());
    std::vector<std::string> labels = header_.labels, units;
    for (std::size_t p = 0; p < planes; ++p) {
      const bool has_own = !header_.plane_units.empty() && !header_.plane_units[p].empty();
      units.push_back(has_own ? header_.plane_units[p] : header_.unit);
    }
    std::string form = is_single ? "1E" : "1D";
    std::vector<char*> names, forms(planes, form.data()), unit_names;
    for (std::string& label : labels) names.push_back(label.data());
    for (std::string& unit : units) unit_names.push_back(unit.data());
    file_.call(fits_create_tbl, BINARY_TBL, static_cast<LONGLONG>(pixels), static_cast<int>(planes),
               names.data(), forms.data(), unit_names.data(), "HEALPIX");
    write_cards(file_, common);
    std::vector<Card> cards = {
        {"PIXTYPE", std::string("HEALPIX"), "pixels of one area"},
        {"ORDERING", std::string(map.is_nested ? "NESTED" : "RING"), "order of the pixels"},
        {"NSIDE", static_cast<long long>(map.nside), "pixels on a side of a base pixel"},
        {"FIRSTPIX", 0LL, "number of the first pixel"},
        {"LASTPIX", static_cast<long long>(pixels - 1), "and of the last"},
        {"INDXSCHM", std::string("IMPLICIT"), "the row is the pixel's number"},
        {"OBJECT", std::string("FULLSKY"), "the whole sphere"},
        {"COORDSYS", std::string(1, map.frame), "G galactic, C equatorial, E ecliptic"}};
    append_plane_cards(cards, header_, 0, header_.planes());
    const std::vector<Card> more = without_common_cards(header_.cards);
    cards.insert(cards.end(), more.begin(), more.end());
    write_cards(file_, cards);

    std::vector<std::size_t> places;
    std::vector<Value> column;
    for (std::int64_t first = 0; first < pixels; first += rows_at_once) {
      const std::int64_t count = std::min(rows_at_once, pixels - first);
      places.clear();
      for (std::int64_t pixel = first; pixel < first + count; ++pixel) {
        const HealpixPlace place = healpix_place(map.nside, map.is_nested, pixel);
        places.push_back(static_cast<std::size_t>(place.y) * row_size_ +
                         static_cast<std::size_t>(place.x));
      }
      for (std::size_t p = 0; p < planes; ++p) {
        column.clear();
        for (const std::size_t place : places) {
          column.push_back(values_[place + p * static_cast<std::size_t>(map.nside)]);
        }
        if constexpr (is_single) {
          file_.call(fits_write_col_flt, static_cast<int>(p) + 1, static_cast<LONGLONG>(first + 1),
                     LONGLONG{1}, static_cast<LONGLONG>(count), column.data());
        } else {
          file_.call(fits_write_col_dbl, static_cast<int>(p) + 1, static_cast<LONGLONG>(first + 1),
                     LONGLONG{1}, static_cast<LONGLONG>(count), column.data());
        }
      }
    }
  }

  OutputOptions options_;
  ImageHeader header_;
  OutputFile place_;
  FitsFile file_;
  std::size_t row_size_;
  std::vector<Value> values_;  ///< [row][plane][x]
  std::vector<bool> written_;
};

}  // namespace

HealpixPlace healpix_place(int nside, bool is_nested, std::int64_t pixel) {
  std::int64_t nested = pixel;
  if (!is_nested) ring2nest64(nside, pixel, &nested);
  const std::int64_t face_pixels = static_cast<std::int64_t>(nside) * nside;
  const auto within = static_cast<std::uint64_t>(nested % face_pixels);
  return {even_bits(within),
          static_cast<int>(nested / face_pixels) * nside + even_bits(within >> 1)};
}

std::uint64_t healpix_memory(const OutputOptions& options, const ImageHeader& header) {
  return static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height) *
         static_cast<std::uint64_t>(header.planes()) * (options.bitpix == -64 ? 8 : 4);
}

std::unique_ptr<ImageWriter> make_healpix_writer(const OutputOptions& options,
                                                 const ImageHeader& header) {
  if (options.bitpix == -64) return std::make_unique<HealpixWriter<double>>(options, header);
  return std::make_unique<HealpixWriter<float>>(options, header);
}

}  // namespace gamer
