#include "studio/scene_orientation.h"

#include <cstddef>
#include <map>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/scene/catalogue.h"
#include "studio/document.h"

namespace gamer {
namespace {

/// The words of a column of a list; none where it lacks the column.
std::vector<std::string_view> words_of(const Catalogue& list, std::string_view name) {
  for (const Catalogue::Column& column : list.columns()) {
    const auto* cells = std::get_if<std::vector<std::string_view>>(&column.cells);
    if (column.name == name && cells != nullptr) return *cells;
  }
  return {};
}

/// The job of a document as a film, whose list has orientations in space.
RenderJob load_film(const Session& session, const std::string& label,
                    const PageDocument& document) {
  RenderParameters parameters = parameters_of(document, label, session.folders());
  if (parameters.camera.projection == Projection::sky) throw InputError("a sky view has one side");
  if (parameters.animation.frames == 0) parameters.set("animation", "frames", std::int64_t{1});
  return session.load(
      {parameters.toml(), RenderInput::Text{document.scene}, document.galaxies, {}, label});
}

}  // namespace

std::string fix_orientations(const Session& session, const std::string& label,
                             const PageDocument& document) {
  edit_scene(document.scene, {}, label);
  const RenderJob job = load_film(session, label, document);
  const Catalogue given = Catalogue::parse(document.scene, label, CatalogueFormat::automatic);
  const std::string text(job.scene->list);
  const Catalogue fixed = Catalogue::parse(text, label, CatalogueFormat::list);
  std::map<std::string, std::vector<std::string_view>> axes;
  for (const char* axis : {"ox", "oy", "oz", "pa"}) axes[axis] = words_of(fixed, axis);
  std::vector<SceneEdit> edits;
  for (const char* name : {"inclination", "axis_ratio"}) {
    const std::vector<std::string_view> words = words_of(given, name);
    const std::vector<std::string_view> kept = words_of(fixed, name);
    for (std::size_t i = 0; i < job.scene->kept.size() && !words.empty(); ++i) {
      const std::size_t row = job.scene->kept[i];
      if (words[row] == "-") continue;
      const int number = static_cast<int>(row);
      // The flattening of a galaxy that is made from its row stays.
      if (kept.empty() || kept[i] == "-") edits.push_back(SetCellEdit{number, name, "-"});
      for (const auto& [axis, fixed_words] : axes) {
        edits.push_back(SetCellEdit{number, axis, std::string(fixed_words.at(i))});
      }
    }
  }
  return edit_scene(document.scene, edits, label);
}

}  // namespace gamer
