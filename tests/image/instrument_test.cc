#include "gamer/image/instrument.h"

#include <gtest/gtest.h>

#include <string>

#include "core/error_text.h"
#include "gamer/core/error.h"

namespace gamer::instrument_test {
namespace {

const std::string camera = R"([instrument]
name = "A camera"
pixel_scale = 0.5
exposure = 60
read_noise = 4
)";
const std::string band = "[[band]]\nname = \"sdss_r\"\nzero_point = 25\nfwhm = 1.5\n";

TEST(Instrument, ReadsAFile) {
  const Instrument read = Instrument::parse(camera + band, "a.toml");
  EXPECT_EQ(read.name, "A camera");
  EXPECT_EQ(read.pixel_scale, 0.5);
  EXPECT_EQ(read.exposure, 60);
  EXPECT_EQ(read.exposures, 1);
  EXPECT_EQ(read.read_noise, 4);
  EXPECT_EQ(read.dark, 0);
  EXPECT_FALSE(read.full_well);
  EXPECT_FALSE(read.is_moffat);
  EXPECT_EQ(read.band("sdss_r").zero_point, 25);
  EXPECT_EQ(read.band("sdss_r").fwhm, 1.5);
  EXPECT_FALSE(read.band("sdss_r").sky);
}

TEST(Instrument, SaysWhatIsWrong) {
  struct Case {
    std::string text, message;
  };
  const Case cases[] = {
      {band, "a.toml: an instrument needs [instrument]"},
      {camera, "a.toml: an instrument needs [[band]] with name, zero_point and fwhm"},
      {camera + band + band, "a.toml:11:8: band 'sdss_r' stands twice"},
      {camera + "[[bands]]\n" + band,
       "unknown section 'bands' in an instrument; did you mean 'band'?"},
      {camera + "[[band]]\nname = \"sdss_r\"\nfwhm = 1\n", "zero_point"},
      {camera + "gian = 2\n" + band, "did you mean 'gain'?"},
      {"[instrument]\nname = \"A camera\"\npixel_scale = -1\nexposure = 60\nread_noise = 4\n" +
           band,
       "a.toml:3:15"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_NE(error_text([&] { Instrument::parse(text, "a.toml"); }).find(message),
              std::string::npos)
        << message << "\n"
        << error_text([&] { Instrument::parse(text, "a.toml"); });
  }
  const Instrument read = Instrument::parse(camera + band, "a.toml");
  EXPECT_EQ(error_text([&] { read.band("sdss_t"); }),
            "A camera has no band 'sdss_t'; it has sdss_r; did you mean 'sdss_r'?");
}

}  // namespace
}  // namespace gamer::instrument_test
