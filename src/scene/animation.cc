#include "gamer/scene/animation.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <string>
#include <utility>

#include "core/message.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

constexpr int least_digits = 4;
// Smallest angle between up and the view for a level horizon, deg. With a smaller angle the image
// would spin.
constexpr double nearest_pole = 0.5;

std::vector<glm::dvec3> vectors(const std::vector<double>& numbers) {
  std::vector<glm::dvec3> result;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
    result.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  return result;
}

std::vector<double> numbers_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Unit vector along v, for any length of v; not finite where v has no direction.
glm::dvec3 unit_vector(const glm::dvec3& v) {
  return glm::normalize(v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
}

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The turn from x, y, z to right, up, back of a view. `view` and `up` are unit vectors.
glm::dquat turn_of(const glm::dvec3& view, const glm::dvec3& up) {
  const glm::dvec3 back = -view;
  const glm::dvec3 right = glm::normalize(glm::cross(up, back));
  return glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back));
}

/// The shortest turn between two directions of length 1.
glm::dquat shortest_turn(const glm::dvec3& from, const glm::dvec3& to) {
  return glm::normalize(glm::dquat(1 + glm::dot(from, to), glm::cross(from, to)));
}

}  // namespace

template <class Value>
SmoothPath<Value>::SmoothPath(std::vector<double> times, std::vector<Value> values)
    : times_(std::move(times)), values_(std::move(values)) {
  const std::size_t count = values_.size();
  // Slopes and lengths of the pieces.
  std::vector<Value> rates;
  std::vector<double> lengths;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    lengths.push_back(times_[i + 1] - times_[i]);
    rates.push_back((values_[i + 1] - values_[i]) * (1 / lengths[i]));
  }
  if (count == 1) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (count == 2) {
      slopes_.push_back(rates[0]);
      continue;
    }
    // The parabola through k - 1, k, k + 1; its slope is linear in time.
    const std::size_t k = std::clamp<std::size_t>(i, 1, count - 2);
    const double before = lengths[k - 1], after = lengths[k];
    const Value bend = (rates[k] - rates[k - 1]) * (1 / (before + after));
    const Value middle = rates[k - 1] + bend * before;
    slopes_.push_back(middle + bend * (2 * (times_[i] - times_[k])));
  }
}

template <class Value>
Value SmoothPath<Value>::at(double time) const {
  if (values_.size() == 1) return values_.front();
  const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, time);
  const auto i = static_cast<std::size_t>(next - times_.begin()) - 1;
  const double length = times_[i + 1] - times_[i];
  const double s = (time - times_[i]) / length, r = 1 - s;
  return values_[i] * (r * r * (1 + 2 * s)) + slopes_[i] * (r * r * s * length) +
         values_[i + 1] * (s * s * (1 + 2 * r)) - slopes_[i + 1] * (s * s * r * length);
}

template class SmoothPath<double>;
template class SmoothPath<glm::dvec3>;
template class SmoothPath<glm::dquat>;

CameraPath::CameraPath(const RenderParameters& parameters)
    : frames_(parameters.animation.frames),
      constant_{parameters.camera.position, parameters.camera.target, parameters.camera.up,
                parameters.camera.fov, parameters.camera.width} {
  const ParameterSet& animation = parameters.section("animation");
  if (parameters.camera.projection == Projection::sky) {
    throw InputError(animation.where("frames"),
                     "frames: an animation moves a camera with a target; a sky view has none");
  }
  constexpr std::pair<const char*, std::size_t> lists[] = {
      {"times", 1}, {"position", 3}, {"target", 3}, {"up", 3}, {"fov", 1}, {"width", 1}};
  std::size_t keys = 0;
  const char* first = nullptr;
  for (const auto& [name, size] : lists) {
    if (!animation.has(name)) continue;
    const std::size_t numbers = animation.numbers(name).size();
    if (numbers % size != 0) {
      throw input_error(animation.where(name), "{} has {} numbers; each key frame has three", name,
                        numbers);
    }
    if (numbers == 0) throw input_error(animation.where(name), "{} is empty", name);
    if (first != nullptr && numbers / size != keys) {
      throw input_error(animation.where(name), "{} has {} key frames, but {} has {}", name,
                        numbers / size, first, keys);
    }
    keys = numbers / size;
    if (first == nullptr) first = name;
  }
  for (const auto& [name, kinds] : {std::pair{"fov", "a perspective or fisheye view"},
                                    std::pair{"width", "an orthographic view"}}) {
    if (animation.has(name) && !parameters.applies("camera", name)) {
      throw input_error(animation.where(name), "animation.{} belongs to {}", name, kinds);
    }
  }
  if (animation.has("times")) {
    times_ = animation.numbers("times");
    for (std::size_t i = 1; i < times_.size(); ++i) {
      if (times_[i] > times_[i - 1]) continue;
      throw input_error(animation.where("times"), "times[{}] = {} is not after times[{}] = {}", i,
                        times_[i], i - 1, times_[i - 1]);
    }
  } else {
    for (std::size_t i = 0; i < std::max<std::size_t>(keys, 1); ++i) {
      times_.push_back(static_cast<double>(i));
    }
  }
  if (animation.has("position")) position_.emplace(times_, vectors(animation.numbers("position")));
  if (animation.has("target")) target_.emplace(times_, vectors(animation.numbers("target")));
  const auto logarithms = [&](const char* name) {
    std::vector<double> result = animation.numbers(name);
    for (double& value : result) value = std::log(value);
    return result;
  };
  if (animation.has("fov")) log_fov_.emplace(times_, logarithms("fov"));
  if (animation.has("width")) log_width_.emplace(times_, logarithms("width"));
  if (animation.has("up")) {
    const std::vector<glm::dvec3> ups = vectors(animation.numbers("up"));
    std::vector<glm::dquat> turns;
    for (std::size_t i = 0; i < ups.size(); ++i) {
      const View view = at(times_[i]);
      const glm::dvec3 way = unit_vector(view.target - view.position);
      const glm::dvec3 up = unit_vector(ups[i]);
      if (!(glm::length(glm::cross(way, up)) > 0)) {
        throw input_error(animation.where("up"),
                          "up of key frame {} is none or parallel to the view", i + 1);
      }
      const glm::dquat turn = turn_of(way, up);
      turns.push_back(!turns.empty() && glm::dot(turns.back(), turn) < 0 ? -turn : turn);
    }
    turn_.emplace(times_, std::move(turns));
  }
  check_views(animation, parameters.camera.projection);
}

void CameraPath::check_views(const ParameterSet& animation, Projection projection) const {
  // The interval of camera.fov in RenderParameters.
  const bool may_be_most = projection != Projection::perspective;
  const double most_fov = may_be_most ? 360 : 180;
  const double least = std::sin(nearest_pole * std::acos(-1.0) / 180);
  for (int frame = 0; frame < frames_; ++frame) {
    const View view = at(time(frame));
    const glm::dvec3 way = view.target - view.position;
    const double distance = glm::length(way);
    if (!is_finite(view.position) || !is_finite(view.target) || !is_finite(view.up) ||
        !std::isfinite(distance) || !(view.fov > 0) || !(view.width > 0) ||
        !std::isfinite(view.fov) || !std::isfinite(view.width)) {
      throw input_error(animation.where(animation.has("times") ? "times" : "frames"),
                        "in frame {} the camera leaves the range of numbers: the key frames lie "
                        "too far apart, or their times too near",
                        frame + 1);
    }
    if (log_fov_ && !(view.fov < most_fov || (view.fov == most_fov && may_be_most))) {
      throw input_error(animation.where("fov"),
                        "in frame {} fov is {:.6g}, outside ]0, {}{} (deg): the path through the "
                        "key frames swings beyond them; more of them hold it",
                        frame + 1, view.fov, most_fov, may_be_most ? ']' : '[');
    }
    if (!(distance > 0)) {
      throw input_error(animation.where("frames"),
                        "in frame {} the camera stands on its target: the view has no direction",
                        frame + 1);
    }
    const double sine = glm::length(glm::cross(way / distance, glm::normalize(view.up)));
    if (!turn_ && sine < least) {
      throw input_error(animation.where("frames"),
                        "in frame {} the view is parallel to camera.up, about which the image "
                        "would spin; give animation.up, the direction that is up in each key frame",
                        frame + 1);
    }
  }
}

double CameraPath::time(int frame) const {
  if (frames_ == 1) return times_.front();
  if (frame == frames_ - 1) return times_.back();
  return times_.front() + (times_.back() - times_.front()) * frame / (frames_ - 1);
}

CameraPath::View CameraPath::at(double time) const {
  View view = constant_;
  if (position_) view.position = position_->at(time);
  if (target_) view.target = target_->at(time);
  if (log_fov_) view.fov = std::exp(log_fov_->at(time));
  if (log_width_) view.width = std::exp(log_width_->at(time));
  if (turn_) {
    const glm::dquat turn = glm::normalize(turn_->at(time));
    const glm::dvec3 forward = glm::normalize(view.target - view.position);
    view.up = shortest_turn(turn * glm::dvec3(0, 0, -1), forward) * (turn * glm::dvec3(0, 1, 0));
  }
  return view;
}

std::filesystem::path frame_path(const std::filesystem::path& output, int frame, int frames) {
  const int digits = std::max(least_digits, static_cast<int>(fmt::format("{}", frames).size()));
  const std::string suffix = image_suffix_text(output);
  std::string stem = output.filename().string();
  stem.resize(stem.size() - suffix.size());
  return output.parent_path() / fmt::format("{}_{:0{}}{}", stem, frame + 1, digits, suffix);
}

RenderParameters frame_parameters(const RenderParameters& parameters, const CameraPath& path,
                                  int frame) {
  const CameraPath::View view = path.at(path.time(frame));
  const int frames = path.frames();
  std::vector<RenderParameters::Setting> settings = {
      {"camera", "position", numbers_of(view.position)},
      {"camera", "target", numbers_of(view.target)},
      {"camera", "up", numbers_of(view.up)},
      {"image", "output", frame_path(parameters.image.output.path, frame, frames).string()}};
  if (parameters.applies("camera", "fov")) settings.push_back({"camera", "fov", view.fov});
  if (parameters.applies("camera", "width")) settings.push_back({"camera", "width", view.width});
  if (!parameters.truth.path.empty()) {
    settings.push_back(
        {"truth", "output", frame_path(parameters.truth.path, frame, frames).string()});
  }
  const PictureStyle& style = parameters.image.output.style;
  if (style.grain > 0) {
    const std::uint64_t seed = style.grain_seed + static_cast<std::uint64_t>(frame);
    settings.push_back({"image", "grain_seed",
                        static_cast<std::int64_t>(seed % (PictureStyle::most_grain_seed + 1))});
  }
  for (const Parameter& parameter : parameters.section("animation").table()) {
    settings.push_back({"animation", parameter.name, std::monostate()});
  }
  RenderParameters result = parameters;
  result.set(settings);
  return result;
}

}  // namespace gamer
