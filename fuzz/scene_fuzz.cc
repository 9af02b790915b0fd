// Fuzzes catalogues with any text: a scene list, a plain table, CSV, a VOTable, ECSV, SExtractor's
// or SkyMaker's list.

#include <cstdint>
#include <string_view>

#include "scene_views.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const SceneViews views;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  expect_errors_only([&] {
    views.read(gamer::Catalogue::parse(text, "scene.lst", gamer::CatalogueFormat::automatic));
  });
  return 0;
}
