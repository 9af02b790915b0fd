#include "gamer/image/image_writer.h"

#include <sys/resource.h>

#include <algorithm>
#include <ranges>
#include <set>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/new_file.h"
#include "gamer/image/picture.h"
#include "image/healpix_writer.h"
#include "image/image_suffix.h"
#include "image/memory.h"
#include "image/picture_size.h"
#include "image/standard_stream.h"

namespace gamer {
namespace {

constexpr std::array<std::pair<const char*, ImageSuffix>, 4> suffixes = {{
    {".fits", ImageSuffix::fits},
    {".fits.fz", ImageSuffix::fits_compressed},
    {".png", ImageSuffix::png},
    {".bmp", ImageSuffix::bmp},
}};

/// Space for the headers of a FITS file besides its cards.
constexpr std::uint64_t header_bytes = 16 * 1024;
constexpr std::uint64_t card_bytes = 80;
/// Open files of a process besides the image's: streams, libraries, sockets of MPI.
constexpr std::uint64_t other_files = 64;
/// CFITSIO's limit of open files (NMAXFILES).
constexpr std::uint64_t most_fits_files = 10000;

bool is_fits(ImageSuffix suffix) {
  return suffix == ImageSuffix::fits || suffix == ImageSuffix::fits_compressed;
}

std::uint64_t pixels(const ImageHeader& header) {
  return static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height);
}

std::uint64_t bytes_on_disk(ImageSuffix suffix, const OutputOptions& options,
                            const ImageHeader& header) {
  const auto [width, height] = picture_extent(header);
  if (suffix == ImageSuffix::bmp) return bmp_bytes(width, height);
  if (suffix == ImageSuffix::png) {
    return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * 3 *
           sizeof(std::uint16_t);
  }
  std::uint64_t texts = header.cards.size() * card_bytes;
  for (const TextTable& table : header.tables) {
    texts += table.cards.size() * card_bytes;
    table.for_each_row([&](std::span<const std::string_view> row) {
      for (const std::string_view cell : row) texts += cell.size();
    });
  }
  constexpr std::uint64_t cell_bytes = 8;
  for (const DataTable& table : header.data_tables) {
    texts += table.columns.size() * (table.rows() * cell_bytes + 2 * card_bytes);
  }
  const std::uint64_t planes = header.labels.size();
  const std::uint64_t files = options.layout == ImageLayout::files ? planes : 1;
  const std::uint64_t bytes_per_pixel = options.bitpix == -64 ? 8 : 4;
  const std::uint64_t plain =
      pixels(header) * planes * bytes_per_pixel + files * texts + (planes + 1) * header_bytes;
  // Compression needs the plain file and, at worst, an equally large compressed file.
  return suffix == ImageSuffix::fits_compressed ? 2 * plain : plain;
}

std::uint64_t most_open_files() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return most_fits_files;
  }
  const std::uint64_t current = limit.rlim_cur;
  return std::min(most_fits_files, current > other_files ? current - other_files : 1);
}

}  // namespace

std::optional<ImageSuffix> image_suffix(const std::filesystem::path& path) {
  if (path == standard_stream) return ImageSuffix::fits;
  const std::string text = image_suffix_text(path);
  for (const auto& [name, suffix] : suffixes) {
    if (text == name) return suffix;
  }
  return std::nullopt;
}

std::string image_suffix_text(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  std::string longest;
  for (const auto& [text, suffix] : suffixes) {
    const std::string candidate = text;
    // A name that is only the suffix would be a hidden file.
    if (name.size() > candidate.size() && name.ends_with(candidate) &&
        candidate.size() > longest.size()) {
      longest = candidate;
    }
  }
  return longest;
}

std::vector<std::filesystem::path> output_files(const OutputOptions& options,
                                                const ImageHeader& header) {
  const std::optional<ImageSuffix> suffix = image_suffix(options.path);
  if (options.layout != ImageLayout::files || !suffix || !is_fits(*suffix)) return {options.path};
  const std::string ending = image_suffix_text(options.path);
  std::string stem = options.path.filename().string();
  stem.resize(stem.size() - ending.size());
  std::vector<std::filesystem::path> files;
  for (const std::string& label : header.labels) {
    files.push_back(options.path.parent_path() / fmt::format("{}_{}{}", stem, label, ending));
  }
  return files;
}

namespace {

[[noreturn]] void refuse(const OutputOptions& options, const std::string& reason) {
  throw input_error("output '{}': {}", options.path.string(), reason);
}

/// Labels become parts of file names or names of HDUs.
void check_labels(const OutputOptions& options, const ImageHeader& header) {
  std::set<std::string> labels;
  for (const std::string& label : header.labels) {
    if (label.find('/') != std::string::npos) {
      refuse(options, fmt::format("the label '{}' cannot be part of a file name", label));
    }
    if (!labels.insert(label).second) {
      refuse(options, fmt::format("two planes have the label '{}'", label));
    }
  }
}

void check_file_count(const OutputOptions& options, const ImageHeader& header) {
  if (options.path == standard_stream) {
    refuse(options, "standard output holds one file; use layout \"cube\"");
  }
  if (const std::uint64_t most = most_open_files(); header.labels.size() > most) {
    refuse(options, fmt::format("{} files cannot be written at once here, at most {} (ulimit -n); "
                                "use layout \"extensions\" or \"cube\"",
                                header.labels.size(), most));
  }
}

void check_fits(const OutputOptions& options, const ImageHeader& header) {
  if (options.bitpix != -32 && options.bitpix != -64) {
    refuse(options, fmt::format("bitpix = {} is not one of -32, -64", options.bitpix));
  }
  if (options.layout == ImageLayout::extensions || options.layout == ImageLayout::files) {
    check_labels(options, header);
  }
  if (options.layout == ImageLayout::files) check_file_count(options, header);
}

void check_memory(const OutputOptions& options, const ImageHeader& header, ImageSuffix suffix) {
  const std::uint64_t available = available_memory();
  if (!is_fits(suffix)) {
    const auto [width, height] = picture_extent(header);
    const std::uint64_t needed =
        picture_memory(width, height, static_cast<int>(header.labels.size()), options.style);
    if (needed > available) {
      refuse(options, fmt::format("a picture of {} x {} pixels needs {} of memory, {} is "
                                  "available; FITS files are written row by row and need little",
                                  width, height, bytes_text(needed), bytes_text(available)));
    }
  }
  if (header.healpix) {
    if (const std::uint64_t needed = healpix_memory(options, header); needed > available) {
      refuse(options,
             fmt::format(
                 "a HEALPix map of nside = {} and {} plane{} needs {} of memory, {} is available",
                 header.healpix->nside, header.planes(), header.planes() == 1 ? "" : "s",
                 bytes_text(needed), bytes_text(available)));
    }
  }
}

void check_disk_space(const OutputOptions& options, std::uint64_t bytes) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::absolute(options.path).parent_path();
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error || bytes <= space.available) return;
  refuse(options,
         fmt::format("needs {} on disk, folder '{}' has {} left", bytes_text(bytes),
                     options.path.has_parent_path() ? options.path.parent_path().string() : ".",
                     bytes_text(space.available)));
}

}  // namespace

void check_output_suffix(const OutputOptions& options) {
  if (image_suffix(options.path)) return;
  refuse(options, fmt::format("unknown kind of file; the name must end in one of {}",
                              fmt::join(suffixes | std::views::keys, ", ")));
}

void check_output(const OutputOptions& options, const ImageHeader& header) {
  check_output_suffix(options);
  const ImageSuffix suffix = *image_suffix(options.path);
  if (header.healpix && suffix != ImageSuffix::fits) {
    refuse(options, "a HEALPix map is a .fits file");
  }
  if (is_fits(suffix)) check_fits(options, header);
  for (const std::filesystem::path& file : output_files(options, header)) {
    check_new_file(file, options.overwrite);
  }
  const std::uint64_t bytes = bytes_on_disk(suffix, options, header);
  if (suffix == ImageSuffix::bmp && bytes > largest_bmp) {
    const auto [width, height] = picture_extent(header);
    refuse(options, fmt::format("{} x {} pixels are too many for a BMP file (4 GiB); use .png",
                                width, height));
  }
  check_memory(options, header, suffix);
  check_disk_space(options, bytes);
}

namespace {

class SplitWriter final : public ImageWriter {
 public:
  SplitWriter(std::unique_ptr<ImageWriter> first, std::size_t first_values,
              std::unique_ptr<ImageWriter> rest, std::size_t values)
      : first_(std::move(first)),
        rest_(std::move(rest)),
        first_values_(first_values),
        values_(values) {}

  void write_rows(int first, int count, std::span<const double> values) override {
    first_rows_.clear();
    rest_rows_.clear();
    for (std::size_t row = 0; row < static_cast<std::size_t>(count); ++row) {
      const std::span<const double> all = values.subspan(row * values_, values_);
      const std::span<const double> own = all.first(first_values_);
      const std::span<const double> others = all.subspan(first_values_);
      first_rows_.insert(first_rows_.end(), own.begin(), own.end());
      rest_rows_.insert(rest_rows_.end(), others.begin(), others.end());
    }
    first_->write_rows(first, count, first_rows_);
    rest_->write_rows(first, count, rest_rows_);
  }

  void add_cards(const std::vector<Card>& cards) override {
    first_->add_cards(cards);
    rest_->add_cards(cards);
  }

  void finish() override {
    first_->finish();
    rest_->finish();
  }

 private:
  std::unique_ptr<ImageWriter> first_, rest_;
  std::size_t first_values_, values_;  ///< number of values of a row
  std::vector<double> first_rows_, rest_rows_;
};

}  // namespace

std::unique_ptr<ImageWriter> make_split_writer(std::unique_ptr<ImageWriter> first, int first_planes,
                                               std::unique_ptr<ImageWriter> rest, int planes,
                                               int width) {
  const auto values = [width](int count) {
    return static_cast<std::size_t>(count) * static_cast<std::size_t>(width);
  };
  return std::make_unique<SplitWriter>(std::move(first), values(first_planes), std::move(rest),
                                       values(planes));
}

std::unique_ptr<ImageWriter> make_image_writer(const OutputOptions& options,
                                               const ImageHeader& header) {
  check_output(options, header);
  if (header.healpix) return make_healpix_writer(options, header);
  return is_fits(*image_suffix(options.path)) ? make_fits_writer(options, header)
                                              : make_picture_writer(options, header);
}

}  // namespace gamer
