// Damaged files of every kind: each is read, or ends in an error that names the file.

#include <fitsio.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error_text.h"
#include "gamer/image/data_table.h"
#include "gamer/image/fits/checksums.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/picture.h"
#include "gamer/image/png_table.h"
#include "gamer/image/wcs.h"
#include "image/damage.h"
#include "image/fits/fits_file.h"
#include "image/image_test_util.h"

namespace gamer::damaged_files_test {
namespace {

const TextTable inputs = {
    "INPUTS",
    {"NAME", "TEXT"},
    {{"render.par", "[image]\nsize = 3\n"}, {"scene.lst", "galaxy x y z\nspiral 0 0.7 0\n"}},
    {}};

/// The header of a cube of two planes on the sky, with the texts of a job.
ImageHeader header() {
  ImageHeader result = test_header(9, 7, {4400, 5500});
  SkyView view;
  view.width = result.width;
  view.height = result.height;
  view.center = {150, 2};
  result.wcs_records = CelestialWcs(view).records();
  result.tables = {inputs};
  return result;
}

std::string compressed_by_gzip(const std::filesystem::path& path, const std::string& bytes) {
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  return file_bytes(path);
}

class DamagedFiles : public testing::Test {
 protected:
  std::string image(const char* suffix) const {
    const OutputOptions options{folder_ / (std::string("good") + suffix), -32, ImageLayout::cube,
                                true};
    write_test_image(options, header());
    return file_bytes(options.path);
  }

  TemporaryFolder folder_;
};

void read_planes(const std::string& name) {
  const FitsInput input(name);
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    constexpr long long most_pixels = 1 << 20;
    if (!hdu.is_image() || 1LL * hdu.width * hdu.height > most_pixels) continue;
    std::vector<double> values(static_cast<std::size_t>(hdu.width) * hdu.height);
    for (const int plane : {0, hdu.planes - 1}) {
      input.plane(i, plane)->read({0, 0, hdu.width, hdu.height}, values.data());
    }
  }
}

TEST_F(DamagedFiles, FitsImages) {
  const std::vector<std::string> good = {image(".fits"), image(".fits.fz")};
  const auto path = folder_ / "damaged.fits";
  const auto make = [&](Damage& damage, unsigned seed) {
    const std::string bytes = damage.of_fits(good[seed % good.size()]);
    return seed % 8 == 0 ? compressed_by_gzip(folder_ / "packed", bytes) : bytes;
  };
  expect_errors_that_name(path, make, [&] { read_planes(path.string()); });
  expect_errors_that_name(path, make, [&] { read_fits(path); });
  expect_errors_that_name(path, make, [&] { check_sums(path); });
}

TEST_F(DamagedFiles, GzipStreams) {
  const std::string good = compressed_by_gzip(folder_ / "packed", image(".fits"));
  const auto path = folder_ / "damaged.fits";
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned) { return damage.of_bytes(good); },
      [&] { read_planes(path.string()); });
}

TEST_F(DamagedFiles, Headers) {
  const std::vector<std::string> good = {image(".fits"), image(".fits.fz")};
  const auto path = folder_ / "damaged.fits";
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned seed) { return damage.of_fits(good[seed % good.size()]); },
      [&] { CelestialWcs::from_header(header_text(path), path.string()); });
}

TEST_F(DamagedFiles, RecordsAreReadAsTheyWereWritten) {
  const std::string good = image(".fits");
  const auto path = folder_ / "damaged.fits";
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned) { return damage.of_fits(good); },
      [&] { EXPECT_EQ(read_fits_table(path, "INPUTS").rows, inputs.rows); });
}

TEST_F(DamagedFiles, PngPictures) {
  PictureFileOptions options;
  options.name = folder_ / "good.png";
  options.tables = {pack_png_table(inputs)};
  PictureFile file(options, 2, 1);
  const std::uint16_t row[] = {1, 2, 3, 40000, 50000, 65535};
  file.write_row(row);
  file.finish();
  const std::string good = file_bytes(folder_ / "good.png");
  const auto path = folder_ / "damaged.png";
  const auto make = [&](Damage& damage, unsigned) { return damage.of_bytes(good); };
  expect_errors_that_name(path, make,
                          [&] { EXPECT_EQ(read_png_table(path, "INPUTS").rows, inputs.rows); });
  expect_errors_that_name(path, make, [&] {
    check_sums(path);
    EXPECT_EQ(file_bytes(path), good);
  });
}

TEST_F(DamagedFiles, Catalogues) {
  const DataTable table = {"OBJECTS",
                           {{"ra", "deg", "", std::vector<double>{150, 151}},
                            {"id", "", "", std::vector<std::int64_t>{1, 2}},
                            {"galaxy", "", "", std::vector<std::string>{"spiral", "disk"}}},
                           {}};
  write_fits_table(folder_ / "good.fits", table, {});
  const std::string good = file_bytes(folder_ / "good.fits");
  const auto path = folder_ / "damaged.fits";
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned) { return damage.of_fits(good); },
      [&] { read_data_table(path); });
}

TEST_F(DamagedFiles, ExtendedNames) {
  image(".fits");
  const std::string path = folder_ / "good.fits";
  for (const char* shape : {"[0]", "[0][2:3,4:5]", "[INPUTS,1]", "[1:9:2,*,*]"}) {
    for (unsigned seed = 0; seed < damaged_files / 4; ++seed) {
      Damage damage(seed);
      std::string name = shape;
      for (std::size_t i = damage.below(4); i > 0; --i) {
        name.insert(damage.below(name.size()), name.substr(damage.below(name.size())));
        name = "[" + damage.of_text(name);
      }
      SCOPED_TRACE(name);
      try {
        read_planes(path + name);
      } catch (const InputError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(path)) << error.what();
      }
    }
  }
  std::string many;
  for (int i = 0; i < 5000; ++i) many += "[0]";
  EXPECT_NE(error_text([&] { read_planes(path + many); }).find("expected the number or the name"),
            std::string::npos);
  const std::string section = "[0][" + std::string(5000, '1') + ":2,1:2]";
  EXPECT_NE(error_text([&] { read_planes(path + section); }).find("expected the number"),
            std::string::npos);
}

// ---- Headers that CFITSIO must not see ---------------------------------------------------------

class HeaderCards : public DamagedFiles {
 protected:
  /// The error of reading a file with these first cards and no data.
  std::string error(const std::vector<std::string>& cards) const {
    const auto path = folder_ / "x.fits";
    std::string bytes;
    for (std::string card : cards) {
      card.resize(80, ' ');
      bytes += card;
    }
    bytes.resize((bytes.size() + 2879) / 2880 * 2880, ' ');
    std::ofstream(path, std::ios::binary) << bytes;
    const std::string message = error_text([&] { FitsFile::open(path, "x.fits"); });
    // Every reader gives this message.
    const std::string named = path.string() + message.substr(std::string("x.fits").size());
    EXPECT_EQ(error_text([&] { FitsInput(path.string()); }), named);
    EXPECT_EQ(error_text([&] { read_data_table(path); }), named);
    EXPECT_EQ(error_text([&] { header_text(path); }), named);
    EXPECT_EQ(error_text([&] { read_fits_table(path, "INPUTS"); }), named);
    EXPECT_EQ(error_text([&] { check_sums(path); }), named);
    EXPECT_EQ(error_text([&] { FitsInput(path.string() + "[0]"); }).substr(0, path.string().size()),
              path.string());
    return message;
  }

  static std::string card(const std::string& key, const std::string& value) {
    return key + std::string(8 - key.size(), ' ') + "= " + value;
  }
  std::vector<std::string> image_cards(const std::string& axes, const std::string& first) const {
    return {card("SIMPLE", "T"),   card("BITPIX", "8"), card("NAXIS", axes),
            card("NAXIS1", first), card("NAXIS2", "2"), "END"};
  }
};

TEST_F(HeaderCards, SizesThatCannotBe) {
  for (const char* axes : {"-1", "100", "140", "999", "1.5", "two", "'2'", "", "1 2", "2E0"}) {
    EXPECT_EQ(error(image_cards(axes, "3")), "x.fits: HDU 0: NAXIS has a value that cannot be");
  }
  for (const char* first : {"-3", "1.5", "T", "99999999999999999999", ""}) {
    EXPECT_EQ(error(image_cards("2", first)), "x.fits: HDU 0: NAXIS1 has a value that cannot be");
  }
  std::vector<std::string> many = image_cards("140", "1");
  many.pop_back();
  for (int axis = 3; axis <= 140; ++axis) many.push_back(card("NAXIS" + std::to_string(axis), "1"));
  many.emplace_back("END");
  EXPECT_EQ(error(many), "x.fits: HDU 0: NAXIS has a value that cannot be");
}

TEST_F(HeaderCards, SizesThatOverflow) {
  const std::string cannot_be = "x.fits: HDU 0: its sizes cannot be";
  std::vector<std::string> square = image_cards("2", "4294967296");
  square[4] = card("NAXIS2", "4294967296");
  EXPECT_EQ(error(square), cannot_be);
  // The product of the sizes is infinity times 0.
  std::vector<std::string> many = {card("SIMPLE", "T"), card("BITPIX", "8"), card("NAXIS", "20")};
  for (int axis = 1; axis <= 20; ++axis) {
    many.push_back(card("NAXIS" + std::to_string(axis), axis == 20 ? "0" : "9000000000000000000"));
  }
  many.emplace_back("END");
  EXPECT_EQ(error(many), cannot_be);
}

TEST_F(HeaderCards, RandomGroups) {
  std::vector<std::string> cards = image_cards("2", "0");
  for (const char* first :
       {"GROUPS  = F", "GROUPS    T", "GROUPS=T", "groups  = T", "HIERARCH GROUPS = T"}) {
    cards.resize(5);
    cards.insert(cards.end(), {first, card("GROUPS", "T"), "END"});
    EXPECT_EQ(error(cards), "x.fits: HDU 0: random groups are no image") << first;
    cards.erase(cards.begin() + 6);
    EXPECT_EQ(error(cards), "x.fits: HDU 0: random groups are no image") << first;
  }
}

TEST_F(HeaderCards, NamesThatOnlyCfitsioSees) {
  for (const char* record : {"PCOUNT=2880", "HIERARCH PCOUNT = 2880", "PCOUNT = 2880"}) {
    std::vector<std::string> cards = image_cards("2", "3");
    cards.insert(cards.end() - 1, record);
    EXPECT_EQ(error(cards), "x.fits: HDU 0: PCOUNT has a value that cannot be") << record;
  }
}

TEST_F(HeaderCards, CardsOutOfPlace) {
  std::vector<std::string> cards = image_cards("2", "3");
  std::swap(cards[1], cards[2]);
  EXPECT_EQ(error(cards), "x.fits: HDU 0: card 2 must be BITPIX");
  EXPECT_EQ(error(image_cards("3", "3")), "x.fits: HDU 0: cards of its sizes are missing");
  cards = image_cards("2", "3");
  cards.insert(cards.end() - 1, card("NAXIS1", "3"));
  EXPECT_EQ(error(cards), "x.fits: HDU 0: NAXIS1 stands there twice");
  cards = image_cards("2", "3");
  cards[5] = card("END", "3");
  EXPECT_EQ(error(cards), "x.fits: HDU 0: text stands behind END");
  cards.pop_back();
  EXPECT_EQ(error(cards), "x.fits: HDU 0: the file ends before its header does (END)");
}

TEST_F(HeaderCards, Tables) {
  const DataTable table = {"T", {{"x", "", "", std::vector<double>{1, 2}}}, {}};
  write_fits_table(folder_ / "good.fits", table, {});
  const std::string good = file_bytes(folder_ / "good.fits");
  const auto path = folder_ / "x.fits";
  for (const char* key : {"PCOUNT  =", "GCOUNT  =", "TFIELDS ="}) {
    std::string bytes = good;
    bytes[bytes.find(key, bytes.find("XTENSION"))] = 'X';
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_EQ(error_text([&] { read_data_table(path); }),
              path.string() +
                  ": HDU 1: a table begins with BITPIX = 8, NAXIS = 2, NAXIS1, NAXIS2, PCOUNT, "
                  "GCOUNT, TFIELDS, in this order");
  }
}

}  // namespace
}  // namespace gamer::damaged_files_test
