#include "gamer/job/look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "gamer/core/config.h"
#include "gamer/core/units.h"
#include "gamer/job/record.h"

namespace gamer {
namespace {

constexpr const char* label = "gamer look";

constexpr const char* view = R"([image]
size = [640, 640]
output = {}
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 2
[sampling]
tolerance = 0.01
)";

// Blue, green, and red with H alpha, unless the user chooses planes.
constexpr const char* colours = R"([spectrum]
bands = ["bessell_b", "bessell_v", "red_halpha"]
)";

bool chooses_planes(const std::vector<std::string>& settings) {
  return std::ranges::any_of(settings, [](const std::string& setting) {
    return setting.starts_with("spectrum.bands") || setting.starts_with("spectrum.wavelengths");
  });
}

/// The scene list of a galaxy with this inclination and position angle for the camera of `view`.
/// The axis is in scene coordinates, so that a moved camera sees the galaxy from another side. The
/// line of nodes is at `position_angle` from +y, a right angle more than that from +x.
std::string scene_list(const Look& look) {
  const double tilt = look.inclination * degree, angle = look.position_angle * degree;
  return fmt::format("galaxy,x,y,z,ox,oy,oz,pa\n\"{}\",0,0,0,{},{},{},{}\n", look.galaxy,
                     std::sin(tilt) * std::cos(angle), std::sin(tilt) * std::sin(angle),
                     std::cos(tilt), std::remainder(look.position_angle + 90, 360));
}

}  // namespace

void add_look(const Look& look, const std::vector<std::string>& settings, Resources& resources) {
  if (look.galaxy.find_first_of("\"\n\r") != std::string::npos) {
    throw InputError({label, 0, 0}, "a galaxy's name has no quotes and no line breaks");
  }
  const std::string picture = std::filesystem::path(look.galaxy).stem().string() + ".png";
  resources.add({recorded_parameters, label,
                 fmt::format(fmt::runtime(view), toml_string(picture)) +
                     (chooses_planes(settings) ? "" : colours)});
  resources.add({recorded_scene, label, scene_list(look)});
}

}  // namespace gamer
