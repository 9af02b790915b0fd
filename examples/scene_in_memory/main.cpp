// Builds a galaxy and a scene in memory, renders them with a progress bar, and prints the
// properties of each object. Only spectra and bands are read from files.
//
//   scene_in_memory [output.fits]

#include <gamer/gamer.h>

#include <iostream>
#include <string>
#include <variant>

namespace {

constexpr const char* galaxy = R"(
[[component]]
class = "bulge"
sed = "E"
fraction = 0.2
effective_radius = 0.08

[[component]]
class = "disk"
sed = "Sbc"
fraction = 0.8
rh = 0.25
z0 = 0.02
noise = false

[[component]]
class = "dust"
optical_depth = 1.5
rh = 0.3
z0 = 0.01
noise = false
)";

constexpr const char* view = R"(
[image]
size = [64, 48]
[camera]
projection = "sky"
center = [150.1, 2.2]
pixel_scale = 0.2
[spectrum]
bands = ["lsst_g", "lsst_r"]
[sampling]
tolerance = 1e-2
)";

/// Three galaxies in a row, each farther away than the last.
gamer::DataTable objects() {
  gamer::DataTable table;
  table.columns.push_back({"galaxy", "", "", std::vector<std::string>(3, "mine")});
  table.columns.push_back({"dx", "arcsec", "", std::vector<double>{-4, 0, 4}});
  table.columns.push_back({"dy", "arcsec", "", std::vector<double>{0, 0, 0}});
  table.columns.push_back({"redshift", "", "", std::vector<double>{0.2, 0.3, 0.4}});
  table.columns.push_back({"size_kpc", "kpc", "", std::vector<double>{15, 15, 15}});
  table.columns.push_back({"magnitude", "mag", "", std::vector<double>{-21, -21, -21}});
  table.columns.push_back({"inclination", "deg", "", std::vector<double>{20, 60, 85}});
  table.columns.push_back({"pa", "deg", "", std::vector<double>{0, 30, 60}});
  return table;
}

const std::vector<double>& numbers(const gamer::DataTable& table, const std::string& name) {
  for (const gamer::DataColumn& column : table.columns) {
    if (column.name == name) return std::get<std::vector<double>>(column.values);
  }
  throw std::out_of_range(name);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    gamer::Session session;
    gamer::RenderInput input;
    input.parameters = view;
    input.scene = objects();
    input.galaxies["mine"] = galaxy;

    gamer::RenderControl control;
    control.truth = true;
    control.progress = [](const gamer::RenderProgress& now) {
      if (now.stage != gamer::RenderProgress::Stage::rows) return;
      std::cerr << '\r' << now.done << " of " << now.total << " rows" << std::flush;
    };
    const gamer::Rendering rendering = session.render(session.load(input), control);
    std::cerr << '\n';

    const gamer::ImageHeader header = rendering.header();
    std::cout << header.width << " x " << header.height << " pixels in " << header.unit << '\n';
    const gamer::DataTable& truth = *rendering.truth;
    for (std::size_t row = 0; row < truth.rows(); ++row) {
      std::cout << "galaxy " << row + 1 << ": r = " << numbers(truth, "mag_lsst_r")[row]
                << " mag, without dust " << numbers(truth, "mag_dustfree_lsst_r")[row] << '\n';
    }
    if (argc > 1) rendering.write(argv[1], true);
  } catch (const gamer::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
