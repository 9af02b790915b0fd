#include "image/fits/fits_file.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/capitals.h"
#include "gamer/core/near.h"
#include "image/fits/fits_scan.h"

namespace gamer {
namespace {

/// Whether the text in brackets is a section, "10:90,*", not an HDU.
bool is_section(std::string_view text) {
  return text.find_first_of(":*") != std::string_view::npos &&
         text.find_first_not_of("0123456789:*-, ") == std::string_view::npos;
}

struct Extension {
  std::string hdu, section;  ///< empty for none
};

/// The parts of "[SCI][10:90,*]"; nothing for a text of another form.
std::optional<Extension> parse_extension(std::string_view text) {
  Extension extension;
  while (!text.empty()) {
    const std::size_t end = text.find(']');
    if (!text.starts_with('[') || end == std::string_view::npos) return std::nullopt;
    const std::string part(text.substr(1, end - 1));
    text.remove_prefix(end + 1);
    const bool is_last = text.empty();
    if (is_last && is_section(part) && part.size() < FLEN_VALUE) {
      extension.section = part;
    } else if (extension.hdu.empty() && !part.empty() && part.find('[') == std::string::npos) {
      extension.hdu = part;
    } else {
      return std::nullopt;
    }
  }
  return extension;
}

}  // namespace

FitsFile FitsFile::create(const std::filesystem::path& path, std::string label) {
  FitsFile file(std::move(label), true);
  int status = 0;
  errno = 0;
  // The "diskfile" functions take the name literally, also brackets and the like.
  fits_create_diskfile(&file.handle_, std::filesystem::absolute(path).c_str(), &status);
  if (status != 0) file.fail(status);
  return file;
}

FitsFile FitsFile::open(const std::filesystem::path& path, std::string label, bool written) {
  FitsFile file(std::move(label), written);
  if (!written) check_headers(path, file.label_);
  int status = 0;
  errno = 0;
  fits_open_diskfile(&file.handle_, std::filesystem::absolute(path).c_str(), READONLY, &status);
  if (status != 0) {
    file.handle_ = nullptr;
    file.fail(status);
  }
  return file;
}

// CFITSIO's reader of extended names (4.2) overflows its buffers where names are long.
FitsFile FitsFile::open_extended(const std::string& name) {
  const std::size_t bracket = name.find('[');
  const auto extension = parse_extension(std::string_view(name).substr(bracket));
  if (!extension) {
    throw input_error(
        "{}: expected the number or the name of an HDU in brackets, then perhaps a section: "
        "a.fits[1][10:90,10:90]",
        name.substr(0, bracket));
  }
  FitsFile file = open(name.substr(0, bracket), name);
  const int count = file.hdu_count();
  for (int hdu = count; hdu >= 1; --hdu) {
    file.move_to(hdu);
    file.check_data(0);
  }
  if (!extension->hdu.empty()) file.move_to_named(extension->hdu);
  if (extension->section.empty()) return file;
  // Without an HDU, the name means the first image.
  for (int hdu = 2, axes = 0; extension->hdu.empty() && hdu <= count; ++hdu) {
    file.call(fits_get_img_dim, &axes);
    if (axes > 0) break;
    file.move_to(hdu);
  }
  int status = 0;
  std::string section = extension->section;
  char copy[] = "mem://section";
  fits_select_image_section(&file.handle_, copy, section.data(), &status);
  if (status != 0) file.fail(status);
  return file;
}

FitsFile::FitsFile(FitsFile&& other) noexcept
    : handle_(std::exchange(other.handle_, nullptr)),
      label_(std::move(other.label_)),
      written_(other.written_) {}

FitsFile::~FitsFile() {
  if (handle_ == nullptr) return;
  int status = 0;
  fits_close_file(handle_, &status);
  fits_clear_errmsg();
}

void FitsFile::move_to(int hdu) {
  int current = 0;
  fits_get_hdu_num(handle_, &current);
  if (current != hdu) call(fits_movabs_hdu, hdu, nullptr);
}

int FitsFile::hdu_count() {
  int count = 0;
  call(fits_get_num_hdus, &count);
  return count;
}

bool FitsFile::has_compressed_image() {
  int status = 0;
  const bool is_compressed = fits_is_compressed_image(handle_, &status) != 0;
  fits_clear_errmsg();
  return is_compressed;
}

void FitsFile::move_to_named(const std::string& hdu) {
  const int count = hdu_count();
  if (const std::optional<int> number = number_of<int>(hdu)) {
    if (*number < 0 || *number >= count) {
      fail(fmt::format("no HDU {} in it; the last one is {}", *number, count - 1));
    }
    move_to(*number + 1);
    return;
  }
  const std::size_t comma = hdu.rfind(',');
  const std::optional<int> version =
      comma == std::string::npos ? std::nullopt : number_of<int>(hdu.substr(comma + 1));
  const std::string name = version ? hdu.substr(0, comma) : hdu;
  std::vector<std::string> names;
  for (int i = 1; i <= count; ++i) {
    move_to(i);
    names.push_back(text("EXTNAME"));
    const std::string its_version = text("EXTVER");
    if (in_capitals(names.back()) != in_capitals(name)) continue;
    if (!version || version == number_of<int>(its_version.empty() ? "1" : its_version)) return;
  }
  std::erase(names, "");
  fail(fmt::format("no HDU {} in it{}", in_quotes(hdu), did_you_mean(hdu, names)));
}

std::string FitsFile::text(const std::string& key) {
  char* value = nullptr;
  int status = 0, free_status = 0;
  fits_read_key_longstr(handle_, key.c_str(), &value, nullptr, &status);
  fits_clear_errmsg();
  std::string result = status == 0 && value != nullptr ? value : "";
  if (value != nullptr) fits_free_memory(value, &free_status);
  return result;
}

void FitsFile::check_data(double bytes, bool with_fill) {
  LONGLONG header = 0, data = 0, end = 0;
  call(fits_get_hduaddrll, &header, &data, &end);
  constexpr LONGLONG record_size = 2880;
  const LONGLONG size = handle_->Fptr->filesize;
  // CFITSIO's own sum may have overflowed.
  const double needed = std::max(static_cast<double>(with_fill ? end : end - record_size + 1),
                                 static_cast<double>(data) + bytes);
  if (end >= data && needed <= static_cast<double>(size)) return;
  int hdu = 0;
  fits_get_hdu_num(handle_, &hdu);
  fail(fmt::format("HDU {} is cut off: it should end at byte {:.0f}, the file has {}", hdu - 1,
                   needed, size));
}

void FitsFile::check_sums() {
  int data = 0, whole = 0, hdu = 0;
  call(fits_verify_chksum, &data, &whole);
  constexpr int wrong = -1;
  if (data != wrong && whole != wrong) return;
  fits_get_hdu_num(handle_, &hdu);
  const std::string name = text("EXTNAME");
  fail(fmt::format("HDU {}{} is damaged, or another program has changed it: its {} is wrong",
                   hdu - 1, name.empty() ? "" : fmt::format(" ({})", name),
                   data == wrong ? "DATASUM" : "CHECKSUM"));
}

void FitsFile::reserve_data() {
  LONGLONG begin = 0, data = 0, end = 0;
  // This fixes the position of the data.
  call(fits_set_hdustruc);
  call(fits_flush_buffer, 0);
  call(fits_get_hduaddrll, &begin, &data, &end);
  FITSfile& file = *handle_->Fptr;
  if (end <= file.filesize) return;
  errno = 0;
  if (truncate(file.filename, end) != 0) fail(WRITE_ERROR);
  file.filesize = end;
  file.logfilesize = end;
}

void FitsFile::close() {
  int status = 0;
  errno = 0;
  fits_close_file(std::exchange(handle_, nullptr), &status);
  if (status != 0) fail(status);
}

void FitsFile::fail(const std::string& message) const {
  const std::string text = fmt::format("{}: {}", label_, message);
  if (written_) throw RunError(text);
  throw InputError(text);
}

void FitsFile::fail(int status) const {
  const int error = errno;
  char text[FLEN_STATUS] = {};
  fits_get_errstatus(status, text);
  std::string message = text;
  char detail[FLEN_ERRMSG] = {};
  if (fits_read_errmsg(detail) != 0) message += fmt::format(": {}", detail);
  fits_clear_errmsg();
  const bool of_the_system = status == WRITE_ERROR || status == READ_ERROR ||
                             status == FILE_NOT_CREATED || status == FILE_NOT_OPENED ||
                             status == FILE_NOT_CLOSED;
  if (of_the_system && error != 0) message += fmt::format(" ({})", std::strerror(error));
  fail(message);
}

}  // namespace gamer
