#include "studio/draft.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include "gamer/core/config.h"
#include "gamer/core/parallel_for.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/render/spectral_basis.h"
#include "gamer/render/stars/star_fields.h"
#include "job/make_job.h"
#include "studio/document.h"
#include "studio/draft_bytes.h"
#include "studio/frame.h"
#include "studio/model.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

// The footprint of a voxel is that of a view with this many pixels across the galaxy's ball.
constexpr int footprint_pixels = 128;
// The largest number of a voxel; half precision ends at 65504.
constexpr double largest_number = 32768;
constexpr std::size_t most_planes = 3;
// ln(path/height) of a ray that is inclined by 45 degrees.
constexpr float mean_obliquity = 0.347f;
// Wavelengths in a band, for the extinction of its light.
constexpr int samples_of_band = 6;

/// The job of a view from a direction in which the ball fills the image.
RenderJob load_view(const Session& session, const std::string& label, const DraftRequest& request,
                    const glm::dvec3& direction, const glm::dvec3& centre, double radius) {
  PageDocument document = request.document;
  const RenderParameters given = parameters_of(document, label, session.folders());
  const bool is_flat = given.camera.projection == Projection::orthographic;
  if (!is_flat && given.camera.projection != Projection::perspective) {
    throw InputError("a draft needs a perspective or orthographic camera");
  }
  const auto set = [&](const char* key, const ParameterValue& value) {
    document.settings.push_back(fmt::format("camera.{}={}", key, value_text(value)));
  };
  const auto vector = [](const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
  const double distance = is_flat ? 1 : radius / std::tan(glm::radians(given.camera.fov) / 2);
  set("target", vector(centre));
  set("position", vector(centre + distance * glm::normalize(direction)));
  set("up", vector({0, 0, 1}));
  if (is_flat) set("width", 2 * radius);
  RenderParameters parameters = level_parameters(parameters_of(document, label, session.folders()),
                                                 {footprint_pixels, footprint_pixels, {}});
  // The job measures the galaxy; its image is not used.
  parameters.set("image", "region", std::vector<double>{1, 1, 1, 1});
  return session.load(
      {parameters.toml(), RenderInput::Text{document.scene}, document.galaxies, {}, label});
}

/// Throws InputError for a job that a draft cannot show.
void check_job(const RenderJob& job, const RenderJob& other) {
  const Scene& scene = *job.scene;
  if (scene.galaxies.size() != 1 || scene.objects != 1) {
    throw InputError("a draft shows a scene of one galaxy");
  }
  if (job.spectrum.planes.size() > most_planes) throw InputError("a draft has at most 3 planes");
  if (counts_flux(scene.unit) || scene.unit == PixelUnit::magnitude) {
    throw InputError("a draft needs a unit of brightness");
  }
  const glm::dmat3 &a = scene.galaxies[0].to_ball, &b = other.scene->galaxies[0].to_ball;
  for (int i = 0; i < 3; ++i) {
    if (glm::length(a[i] - b[i]) > 1e-9 * glm::length(a[i])) {
      throw InputError("a draft needs a galaxy that does not turn with the camera");
    }
  }
}

constexpr std::size_t all_numbers = Draft::numbers + Draft::other_variants;

/// A component, and the factor of its light in each plane.
struct Contribution {
  std::size_t component = 0;
  bool absorbs = false;
  std::array<double, most_planes> factors{};
};

class Baker {
 public:
  Baker(const RenderJob& job, const std::set<std::string>& muted, Draft& draft)
      : job_(job), placed_(job.scene->galaxies[0]), draft_(draft) {
    const auto& axis = placed_.galaxy->axis();
    footprint_ =
        static_cast<float>(2.0 / footprint_pixels / *std::min_element(axis.begin(), axis.end()));
    draft_.to_ball = placed_.to_ball;
    draft_.centre = placed_.centre;
    draft_.radius = placed_.radius;
    draft_.unit = unit_text(job.scene->unit);
    for (const SpectralPlane& plane : job.spectrum.planes) {
      draft_.planes.push_back({plane.label, plane.wavelength, 0, 0});
    }
    for (std::size_t i = 0; i < 3; ++i) places_[i] = draft_.axes[i].places();
    weights_ = draft_.axes[2].weights();
    add_contributions(muted);
  }

  void bake() {
    const std::size_t nx = size(0), ny = size(1), nz = size(2);
    values_.assign(nx * ny * nz * all_numbers, 0.0f);
    parallel_for(ny * nz, [&](std::size_t row) {
      check_cancelled();
      fill_row(row % ny, row / ny, values_.data() + row * nx * all_numbers);
    });
    pack();
  }

 private:
  std::size_t size(int axis) const {
    return static_cast<std::size_t>(draft_.axes[static_cast<std::size_t>(axis)].nodes);
  }

  SpectralBasis make_basis() const {
    const Sed* light = first_light(*placed_.galaxy);
    std::vector<SpectralBasis::Probe> probes;
    for (const auto& component : placed_.galaxy->components()) {
      if (!component->absorbs() || light == nullptr) continue;
      probes.push_back({light, placed_.redshift, component->extinction(), placed_.redshift});
    }
    return {job_.spectrum, probes, samples_of_band, 1};
  }

  void add_contributions(const std::set<std::string>& muted) {
    const auto components = placed_.galaxy->components();
    const StarFields fields(*job_.scene, job_.camera, 0);
    const SpectralBasis basis = make_basis();
    std::vector<double> flux(basis.planes() * basis.size()), curve(basis.size());
    double all_dust = 0;
    for (std::size_t c = 0; c < components.size(); ++c) {
      const Component& component = *components[c];
      if (muted.contains(component.name())) continue;
      Contribution contribution{c, component.absorbs(), {}};
      if (component.absorbs()) {
        // All dust has one curve of extinction, the mean of the components' curves.
        const double dust = component.amplitude() * component.envelope_integral();
        all_dust += dust;
        for (std::size_t j = 0; j < curve.size(); ++j) {
          curve[j] += dust * SpectralBasis::extinction(*component.extinction(), placed_.redshift,
                                                       basis.node(j));
        }
        has_variants_ = has_variants_ || component.hides_texture(footprint_);
      } else {
        add_light(c, fields.find(0, c), basis, contribution, flux);
      }
      contributions_.push_back(contribution);
    }
    if (all_dust > 0) set_extinction(all_dust, curve, flux);
  }

  /// Adds the light of a component to its factors, and to the sums `flux` [plane][node].
  void add_light(std::size_t c, const StarFields::Field* field, const SpectralBasis& basis,
                 Contribution& contribution, std::vector<double>& flux) const {
    std::vector<const Sed*> seds;
    if (field == nullptr) {
      seds.push_back(placed_.galaxy->components()[c]->sed());
    } else {
      for (const StarFields::SmoothPart& part : field->parts) seds.push_back(part.sed.get());
    }
    for (const Sed* sed : seds) {
      const std::vector<double> weights = basis.weights(*sed, placed_.redshift);
      for (std::size_t p = 0; p < basis.planes(); ++p) {
        const double unit =
            placed_.brightness *
            value_of_nanojansky(job_.spectrum.planes[p], job_.scene->unit, job_.parameters);
        for (std::size_t j = 0; j < basis.size(); ++j) {
          const double light = weights[p * basis.size() + j];
          contribution.factors[p] += unit * light;
          flux[p * basis.size() + j] += light * placed_.galaxy->luminosity(c);
        }
      }
    }
  }

  /// Finds the extinction of each plane from its light behind a screen of tau_V = 1. A screen dims
  /// the light of a band less than light of one wavelength, since the red part of the band remains.
  void set_extinction(double all_dust, const std::vector<double>& curve,
                      const std::vector<double>& flux) {
    constexpr double screen = 1;
    for (std::size_t p = 0; p < draft_.planes.size(); ++p) {
      double clear = 0, seen = 0;
      for (std::size_t j = 0; j < curve.size(); ++j) {
        const double light = flux[p * curve.size() + j];
        clear += light;
        seen += light * std::exp(-screen * curve[j] / all_dust);
      }
      if (seen > 0) draft_.planes[p].extinction = std::log(clear / seen) / screen;
    }
  }

  /// Fills the voxels of a row that are in the ball; the others stay 0.
  void fill_row(std::size_t iy, std::size_t iz, float* out) const {
    const double y = places_[1][iy], z = places_[2][iz];
    const double room = 1 - y * y - z * z;
    if (room <= 0) return;
    struct Scratch {
      BatchArray x, y, z;
      RayBatch rays;
      std::vector<BatchArray> densities;
    };
    thread_local Scratch s;
    s.densities.resize(
        std::max(s.densities.size(), dust_deviations.size() * placed_.galaxy->components().size()));
    std::size_t first = 0, count = 0;
    for (std::size_t i = 0; i < size(0); ++i) {
      const double x = places_[0][i];
      if (x * x >= room) continue;
      if (count == 0) first = i;
      s.x[count++] = static_cast<float>(x);
    }
    if (count == 0) return;
    for (std::size_t i = count; i < padded(count); ++i) s.x[i] = 0;
    std::fill_n(s.y.data(), padded(count), static_cast<float>(y));
    std::fill_n(s.z.data(), padded(count), static_cast<float>(z));
    std::fill_n(s.rays.footprint.data(), padded(count), footprint_);
    std::fill_n(s.rays.obliquity.data(), padded(count), mean_obliquity);
    const Accuracy accuracy = Accuracy::from_tolerance(job_.parameters.sampling.tolerance);
    const std::span deviations =
        std::span(dust_deviations).first(has_variants_ ? dust_deviations.size() : 0);
    EvaluationCounts counts;
    placed_.galaxy->evaluate({s.x.data(), s.y.data(), s.z.data(), count},
                             static_cast<float>(accuracy.texture_threshold), &s.rays, deviations,
                             s.densities, counts);
    for (const Contribution& one : contributions_) {
      for (std::size_t i = 0; i < count; ++i) {
        add(one, s.densities, i, weights_[iz], out + (first + i) * all_numbers);
      }
    }
  }

  /// Adds a component's density at point i to a voxel.
  void add(const Contribution& one, std::span<const BatchArray> densities, std::size_t i,
           double weight, float* voxel) const {
    if (!one.absorbs) {
      for (std::size_t p = 0; p < draft_.planes.size(); ++p) {
        voxel[p] += static_cast<float>(one.factors[p] * weight * densities[one.component][i]);
      }
      return;
    }
    const std::size_t components = placed_.galaxy->components().size();
    for (std::size_t v = 0; v <= Draft::other_variants; ++v) {
      const std::size_t set = has_variants_ ? v : 0;
      voxel[most_planes + v] +=
          static_cast<float>(weight * densities[set * components + one.component][i]);
    }
  }

  /// Scales the numbers to half precision.
  void pack() {
    std::array<double, all_numbers> most{};
    for (std::size_t i = 0; i < values_.size(); ++i) {
      double& largest = most[i % all_numbers];
      largest = std::max(largest, double{values_[i]});
    }
    // All variants of the dust have one scale.
    const double dust = *std::max_element(most.begin() + most_planes, most.end());
    std::fill(most.begin() + most_planes, most.end(), dust);
    for (std::size_t p = 0; p < draft_.planes.size(); ++p) {
      draft_.planes[p].light = most[p] / largest_number;
    }
    draft_.depth = dust / largest_number;
    const std::size_t voxels = values_.size() / all_numbers;
    draft_.voxels.reserve(voxels * Draft::numbers);
    if (has_variants_) draft_.variants.reserve(voxels * Draft::other_variants);
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const std::size_t number = i % all_numbers;
      if (number >= Draft::numbers && !has_variants_) continue;
      const double scale = most[number] > 0 ? largest_number / most[number] : 0;
      (number < Draft::numbers ? draft_.voxels : draft_.variants)
          .push_back(half_of(static_cast<float>(values_[i] * scale)));
    }
  }

  const RenderJob& job_;
  const PlacedGalaxy& placed_;
  Draft& draft_;
  float footprint_;
  std::array<std::vector<double>, 3> places_;  ///< [axis][node]
  std::vector<double> weights_;                ///< of the nodes of the last axis
  std::vector<Contribution> contributions_;
  bool has_variants_ = false;
  std::vector<float> values_;  ///< [voxel][plane, then variant of the dust]
};

/// The names of the components of the one galaxy that are muted.
std::set<std::string> muted_names(const DraftRequest& request, const std::string& label) {
  std::set<std::string> names;
  if (request.muted.empty() || request.document.galaxies.empty()) return names;
  const auto& galaxies = request.document.galaxies;
  const auto chosen = galaxies.find(request.document.chosen);
  const std::string& text = (chosen == galaxies.end() ? galaxies.begin() : chosen)->second;
  const std::vector<std::string> all = component_names(parse_toml(text, label));
  for (const int index : request.muted) {
    if (index < static_cast<int>(all.size())) names.insert(all[static_cast<std::size_t>(index)]);
  }
  return names;
}

}  // namespace

double DraftAxis::index(double x) const {
  const double close = std::asinh(x / core) / std::asinh(1 / core);
  return 0.5 * (nodes - 1) * (1 + (1 - share) * x + share * close);
}

double DraftAxis::density(double x) const {
  return 0.5 * (nodes - 1) *
         (1 - share + share / (std::asinh(1 / core) * std::sqrt(x * x + core * core)));
}

double DraftAxis::place(double index) const {
  double low = -1, high = 1;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (this->index(middle) < index ? low : high) = middle;
  }
}

std::vector<double> DraftAxis::places() const {
  std::vector<double> result;
  for (int i = 0; i < nodes; ++i) result.push_back(place(i));
  return result;
}

std::vector<double> DraftAxis::weights() const {
  std::vector<double> result(static_cast<std::size_t>(nodes), 1.0);
  for (int i = 1; i + 1 < nodes; ++i) {
    // The integral of a node's hat function times dx/du. It equals the mean of x over the interval
    // above the node, less the mean over the interval below. Both means are by Simpson's rule.
    const double hat = (4 * (place(i + 0.5) - place(i - 0.5)) + place(i + 1) - place(i - 1)) / 6;
    result[static_cast<std::size_t>(i)] = 1 / (density(place(i)) * hat);
  }
  return result;
}

std::uint16_t half_of(float value) {
  constexpr float smallest_normal = 0x1p-14f;
  if (!(value > 0)) return 0;
  // Subnormal numbers are multiples of 2^-24.
  if (value < smallest_normal) return static_cast<std::uint16_t>(std::nearbyint(value * 0x1p24f));
  const auto bits = std::bit_cast<std::uint32_t>(value) - (112u << 23);
  constexpr std::uint32_t dropped = 13, below_half = (1u << 12) - 1;
  const std::uint32_t rounded = (bits + below_half + ((bits >> dropped) & 1u)) >> dropped;
  return static_cast<std::uint16_t>(std::min(rounded, 0x7bffu));
}

Draft make_draft(const Session& session, const std::string& label, const DraftRequest& request,
                 const Cancellation& cancellation) {
  const CancellationScope scope(&cancellation);
  const glm::dvec3 direction{3, -5, 4}, another{-4, -3, 7}, origin{0, 0, 0};
  const RenderJob first = load_view(session, label, request, direction, origin, 1);
  check_job(first, load_view(session, label, request, another, origin, 1));
  const PlacedGalaxy& placed = first.scene->galaxies[0];
  // The render measures the textures for rays of the draft's footprint.
  RenderControl control;
  control.cancellation = &cancellation;
  const Rendering rendering = session.render(
      load_view(session, label, request, direction, placed.centre, placed.radius), control);
  Draft draft;
  // Cusps need the nodes at the middle, thin layers those in the plane, and textures the others.
  draft.axes[0] = draft.axes[1] = {request.size, 0.003, 0.25};
  draft.axes[2] = {request.size * 5 / 8, 0.01, 0.85};
  Baker(*rendering.job, muted_names(request, label), draft).bake();
  return draft;
}

std::string encode_slices(const Draft& draft, std::int64_t id, int first, int count) {
  Json axes = Json::array(), planes = Json::array(), to_ball = Json::array();
  for (const DraftAxis& axis : draft.axes) {
    axes.push_back({{"nodes", axis.nodes}, {"core", axis.core}, {"share", axis.share}});
  }
  for (const Draft::Plane& plane : draft.planes) {
    planes.push_back({{"label", plane.label},
                      {"wavelength", plane.wavelength},
                      {"unit", draft.unit},
                      {"extinction", plane.extinction},
                      {"light", plane.light}});
  }
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) to_ball.push_back(draft.to_ball[column][row]);
  }
  const Json head = {{"id", id},
                     {"slice", first},
                     {"slices", count},
                     {"axes", axes},
                     {"planes", planes},
                     {"depth", draft.depth},
                     {"to_ball", to_ball},
                     {"centre", {draft.centre.x, draft.centre.y, draft.centre.z}},
                     {"radius", draft.radius},
                     {"variants", !draft.variants.empty()}};
  FrameEncoder frame(json_text(head), 0);
  frame.add(packed_slices(draft, first, count));
  return frame.take();
}

std::string send_draft(const Draft& draft, std::int64_t id, const Send& send) {
  constexpr std::size_t most_bytes = std::size_t{1} << 19;
  const int all = draft.axes[2].nodes;
  const std::size_t numbers = draft.voxels.size() + draft.variants.size();
  const std::size_t slice = numbers * sizeof(std::uint16_t) / static_cast<std::size_t>(all);
  const int at_once = std::max(static_cast<int>(most_bytes / slice), 1);
  int first = 0;
  for (; first + at_once < all; first += at_once) {
    send(encode_slices(draft, id, first, at_once), true);
  }
  return encode_slices(draft, id, first, all - first);
}

}  // namespace gamer
