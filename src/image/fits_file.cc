#include "image/fits_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string_view>
#include <utility>

#include "gamer/core/error.h"
#include "image/fits_scan.h"

namespace gamer {
namespace {

/// Whether a file that could not be opened begins unlike FITS, plain or compressed.
bool is_other_file(const std::filesystem::path& path) {
  constexpr std::string_view signatures[] = {"SIMPLE", "\x1f\x8b", "\x1f\x9d", "PK", "BZ"};
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  char start[6] = {};
  file.read(start, sizeof start);
  const std::string_view text(start, static_cast<std::size_t>(file.gcount()));
  return std::ranges::none_of(
      signatures, [&](std::string_view signature) { return text.starts_with(signature); });
}

}  // namespace

FitsFile FitsFile::create(const std::filesystem::path& path, std::string label) {
  FitsFile file(std::move(label), true);
  int status = 0;
  errno = 0;
  // The "diskfile" calls take the name as it is: brackets and the like mean nothing.
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
    if (is_other_file(path)) {
      fits_clear_errmsg();
      file.fail("is no FITS file");
    }
    file.fail(status);
  }
  return file;
}

FitsFile FitsFile::open_extended(const std::string& name) {
  FitsFile file(name, false);
  check_headers(name.substr(0, name.find('[')), name);
  int status = 0;
  errno = 0;
  fits_open_file(&file.handle_, name.c_str(), READONLY, &status);
  if (status != 0) {
    file.handle_ = nullptr;
    file.fail(status);
  }
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

void FitsFile::reserve_data() {
  LONGLONG begin = 0, data = 0, end = 0;
  // Fixes where the data begin.
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
