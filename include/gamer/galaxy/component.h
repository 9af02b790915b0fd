#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/core/parameter.h"
#include "gamer/core/resources.h"
#include "gamer/galaxy/accuracy.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/sample_batch.h"
#include "gamer/galaxy/texture.h"
#include "gamer/noise/fractal.h"
#include "gamer/sed/extinction.h"
#include "gamer/sed/sed.h"

namespace gamer {

class Galaxy;
class StarField;

/// A ray in a galaxy's ball frame: p(t) = origin + t direction for t in [begin, end].
struct BallRay {
  double origin[3];
  double direction[3];
  double begin;
  double end;
  double footprint = 0;  ///< width of the area that the ray represents, galaxy radii
};

/// A place on a ray where a component needs nodes: rate / sqrt(1 + ((t - centre)/width)^2) nodes
/// per unit of t.
struct Focus {
  double centre;
  double width;
  double rate;
};

/// The sampling of a ray: the interval that has components, and its focuses.
struct RayPlan {
  double begin;
  double end;  ///< the interval is empty if end <= begin
  std::vector<Focus> focuses;
  bool has_texture;  ///< whether a component in the interval has a texture

  void clear() {
    begin = HUGE_VAL;
    end = -HUGE_VAL;
    has_texture = false;
    focuses.clear();
  }
  void extend(double from, double to) {
    begin = std::min(begin, from);
    end = std::max(end, to);
  }
};

/// Lengths across a ray, galaxy radii, over which a component's column changes by about its own
/// value; infinite where the column is negligible.
struct ColumnScale {
  double envelope = HUGE_VAL;
  double edge = HUGE_VAL;     ///< scale across an edge, which extends over many rays
  double texture = HUGE_VAL;  ///< scale of arms and noise, which extend over many rays
};

/// All settings from which the components of one galaxy are built.
struct GalaxySettings {
  const Noise* noise_kind = nullptr;
  std::optional<int> octaves;  ///< `noise.octaves` if the render parameters have it
  std::uint64_t seed = 1;
  std::shared_ptr<const Sed> sed;  ///< replaces the SEDs of the components
  /// Values that replace values of the file, by section or component: {dust: {optical_depth: 3}}.
  std::shared_ptr<const ConfigNode> overrides = nullptr;
  /// The reference of a galaxy of the same file (Galaxy::reference()), or null.
  std::shared_ptr<Galaxy> reference = nullptr;
  /// The twin: a galaxy of the file with another seed, or of the file before an edit, or null.
  /// Measurements that are equal in both, whatever the seed, are copied from the twin.
  std::shared_ptr<const Galaxy> twin = nullptr;
  /// Sets the accuracy of the means of textures.
  Accuracy accuracy = Accuracy::from_tolerance(1e-3);
  /// Largest number of points of a component over which the mean of its texture is taken. Fewer
  /// points are faster, but unsuitable for rendering: <Phi> = 1 holds less well.
  std::size_t most_cloud_points = std::size_t{1} << 22;
};

/// Columns through a layer.
struct ColumnCloud {
  std::vector<WeightedBatch>
      columns;                 ///< places where columns meet the plane, weighted with their area
  std::vector<float> heights;  ///< heights along the columns; the weight of each is its step dz
  std::vector<float> steps;
};

/// Digests of a component's parameters. Two components with an equal digest `envelope` have equal
/// envelopes, in any galaxy of any file. Forms and textures have their own digests.
struct ComponentDigests {
  std::string envelope;  ///< decides the envelope
  std::string form;      ///< decides all but the amplitude, the spectrum and what a seed changes
  /// Decides the texture and its statistics, and those of the component that it follows.
  std::string texture;
};

/// The properties of a kind of component.
struct ComponentTraits {
  bool emits = true;              ///< it has sed, intensity, fraction
  bool absorbs = false;           ///< it has optical_depth, extinction, r_v
  bool can_follow = false;        ///< has the key `follows`
  bool can_be_followed = false;   ///< its texture may modulate other components too
  bool is_bulge = false;          ///< its light counts as the bulge in the truth table
  bool has_own_spectrum = false;  ///< need not have `sed`
};

/// One light-emitting or absorbing part of a galaxy:
///   emissivity              j = amplitude * envelope * Phi * flux(lambda)        (light)
///   extinction coefficient  kappa = amplitude * envelope * Phi * A(lambda)/A(V)  (dust)
/// per galaxy radius of path. Envelopes are analytic; Phi is the texture's noise, or 1.
class Component {
 public:
  virtual ~Component() = default;

  /// The envelope over a batch: D with the taper, times the arm modifier.
  virtual void envelope(const SampleBatch& batch, float* out) const = 0;
  /// The integral of the envelope over the ball, galaxy radii^3.
  virtual double envelope_integral() const = 0;
  /// About `size` points spread over the envelope, for the statistics of the noise; empty for kinds
  /// without noise. The points are turned back by the twirl, as for the texture. The cloud must not
  /// outlive the component.
  virtual Cloud cloud(std::size_t size) const = 0;
  /// Whether texture_means() gives the means of Phi, since a cloud of points would miss the peaks
  /// of Phi.
  virtual bool has_texture_mean() const { return false; }
  /// The means of Phi over the component for rays of each width (galaxy radii; 0 resolves
  /// everything), with a relative error of about `error`. The mean for a width does not depend on
  /// the other widths. Clouds of points have at most `most_points` points.
  virtual std::vector<double> texture_means(std::span<const double> widths, double /*error*/,
                                            std::size_t /*most_points*/) const {
    return std::vector<double>(widths.size(), 1.0);
  }
  /// About `size` columns of `heights` points, spread over a layer; empty for other components.
  virtual ColumnCloud columns(std::size_t /*size*/, std::size_t /*heights*/) const { return {}; }
  /// Adds the interval and focuses that the component needs on `ray` for the given accuracy.
  virtual void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const = 0;
  /// The scale on which the integral of the density changes across rays within `reach` of this ray.
  /// `nearest` is the ray's point closest to the centre; `direction` has length 1.
  virtual ColumnScale column_scale(const double nearest[3], const double direction[3],
                                   double reach) const = 0;
  /// Approximate largest value of the envelope along this ray and its neighbours within `reach`, as
  /// a share of the component's peak.
  virtual double column_brightness(const double /*nearest*/[3], const double /*direction*/[3],
                                   double /*reach*/) const {
    return 1;
  }
  /// Whether the integral of the density has a cusp at the centre, where a single ray differs
  /// strongly from the mean over a pixel.
  virtual bool has_cusp() const { return false; }
  /// Approximate largest integral of the envelope along a face-on ray, galaxy radii.
  virtual double face_on_column() const = 0;
  /// The largest envelope without the arm modifier.
  virtual double peak() const { return 1; }
  /// Factor of Accuracy::texture_threshold for this component's envelope: the envelope's peak,
  /// divided by sqrt(<Phi^2>) if there is a texture.
  double threshold_scale() const { return peak() / (texture_ != nullptr ? texture_->rms() : 1.0); }
  /// Frequency of the texture's sharpest features after winding by the twirl, cycles per galaxy
  /// radius; 0 without a texture.
  virtual double texture_frequency() const { return 0; }
  /// Ratio of the width with which a ray sees the texture to the ray's footprint. The ratio exceeds
  /// 1 for light whose features are much narrower than its octaves, since rays at the footprint's
  /// spacing could not follow them. For dust it is 1, since exp(-tau) blunts the peaks.
  double footprint_scale() const;
  /// Whether a ray of this footprint (galaxy radii) may hide a part of the texture.
  virtual bool hides_texture(double /*footprint*/) const { return false; }
  /// Whether a galaxy's seed changes the component.
  virtual bool depends_on_seed() const { return texture_ != nullptr; }
  /// Whether the mid-plane leaves z = 0. Heights above it then replace z in the texture and in the
  /// points of clouds and columns.
  virtual bool is_warped() const { return false; }
  /// Heights of the mid-plane above z = 0 at the radii and azimuths of a batch.
  virtual void lift(const SampleBatch& batch, float* out) const {
    std::fill_n(out, padded(batch.size), 0.0f);
  }
  virtual bool needs_azimuth() const { return false; }
  /// Whether the envelope changes around the axis.
  virtual bool varies_around_axis() const { return needs_azimuth(); }
  virtual bool needs_winding() const { return false; }

  /// The component as a field of stars; null for other kinds.
  virtual const StarField* star_field() const { return nullptr; }

  /// The name of the kind: "bulge", "disk"...
  const std::string& kind() const { return kind_; }
  const ComponentTraits& traits() const { return traits_; }
  bool absorbs() const { return traits_.absorbs; }
  const std::string& name() const { return name_; }
  bool active() const { return active_; }
  double amplitude() const { return amplitude_; }
  void set_amplitude(double amplitude) { amplitude_ = amplitude; }
  const Sed* sed() const { return sed_.get(); }
  const ExtinctionCurve* extinction() const { return extinction_.get(); }
  /// Share of the galaxy's light, if given instead of an intensity.
  std::optional<double> fraction() const { return fraction_; }

  const ComponentDigests& digests() const { return digests_; }
  /// Adds the digest of the component that this one follows to the digest of the texture.
  void follow(const ComponentDigests& followed);
  /// Takes the clumps of associations as places of its objects. Returns false if the component has
  /// no objects or has a texture of its own.
  virtual bool gather_in_clumps(const Component& /*associations*/) { return false; }

  Texture* texture() { return texture_.get(); }
  const Texture* texture() const { return texture_.get(); }
  /// Name of the component whose noise also modulates this one; empty for none.
  const std::string& follows() const { return follows_; }
  /// Place of that name in the file.
  const SourceLocation& follows_where() const { return follows_where_; }
  const SourceLocation& where() const { return where_; }

 protected:
  std::string kind_;
  ComponentTraits traits_;
  std::string name_;
  bool active_ = true;
  double amplitude_ = 1;
  std::optional<double> fraction_;
  std::string follows_;
  std::shared_ptr<const Sed> sed_;
  std::shared_ptr<const ExtinctionCurve> extinction_;
  std::unique_ptr<Texture> texture_;
  ComponentDigests digests_;
  SourceLocation where_;
  SourceLocation follows_where_;

  friend class ComponentReader;
};

/// The arguments of a kind's maker: the values read by its table, and all else that a component
/// needs.
struct ComponentInput {
  const ParameterSet& values;
  const ConfigNode& node;      ///< the [[component]] table
  const std::string& context;  ///< begins messages: "component 'arms': "
  const ArmPattern& arms;
  double axis_z;  ///< the galaxy's stretch along z
  const GalaxySettings& settings;
  const std::string& name;  ///< the component's name
  Resources& resources;
  const Component* twin;  ///< a component of equal form (ComponentDigests), or null
};

/// One kind of component: its declaration and its maker. The registry adds the parameters of its
/// traits and of all kinds.
struct ComponentKind {
  std::string name;
  std::string description;
  ComponentTraits traits;
  ParameterTable parameters;
  /// The defaults of its `noise` table; none for kinds without noise.
  std::optional<FractalParameters> noise;
  /// The parameters that no envelope depends on, besides `noise`.
  ParameterTable texture_parameters = {};
  std::function<std::unique_ptr<Component>(const ComponentInput&)> make;
};

/// All kinds: those of gamer, then those registered.
std::span<const ComponentKind> component_kinds();
/// Adds a program's own kind, before galaxies are read or threads are started. Throws
/// std::invalid_argument if the name exists.
void register_component_kind(ComponentKind kind);
/// Throws InputError at `where` for an unknown name. The message proposes similar names.
const ComponentKind& find_component_kind(const std::string& name, const SourceLocation& where);

/// The data that all components of a galaxy file share.
struct ComponentSurroundings {
  const ArmPattern& arms;
  double axis_z;          ///< the galaxy's stretch along z
  std::string text = {};  ///< decides arms and axis (ComponentDigests)
};

/// Builds one component from its [[component]] table; `index` counts within the file. Throws
/// InputError.
std::unique_ptr<Component> read_component(const ConfigNode& node, int index,
                                          const ComponentSurroundings& surroundings,
                                          const GalaxySettings& settings, Resources& resources);

ComponentKind bulge_kind();
ComponentKind disk_kind();
ComponentKind stars_kind();
ComponentKind dust_kind();
ComponentKind veins_kind();
ComponentKind veins_light_kind();
ComponentKind starfield_kind();
ComponentKind sersic_kind();
ComponentKind associations_kind();
ComponentKind bar_kind();

}  // namespace gamer
