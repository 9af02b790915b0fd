// Fuzzes the reader of catalogues in FITS files with any bytes.

#include <cstdint>
#include <string>

#include "fuzz_folder.h"
#include "gamer/image/data_table.h"
#include "scene_views.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const SceneViews views;
  static const FuzzFolder folder;
  const std::string name = folder.write("a.fits", data, size);
  expect_errors_only(
      [&] { views.read(gamer::Catalogue::from_table(gamer::read_data_table(name), name)); });
  return 0;
}
