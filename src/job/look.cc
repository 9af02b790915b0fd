#include "gamer/job/look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "core/message.h"
#include "gamer/core/config.h"
#include "gamer/core/random.h"
#include "gamer/core/units.h"
#include "gamer/job/job.h"
#include "gamer/job/record.h"
#include "gamer/scene/background.h"

namespace gamer {
namespace {

constexpr const char* label = "gamer look";

// The nucleus may become white, as in photographs of galaxies, so that the disk keeps its contrast.
constexpr const char* picture = R"([sampling]
tolerance = 0.01
[image]
size = [640, 640]
output = {}
brightness = 1.2
contrast = 3
saturation = 1.2
)";

// Stars, clusters and diffuse light are blurred alike, by one pixel, as in the sharpest
// photographs.
constexpr const char* style_in_space = "seeing = 1\n";

constexpr const char* style_of_sky = R"(seeing = 1.2
sky = 0.03
grain = 0.008
grain_seed = {}
[stars]
spikes = 0.06
)";

// Blue, green, and red with H alpha, unless the user chooses planes.
constexpr const char* colours = R"([spectrum]
bands = ["bessell_b", "bessell_v", "red_halpha"]
)";

constexpr const char* view_in_space = R"([camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 2
)";

constexpr const char* view_of_sky = R"([photometry]
reference_band = "red_halpha"
[camera]
projection = "sky"
center = [180, 0]
)";

// A galaxy in front of a sky. Its mean surface brightness within its ball is 22.2 mag arcsec^-2 in
// the red, as for M100 and M51.
constexpr double sky_radius = 200;     // of the galaxy's ball, arcsec
constexpr double sky_magnitude = 9.5;  // AB
constexpr double sky_distance = 10;    // Mpc
// Limits of Background. Background has magnitudes in i, which are taken here as magnitudes in the
// red plane. Numbers and sizes thus belong to objects whose i has the value of the red magnitude.
// Such objects are some tenths of a magnitude fainter in red.
constexpr double faintest_galaxies = 22;
constexpr double star_number = 1;  // arcmin^-2

bool chooses(const std::vector<std::string>& settings, std::string_view key) {
  return std::ranges::any_of(
      settings, [key](const std::string& setting) { return setting.starts_with(key); });
}

/// The seed of the sky: each galaxy has its own.
std::uint64_t seed_of(const Look& look) {
  return hash_text(0, std::filesystem::path(look.galaxy).stem().string());
}

std::string parameters_text(const Look& look, const std::vector<std::string>& settings) {
  const std::string name = std::filesystem::path(look.galaxy).stem().string() + ".png";
  std::string text = fmt::format(fmt::runtime(picture), toml_string(name));
  if (look.has_sky) {
    text += fmt::format(fmt::runtime(style_of_sky), seed_of(look) % PictureStyle::most_grain_seed);
  } else if (look.has_seeing) {
    text += style_in_space;
  }
  if (!chooses(settings, "spectrum.bands") && !chooses(settings, "spectrum.wavelengths")) {
    text += colours;
  }
  if (!look.has_sky) return text + view_in_space;
  text += view_of_sky;
  if (chooses(settings, "camera.pixel_scale") || chooses(settings, "camera.instrument")) {
    return text;
  }
  ConfigNode root = parse_toml(text, label);
  for (const std::string& setting : settings) set_from_text(root, setting);
  const RenderParameters parameters = RenderParameters::read(root);
  return text + fmt::format("pixel_scale = {:.6g}\n",
                            2 * sky_radius / std::min(parameters.width, parameters.height));
}

/// The scene list of a galaxy with this inclination and position angle in `view_in_space`.
/// The axis is in scene coordinates, so that a moved camera sees the galaxy from another side. The
/// line of nodes is at `position_angle` from +y, a right angle more than that from +x.
std::string scene_list(const Look& look) {
  const double tilt = look.inclination * degree, angle = look.position_angle * degree;
  return fmt::format("galaxy,x,y,z,ox,oy,oz,pa\n\"{}\",0,0,0,{},{},{},{}\n", look.galaxy,
                     std::sin(tilt) * std::cos(angle), std::sin(tilt) * std::sin(angle),
                     std::cos(tilt), std::remainder(look.position_angle + 90, 360));
}

/// Throws InputError where settings contradict a view of the sky.
void check_sky(const std::vector<std::string>& settings) {
  for (const std::string_view key : {"camera.projection", "scene.solo"}) {
    if (chooses(settings, key)) {
      throw input_error({label, 0, 0}, "--sky shows a whole galaxy on the sky: leave out {}", key);
    }
  }
}

/// The scene list of a galaxy in the middle of a view of the sky, with stars and faint galaxies.
std::string sky_list(const Look& look, const std::vector<std::string>& settings,
                     Resources& resources) {
  JobRequest request;
  request.settings = settings;
  RenderParameters parameters = load_parameters(request, resources);
  const Camera camera = make_camera(parameters, resources);
  Background background;
  background.faintest = faintest_galaxies;
  background.star_number = star_number;
  background.seed = seed_of(look);
  // A list with commas holds any name of a file.
  std::istringstream rows(background_list(background, camera));
  std::string list, row;
  while (std::getline(rows, row)) {
    std::ranges::replace(row, ' ', ',');
    list += row + (list.empty() ? ",distance,size_arcsec\n" : ",-,-\n");
  }
  const std::vector<double>& middle = parameters.section("camera").numbers("center");
  return list + fmt::format("\"{}\",{},{},-,-,{},{},{},-,-,{},{}\n", look.galaxy, middle[0],
                            middle[1], sky_magnitude, look.inclination, look.position_angle,
                            sky_distance, sky_radius);
}

}  // namespace

void add_look(const Look& look, const std::vector<std::string>& settings, Resources& resources) {
  if (look.galaxy.find_first_of("\"\n\r") != std::string::npos) {
    throw InputError({label, 0, 0}, "a galaxy's name has no quotes and no line breaks");
  }
  if (look.has_sky) check_sky(settings);
  resources.add({recorded_parameters, label, parameters_text(look, settings)});
  resources.add({recorded_scene, label,
                 look.has_sky ? sky_list(look, settings, resources) : scene_list(look)});
}

}  // namespace gamer
