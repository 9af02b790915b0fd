#include "gamer/image/fits/fits_stream.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <climits>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/new_file.h"
#include "image/fits/card_record.h"
#include "image/fits/fits_cards.h"
#include "image/fits/fits_file.h"
#include "image/fits/fits_scan.h"
#include "image/fits/fits_tiles.h"
#include "image/image_suffix.h"
#include "image/output_file.h"
#include "image/pixel_sum.h"
#include "image/standard_stream.h"
#include "image/temporary_file.h"
#include "image/wavelength_axis.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Pixels converted at a time: 64 KiB of floats.
constexpr std::size_t piece_size = std::size_t{1} << 14;

using CFile = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// Reads the sizes of the current HDU's image; planes = 0 where there is none.
void read_shape(FitsFile& file, FitsHdu& hdu) {
  int type = 0, axes = 0;
  file.call(fits_get_hdu_type, &type);
  file.check_data(0);
  // CFITSIO presents a compressed image as an image, other readers as a table.
  const bool compressed = file.has_compressed_image();
  if (type != IMAGE_HDU && !compressed) return;
  file.call(fits_get_img_dim, &axes);
  if (axes < 2) return;
  std::vector<LONGLONG> sizes(axes);
  file.call(fits_get_img_sizell, axes, sizes.data());
  LONGLONG planes = 1;
  for (int axis = 0; axis < axes; ++axis) {
    if (sizes[axis] <= 0) return;
    LONGLONG& count = axis < 2 ? sizes[axis] : planes;
    if (axis >= 2 && sizes[axis] > INT_MAX / planes) count = LONGLONG{INT_MAX} + 1;
    if (axis >= 2 && count <= INT_MAX) count *= sizes[axis];
    if (count > INT_MAX) {
      file.fail(fmt::format("HDU {}: axis {} of {} pixels is too long", hdu.number, axis + 1,
                            sizes[axis]));
    }
  }
  int stored = 0;
  file.call(fits_get_img_type, &stored);
  if (!compressed) {
    constexpr double bits_per_byte = 8;
    file.check_data(static_cast<double>(sizes[0]) * static_cast<double>(sizes[1]) *
                    static_cast<double>(planes) * std::abs(stored) / bits_per_byte);
  }
  file.call(fits_get_img_equivtype, &hdu.bitpix);
  hdu.has_integers = stored > 0;
  hdu.further_axes.assign(sizes.begin() + 2, sizes.end());
  if (compressed) check_tiles(file, hdu.number, stored, sizes);
  hdu.width = static_cast<int>(sizes[0]);
  hdu.height = static_cast<int>(sizes[1]);
  hdu.planes = static_cast<int>(planes);
}

std::string hdu_name(FitsFile& file) {
  char name[FLEN_VALUE] = {};
  int status = 0;
  fits_read_key_str(file.handle(), "EXTNAME", name, nullptr, &status);
  fits_clear_errmsg();
  // CFITSIO's name of compressed images without a name.
  return std::string_view(name) == "COMPRESSED_IMAGE" ? "" : name;
}

FitsHdu read_hdu(FitsFile& file, int number) {
  FitsHdu hdu;
  hdu.number = number - 1;
  hdu.name = hdu_name(file);
  read_shape(file, hdu);
  std::vector<std::string> records;
  bool keep = false;
  for (const std::string& record : read_records(file)) {
    if (!is_continuation(record)) {
      keep = !is_layout_record(record);
      if (record_key(record) == "EXTNAME" && hdu.name.empty()) keep = false;
    }
    if (keep) records.push_back(record);
  }
  hdu.header = FitsHeader(std::move(records));
  return hdu;
}

/// Fails for sections that renumber planes, since the header refers to planes by number.
void check_section(const std::string& name) {
  const std::string last = name.substr(name.rfind('[') + 1);
  std::size_t comma = last.find(',');
  if (comma != std::string::npos) comma = last.find(',', comma + 1);
  if (comma == std::string::npos) return;
  const std::size_t first = last.find_first_not_of(' ', comma + 1);
  if (first != std::string::npos && last[first] == '*') return;
  throw input_error(
      "{}: a section of the third axis; write * there, and take planes with gutil stack --planes",
      name);
}

bool exists(const std::string& name) {
  std::error_code error;
  return fs::exists(name, error);
}

}  // namespace

// ---- Input -------------------------------------------------------------------------------------

class FitsInput::File {
 public:
  explicit File(const std::string& name)
      : name_(name == standard_stream ? "standard input" : name) {
    file_.emplace(open(name));
    int first = 1, last = file_->hdu_count();
    if (is_extended_) {
      fits_get_hdu_num(file_->handle(), &first);
      last = first;
    }
    for (int number = first; number <= last; ++number) {
      file_->move_to(number);
      hdus_.push_back(read_hdu(*file_, number));
    }
    if (is_extended_) add_coordinate_table();
  }

  const std::string& name() const { return name_; }
  const std::vector<FitsHdu>& hdus() const { return hdus_; }

  /// The file with that HDU current, for copies; not to be used while planes are read.
  FitsFile& at(std::size_t hdu) {
    file_->move_to(hdus_[hdu].number + 1);
    return *file_;
  }

  void read(const FitsHdu& hdu, int plane, const Area& area, double* out, std::ptrdiff_t stride) {
    const bool whole_rows = area.width == hdu.width;
    const std::lock_guard lock(mutex_);
    file_->move_to(hdu.number + 1);
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    if (whole_rows && stride == area.width && hdu.bitpix == FLOAT_IMG) {
      read_floats(hdu, plane, area.y, count, out);
    } else if (whole_rows && stride == area.width) {
      read_pixels(hdu, plane, 0, area.y, count, TDOUBLE, out);
    } else if (file_->has_compressed_image() && !whole_rows) {
      read_from_rows(hdu, plane, area, out, stride);
    } else {
      for (int row = 0; row < area.height; ++row) {
        read_pixels(hdu, plane, area.x, area.y + row, static_cast<std::size_t>(area.width), TDOUBLE,
                    out + row * stride);
      }
    }
  }

 private:
  FitsFile open(const std::string& name) {
    if (name == standard_stream) return open_standard_input();
    if (exists(name)) {
      if (std::error_code error; fs::is_directory(name, error)) {
        throw input_error("{}: is a folder", name);
      }
      return FitsFile::open(name, name);
    }
    const std::size_t bracket = name.find('[');
    if (bracket == std::string::npos || !exists(name.substr(0, bracket))) {
      throw input_error("{}: no such file", name.substr(0, bracket));
    }
    check_section(name);
    is_extended_ = true;
    return FitsFile::open_extended(name);
  }

  FitsFile open_standard_input() {
    std::array<char, fits_beginning> start{};
    const std::size_t count = std::fread(start.data(), 1, start.size(), stdin);
    if (!begins_as_fits({start.data(), count})) throw input_error("{}: is no FITS file", name_);
    spool_.emplace();
    {
      const CFile copy(std::fopen(spool_->path().c_str(), "wb"), &std::fclose);
      if (!copy || std::fwrite(start.data(), 1, count, copy.get()) != count) {
        throw run_error("{}: {}", name_, std::strerror(errno));
      }
      copy_bytes(stdin, copy.get(), name_);
    }
    return FitsFile::open(spool_->path(), name_);
  }

  /// Adds the table that holds the coordinates of an axis, which the axis requires.
  void add_coordinate_table() {
    const std::optional<std::string> wanted = hdus_.front().header.text("PS3_0");
    const int count = wanted ? file_->hdu_count() : 0;
    for (int number = 1; number <= count; ++number) {
      if (number == hdus_.front().number + 1) continue;
      file_->move_to(number);
      if (hdu_name(*file_) == *wanted) hdus_.push_back(read_hdu(*file_, number));
    }
  }

  /// Reads whole rows. CFITSIO's own conversion to double is slower than reading pieces that stay
  /// in the cache.
  void read_floats(const FitsHdu& hdu, int plane, int y, std::size_t count, double* out) {
    std::array<float, piece_size> piece;
    LONGLONG first = (static_cast<LONGLONG>(plane) * hdu.height + y) * hdu.width + 1;
    for (std::size_t done = 0; done < count;) {
      const std::size_t size = std::min(piece.size(), count - done);
      read_consecutive(hdu, first, size, TFLOAT, piece.data());
      std::copy_n(piece.begin(), size, out + done);
      done += size;
      first += static_cast<LONGLONG>(size);
    }
  }

  void read_pixels(const FitsHdu& hdu, int plane, int x, int y, std::size_t count, int type,
                   void* out) {
    read_consecutive(hdu,
                     (static_cast<LONGLONG>(plane) * hdu.height + y) * hdu.width + x + LONGLONG{1},
                     count, type, out);
  }

  /// Reads consecutive pixels of the current HDU; `first` counts from 1.
  void read_consecutive(const FitsHdu& hdu, LONGLONG first, std::size_t count, int type,
                        void* out) {
    double blank = std::numeric_limits<double>::quiet_NaN();
    float float_blank = std::numeric_limits<float>::quiet_NaN();
    void* null = nullptr;
    // Floating-point numbers are read unchanged: if CFITSIO looked for blanks, it would also
    // replace infinities and subnormal numbers. Integers, and floating-point numbers that were
    // quantised, have a special value for "blank".
    if (hdu.has_integers || is_quantised()) {
      null = type == TFLOAT ? static_cast<void*>(&float_blank) : static_cast<void*>(&blank);
    }
    int any_blank = 0;
    file_->call(fits_read_img, type, first, static_cast<LONGLONG>(count), null, out, &any_blank);
  }

  bool is_quantised() {
    int status = 0;
    char value[FLEN_VALUE] = {};
    fits_read_key_str(file_->handle(), "ZQUANTIZ", value, nullptr, &status);
    fits_clear_errmsg();
    return status == 0 && std::string_view(value) != "NONE";
  }

  /// Reads an area of a compressed image. Its tiles are rows, and any part of a tile costs as much
  /// as the whole. The last rows read are kept in blocks for neighbouring areas, which are asked
  /// for next.
  void read_from_rows(const FitsHdu& hdu, int plane, const Area& area, double* out,
                      std::ptrdiff_t stride) {
    for (int row = 0; row < area.height; ++row) {
      const RowBlock& block = row_block(hdu, plane, area.y + row);
      const std::size_t from =
          static_cast<std::size_t>(area.y + row - block.first) * hdu.width + area.x;
      std::copy_n(block.values.data() + from, area.width, out + row * stride);
    }
  }

  struct RowBlock {
    int hdu = 0, plane = 0, first = 0, count = 0;
    std::vector<double> values;
  };

  const RowBlock& row_block(const FitsHdu& hdu, int plane, int row) {
    constexpr std::size_t most_values = std::size_t{1} << 25, block_count = 32;
    const auto found = std::ranges::find_if(blocks_, [&](const RowBlock& block) {
      return block.hdu == hdu.number && block.plane == plane && row >= block.first &&
             row < block.first + block.count;
    });
    if (found != blocks_.end()) {
      blocks_.splice(blocks_.begin(), blocks_, found);
      return blocks_.front();
    }
    const auto width = static_cast<std::size_t>(hdu.width);
    const auto rows = static_cast<int>(std::clamp<std::size_t>(
        most_values / block_count / width, 1, static_cast<std::size_t>(hdu.height)));
    const int first = row / rows * rows, count = std::min(rows, hdu.height - first);
    const std::size_t size = width * static_cast<std::size_t>(count);
    std::size_t kept = size;
    for (const RowBlock& block : blocks_) kept += block.values.size();
    while (!blocks_.empty() && kept > most_values) {
      kept -= blocks_.back().values.size();
      blocks_.pop_back();
    }
    RowBlock block = {hdu.number, plane, first, count, std::vector<double>(size)};
    read_pixels(hdu, plane, 0, first, size, TDOUBLE, block.values.data());
    blocks_.push_front(std::move(block));
    return blocks_.front();
  }

  std::string name_;
  std::optional<SpoolFile> spool_;
  bool is_extended_ = false;
  std::optional<FitsFile> file_;
  std::vector<FitsHdu> hdus_;
  std::mutex mutex_;

  std::list<RowBlock> blocks_;  ///< most recently used first
};

namespace {

class FitsPlane final : public Plane {
 public:
  FitsPlane(std::shared_ptr<FitsInput::File> file, const FitsHdu& hdu, int plane)
      : Plane(hdu.width, hdu.height), file_(std::move(file)), hdu_(hdu), plane_(plane) {}
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    file_->read(hdu_, plane_, area, out, stride);
  }

 private:
  std::shared_ptr<FitsInput::File> file_;
  const FitsHdu& hdu_;
  int plane_;
};

}  // namespace

FitsInput::FitsInput(const std::string& name) : file_(std::make_shared<File>(name)) {}

const std::string& FitsInput::name() const { return file_->name(); }

const std::vector<FitsHdu>& FitsInput::hdus() const { return file_->hdus(); }

PlanePtr FitsInput::plane(std::size_t hdu, int plane) const {
  return std::make_shared<FitsPlane>(file_, file_->hdus()[hdu], plane);
}

// ---- Output ------------------------------------------------------------------------------------

class FitsOutput::File {
 public:
  explicit File(const FitsOutputOptions& options) : options_(options) {
    const std::optional<ImageSuffix> suffix = image_suffix(options.name);
    if (suffix != ImageSuffix::fits && suffix != ImageSuffix::fits_compressed) {
      throw input_error("output {}: the name must end in .fits or .fits.fz",
                        in_quotes(options.name));
    }
    check_new_file(options.name, options.overwrite);
    compressed_ = suffix == ImageSuffix::fits_compressed;
    output_.emplace(options.name);
    file_.emplace(FitsFile::create(output_->path(), output_->label()));
  }

  void copy(const FitsInput& input, std::size_t hdu) {
    constexpr int no_room = 0;
    int status = 0;
    FitsFile& from = input.file()->at(hdu);
    constexpr bool with_fill = true;
    from.check_data(0, with_fill);
    fits_copy_hdu(from.handle(), file_->handle(), no_room, &status);
    if (status != 0) file_->call([status](fitsfile*, int* result) { *result = status; });
  }

  void copy(const FitsInput& input, std::size_t hdu, const FitsHeader& header) {
    copy(input, hdu);
    int count = 0;
    file_->call(fits_get_hdrspace, &count, nullptr);
    const std::vector<std::string> records = read_records(*file_);
    for (int number = count; number >= 1; --number) {
      const std::string& record = records[static_cast<std::size_t>(number) - 1];
      const bool is_name_of_compressed = record_key(record) == "EXTNAME" && !header.has("EXTNAME");
      if (is_layout_record(record) || is_name_of_compressed) continue;
      file_->call(fits_delete_record, number);
    }
    write_records(header);
  }

  void write_empty(FitsHeader header) {
    file_->call(fits_create_img, BYTE_IMG, 0, nullptr);
    header.set({"DATE", fits_date(), "time of writing (UTC)"});
    write_records(header);
  }

  void write(const FitsHeader& header, const std::vector<PlanePtr>& planes, int bitpix, int threads,
             const std::vector<long long>& further_axes) {
    const int width = planes.front()->width(), height = planes.front()->height();
    if (compressed_) {
      file_->call(fits_set_compression_type, GZIP_2);
      // Level 0 switches quantisation off.
      file_->call(fits_set_quantize_level, 0.0F);
    }
    std::vector<LONGLONG> sizes = {width, height};
    LONGLONG further = 1;
    for (const long long size : further_axes) further *= size;
    if (!further_axes.empty() && further == static_cast<LONGLONG>(planes.size())) {
      sizes.insert(sizes.end(), further_axes.begin(), further_axes.end());
    } else if (planes.size() > 1) {
      sizes.push_back(static_cast<LONGLONG>(planes.size()));
    }
    file_->call(fits_create_imgll, bitpix, static_cast<int>(sizes.size()), sizes.data());
    FitsHeader dated = header;
    dated.set({"DATE", fits_date(), "time of writing (UTC)"});
    write_records(dated);
    LONGLONG first = 1;
    PixelSum sum;
    for (const PlanePtr& plane : planes) {
      FloatRange range;
      for_each_band(*plane, threads, [&](const Area& area, const double* values) {
        const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
        write_pixels(values, count, bitpix, first, sum, range);
        first += static_cast<LONGLONG>(count);
      });
      if (range.is_lost && !range.is_seen) {
        throw run_error(
            "{}: a plane's pixels are all too small for 32 bits; --bitpix -64 keeps them",
            output_->label());
      }
    }
    if (!compressed_) data_sums_[file_->hdu_count()] = sum.value();
  }

  void write_cube(FitsHeader header, const std::vector<PlanePtr>& planes,
                  const std::vector<double>& wavelengths, int bitpix, int threads) {
    header.remove_further_axes();
    if (planes.size() > 1) {
      std::vector<Card> cards;
      for (int axis = 1; axis <= 2; ++axis) {
        if (!header.has(fmt::format("CTYPE{}", axis)))
          append_axis(cards, axis, {"PIXEL", "", 1, 1, 1});
      }
      // The number of axes must be stated: a compressed image is a table of two axes.
      header.set_first({"WCSAXES", 3LL, "number of world axes"});
      append_third_axis(cards, wavelengths, header.records());
      for (const Card& card : cards) header.set(card);
    }
    for (std::size_t i = 0; i < wavelengths.size(); ++i) {
      header.set({fmt::format("WAVELEN{}", i + 1), wavelengths[i],
                  fmt::format("[Angstrom] of plane {}", i + 1)});
    }
    write(header, planes, bitpix, threads, {});
  }

  void complete() {
    const int hdus = file_->hdu_count();
    for (int hdu = 1; hdu <= hdus; ++hdu) {
      file_->move_to(hdu);
      const auto sum = data_sums_.find(hdu);
      write_checksum(*file_, sum == data_sums_.end() ? std::nullopt : std::optional(sum->second));
    }
    file_->close();
    file_.reset();
  }

  void finish() {
    if (file_) complete();
    output_->deliver(options_.overwrite);
  }

 private:
  void write_records(const FitsHeader& header) {
    for (const std::string& record : header.records()) {
      file_->call(fits_write_record, record.c_str());
    }
    const bool has_long_strings = std::any_of(header.records().begin(), header.records().end(),
                                              [](const auto& r) { return is_continuation(r); });
    if (has_long_strings) {
      file_->call(fits_update_key_str, "LONGSTRN", "OGIP 1.0",
                  "long strings go on in CONTINUE cards");
    }
  }

  /// Whether a plane has values that a float holds, and values too small for a float.
  struct FloatRange {
    bool is_seen = false;
    bool is_lost = false;
  };

  void write_pixels(const double* values, std::size_t count, int bitpix, LONGLONG first,
                    PixelSum& sum, FloatRange& range) {
    if (bitpix != FLOAT_IMG) {
      sum.add(values, count);
      file_->call(fits_write_img, TDOUBLE, first, static_cast<LONGLONG>(count),
                  static_cast<void*>(const_cast<double*>(values)));
      return;
    }
    std::array<float, piece_size> piece;
    // Compressed files are written in whole tiles.
    const std::size_t most = compressed_ ? count : piece.size();
    std::vector<float> tiles(compressed_ ? count : 0);
    float* floats = compressed_ ? tiles.data() : piece.data();
    for (std::size_t done = 0; done < count;) {
      const std::size_t size = std::min(most, count - done);
      to_floats(values + done, size, floats, range);
      sum.add(floats, size);
      file_->call(fits_write_img, TFLOAT, first + static_cast<LONGLONG>(done),
                  static_cast<LONGLONG>(size), static_cast<void*>(floats));
      done += size;
    }
  }

  void to_floats(const double* values, std::size_t count, float* out, FloatRange& range) const {
    constexpr std::uint32_t positive_infinity = 0x7F800000, without_sign = 0x7FFFFFFF;
    for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<float>(values[i]);
    std::uint32_t infinities = 0;
    std::int32_t largest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t bits = std::bit_cast<std::uint32_t>(out[i]) & without_sign;
      infinities += bits == positive_infinity ? 1 : 0;
      largest = std::max(largest, static_cast<std::int32_t>(bits));
    }
    if (largest >= std::bit_cast<std::int32_t>(std::numeric_limits<float>::min())) {
      range.is_seen = true;
    } else if (!range.is_lost) {
      range.is_lost = std::any_of(values, values + count, [](double v) { return v != 0; });
    }
    if (infinities == 0) return;
    for (std::size_t i = 0; i < count; ++i) {
      if (std::isinf(out[i]) && !std::isinf(values[i])) {
        throw run_error("{}: pixels are too large for 32 bits; --bitpix -64 keeps them",
                        output_->label());
      }
    }
  }

  FitsOutputOptions options_;
  bool compressed_ = false;
  std::optional<OutputFile> output_;
  std::optional<FitsFile> file_;
  std::map<int, std::uint32_t> data_sums_;  ///< [HDU, from 1]: the sum, where known
};

FitsOutput::FitsOutput(const FitsOutputOptions& options) : file_(std::make_unique<File>(options)) {}

FitsOutput::~FitsOutput() = default;

void FitsOutput::copy(const FitsInput& input, std::size_t hdu) { file_->copy(input, hdu); }

void FitsOutput::copy(const FitsInput& input, std::size_t hdu, const FitsHeader& header) {
  file_->copy(input, hdu, header);
}

void FitsOutput::write_empty(const FitsHeader& header) { file_->write_empty(header); }

void FitsOutput::write(const FitsHeader& header, const std::vector<PlanePtr>& planes, int bitpix,
                       int threads, const std::vector<long long>& further_axes) {
  file_->write(header, planes, bitpix, threads, further_axes);
}

void FitsOutput::write_cube(const FitsHeader& header, const std::vector<PlanePtr>& planes,
                            const std::vector<double>& wavelengths, int bitpix, int threads) {
  file_->write_cube(header, planes, wavelengths, bitpix, threads);
}

void FitsOutput::complete() { file_->complete(); }

void FitsOutput::finish() { file_->finish(); }

}  // namespace gamer
