#include "gamer/render/output_planes.h"

#include <fmt/format.h>

#include <utility>

namespace gamer {

std::vector<OutputPlane> output_planes(const Scene& scene, const Spectrum& spectrum,
                                       const TruthSettings& truth) {
  using Kind = OutputPlane::Kind;
  std::vector<OutputPlane> outputs;
  const auto add = [&](Kind kind, const std::string& prefix, std::size_t object = 0,
                       std::size_t component = 0) {
    for (std::size_t p = 0; p < spectrum.planes.size(); ++p) {
      outputs.push_back({kind, p, object, component, prefix + spectrum.planes[p].label});
    }
  };
  add(Kind::image, "");
  if (truth.dust_free) add(Kind::dust_free, "DUSTFREE_");
  if (truth.optical_depth) add(Kind::optical_depth, "TAU_");
  if (truth.segmentation) {
    outputs.push_back({Kind::owner, 0, 0, 0, "SEGMENTATION"});
    outputs.push_back({Kind::share, 0, 0, 0, "SHARE"});
  }
  if (truth.parts == TruthSettings::Parts::none) return outputs;
  std::vector<const PlacedGalaxy*> galaxies(scene.objects, nullptr);
  for (const PlacedGalaxy& placed : scene.galaxies) galaxies[placed.object] = &placed;
  for (std::size_t object = 0; object < scene.objects; ++object) {
    if (truth.parts == TruthSettings::Parts::objects || galaxies[object] == nullptr) {
      add(Kind::object, fmt::format("OBJECT_{}_", object + 1), object);
      continue;
    }
    std::size_t light = 0;
    for (const auto& component : galaxies[object]->galaxy->components()) {
      if (component->absorbs()) continue;
      add(Kind::component, fmt::format("OBJECT_{}_{}_", object + 1, component->name()), object,
          light++);
    }
  }
  return outputs;
}

OutputLayout::OutputLayout(std::vector<OutputPlane> planes, std::size_t objects,
                           std::size_t spectral)
    : planes_(std::move(planes)), spectral_(spectral) {
  using Kind = OutputPlane::Kind;
  for (std::size_t o = 0; o < planes_.size(); ++o) {
    const OutputPlane& output = planes_[o];
    if (output.kind == Kind::dust_free && !dust_free_) dust_free_ = o;
    if (output.kind == Kind::optical_depth && !optical_depth_) optical_depth_ = o;
    if (output.kind == Kind::owner) owner_ = o;
    has_components_ = has_components_ || output.kind == Kind::component;
    const bool is_part = output.kind == Kind::object || output.kind == Kind::component;
    if (is_part && output.component == 0 && output.plane == 0) {
      parts_.resize(objects);
      parts_[output.object] = o;
    }
  }
}

std::optional<std::size_t> OutputLayout::part(std::size_t object, std::size_t emitter) const {
  if (parts_.empty()) return std::nullopt;
  const std::size_t first = parts_[object];
  return planes_[first].kind == OutputPlane::Kind::object ? first : first + emitter * spectral_;
}

}  // namespace gamer
