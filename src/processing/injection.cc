#include "processing/injection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/core/units.h"
#include "processing/arithmetic.h"
#include "processing/detector.h"
#include "processing/plane_info.h"

namespace gamer {
namespace {

/// Zero points of one image that differ by less are equal, mag.
constexpr double zero_point_error = 1e-3;

std::optional<CardValue> plane_card(const FitsHeader& header, std::string_view key, int plane) {
  return of_plane(key, plane, [&](const std::string& name) -> std::optional<CardValue> {
    if (const auto value = header.number(name)) return CardValue{*value, name};
    return std::nullopt;
  });
}

/// The zero point of a flux density in a unit of janskys: 8.9 is that of 1 Jy (AB).
std::optional<CardValue> unit_zero_point(const FitsHeader& header) {
  constexpr std::array<std::pair<std::string_view, double>, 4> units = {
      {{"nJy", 31.4}, {"uJy", 23.9}, {"mJy", 16.4}, {"Jy", 8.9}}};
  const std::string unit = header.text("BUNIT").value_or("");
  const auto known =
      std::ranges::find_if(units, [&](const auto& entry) { return entry.first == unit; });
  if (known == units.end()) return std::nullopt;
  return CardValue{known->second, "BUNIT"};
}

/// Side vectors of a pixel, arcsec towards East and North: of x, then of y.
std::optional<std::array<double, 4>> sides(const CelestialWcs& wcs, const PixelPosition& at) {
  constexpr double full_circle = 360;
  std::array<double, 4> result{};
  for (const int axis : {0, 1}) {
    const double dx = axis == 0 ? 0.5 : 0, dy = 0.5 - dx;
    const auto low = wcs.sky({at.x - dx, at.y - dy}), high = wcs.sky({at.x + dx, at.y + dy});
    if (!low || !high) return std::nullopt;
    const double middle = 0.5 * (low->dec + high->dec) * degree;
    const auto first = static_cast<std::size_t>(2 * axis);
    result[first] =
        std::remainder(high->ra - low->ra, full_circle) * std::cos(middle) * degree / arcsecond;
    result[first + 1] = (high->dec - low->dec) * degree / arcsecond;
  }
  return result;
}

/// The sum of an image and light of its size.
class InjectedPlane final : public Plane {
 public:
  InjectedPlane(PlanePtr image, PlanePtr light, Tile tile)
      : Plane(image->width(), image->height()),
        image_(std::move(image)),
        light_(std::move(light)),
        tile_(tile) {
    if (light_->width() != width() || light_->height() != height()) {
      throw std::invalid_argument("image and light differ in size");
    }
  }

  Tile tile() const override { return tile_.width > 0 ? tile_ : image_->tile(); }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    image_->read(area, out, stride);
    std::vector<double> light(static_cast<std::size_t>(area.width) * area.height);
    light_->read(area, light.data());
    const double* from = light.data();
    for (int row = 0; row < area.height; ++row, from += area.width) {
      double* to = out + row * stride;
      for (int i = 0; i < area.width; ++i) {
        // Adding 0 would change -0.
        if (from[i] != 0) to[i] += from[i];
      }
    }
  }

 private:
  PlanePtr image_, light_;
  Tile tile_;
};

}  // namespace

std::span<const std::string_view> zero_point_keys() {
  static constexpr std::array<std::string_view, 6> keys = {"MAGZERO", "PHOTZP", "MAGZEROP",
                                                           "MAGZPT",  "MAGZP",  "ZEROPOINT"};
  return keys;
}

std::span<const std::string_view> gain_keys() {
  static constexpr std::array<std::string_view, 2> keys = {"GAIN", "EGAIN"};
  return keys;
}

std::optional<CardValue> zero_point_of(std::span<const FitsHeader> headers, int plane,
                                       const std::string& context) {
  for (const FitsHeader& header : headers) {
    std::optional<CardValue> found;
    for (const std::string_view key : zero_point_keys()) {
      const auto card = plane_card(header, key, plane);
      if (!card) continue;
      if (!found) found = card;
      if (std::abs(card->value - found->value) > zero_point_error) {
        throw input_error("{}{} is {}, but {} is {}; --zero-point says what counts", context,
                          found->key, found->value, card->key, card->value);
      }
    }
    if (found) return found;
  }
  for (const FitsHeader& header : headers) {
    if (const auto value = unit_zero_point(header)) return value;
  }
  return std::nullopt;
}

std::optional<CardValue> gain_of(std::span<const FitsHeader> headers, int plane) {
  for (const FitsHeader& header : headers) {
    for (const std::string_view key : gain_keys()) {
      const auto card = plane_card(header, key, plane);
      if (card && card->value > 0) return card;
    }
  }
  return std::nullopt;
}

std::optional<GridShift> grid_shift(const CelestialWcs& large, const CelestialWcs& small, int width,
                                    int height) {
  const PixelPosition middle = {0.5 * (width + 1), 0.5 * (height + 1)};
  const std::array<PixelPosition, 5> places = {
      {middle,
       {1, 1},
       {static_cast<double>(width), 1},
       {1, static_cast<double>(height)},
       {static_cast<double>(width), static_cast<double>(height)}}};
  GridShift shift;
  for (const PixelPosition& place : places) {
    const auto sky = small.sky(place);
    const auto pixel = sky ? large.pixel(*sky) : std::nullopt;
    if (!pixel) return std::nullopt;
    const double dx = pixel->x - place.x, dy = pixel->y - place.y;
    constexpr double farthest = 1e9;
    if (std::hypot(dx, dy) > farthest) return std::nullopt;
    if (&place == places.data()) {
      shift.x = static_cast<int>(std::lround(dx));
      shift.y = static_cast<int>(std::lround(dy));
      shift.rest_x = dx - shift.x;
      shift.rest_y = dy - shift.y;
    }
    const double bend_x = dx - shift.x - shift.rest_x, bend_y = dy - shift.y - shift.rest_y;
    shift.bend = std::max(shift.bend, std::hypot(bend_x, bend_y));
    shift.error = std::max(shift.error, std::hypot(dx - shift.x, dy - shift.y));
  }
  return shift;
}

double grid_difference(const CelestialWcs& a, const PixelPosition& at_a, const CelestialWcs& b,
                       const PixelPosition& at_b) {
  const auto first = sides(a, at_a), second = sides(b, at_b);
  if (!first || !second) return std::numeric_limits<double>::infinity();
  const double scale = std::hypot((*first)[0], (*first)[1]);
  double most = 0;
  for (std::size_t i : {std::size_t{0}, std::size_t{2}}) {
    most =
        std::max(most, std::hypot((*first)[i] - (*second)[i], (*first)[i + 1] - (*second)[i + 1]));
  }
  return most / scale;
}

PlanePtr injected(PlanePtr image, PlanePtr light, const Injection& injection) {
  if (injection.least > 0) {
    light = changed(std::move(light), [least = injection.least](const Area& area, double* values) {
      const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
      for (double& v : all) v = std::abs(v) < least ? 0 : v;
    });
  }
  if (injection.has_noise) {
    const Detector detector{.electron_rate = injection.factor * injection.gain,
                            .per_electron = 1 / injection.gain};
    light = observed(std::move(light), detector, injection.key);
  } else {
    light = scaled(std::move(light), injection.factor, 0);
  }
  return std::make_shared<InjectedPlane>(std::move(image), std::move(light), injection.tile);
}

PlanePtr without_missing(PlanePtr light) {
  return changed(std::move(light), [](const Area& area, double* values) {
    const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
    for (double& v : all) v = std::isfinite(v) ? v : 0;
  });
}

double largest_value(const Plane& plane, int threads) {
  double most = 0;
  for_each_band(plane, threads, [&](const Area& area, const double* values) {
    const std::span all(values, static_cast<std::size_t>(area.width) * area.height);
    for (const double v : all) most = std::max(most, std::abs(v));
  });
  return most;
}

}  // namespace gamer
