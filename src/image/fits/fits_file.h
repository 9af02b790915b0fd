#pragma once

#include <fitsio.h>

#include <cerrno>
#include <filesystem>
#include <string>

namespace gamer {

/// An open FITS file. call() runs one CFITSIO function on it and turns a bad status into an
/// exception that carries CFITSIO's own words: RunError where the file is written, InputError where
/// it is read.
class FitsFile {
 public:
  /// A new file; messages name it `label` (the final name, not the temporary one).
  static FitsFile create(const std::filesystem::path& path, std::string label);
  /// An existing file, read only. `written` marks a file of our own making, whose errors are
  /// failures while running and not wrong input.
  static FitsFile open(const std::filesystem::path& path, std::string label, bool written = false);

  /// By an extended name, "a.fits[1]" or "a.fits[SCI,2][10:90,10:90]"; read only. The HDU is
  /// current, or the section of its image in its place.
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
  /// Moves to the HDU called or, from 0, numbered `hdu`; "SCI,2" is that of EXTVER 2.
  void move_to_named(const std::string& hdu);
  int hdu_count();
  /// A string value of the current header; "" where it has none.
  std::string text(const std::string& key);

  /// The data of the current HDU, `bytes` of them where they are an image's, must be there:
  /// otherwise a few bytes could ask for any amount of memory. The fill of the last record may be
  /// missing, unless `with_fill`.
  void check_data(double bytes, bool with_fill = false);
  /// The current HDU's DATASUM and CHECKSUM, where it has them, must be right. Reads it whole,
  /// piece by piece.
  void check_sums();

  /// Reserves the room of the current HDU, which is the last and whose header is complete: zeros
  /// that take no place on disk. CFITSIO would write them before the first pixel of a later row.
  void reserve_data();
  /// Flushes and closes; the destructor does so too, but cannot report an error.
  void close();

  fitsfile* handle() const { return handle_; }
  const std::string& label() const { return label_; }
  /// Throws the exception of the file's kind: "label: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  FitsFile(std::string label, bool written) : label_(std::move(label)), written_(written) {}
  [[noreturn]] void fail(int status) const;

  fitsfile* handle_ = nullptr;
  std::string label_;
  bool written_;
};

}  // namespace gamer
