#include "galaxy/arm_courses.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/arm_courses.cc"
#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "galaxy/arm_courses-inl.h"
#include "gamer/core/random.h"
#include "gamer/core/units.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void StraightenArms(const Points& points, const float* HWY_RESTRICT winding, float shift,
                    const float* table, std::size_t arm_size, int trunks, float* HWY_RESTRICT x,
                    float* HWY_RESTRICT y) {
  const hn::ScalableTag<float> d;
  constexpr float turn = 2 * std::numbers::pi_v<float>;
  const float spacing = turn / static_cast<float>(trunks);
  const float sharpness = -4.5f / (spacing * spacing);
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto px = hn::Load(d, points.x + i);
    const auto py = hn::Load(d, points.y + i);
    const ArmNodes nodes(d, hn::Sqrt(hn::MulAdd(px, px, hn::Mul(py, py))));
    const auto angle =
        hn::Sub(hn::Sub(Atan2(d, py, px), hn::Set(d, shift)), hn::Load(d, winding + i));
    // The initial value avoids 0/0 where the weights of all arms vanish.
    auto weights = hn::Set(d, 1e-30f);
    auto sum = hn::Zero(d);
    for (int k = 0; k < trunks; ++k) {
      const auto offset = nodes.LookUp(d, table + static_cast<std::size_t>(k) * arm_size).offset;
      const auto away = WithoutTurns(d, hn::Sub(angle, offset));
      const auto moved =
          WithoutTurns(d, hn::Sub(offset, hn::Set(d, static_cast<float>(k) * spacing)));
      const auto weight = Exp(d, hn::Mul(hn::Mul(away, away), hn::Set(d, sharpness)));
      weights = hn::Add(weights, weight);
      sum = hn::MulAdd(weight, moved, sum);
    }
    auto sine = hn::Zero(d);
    auto cosine = hn::Zero(d);
    SinCos(d, hn::Div(sum, weights), sine, cosine);
    hn::Store(hn::MulAdd(px, cosine, hn::Mul(py, sine)), d, x + i);
    hn::Store(hn::MulSub(py, cosine, hn::Mul(px, sine)), d, y + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(StraightenArms);

namespace {

// Lengths over which an arm rises from its begin and falls to its end, galaxy radii.
constexpr double rise = 0.08;
constexpr double fall = 0.2;

// Half the width over which the pitch changes at a kink, in nodes.
constexpr std::size_t kink_nodes = 8;

// Radius within which offsets are constant, since laws of pitch diverge at the centre.
constexpr double innermost = 0.04;

// Smallest ratio of a segment's tan p to that of the law.
constexpr double least_ratio = 0.35;

// Deviation from an arm's law, in distances of neighbouring arms, beyond which the next segment
// leads back to the law.
constexpr double largest_deviation = 0.12;

// Widest profile, radians; at half a turn from the crest it is below 5e-5.
constexpr double widest = 0.7;

double radius_of(std::size_t node) { return static_cast<double>(node) / ArmCourses::intervals; }

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Random numbers in [0, 1) of one arm, a sequence for each purpose.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t purpose) : seed_(seed), purpose_(purpose) {}
  double next() { return to_unit(hash_words({seed_, purpose_, ++count_})); }

 private:
  std::uint64_t seed_, purpose_, count_ = 0;
};

}  // namespace

/// The parameters of one arm, from [arms] and its [[arm]].
struct ArmCourses::Arm {
  double offset = 0;  ///< at its begin, radians
  double strength = 1, width = 1;
  double begin = 0;
  double end = HUGE_VAL;  ///< beyond the galaxy for an arm without end
  double pitch_variation = 0, segment_length = 0.25;
  double strength_variation = 0, beat_length = 0.15;
  double width_growth = 0;
  std::vector<double> kinks;    ///< increasing radii
  std::vector<double> pitches;  ///< radians; empty for the pattern's law
  std::uint64_t seed = 1;
  double spacing = full_turn;  ///< angle between neighbouring trunks

  /// The keys of [arms] that hold for each arm, and those of [[arm]].
  BoundTable common_keys();
  BoundTable own_keys();
  /// Offset of each node.
  std::vector<double> offsets(const ArmPattern& pattern) const;
  /// Strength of each node.
  std::vector<double> strengths() const;

 private:
  /// d phi/d ln r of the pattern or of the arm's pitch angles, without random segments.
  double law(const ArmPattern& pattern, double orientation, double r) const;
  /// Excess of d phi/d ln r over that of the pattern at each node, from node `first` on.
  std::vector<double> excesses(const ArmPattern& pattern, std::size_t first) const;
};

double ArmCourses::Arm::law(const ArmPattern& pattern, double orientation, double r) const {
  if (pitches.empty()) return pattern.shear(r);
  const auto segment = std::upper_bound(kinks.begin(), kinks.end(), r) - kinks.begin();
  return orientation / std::tan(pitches[static_cast<std::size_t>(segment)]);
}

std::vector<double> ArmCourses::Arm::excesses(const ArmPattern& pattern, std::size_t first) const {
  const double orientation = std::copysign(1.0, pattern.shear(0.5));
  std::vector<double> result(intervals + 1, 0.0);
  Draws draws(seed, 1);
  double next = 0, ratio = 1, deviation = 0;
  for (std::size_t j = first; j <= intervals; ++j) {
    const double r = radius_of(j);
    const double slope = law(pattern, orientation, r);
    // A segment ends early where it leads too far away; the next one leads back.
    const bool is_far = std::abs(deviation) > largest_deviation * spacing;
    if (r >= next || (is_far && deviation * slope * (1 / ratio - 1) > 0)) {
      next = r + segment_length * (0.6 + 0.8 * draws.next());
      const double change = std::sqrt(3.0) * pitch_variation * (2 * draws.next() - 1);
      ratio =
          std::max(1 + (is_far ? std::copysign(change, deviation * slope) : change), least_ratio);
    }
    deviation += slope * (1 / ratio - 1) / (r * intervals);
    result[j] = slope / ratio - pattern.shear(r);
  }
  return result;
}

std::vector<double> ArmCourses::Arm::offsets(const ArmPattern& pattern) const {
  const double start = std::max(begin, innermost);
  const auto first = static_cast<std::size_t>(std::ceil(start * intervals));
  const std::vector<double> excess = excesses(pattern, first);
  // The mean over nearby nodes rounds kinks.
  const auto rounded = [&](std::size_t j) {
    const std::size_t from = std::max(first + kink_nodes, j) - kink_nodes;
    const std::size_t to = std::min(j + kink_nodes + 1, excess.size());
    return std::accumulate(excess.begin() + static_cast<std::ptrdiff_t>(from),
                           excess.begin() + static_cast<std::ptrdiff_t>(to), 0.0) /
           static_cast<double>(to - from);
  };
  std::vector<double> result(excess.size(), offset);
  double sum = 0, before = rounded(first);
  for (std::size_t j = first; j < result.size(); ++j) {
    const double here = rounded(j);
    sum += 0.5 * (before + here) * std::log(radius_of(j) / std::max(radius_of(j - 1), start));
    before = here;
    result[j] = offset + sum;
  }
  return result;
}

std::vector<double> ArmCourses::Arm::strengths() const {
  std::vector<double> result;
  Draws draws(seed, 2);
  double low = begin, high = begin, depth = 0;
  for (std::size_t j = 0; j <= intervals; ++j) {
    const double r = radius_of(j);
    while (r >= high) {
      low = high;
      high += beat_length * (0.6 + 0.8 * draws.next());
      depth = strength_variation * (0.4 + 0.6 * draws.next());
    }
    const double phase = full_turn * (r - low) / (high - low);
    const double beat = r < begin ? 1.0 : 1 - depth * (0.5 - 0.5 * std::cos(phase));
    const double risen = begin > 0 ? smooth_step((r - begin) / rise) : 1.0;
    result.push_back(strength * beat * risen * smooth_step((end - r) / fall));
  }
  return result;
}

BoundTable ArmCourses::Arm::common_keys() {
  return {
      {begin, "begin", "galaxy radii", Interval::right_open(0, 1),
       "radius at which arms begin; they rise over 0.08"},
      without_default({end, "end", "galaxy radii", Interval::left_open(0, 2).usual(0.2, 1.5),
                       "radius at which arms have faded, over 0.2; by default they do not end"}),
      {pitch_variation, "pitch_variation", "", Interval::closed(0, 0.6),
       "relative deviation of tan p of the segments of an arm, 0.2 to 0.3 in most galaxies"},
      {segment_length, "segment_length", "galaxy radii", Interval::closed(0.03, 2).usual(0.05, 0.6),
       "mean length of segments of one pitch angle, in radius"},
      {strength_variation, "strength_variation", "", Interval::closed(0, 1),
       "depth of the beats of strength along an arm"},
      {beat_length, "beat_length", "galaxy radii", Interval::closed(0.02, 2).usual(0.03, 0.5),
       "mean distance of minima of strength, in radius"},
      {width_growth, "width_growth", "", Interval::closed(-2, 2),
       "g: widths as angles are multiplied by (2 r)^g; at 0 arms widen as r"},
      {seed, "seed", "", Interval::right_open(0, largest_seed),
       "chooses segments and beats, for all galaxies of the file"}};
}

BoundTable ArmCourses::Arm::own_keys() {
  return {Parameter::number("offset", "deg", Interval::any().usual(-360, 360), std::nullopt,
                            "angle of the arm; by default arms are evenly spread"),
          {strength, "strength", "", Interval::closed(0, 1),
           "contrast of the arm against the full one"},
          {width, "width", "", Interval::closed(0.1, 10).usual_logarithmic(0.2, 5),
           "width relative to that of the component"},
          without_default({begin, "begin", "galaxy radii", Interval::right_open(0, 1),
                           "radius at which the arm begins; default that of [arms]"}),
          without_default({end, "end", "galaxy radii", Interval::left_open(0, 2).usual(0.2, 1.5),
                           "radius at which the arm has faded; default that of [arms]"}),
          Parameter::numbers("pitch_angles", "deg", Interval::open(0, 90), std::nullopt,
                             "pitch angle of each segment, from inside; default the law of [arms]"),
          without_default({kinks, "kinks", "galaxy radii", Interval::open(0, 1),
                           "radii at which the next pitch begins: one fewer than pitch angles"}),
          Parameter::integer("leaves", "", Interval::closed(1, 64), std::nullopt,
                             "number of the arm, from 1, that this branch leaves at its begin"),
          without_default(
              {seed, "seed", "", Interval::right_open(0, largest_seed),
               "chooses its segments and beats; default the seed of [arms] and its number"})};
}

ParameterTable ArmCourses::common_table() { return declarations(Arm().common_keys()); }

ParameterTable ArmCourses::arm_table() { return declarations(Arm().own_keys()); }

std::int64_t ArmCourses::trunks(const ConfigNode& list) {
  if (!list.is_array()) throw InputError(list.key_where, "write [[arm]], with double brackets");
  return std::count_if(list.array().begin(), list.array().end(), [](const ConfigNode& one) {
    return !one.is_table() || one.find("leaves") == nullptr;
  });
}

bool ArmCourses::are_asked_for(const ParameterSet& common, const ConfigNode* list) {
  if (list != nullptr) return true;
  const ParameterTable table = common_table();
  return std::ranges::any_of(table,
                             [&](const Parameter& one) { return common.is_given(one.name); });
}

namespace {

std::vector<ParameterSet> read_arms(const ConfigNode& list) {
  std::vector<ParameterSet> result;
  for (const ConfigNode& node : list.array()) {
    if (!node.is_table()) {
      throw InputError(node.where, "[[arm]] must be a table, not " + node.type_name());
    }
    const std::string context = fmt::format("arm {}: ", result.size() + 1);
    result.push_back(ParameterSet::read(ArmCourses::arm_table(), node, context, "in [[arm]]"));
    const ParameterSet& own = result.back();
    if (own.is_given("leaves") && own.is_given("offset")) {
      throw InputError(own.where("offset"), context +
                                                "'leaves' and 'offset' exclude each other: a "
                                                "branch begins on the arm that it leaves");
    }
    if (own.is_given("leaves") && own.integer("leaves") >= std::ssize(result)) {
      throw InputError(own.where("leaves"),
                       context + "'leaves' must name an arm that stands before it in the file");
    }
    const std::size_t segments = own.has("pitch_angles") ? own.numbers("pitch_angles").size() : 0;
    const auto kinks = own.has("kinks") ? own.numbers("kinks") : std::vector<double>();
    if (kinks.size() + 1 != std::max<std::size_t>(segments, 1)) {
      throw input_error(own.where(own.has("kinks") ? "kinks" : "pitch_angles"),
                        "{}{} pitch_angles need {} kinks between them, not {}", context, segments,
                        std::max<std::size_t>(segments, 1) - 1, kinks.size());
    }
    if (!std::is_sorted(kinks.begin(), kinks.end())) {
      throw InputError(own.where("kinks"), context + "'kinks' must increase");
    }
  }
  return result;
}

}  // namespace

ArmCourses::ArmCourses(const ArmPattern& pattern, const ParameterSet& common,
                       const ConfigNode* list) {
  std::vector<ParameterSet> arms;
  if (list != nullptr) {
    arms = read_arms(*list);
  } else {
    arms.assign(static_cast<std::size_t>(pattern.count()), ParameterSet(arm_table()));
  }
  trunks_ = static_cast<int>(
      std::ranges::count_if(arms, [](const ParameterSet& one) { return !one.has("leaves"); }));
  table_.resize(arms.size() * arm_size);
  // Trunks stand before branches in the tables.
  std::vector<std::size_t> places;
  std::size_t trunk = 0, branch = static_cast<std::size_t>(trunks_);
  for (const ParameterSet& values : arms) {
    Arm arm;
    put_values(common, arm.common_keys());
    put_values(values, arm.own_keys());
    if (values.has("pitch_angles")) {
      for (const double angle : values.numbers("pitch_angles"))
        arm.pitches.push_back(angle * degree);
    }
    if (!values.has("seed")) arm.seed = hash_words({arm.seed, places.size() + 1});
    arm.spacing = full_turn / std::max(trunks_, 1);
    if (values.has("leaves")) {
      const std::size_t left = places[static_cast<std::size_t>(values.integer("leaves")) - 1];
      arm.offset = at(left, arm.begin).offset;
      places.push_back(branch++);
    } else {
      arm.offset = values.has("offset")        ? values.number("offset") * degree
                   : pattern.offsets().empty() ? 0.0
                                               : pattern.offsets()[trunk];
      places.push_back(trunk++);
    }
    fill(places.back(), pattern, arm);
  }
}

void ArmCourses::fill(std::size_t place, const ArmPattern& pattern, const Arm& arm) {
  const std::vector<double> offsets = arm.offsets(pattern);
  const std::vector<double> strengths = arm.strengths();
  for (std::size_t j = 0; j <= intervals; ++j) {
    float* node = table_.data() + place * arm_size + j * node_size;
    const double width =
        arm.width * std::pow(2 * std::max(radius_of(j), innermost), arm.width_growth);
    node[0] = static_cast<float>(offsets[j]);
    node[1] = static_cast<float>(strengths[j]);
    node[2] = static_cast<float>(1 / width);
  }
}

ArmCourses::Place ArmCourses::at(std::size_t k, double r) const {
  const double position = std::clamp(r, 0.0, 1.0) * intervals;
  const auto node = std::min(static_cast<std::size_t>(position), std::size_t{intervals} - 1);
  const double beyond = position - static_cast<double>(node);
  const float* low = table_.data() + k * arm_size + node * node_size;
  const auto value = [&](int q) { return low[q] + beyond * (low[q + node_size] - low[q]); };
  return {value(0), value(1), 1 / value(2)};
}

void ArmCourses::straighten(const Points& points, const ArmPattern& pattern, double shift, float* x,
                            float* y) const {
  BatchArray r, winding;
  for (std::size_t i = 0; i < points.size; ++i) r[i] = std::hypot(points.x[i], points.y[i]);
  pattern.winding(r.data(), points.size, winding.data());
  HWY_DYNAMIC_DISPATCH(StraightenArms)
  (points, winding.data(), static_cast<float>(shift), table_.data(), arm_size, trunks_, x, y);
}

ArmProfile::ArmProfile(double arm_width, int trunks) {
  const double half_maximum = full_turn * (1 - std::exp2(-1 / arm_width));
  const double spacing = full_turn / std::max(trunks, 1);
  const double per_width = 2 * std::sqrt(2 * std::numbers::ln2);
  width = std::min(std::min(half_maximum, 0.5 * spacing) / per_width, widest);
  floor = std::pow(1 - 1.0 / std::max(trunks, 2), arm_width);
}

double ArmProfile::mean(const ArmCourses& courses, double r) const {
  std::vector<ArmCourses::Place> places;
  double narrowest = widest;
  for (std::size_t k = 0; k < courses.size(); ++k) {
    const ArmCourses::Place place = courses.at(k, r);
    if (place.strength <= 0) continue;
    places.push_back(place);
    narrowest = std::min(narrowest, width * place.width);
  }
  // The trapezoidal rule converges exponentially for sums of Gaussian functions.
  const int steps =
      std::clamp(static_cast<int>(std::ceil(full_turn / (0.7 * narrowest))), 32, 4096);
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double angle = full_turn * i / steps;
    double missed = 1;
    for (const ArmCourses::Place& place : places) {
      const double x = std::remainder(angle - place.offset, full_turn) / (width * place.width);
      missed *= 1 - place.strength * std::exp(-0.5 * x * x);
    }
    sum += 1 - missed;
  }
  return floor + (1 - floor) * sum / steps;
}

std::vector<double> ArmProfile::means(const ArmCourses& courses, std::size_t intervals) const {
  std::vector<double> result;
  for (std::size_t k = 0; k <= intervals; ++k) {
    result.push_back(mean(courses, static_cast<double>(k) / static_cast<double>(intervals)));
  }
  return result;
}

ArmFactorInput ArmProfile::input(const ArmCourses& courses) const {
  return {courses.table(), courses.size(), static_cast<float>(floor),
          static_cast<float>(1 / width)};
}

}  // namespace gamer
#endif
