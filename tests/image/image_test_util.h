#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "gamer/image/image_writer.h"

namespace gamer {

/// A temporary folder, removed with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "gamer_test_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }
  /// The number of files in it, hidden ones included.
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

struct CommandResult {
  int status = 0;
  std::string output;
};

inline CommandResult run_command(const std::string& command) {
  CommandResult result;
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {-1, "popen failed"};
  std::array<char, 4096> buffer;
  for (std::size_t size; (size = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    result.output.append(buffer.data(), size);
  }
  result.status = pclose(pipe);
  return result;
}

/// Fails if fitsverify reports anything about the file; does nothing if it is not installed.
inline void expect_fitsverify_clean(const std::filesystem::path& path) {
  static const bool installed = run_command("command -v fitsverify").status == 0;
  if (!installed) return;
  const CommandResult result = run_command("fitsverify '" + path.string() + "'");
  EXPECT_NE(result.output.find("Verification found 0 warning(s) and 0 error(s)"), std::string::npos)
      << result.output;
}

/// A Python with Astropy, or "".
inline const std::string& astropy_python() {
  static const std::string found = [] {
    std::vector<std::string> candidates = {"python3", "/usr/bin/python3"};
#ifdef GAMER_PYTHON
    candidates.insert(candidates.begin(), GAMER_PYTHON);
#endif
    for (const std::string& python : candidates) {
      if (run_command(python + " -c 'import astropy.wcs'").status == 0) return python;
    }
    return std::string();
  }();
  return found;
}

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Values that no float holds exactly and that differ in every pixel.
inline double test_value(int x, int y, int plane) {
  return (1 + x + 0.1 * y + 100.0 * plane) / 3 * (x % 2 == 0 ? 1 : -1);
}

inline ImageHeader test_header(int width, int height, const std::vector<double>& wavelengths) {
  ImageHeader header;
  header.width = width;
  header.height = height;
  header.unit = "nJy";
  header.x = {"LINEAR", "deg", 0.5 + width / 2.0, 0.1, -0.25};
  header.y = {"LINEAR", "deg", 0.5 + height / 2.0, -0.2, 0.25};
  header.wavelengths = wavelengths;
  for (const double wavelength : wavelengths) {
    std::string label = std::to_string(wavelength);
    label.erase(label.find_last_not_of('0') + 1);
    if (label.back() == '.') label.pop_back();
    header.labels.push_back(label + "A");
  }
  return header;
}

/// Rows [first, first + count) of the test image.
inline std::vector<double> test_rows(const ImageHeader& header, int first, int count) {
  std::vector<double> values;
  for (int y = first; y < first + count; ++y) {
    for (int plane = 0; plane < header.planes(); ++plane) {
      for (int x = 0; x < header.width; ++x) values.push_back(test_value(x, y, plane));
    }
  }
  return values;
}

/// Writes the whole test image, in the given order of rows (ascending where it is empty).
inline void write_test_image(const OutputOptions& options, const ImageHeader& header,
                             std::vector<int> order = {}) {
  auto writer = make_image_writer(options, header);
  if (order.empty()) {
    for (int y = 0; y < header.height; ++y) order.push_back(y);
  }
  for (const int y : order) writer->write_rows(y, 1, test_rows(header, y, 1));
  writer->finish();
}

}  // namespace gamer
