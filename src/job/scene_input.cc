#include "job/scene_input.h"

#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <string_view>
#include <utility>

#include "core/message.h"
#include "gamer/image/data_table.h"
#include "image/standard_stream.h"
#include "image/temporary_file.h"

namespace gamer {
namespace {

constexpr std::string_view fits_begin = "SIMPLE  ";
constexpr std::string_view gzip_begin = "\x1f\x8b";
constexpr const char* standard_input = "standard input";
constexpr std::size_t most_bytes = std::size_t{1} << 30;  // of standard input

/// First bytes of a file, unzipped where it is compressed.
struct FileStart {
  bool is_compressed = false;
  bool is_fits = false;
};

FileStart start_of(const std::filesystem::path& path) {
  FileStart start;
  // Opening a pipe could block for ever.
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return start;
  std::array<char, fits_begin.size()> bytes{};
  std::ifstream(path, std::ios::binary).read(bytes.data(), gzip_begin.size());
  start.is_compressed = std::string_view(bytes.data(), gzip_begin.size()) == gzip_begin;
  const std::unique_ptr<gzFile_s, decltype(&gzclose)> file(gzopen(path.c_str(), "rb"), &gzclose);
  if (!file) return start;
  const int count = gzread(file.get(), bytes.data(), static_cast<unsigned>(bytes.size()));
  start.is_fits = count == static_cast<int>(bytes.size()) &&
                  std::string_view(bytes.data(), bytes.size()) == fits_begin;
  return start;
}

/// Whether a file is a FITS table, which no text can hold.
bool is_table(const RenderParameters& parameters, const std::filesystem::path& path) {
  const CatalogueFormat format = parameters.catalogue.format;
  if (format == CatalogueFormat::fits) return true;
  if (format != CatalogueFormat::automatic) return false;
  const FileStart start = start_of(path);
  if (start.is_compressed && !start.is_fits) {
    throw InputError({path.generic_string(), 0, 0},
                     "it is compressed; only FITS files may be: unpack it with gunzip");
  }
  return start.is_fits || path.string().find(".fits[") != std::string::npos;
}

std::string read_standard_input() {
  const auto fail = [](const std::string& message) {
    throw InputError({standard_input, 0, 0}, message);
  };
  if (isatty(STDIN_FILENO) == 1) fail("'-' reads the scene from here, but it is a terminal");
  std::string content;
  std::array<char, 1 << 16> block{};
  for (;;) {
    const ssize_t count = read(STDIN_FILENO, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(fmt::format("it cannot be read: {}", std::strerror(errno)));
    if (count == 0) return content;
    content.append(block.data(), static_cast<std::size_t>(count));
    if (content.size() > most_bytes) fail(fmt::format("more than {} MiB", most_bytes >> 20));
  }
}

/// The table of a FITS file that came through standard input.
Catalogue read_spooled_table(const std::string& content, const std::string& hdu) {
  const SpoolFile spool;
  std::ofstream file(spool.path(), std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();
  if (!file) throw run_error("{}: cannot be kept on disk", standard_input);
  try {
    return Catalogue::from_table(read_data_table(spool.path(), hdu), standard_input);
  } catch (const InputError& error) {
    std::string message = error.what();
    if (const std::string name = spool.path().string(); message.starts_with(name)) {
      message = standard_input + message.substr(name.size());
    }
    throw InputError(message);
  }
}

Catalogue read_from_standard_input(const RenderParameters& parameters, Resources& resources) {
  std::string content = read_standard_input();
  const CatalogueFormat format = parameters.catalogue.format;
  const bool may_be_table = format == CatalogueFormat::fits || format == CatalogueFormat::automatic;
  if (may_be_table && (content.starts_with(fits_begin) || content.starts_with(gzip_begin) ||
                       format == CatalogueFormat::fits)) {
    return read_spooled_table(content, parameters.catalogue.hdu);
  }
  if (content.find('\0') != std::string::npos) {
    throw InputError({standard_input, 0, 0}, "it has NUL bytes; it is not a text");
  }
  const Resources::Text& scene =
      resources.add({recorded_scene, standard_input, std::move(content)});
  return Catalogue::parse(scene.content, scene.label, format, parameters.catalogue.hdu);
}

}  // namespace

const std::filesystem::path& source_of(const JobRequest& request,
                                       const std::filesystem::path& file) {
  return request.from_header.empty() ? file : request.from_header;
}

const Resources::Text& read_named_file(Resources& resources, const std::string& name,
                                       const std::filesystem::path& path) {
  try {
    return resources.read(name, path);
  } catch (const InputError& error) {
    throw InputError({path.generic_string(), 0, 0}, error.what());
  }
}

Catalogue read_catalogue(const JobRequest& request, const RenderParameters& parameters,
                         Resources& resources) {
  const std::filesystem::path& path = source_of(request, request.scene);
  const bool is_request = request.from_header.empty();
  if (is_request && path == standard_stream) return read_from_standard_input(parameters, resources);
  if (is_request && resources.recorded(recorded_scene) == nullptr && is_table(parameters, path)) {
    Catalogue catalogue = Catalogue::from_table(read_data_table(path, parameters.catalogue.hdu),
                                                path.generic_string());
    resources.add_file(path);
    return catalogue;
  }
  const Resources::Text& scene = read_named_file(resources, recorded_scene, path);
  return Catalogue::parse(scene.content, scene.label, parameters.catalogue.format,
                          parameters.catalogue.hdu);
}

}  // namespace gamer
