#include "studio/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "galaxy/galaxy_overrides.h"
#include "gamer/core/clock.h"
#include "gamer/core/config.h"
#include "gamer/galaxy/component.h"
#include "gamer/image/fits/fits_header.h"
#include "gamer/render/output_planes.h"
#include "gamer/scene/galaxy_library.h"
#include "job/make_job.h"
#include "studio/document.h"
#include "studio/frame.h"
#include "studio/model.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

// Largest number of planes of parts. With more of them a view has only the image's planes.
constexpr std::size_t most_part_planes = 96;
// Images of fewer rows are sent whole, since they are soon finished.
constexpr int least_strip_rows = 256;
constexpr double most_frame_bytes = 256.0 * (1 << 20), most_image_bytes = 1024.0 * (1 << 20);

/// The chosen galaxy of a view, and its muted components.
class ChosenGalaxy {
 public:
  ChosenGalaxy(const ViewRequest& request, const std::string& label)
      : name_(request.document.chosen), muted_(request.muted) {
    const auto& galaxies = request.document.galaxies;
    if (name_.empty() && !galaxies.empty()) name_ = galaxies.begin()->first;
    const auto found = galaxies.find(name_);
    if (found == galaxies.end()) return;
    const ConfigNode root = parse_toml(found->second, label);
    names_ = component_names(root);
    kinds_ = component_kinds_of(root);
  }

  bool is(const PlacedGalaxy& placed) const { return name_of_type(placed.type) == name_; }
  /// The number of a component in the file; none for other names.
  std::optional<int> index(const std::string& component) const {
    const auto found = std::ranges::find(names_, component);
    if (found == names_.end()) return std::nullopt;
    return static_cast<int>(found - names_.begin());
  }
  const std::string& component(int index) const { return names_[static_cast<std::size_t>(index)]; }
  bool is_muted(std::optional<int> index) const {
    return index && std::ranges::count(muted_, *index) > 0;
  }
  /// The settings that give muted dust an optical depth of 0.
  std::vector<std::string> settings() const {
    std::vector<std::string> result;
    for (const int index : muted_) {
      if (index >= static_cast<int>(names_.size())) continue;
      const std::string& kind = kinds_[static_cast<std::size_t>(index)];
      if (!find_component_kind(kind, {}).traits.absorbs) continue;
      result.push_back(
          fmt::format("galaxy.{}.{}{}.optical_depth=0", bare_name(name_), kind, index + 1));
    }
    return result;
  }
  bool mutes_light() const {
    return std::ranges::any_of(muted_, [&](int index) {
      return index < static_cast<int>(kinds_.size()) &&
             find_component_kind(kinds_[static_cast<std::size_t>(index)], {}).traits.emits;
    });
  }

 private:
  std::string name_;
  std::vector<int> muted_;
  std::vector<std::string> names_, kinds_;
};

/// A plane of a frame: sums of planes of the render.
struct FramePlane {
  std::optional<int> component;  ///< of the chosen galaxy; none for all else
  std::string name;
  std::size_t plane = 0;  ///< spectral
  std::vector<int> parts;
};

/// The planes of the parts of a rendering by component, the rest last.
std::vector<FramePlane> part_planes(const RenderJob& job, const ChosenGalaxy& chosen) {
  TruthSettings truth;
  truth.parts = TruthSettings::Parts::components;
  std::vector<const PlacedGalaxy*> galaxies(job.scene->objects, nullptr);
  for (const PlacedGalaxy& placed : job.scene->galaxies) galaxies[placed.object] = &placed;
  std::vector<FramePlane> result;
  int number = 0;
  for (const OutputPlane& output : output_planes(*job.scene, job.spectrum, truth)) {
    if (output.kind == OutputPlane::Kind::image) continue;
    const PlacedGalaxy* placed = galaxies[output.object];
    std::optional<int> index;
    std::string name = "rest";
    if (output.kind == OutputPlane::Kind::component && chosen.is(*placed)) {
      std::size_t light = 0;
      for (const auto& component : placed->galaxy->components()) {
        if (component->absorbs() || light++ != output.component) continue;
        index = chosen.index(component->name());
        name = component->name();
      }
    }
    const auto found = std::ranges::find_if(result, [&](const FramePlane& plane) {
      return plane.component == index && plane.plane == output.plane;
    });
    FramePlane& plane = found != result.end() ? *found : result.emplace_back();
    plane.component = index;
    plane.name = name;
    plane.plane = output.plane;
    plane.parts.push_back(number++);
  }
  std::ranges::stable_sort(result, [](const FramePlane& a, const FramePlane& b) {
    const auto key = [](const FramePlane& p) {
      return std::pair(p.component ? *p.component : 1 << 20, p.plane);
    };
    return key(a) < key(b);
  });
  return result;
}

/// Whether parts are few enough to be kept for all pixels.
bool can_have_parts(const RenderJob& job) {
  std::size_t parts = job.scene->stars.size();
  for (const PlacedGalaxy& placed : job.scene->galaxies) {
    parts += placed.galaxy->components().size();
  }
  return parts * job.spectrum.planes.size() <= most_part_planes;
}

/// The numbers and texts of the cards of world coordinates; null for views of the sphere.
Json wcs_json(const Camera& camera) {
  Json cards = Json::object();
  if (!camera.wcs()) {
    if (is_sphere(camera.projection())) return nullptr;
    int number = 0;
    for (const LinearAxis& axis : {camera.x_axis(), camera.y_axis()}) {
      ++number;
      cards[fmt::format("CTYPE{}", number)] = axis.type;
      cards[fmt::format("CUNIT{}", number)] = axis.unit;
      cards[fmt::format("CRPIX{}", number)] = axis.reference_pixel;
      cards[fmt::format("CRVAL{}", number)] = axis.reference_value;
      cards[fmt::format("CDELT{}", number)] = axis.step;
    }
    return cards;
  }
  const FitsHeader records(camera.wcs_records());
  for (const std::string& record : records.records()) {
    const std::string key = FitsHeader::key_of(record);
    if (key.empty() || key == "COMMENT" || key == "HISTORY") continue;
    if (const auto number = records.number(key)) {
      cards[key] = *number;
    } else if (const auto text = records.text(key)) {
      cards[key] = *text;
    }
  }
  return cards;
}

/// The renderer of a view's levels.
class LevelView {
 public:
  LevelView(const Session& session, const ViewRequest& request, const std::string& label)
      : session_(session),
        label_(label),
        document_(request.document),
        chosen_(request, label),
        wants_components_(request.wants_components) {
    for (const std::string& setting : chosen_.settings()) document_.settings.push_back(setting);
    parameters_ = parameters_of(document_, label_, session.folders());
  }

  /// Renders a level, and returns its frame. Where strips are wanted, rows are sent as they are
  /// finished. If strips brought all rows, the frame has none; otherwise it has all.
  std::string render(const ViewLevel& level, Json head, bool wants_strips,
                     const Cancellation& cancellation, const Send& send) const {
    const Clock clock;
    RenderParameters parameters = level_parameters(parameters_, level);
    // A coarse view is only looked at, so that its galaxies may be measured as for a draft.
    const bool is_coarse = parameters.sampling.tolerance > parameters_.sampling.tolerance;
    RenderInput input{
        parameters.toml(), RenderInput::Text{document_.scene}, document_.galaxies, {}, label_,
        is_coarse};
    RenderJob job = session_.load(input);
    const bool has_parts = (wants_components_ || chosen_.mutes_light()) && can_have_parts(job);
    if (has_parts && job.parameters.truth.parts != TruthSettings::Parts::components) {
      parameters.set("truth", "parts", std::string("components"));
      input.parameters = parameters.toml();
      job = session_.load(input);
    }
    const std::vector<FramePlane> planes = planes_of(job, has_parts);
    check_size(job, has_parts, planes.size());
    add_planes(job, has_parts, planes, head);
    head["wcs"] = wcs_json(job.camera);
    RenderControl control{.truth_images = has_parts, .cancellation = &cancellation};
    int sent_rows = 0;
    if (wants_strips && job.camera.window().height >= least_strip_rows) {
      control.finished = [&](RowRange rows, const Rendering& rendering) {
        if (rows.size() == rendering.image.height()) return;
        send(encode(rendering, has_parts, planes, rows, head), true);
        sent_rows += rows.size();
      };
    }
    // The reply counts the parts of galaxies that were measured and not recalled from memory.
    const std::size_t before = session_.memory().measured();
    const Rendering rendering = session_.render(std::move(job), control);
    head["measured"] = session_.memory().measured() - before;
    head["warnings"] = is_coarse ? std::vector<std::string>() : rendering.warnings;
    head["milliseconds"] = clock.seconds() * 1000;
    const int height = rendering.image.height();
    const RowRange rest{sent_rows == height ? height : 0, height};
    return encode(rendering, has_parts, planes, rest, head);
  }

 private:
  /// Throws InputError for a view that needs too much memory.
  static void check_size(const RenderJob& job, bool has_parts, std::size_t sent) {
    const ImageRegion& window = job.camera.window();
    const double pixels = static_cast<double>(window.width) * window.height;
    TruthSettings truth;
    if (has_parts) truth.parts = TruthSettings::Parts::components;
    const auto all = static_cast<double>(output_planes(*job.scene, job.spectrum, truth).size());
    if (pixels * static_cast<double>(sent * sizeof(float)) > most_frame_bytes ||
        pixels * all * sizeof(double) > most_image_bytes) {
      throw InputError("the view is too large to be sent; ask for fewer pixels");
    }
  }

  std::vector<FramePlane> planes_of(const RenderJob& job, bool has_parts) const {
    std::vector<FramePlane> planes;
    if (has_parts) {
      planes = part_planes(job, chosen_);
      std::erase_if(planes, [&](const FramePlane& p) { return chosen_.is_muted(p.component); });
      if (wants_components_) return planes;
    }
    std::vector<FramePlane> whole(job.spectrum.planes.size());
    for (std::size_t p = 0; p < whole.size(); ++p) whole[p] = {std::nullopt, "image", p, {}};
    for (const FramePlane& part : planes) {
      auto& parts = whole[part.plane].parts;
      parts.insert(parts.end(), part.parts.begin(), part.parts.end());
    }
    return whole;
  }

  void add_planes(const RenderJob& job, bool has_parts, const std::vector<FramePlane>& planes,
                  Json& head) const {
    head["width"] = job.camera.window().width;
    head["height"] = job.camera.window().height;
    head["is_whole"] = !(has_parts && wants_components_);
    const std::string unit = unit_text(job.scene->unit);
    const std::vector<double> magnitudes = zero_points(job);
    Json list = Json::array();
    for (const FramePlane& plane : planes) {
      const SpectralPlane& spectral = job.spectrum.planes[plane.plane];
      list.push_back({{"name", plane.name},
                      {"component", plane.component ? Json(*plane.component) : Json(nullptr)},
                      {"label", spectral.label},
                      {"wavelength", spectral.wavelength},
                      {"zero_point", magnitudes.empty() ? Json() : Json(magnitudes[plane.plane])},
                      {"unit", unit}});
    }
    head["planes"] = list;
  }

  /// A frame of rows of the image.
  static std::string encode(const Rendering& rendering, bool has_parts,
                            const std::vector<FramePlane>& planes, RowRange rows, Json head) {
    head["row"] = rows.first;
    head["rows"] = rows.size();
    const auto width = static_cast<std::size_t>(rendering.image.width());
    const std::size_t begin = static_cast<std::size_t>(rows.first) * width;
    const std::size_t count = static_cast<std::size_t>(rows.size()) * width;
    FrameEncoder frame(json_text(head), count * planes.size());
    std::vector<double> sums(count);
    for (const FramePlane& plane : planes) {
      if (!has_parts) {
        frame.add({rendering.image.plane(static_cast<int>(plane.plane)) + begin, count});
        continue;
      }
      std::ranges::fill(sums, 0.0);
      for (const int part : plane.parts) {
        const double* from = rendering.truth_images.plane(part) + begin;
        for (std::size_t i = 0; i < count; ++i) sums[i] += from[i];
      }
      frame.add(sums);
    }
    return frame.take();
  }

  const Session& session_;
  std::string label_;
  PageDocument document_;
  ChosenGalaxy chosen_;
  bool wants_components_;
  RenderParameters parameters_;
};

}  // namespace

RenderParameters level_parameters(RenderParameters parameters, const ViewLevel& level) {
  if (parameters.animation.frames > 0) {
    std::vector<RenderParameters::Setting> defaults;
    for (const Parameter& parameter : parameters.section("animation").table()) {
      defaults.push_back({"animation", parameter.name, parameter.default_value});
    }
    parameters.set(defaults);
  }
  if (parameters.stars.table) parameters.set("stars", "table", false);
  if (parameters.image.output.layout == ImageLayout::stamps) {
    parameters.set("image", "layout", std::string("cube"));
  }
  const int width = parameters.width;
  // A region, another image's WCS and a map keep their pixels.
  const bool is_fixed = parameters.image.region || !parameters.camera.header.empty() ||
                        parameters.camera.projection == Projection::healpix;
  if (!is_fixed && (level.width != width || level.height != parameters.height)) {
    if (parameters.camera.projection == Projection::sky) {
      parameters.set("camera", "pixel_scale",
                     parameters.camera.sky.pixel_scale * width / level.width);
    }
    const bool is_cube = parameters.camera.projection == Projection::cubemap;
    const double height = is_cube ? level.width : level.height;
    parameters.set("image", "size", std::vector<double>{double(level.width), height});
  }
  const double tolerance = parameters.sampling.tolerance;
  if (level.tolerance && *level.tolerance != tolerance &&
      parameters.applies("sampling", "tolerance")) {
    parameters.set("sampling", "tolerance", *level.tolerance);
    if (*level.tolerance > tolerance) {
      parameters.set("camera", "supersample", std::int64_t{1});
      parameters.set("sampling", "stars_per_pixel", 0.0);
    }
  }
  return parameters;
}

std::string render_view(const Session& session, const std::string& label, std::int64_t id,
                        const ViewRequest& request, const Cancellation& cancellation,
                        const Send& send) {
  // Galaxies of the scene are made before it is rendered.
  const CancellationScope scope(&cancellation);
  const LevelView view(session, request, label);
  std::string frame;
  for (std::size_t level = 0; level < request.levels.size(); ++level) {
    if (level > 0) send(std::move(frame), true);
    const Json head = {{"id", id}, {"level", level}, {"last", level + 1 == request.levels.size()}};
    frame = view.render(request.levels[level], head, request.wants_strips, cancellation, send);
  }
  return frame;
}

}  // namespace gamer
