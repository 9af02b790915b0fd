// Fuzzes operations with any options on small images: an InputError, a RunError or an answer.
//
// The input is a command line: one word a line, the operation first. The file in.fits is a cube of
// three bands on the sky, and psf.fits is a PSF. Outputs of more than 1 MB fail as on a full disk.

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <string>
#include <vector>

#include "fuzz_folder.h"
#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "gamer/processing/operation.h"

namespace {

constexpr rlim_t largest_file = 1 << 20;

gamer::PlanePtr plane(int width, int height, double peak) {
  std::vector<double> values(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r = std::hypot(x - width / 2, y - height / 2);
      values[static_cast<std::size_t>(y) * width + x] = peak * std::exp(-r / 2);
    }
  }
  return std::make_shared<gamer::MemoryPlane>(width, height, std::move(values));
}

class Images {
 public:
  explicit Images(const FuzzFolder& folder) {
    folder.enter();
    constexpr int image_width = 17, image_height = 14, psf_file = 5;
    gamer::SkyView view;
    view.width = image_width;
    view.height = image_height;
    view.center = {150, 2};
    gamer::FitsHeader header;
    header.append(gamer::CelestialWcs(view).records());
    header.set("BUNIT", std::string("nJy"));
    for (const char* key : {"MAGZERO1", "MAGZERO2", "MAGZERO3"}) header.set(key, 31.4);
    gamer::FitsOutput image({"in.fits", true});
    image.write_cube(header,
                     {plane(image_width, image_height, 3), plane(image_width, image_height, 2),
                      plane(image_width, image_height, 1)},
                     {4400, 5500, 8000}, -32, 1);
    image.finish();
    gamer::FitsOutput psf({"psf.fits", true});
    psf.write({}, {plane(psf_file, psf_file, 1)}, -64, 1);
    psf.finish();
    const rlimit limit = {largest_file, largest_file};
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);
  }
};

std::vector<std::string> words_of(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < size; ++i) {
    if (data[i] == '\n') {
      words.emplace_back();
    } else if (data[i] != 0) {
      words.back() += static_cast<char>(data[i]);
    }
  }
  return words;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FuzzFolder folder;
  static const Images images(folder);
  const std::vector<std::string> words = words_of(data, size);
  // Words name no files outside the folder and no streams.
  for (const std::string& word : words) {
    if (word.find('/') != std::string::npos || word == "-") return 0;
  }
  try {
    const gamer::Operation& operation = gamer::find_operation(words.front());
    gamer::OperationCall call = gamer::parse_call(operation, {words.begin() + 1, words.end()});
    if (call.output == "in.fits" || call.output == "psf.fits") return 0;
    call.threads = 1;
    call.print = [](const std::string&) {};
    operation.run(call);
  } catch (const gamer::InputError&) {
  } catch (const gamer::RunError&) {
  }
  folder.clean({"in.fits", "psf.fits"});
  return 0;
}
