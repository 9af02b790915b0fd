#pragma once

#include <fitsio.h>

#include <cerrno>
#include <filesystem>
#include <string>

namespace gamer {

/// An open FITS file. call() runs one CFITSIO function on it and turns a bad status into an
/// exception with CFITSIO's words: RunError for a file being written, InputError for one being
/// read.
class FitsFile {
 public:
  /// A new file; messages name it `label` (the final name, not the temporary one).
  static FitsFile create(const std::filesystem::path& path, std::string label);
  /// Opens an existing file read-only. `written` marks a file of this program, whose errors are
  /// RunErrors.
  static FitsFile open(const std::filesystem::path& path, std::string label, bool written = false);

  /// Opens "a.fits[1]" or "a.fits[SCI,2][10:90,10:90]" read-only. The current HDU is the one named,
  /// or the given section of its image.
  static FitsFile open_extended(const std::string& name);

  FitsFile(FitsFile&& other) noexcept;
  FitsFile& operator=(FitsFile&&) = delete;
  ~FitsFile();

  template <class Function, class... Arguments>
  void call(Function function, Arguments... arguments) {
    int status = 0;
    errno = 0;
    function(handle_, arguments..., &status);
    if (status != 0) fail(status);
  }

  /// Moves to an HDU, counted from 1.
  void move_to(int hdu);
  /// Moves to the HDU with this name or number (from 0); "SCI,2" means EXTVER 2.
  void move_to_named(const std::string& hdu);
  int hdu_count();
  /// Whether the current HDU is a compressed image.
  bool has_compressed_image();
  /// A string value of the current header; "" for none.
  std::string text(const std::string& key);

  /// Fails unless the file is long enough for the current HDU's data, which are `bytes` long in an
  /// image. Without this check a small file could ask for any amount of memory. The fill of the
  /// last record may be missing, unless `with_fill`.
  void check_data(double bytes, bool with_fill = false);
  /// Fails where the current HDU's DATASUM or CHECKSUM is wrong. Reads the whole HDU, piece by
  /// piece.
  void check_sums();

  /// Reserves the data of the current HDU as zeros that take no space on disk. The HDU is the last,
  /// and its header is complete. Without this call CFITSIO would write zeros before the first pixel
  /// of a row that comes early.
  void reserve_data();
  /// Flushes and closes the file, as does the destructor, which cannot report errors.
  void close();

  fitsfile* handle() const { return handle_; }
  const std::string& label() const { return label_; }
  /// Throws RunError (a file being written) or InputError with the text "label: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  FitsFile(std::string label, bool written) : label_(std::move(label)), written_(written) {}
  [[noreturn]] void fail(int status) const;

  fitsfile* handle_ = nullptr;
  std::string label_;
  bool written_;
};

}  // namespace gamer
