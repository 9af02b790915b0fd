// A damaged catalogue gives a scene, or an error that names the file.

#include <gtest/gtest.h>

#include <string>

#include "gamer/image/data_table.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene.h"
#include "image/damage.h"
#include "image/image_test_util.h"
#include "scene/scene_checks.h"

namespace gamer::damaged_catalogue_test {
namespace {

const char* const galaxy = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";
const char* const view =
    "[image]\nsize = 100\n[spectrum]\nwavelengths = [5500]\n"
    "[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 1\n";

class DamagedCatalogues : public testing::Test {
 protected:
  /// Reads the scene of a catalogue.
  void read(const Catalogue& catalogue) {
    Resources resources =
        Resources::from_record({{"galaxies/smooth", "galaxies/smooth.toml", galaxy}});
    read_scene(catalogue, parameters_, spectrum_, camera_, resources);
  }

  TemporaryFolder folder_;
  RenderParameters parameters_ = test::parameters_of(view);
  Camera camera_ = Camera(parameters_);
  Resources none_ = Resources::from_record({});
  Spectrum spectrum_ = load_spectrum(parameters_, none_);
  DataTable table_ = {"OBJECTS",
                      {{"galaxy", "", "", std::vector<std::string>{"smooth", "smooth"}},
                       {"ra", "deg", "", std::vector<double>{150, 150.001}},
                       {"dec", "deg", "", std::vector<double>{2, 2.001}},
                       {"size_arcsec", "arcsec", "", std::vector<double>{2, 3}},
                       {"seed", "", "", std::vector<std::int64_t>{1, 2}}},
                      {}};
};

TEST_F(DamagedCatalogues, FitsTables) {
  write_fits_table(folder_ / "good.fits", table_, {});
  const std::string good = file_bytes(folder_ / "good.fits");
  const auto path = folder_ / "damaged.fits";
  read(Catalogue::from_table(read_data_table(folder_ / "good.fits"), "good.fits"));
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned) { return damage.of_fits(good); },
      [&] { read(Catalogue::from_table(read_data_table(path), path.string())); });
}

TEST_F(DamagedCatalogues, EcsvFiles) {
  write_ecsv(folder_ / "good.ecsv", table_);
  const std::string good = file_bytes(folder_ / "good.ecsv");
  const auto path = folder_ / "damaged.ecsv";
  read(Catalogue::parse(good, "good.ecsv", CatalogueFormat::automatic));
  expect_errors_that_name(
      path, [&](Damage& damage, unsigned) { return damage.of_text(good); },
      [&] {
        const std::string text = file_bytes(path);
        read(Catalogue::parse(text, path.string(), CatalogueFormat::automatic));
      });
}

}  // namespace
}  // namespace gamer::damaged_catalogue_test
