// Operations on truncated files: each runs, or ends in an InputError that names the input.

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "gamer/image/image_writer.h"
#include "image/damage.h"
#include "processing/operation_fixture.h"

namespace gamer::damaged_input_test {
namespace {

class DamagedInput : public SmallFiles {
 protected:
  DamagedInput() {
    ImageHeader header = test_header(9, 7, {4400, 5500});
    header.tables = {{"INPUTS", {"NAME", "TEXT"}, {{"render.par", "size = 3"}}, {}}};
    write_test_image({folder_ / "good.fits", -32, ImageLayout::cube, true}, header);
  }

  void cut(std::size_t size) const {
    const std::string good = file_bytes(folder_ / "good.fits");
    std::ofstream(folder_ / "in.fits", std::ios::binary) << good.substr(0, size);
  }
};

TEST_F(DamagedInput, CutFiles) {
  const std::vector<std::vector<std::string>> operations = {
      {"scale", "--factor", "2", "in.fits", "out.fits"},
      {"header", "--set", "OBJECT=M1", "in.fits", "out.fits"},
      {"stack", "--layout", "extensions", "in.fits", "out.fits"},
      {"add", "good.fits", "in.fits", "out.fits"},
      {"convolve", "--psf", "gaussian", "--fwhm", "2", "in.fits", "out.fits"}};
  const std::size_t size = std::filesystem::file_size(folder_ / "good.fits");
  constexpr unsigned cuts = 200;
  for (unsigned seed = 0; seed < cuts; ++seed) {
    const std::size_t end = Damage(seed).below(size);
    cut(end);
    std::filesystem::remove(folder_ / "out.fits");
    const std::string message = error(operations[seed % operations.size()]);
    EXPECT_TRUE(message == "none" || message.find("in.fits") != std::string::npos) << message;
    EXPECT_EQ(message == "none", std::filesystem::exists(folder_ / "out.fits")) << end;
  }
}

}  // namespace
}  // namespace gamer::damaged_input_test
