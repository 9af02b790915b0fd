#include "gamer/scene/scene_settings.h"

#include <fmt/ranges.h>

#include <vector>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/scene/scene_columns.h"
#include "scene/usual_names.h"

namespace gamer {
namespace {

constexpr double most_frames = 999999;

BoundTable scene_keys(SceneSettings& p) {
  return {
      choice(p.unit, "unit", {{"arbitrary", ""}, {"pc", "pc"}, {"kpc", "kpc"}, {"Mpc", "Mpc"}},
             "unit of positions and sizes"),
      Parameter::texts(
          "overrides", std::vector<std::string>(),
          "parameters that replace those of galaxy files, as TYPE.COMPONENT.key=value; sections "
          "[galaxy.TYPE.COMPONENT] and --set galaxy.TYPE.COMPONENT.key=value add to the list"),
      {p.solo, "solo",
       "name of the only component that galaxies show, with its share of the whole galaxy's light; "
       "dust is hidden"}};
}

/// The format and one key for each column of a scene.
BoundTable catalogue_keys(CatalogueSettings& p) {
  BoundTable table = {
      choice(p.format, "format",
             {{"auto", CatalogueFormat::automatic},
              {"list", CatalogueFormat::list},
              {"csv", CatalogueFormat::csv},
              {"votable", CatalogueFormat::votable},
              {"fits", CatalogueFormat::fits},
              {"ecsv", CatalogueFormat::ecsv},
              {"sextractor", CatalogueFormat::sextractor},
              {"skymaker", CatalogueFormat::skymaker}},
             "format of the file; auto: recognised by its content"),
      without_default(
          {p.hdu, "hdu",
           "name or number of the table in a FITS file or VOTable; by default the first"}),
      {p.skip_flagged, "skip_flagged",
       "leave out rows with flags for missing values (99, -99...); otherwise they are an error"}};
  for (std::size_t c = 0; c < scene_columns().size(); ++c) {
    const std::string& name = scene_columns()[c].name;
    std::vector<std::string> usual;
    for (const auto& group : usual_names(static_cast<column::Column>(c))) {
      usual.push_back(fmt::format("`{}`", fmt::join(group, "` or `")));
    }
    const std::string otherwise = usual.empty() ? ""
                                                : fmt::format("; by default `{}`, else {}", name,
                                                              fmt::join(usual, ", else "));
    table.push_back(Parameter::text(
        name, std::nullopt,
        fmt::format("the catalogue's column for `{}`, or `=word` for this word in every row{}",
                    name, otherwise)));
  }
  return table;
}

BoundTable animation_keys(AnimationSettings& p) {
  return {
      without_default({p.frames, "frames", "", Interval::closed(1, most_frames),
                       "number of images; the first image shows the first key frame, the last "
                       "image shows the last"}),
      Parameter::numbers("times", "", Interval::any(), std::nullopt,
                         "times of the key frames, ascending, in any unit; by default 0, 1, 2..."),
      Parameter::numbers(
          "position", "scene units", Interval::any(), std::nullopt,
          "camera.position in each key frame, one after another: x, y, z, x, y, z..."),
      Parameter::numbers("target", "scene units", Interval::any(), std::nullopt,
                         "camera.target in each key frame"),
      Parameter::numbers("up", "scene units", Interval::any(), std::nullopt,
                         "camera.up in each key frame; by default camera.up is constant"),
      Parameter::numbers("fov", "deg", Interval::left_open(0, 360), std::nullopt,
                         "camera.fov in each key frame"),
      Parameter::numbers("width", "scene units", Interval::positive(), std::nullopt,
                         "camera.width in each key frame"),
      without_default({p.tone_frame, "tone_frame", "", Interval::closed(1, most_frames),
                       "frame on which image.tone of all pictures is measured; by default 1"})};
}

}  // namespace

ParameterSection SceneSettings::section() {
  return {"scene", "The scene list.", declarations(scene_keys)};
}

SceneSettings SceneSettings::read(const ParameterSet& values) {
  SceneSettings result = read_object(values, scene_keys);
  for (const std::string& assignment : values.texts("overrides")) {
    set_from_text(result.overrides, assignment, "galaxy.");
  }
  return result;
}

std::optional<double> SceneSettings::megaparsec() const {
  if (unit == "pc") return 1e-6;
  if (unit == "kpc") return 1e-3;
  if (unit == "Mpc") return 1.0;
  return std::nullopt;
}

ParameterSection CatalogueSettings::section() {
  return {"catalogue",
          "How a catalogue is read as a scene. Names match in any case. `{band}` stands for "
          "photometry.reference_band, and `{letter}` for the part after its last `_`.",
          declarations(catalogue_keys)};
}

CatalogueSettings CatalogueSettings::read(const ParameterSet& values) {
  CatalogueSettings result = read_object(values, catalogue_keys);
  for (const Parameter& column : scene_columns()) {
    if (values.has(column.name)) result.columns[column.name] = values.text(column.name);
  }
  return result;
}

ParameterSection AnimationSettings::section() {
  return {"animation", "A film: numbered images of a moving camera.", declarations(animation_keys)};
}

AnimationSettings AnimationSettings::read(const ParameterSet& values) {
  AnimationSettings result = read_object(values, animation_keys);
  if (values.has("tone_frame") && result.tone_frame > result.frames) {
    throw input_error(values.where("tone_frame"), "tone_frame = {} is beyond the last frame, {}",
                      result.tone_frame, result.frames);
  }
  for (const Parameter& parameter : values.table()) {
    if (result.frames == 0 && values.is_given(parameter.name) && values.has(parameter.name)) {
      throw input_error(values.where(parameter.name), "animation.{} needs animation.frames",
                        parameter.name);
    }
  }
  return result;
}

}  // namespace gamer
