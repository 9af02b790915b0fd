#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "gamer/processing/operation.h"
#include "image/convolution/convolution.h"
#include "image/convolution/psf.h"
#include "image/image_test_util.h"
#include "image/synthetic_image.h"
#include "processing/plane_info.h"

namespace gamer::blur_operations_test {
namespace {

constexpr int image_width = 60, image_height = 48;
constexpr double scale = 0.05;  // arcsec
const std::vector<double> some_wavelengths = {4000, 5500, 8000};

Image read_image(const FitsInput& input, int plane) { return evaluate(*input.plane(0, plane)); }

double largest_difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.width(), b.width());
  EXPECT_EQ(a.height(), b.height());
  double largest = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      largest = std::max(largest, std::abs(a.at(x, y) - b.at(x, y)));
    }
  }
  return largest;
}

class BlurOperations : public testing::Test {
 protected:
  /// Writes three planes on the sky with the brightness 1, 2 and 3, and one plane without
  /// coordinates.
  BlurOperations() {
    for (int i = 0; i < 3; ++i) {
      planes_.push_back(
          make_plane(image_width, image_height, {Gaussian{26, 20, 3, 2, 30, 10.0 * (i + 1)}}));
    }
    FitsHeader header;
    header.set("BUNIT", std::string("nJy"));
    write("plain.fits", header, {planes_.front()});
    header.set("CTYPE1", std::string("RA---TAN"));
    header.set("CTYPE2", std::string("DEC--TAN"));
    header.set("CRPIX1", 20.5);
    header.set("CRPIX2", 31.0);
    header.set("CRVAL1", 150.1);
    header.set("CRVAL2", 2.2);
    header.set("CDELT1", -scale / 3600);
    header.set("CDELT2", scale / 3600);
    for (std::size_t i = 0; i < some_wavelengths.size(); ++i) {
      header.set("WAVELEN" + std::to_string(i + 1), some_wavelengths[i]);
    }
    write("in.fits", header, planes_);
  }

  void write(const std::string& name, const FitsHeader& header,
             const std::vector<PlanePtr>& planes) const {
    FitsOutput output({path(name), true});
    output.write(header, planes, -64, 1);
    output.finish();
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Runs an operation; words that end in .fits, and brackets behind them, name files of the
  /// folder.
  FitsInput run(const std::string& command) const {
    std::istringstream stream(command);
    std::string name;
    stream >> name;
    std::vector<std::string> arguments;
    for (std::string word; stream >> word;) {
      arguments.push_back(word.find(".fits") == std::string::npos ? word : path(word));
    }
    arguments.emplace_back("--overwrite");
    const Operation& operation = find_operation(name);
    OperationCall call = parse_call(operation, arguments);
    call.threads = 2;
    EXPECT_EQ(operation.run(call), 0);
    expect_fitsverify_clean(call.output);
    return FitsInput(call.output);
  }

  std::string error_of(const std::string& command) const {
    try {
      run(command);
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string folder = folder_.path().string() + "/";
      for (std::size_t at; (at = text.find(folder)) != std::string::npos;) {
        text.erase(at, folder.size());
      }
      return text;
    }
    return "none";
  }

  Image expected(int plane, const PsfModel& model, const StampOptions& stamp = {},
                 const ConvolutionOptions& options = {}) const {
    return evaluate(*convolved(planes_[static_cast<std::size_t>(plane)],
                               make_stamp(Psf(model), stamp), options));
  }

  TemporaryFolder folder_;
  std::vector<PlanePtr> planes_;
};

TEST_F(BlurOperations, ConvolvesEveryPlane) {
  const FitsInput out = run("convolve --psf moffat --fwhm 3.5 --beta 2.5 in.fits out.fits");
  const FitsHdu& hdu = out.hdus().front();
  EXPECT_EQ(hdu.planes, 3);
  EXPECT_EQ(hdu.bitpix, -64);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(largest_difference(read_image(out, i), expected(i, {PsfKind::moffat, 3.5, 2.5})),
              1e-15);
  }
  EXPECT_EQ(hdu.header.text("BUNIT"), "nJy");
  EXPECT_EQ(hdu.header.number("CRPIX1"), 20.5);
  EXPECT_EQ(hdu.header.number("WAVELEN3"), 8000);
  std::string history;
  for (const std::string& record : hdu.header.records()) {
    if (FitsHeader::key_of(record) == "HISTORY") history += record.substr(8);
  }
  EXPECT_NE(history.find("gutil convolve --psf moffat --fwhm 3.5 --beta 2.5"), std::string::npos);
}

TEST_F(BlurOperations, OptionsReachTheModel) {
  PsfModel model{PsfKind::airy, 4, 3, .33, .7, 40};
  StampOptions stamp;
  stamp.size = 21;
  stamp.integrated = false;
  stamp.keep_missing_flux = true;
  const std::string airy =
      "convolve --psf airy --fwhm 4 --obscuration 0.33 --axis-ratio 0.7 --position-angle 40 "
      "--size 21 --sampling point --keep-missing-flux ";
  for (const auto& [name, edge] :
       {std::pair{"zero", EdgeMode::zero}, std::pair{"reflect", EdgeMode::reflect},
        std::pair{"wrap", EdgeMode::wrap}}) {
    const FitsInput out = run(airy + "--edge " + name + " in.fits out.fits");
    // In the middle of the image, North differs from +y by 9e-8 rad.
    EXPECT_LT(largest_difference(read_image(out, 1), expected(1, model, stamp, {edge})), 1.1e-7);
  }
  const FitsInput single = run(airy + "--precision single in.fits out.fits");
  EXPECT_LT(
      largest_difference(read_image(single, 2), expected(2, model, stamp, {EdgeMode::zero, true})),
      3.8e-6);
  const FitsInput small = run("convolve --psf gaussian --fwhm 4 --energy 0.6 in.fits out.fits");
  StampOptions options;
  options.energy = 0.6;
  EXPECT_LT(largest_difference(read_image(small, 0), expected(0, {PsfKind::gaussian, 4}, options)),
            1e-15);
}

TEST_F(BlurOperations, WidthsOfEachPlaneInArcsec) {
  const FitsInput out =
      run("convolve --psf gaussian --fwhm 0.1,0.15,0.2 --unit arcsec in.fits out.fits");
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(largest_difference(read_image(out, i), expected(i, {PsfKind::gaussian, 2.0 + i})),
              2e-7);
  }
}

TEST_F(BlurOperations, WidthsByDiffraction) {
  const FitsInput out =
      run("convolve --psf airy --diameter 2.4 --obscuration 0.33 --size 51 in.fits out.fits");
  StampOptions stamp;
  stamp.size = 51;
  for (int i = 0; i < 3; ++i) {
    // FWHM = 0.97198 lambda/D in rad, times 206264.8 arcsec/rad.
    const double fwhm =
        .97198 * some_wavelengths[static_cast<std::size_t>(i)] * 1e-10 / 2.4 * 206264.8 / scale;
    const Image image = expected(i, {PsfKind::airy, fwhm, 3, .33}, stamp);
    EXPECT_LT(largest_difference(read_image(out, i), image), 1e-4);
  }
}

/// North is 70 deg from +y towards +x, and East is 90 deg further.
TEST_F(BlurOperations, PositionAnglesAreOnTheSky) {
  FitsHeader header;
  SkyView view;
  view.center = {150, 30};
  view.pixel_scale = scale;
  view.rotation = 70;
  view.width = image_width;
  view.height = image_height;
  header.append(CelestialWcs(view).records());
  const PlanePtr point = make_plane(image_width, image_height,
                                    [](int x, int y) { return x == 30 && y == 24 ? 1.0 : 0.0; });
  write("turned.fits", header, {point});
  write("flat.fits", {}, {point});
  const std::string convolve =
      "convolve --psf gaussian --fwhm 6 --axis-ratio 0.5 --position-angle 25 ";
  // The angle from +y is the position angle less that of +y.
  for (const auto& [name, angle] :
       {std::pair("turned.fits", 25.0 - 70), std::pair("flat.fits", 25.0)}) {
    const Moments moments = moments_of(read_image(run(convolve + name + " out.fits"), 0));
    const double from_x = std::atan2(2 * moments.xy, moments.xx - moments.yy) / 2;
    EXPECT_NEAR(std::remainder(from_x * 180 / std::numbers::pi - 90 - angle, 180), 0, 0.02) << name;
  }
}

TEST_F(BlurOperations, PsfImages) {
  const FitsInput psf = run("psf --psf kolmogorov --fwhm 2,3,4 --pixel-scale 0.05 psf.fits");
  const FitsHdu& hdu = psf.hdus().front();
  EXPECT_EQ(hdu.planes, 3);
  EXPECT_EQ(hdu.bitpix, -64);
  EXPECT_EQ(hdu.width, stamp_size(Psf({PsfKind::kolmogorov, 4}), 0.999));
  EXPECT_EQ(hdu.height, hdu.width);
  EXPECT_EQ(hdu.header.number("FWHM2"), 3);
  EXPECT_EQ(hdu.header.number("CRPIX1"), hdu.width / 2 + 1);
  EXPECT_NEAR(pixel_scale(hdu.header, "psf"), 0.05, 1e-9);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(moments_of(read_image(psf, i)).sum, 1, 2e-14);

  const FitsInput by_file = run("convolve --psf psf.fits in.fits out.fits");
  StampOptions stamp;
  stamp.size = hdu.width;
  for (int i = 0; i < 3; ++i) {
    const Image image = expected(i, {PsfKind::kolmogorov, 2.0 + i}, stamp);
    EXPECT_LT(largest_difference(read_image(by_file, i), image), 3e-13);
  }
  // A PSF of one plane serves all planes.
  run("psf --psf gaussian --fwhm 2 one.fits");
  const FitsInput by_one = run("convolve --psf one.fits in.fits out.fits");
  EXPECT_LT(largest_difference(read_image(by_one, 2), expected(2, {PsfKind::gaussian, 2})), 1e-14);
}

TEST_F(BlurOperations, PsfImagesByDiffraction) {
  const FitsInput psf =
      run("psf --psf airy --diameter 2.4 --wavelength 5000,10000 --pixel-scale 0.01 --size 11 "
          "psf.fits");
  const FitsHeader& header = psf.hdus().front().header;
  EXPECT_EQ(psf.hdus().front().planes, 2);
  EXPECT_EQ(header.number("WAVELEN2"), 10000);
  EXPECT_EQ(header.text("CTYPE3"), "WAVE");
  EXPECT_EQ(header.number("CRVAL3"), 5000);
  EXPECT_EQ(header.number("CDELT3"), 5000);
  EXPECT_NEAR(*header.number("FWHM1"), 1.02899 * 5e-7 / 2.4 * 206264.8 / 0.01, 3e-5);
  EXPECT_NEAR(*header.number("FWHM2") / *header.number("FWHM1"), 2, 1e-12);

  // Planes at unequal wavelengths have no wavelength axis.
  const FitsInput three =
      run("psf --psf airy --diameter 2.4 --wavelength 5000,6000,10000 --pixel-scale 0.01 --size 11 "
          "three.fits");
  EXPECT_EQ(three.hdus().front().header.text("CTYPE3"), "PLANE");
  EXPECT_EQ(three.hdus().front().header.number("WAVELEN2"), 6000);
}

TEST_F(BlurOperations, PsfImagesThatAreNone) {
  write("even.fits", {}, {make_plane(4, 3, [](int, int) { return 1.0; })});
  write("two.fits", {}, {planes_.front(), planes_.front()});
  write("nan.fits", {}, {make_plane(3, 3, [](int x, int) {
          return x == 1 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
        })});
  write("zero.fits", {}, {make_plane(3, 3, [](int x, int) { return x - 1.0; })});
  EXPECT_EQ(error_of("convolve --psf even.fits in.fits out.fits"),
            "even.fits: a PSF of 4 x 3 pixels has no middle pixel to be centred on; crop or pad it "
            "to odd sides");
  EXPECT_EQ(error_of("convolve --psf two.fits in.fits out.fits"),
            "gutil convolve: the PSF two.fits has 2 planes, in.fits has 3; one, or one for each is "
            "needed");
  EXPECT_EQ(error_of("convolve --psf nan.fits in.fits out.fits"),
            "nan.fits: pixel (2, 1) of the PSF is nan; a PSF must be finite");
  EXPECT_EQ(error_of("convolve --psf zero.fits in.fits out.fits"),
            "zero.fits: the PSF's pixels sum to 0; the sum must be positive");
  EXPECT_EQ(error_of("convolve --psf none.fits in.fits out.fits"), "none.fits: no such file");
  EXPECT_EQ(error_of("convolve --psf mofat --fwhm 2 in.fits out.fits"),
            "gutil convolve: --psf is 'mofat'; a model (gaussian, moffat, airy, kolmogorov) or a "
            "FITS file is needed; did you mean 'moffat'?");
}

TEST_F(BlurOperations, OptionsThatDoNotFit) {
  const auto convolve = [&](const std::string& options, const std::string& input = "in.fits") {
    return error_of("convolve " + options + " " + input + " out.fits");
  };
  EXPECT_EQ(convolve("--psf gaussian"), "gutil convolve: needs --fwhm");
  EXPECT_EQ(convolve("--psf airy"), "gutil convolve: needs --fwhm, or --diameter");
  EXPECT_EQ(convolve("--psf airy --fwhm 2 --diameter 2"),
            "gutil convolve: --fwhm follows from --diameter; give one of them");
  EXPECT_EQ(convolve("--psf airy --diameter 2 --unit arcsec"),
            "gutil convolve: --unit is of --fwhm, not of --diameter");
  EXPECT_EQ(convolve("--psf gaussian --fwhm 2 --beta 3"),
            "gutil convolve: --beta is of --psf moffat only");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --obscuration 0.1"),
            "gutil convolve: --obscuration is of --psf airy only");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --diameter 2"),
            "gutil convolve: --diameter is of --psf airy only");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --size 4"),
            "gutil convolve: --size is 4; only odd sizes have a middle pixel");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --size 5 --energy 0.9"),
            "gutil convolve: --energy chooses the size; give --size or --energy");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --position-angle 10"),
            "gutil convolve: --position-angle needs an --axis-ratio below 1");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2,3"),
            "gutil convolve: --fwhm has 2 values for 3 planes; give one, or one for each");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2,3,2000"),
            "gutil convolve: plane 3: a FWHM of 2000 pixels; [0.1, 1000] are possible");
  EXPECT_EQ(convolve("--psf moffat --fwhm 2 --unit arcsec", "plain.fits"),
            "plain.fits: no celestial axes; expected RA and DEC as axes 1 and 2");
  EXPECT_EQ(convolve("--psf airy --diameter 2", "plain.fits"),
            "gutil convolve: plain.fits: --diameter needs the wavelength of plane 1, which has no "
            "WAVELEN; give --fwhm");
  EXPECT_EQ(folder_.file_count(), 2U);

  EXPECT_EQ(error_of("psf --psf gaussian --fwhm 2 --unit arcsec out.fits"),
            "gutil psf: --unit arcsec needs --pixel-scale");
  EXPECT_EQ(error_of("psf --psf airy --diameter 2 out.fits"),
            "gutil psf: --diameter needs --pixel-scale");
  EXPECT_EQ(error_of("psf --psf airy --diameter 2 --pixel-scale 0.1 out.fits"),
            "gutil psf: --diameter needs --wavelength");
  EXPECT_EQ(error_of("psf --psf airy --fwhm 2,3 --wavelength 1,2,3 out.fits"),
            "gutil psf: --fwhm has 2 values for 3 planes; give one, or one for each");
}

}  // namespace
}  // namespace gamer::blur_operations_test
