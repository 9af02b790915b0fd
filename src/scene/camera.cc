#include "gamer/scene/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "core/message.h"
#include "core/text.h"
#include "gamer/image/data_table.h"
#include "gamer/image/wcs_affine.h"
#include "scene/tangent_plane.h"

namespace gamer {
namespace {

// Comment of CRPIXi in the records of a view that no header gives (CelestialWcs::records()).
constexpr std::string_view view_middle = "middle of the image";

// Key of the header in the record.
constexpr const char* header_name = "camera.header";

CelestialWcs wcs_of(const RenderParameters& parameters) {
  SkyView view = parameters.camera.sky;
  view.width = parameters.width;
  view.height = parameters.height;
  try {
    return CelestialWcs(view);
  } catch (const InputError& error) {
    throw InputError(parameters.section("camera").where("sky_projection"), error.what());
  }
}

/// The region of the parameters, or the whole image.
ImageRegion window_of(const RenderParameters& parameters) {
  const ImageRegion whole{0, 0, parameters.width, parameters.height};
  if (!parameters.image.region) return whole;
  const ImageRegion& region = *parameters.image.region;
  if (region.right() <= whole.width && region.top() <= whole.height) return region;
  throw input_error(parameters.section("image").where("region"),
                    "region = [{}, {}, {}, {}] reaches to the pixel {}, {}; the image has {} x {}",
                    region.left + 1, region.bottom + 1, region.width, region.height, region.right(),
                    region.top(), whole.width, whole.height);
}

/// Value of a header's card, without quotes and comment.
std::optional<std::string> header_value(const std::string& header, const std::string& key) {
  const std::string start = fmt::format("{:<8}=", key);
  for (std::size_t at = 0; at < header.size();) {
    const std::size_t end = std::min(header.find('\n', at), header.size());
    std::string line = header.substr(at, end - at);
    at = end + 1;
    if (!line.starts_with(start)) continue;
    line.erase(0, start.size());
    line.erase(std::min(line.find('/'), line.size()));
    std::erase_if(line, [](char c) { return c == ' ' || c == '\''; });
    return line;
  }
  return std::nullopt;
}

/// Size of an image along an axis, as its header gives it.
int header_size(const std::string& header, const std::string& key, const std::string& label) {
  const std::optional<std::string> value = header_value(header, key);
  if (!value) throw input_error({label, 0, 0}, "its header has no {}", key);
  const int size = number_of<int>(*value).value_or(0);
  if (size < 1) throw input_error({label, 0, 0}, "{} = {} is no image's size", key, *value);
  return size;
}

/// Rejects headers whose coordinates are not ICRS, as catalogues are, or whose pixels have no
/// scale. FK5 at 2000 agrees with ICRS to some 0.02 arcsec.
void check_sky_header(const std::string& header, const std::string& label) {
  const auto number = [&](const char* key) -> std::optional<double> {
    const std::optional<std::string> value = header_value(header, key);
    return value ? std::optional(std::strtod(value->c_str(), nullptr)) : std::nullopt;
  };
  // FITS paper II: without RADESYS, equinoxes before 1984 mean FK4.
  constexpr double first_of_fk5 = 1984, icrs_equinox = 2000;
  std::optional<double> equinox = number("EQUINOX");
  if (!equinox) equinox = number("EPOCH");
  std::string frame = header_value(header, "RADESYS").value_or("");
  if (frame.empty()) frame = header_value(header, "RADECSYS").value_or("");
  if (frame.empty()) frame = !equinox ? "ICRS" : *equinox < first_of_fk5 ? "FK4" : "FK5";
  if (frame != "ICRS" && !(frame == "FK5" && equinox.value_or(icrs_equinox) == icrs_equinox)) {
    throw input_error({label, 0, 0},
                      "its coordinates are {}{}; expected ICRS, or FK5 of the equinox 2000", frame,
                      equinox ? fmt::format(" of the equinox {}", *equinox) : "");
  }
  static constexpr std::array<const char*, 8> scales = {"CD1_1",  "CD1_2",  "CD2_1",    "CD2_2",
                                                        "CDELT1", "CDELT2", "CD001001", "CD002002"};
  if (std::ranges::none_of(
          scales, [&](const char* key) { return header_value(header, key).has_value(); })) {
    throw InputError({label, 0, 0}, "its pixels have no scale; expected CDi_j or CDELTi");
  }
}

/// Places left of, right of, below and above a place.
using Cross = std::array<glm::dvec2, 4>;

Cross cross_at(const glm::dvec2& place, double half) {
  return {{{place.x - half, place.y},
           {place.x + half, place.y},
           {place.x, place.y - half},
           {place.x, place.y + half}}};
}

/// Solid angle of a pixel, from the rays at the ends of its cross.
std::optional<double> angle_across(
    std::span<const std::optional<Ray>, std::tuple_size_v<Cross>> ends, double half) {
  if (!std::ranges::all_of(ends, [](const auto& end) { return end.has_value(); })) return {};
  return glm::length(glm::cross(ends[1]->direction - ends[0]->direction,
                                ends[3]->direction - ends[2]->direction)) /
         (4 * half * half);
}

/// Cosine and sine of an angle in degrees. Only the difference to the next right angle is converted
/// to radians, so that a right ascension near 360 deg loses no digits.
struct UnitCircle {
  explicit UnitCircle(double degrees) {
    int quadrant = 0;
    const double rest = glm::radians(std::remquo(degrees, 90.0, &quadrant));
    const double c = std::cos(rest), s = std::sin(rest);
    const bool is_odd = quadrant % 2 != 0;
    const double sign = (quadrant & 2) != 0 ? -1 : 1;
    cosine = sign * (is_odd ? -s : c);
    sine = sign * (is_odd ? c : s);
  }
  double cosine, sine;
};

}  // namespace

glm::dvec3 direction_of(const SkyPosition& sky) {
  const UnitCircle ra(sky.ra), dec(sky.dec);
  return {dec.cosine * ra.cosine, dec.cosine * ra.sine, dec.sine};
}

SkyPosition sky_of(const glm::dvec3& direction) {
  const double ra = glm::degrees(std::atan2(direction.y, direction.x));
  return {ra < 0 ? ra + 360 : ra,
          glm::degrees(std::atan2(direction.z, std::hypot(direction.x, direction.y)))};
}

Camera::Camera(const RenderParameters& parameters)
    : width_(parameters.width),
      height_(parameters.height),
      window_(window_of(parameters)),
      projection_(parameters.camera.projection),
      position_(parameters.camera.position),
      unit_(parameters.scene.unit),
      sphere_(make_sphere_projection(parameters)) {
  if (projection_ == Projection::sky) {
    if (!parameters.camera.header.empty()) {
      throw InputError(parameters.camera.header_where, "the header of this sky view is not read");
    }
    wcs_ = wcs_of(parameters);
    set_sky();
    return;
  }
  back_ = glm::normalize(parameters.camera.position - parameters.camera.target);
  const double across = projection_ == Projection::perspective
                            ? 2 * std::tan(glm::radians(parameters.camera.fov) / 2)
                            : parameters.camera.width;
  pixel_ = sphere_ ? sphere_->pixel_angle() : across / width_;
  right_ = glm::normalize(glm::cross(glm::normalize(parameters.camera.up), back_));
  up_ = glm::cross(back_, right_);
}

Camera::Camera(const RenderParameters& parameters, const CelestialWcs& wcs)
    : width_(parameters.width),
      height_(parameters.height),
      window_(window_of(parameters)),
      projection_(Projection::sky),
      unit_(parameters.scene.unit),
      wcs_(wcs) {
  wcs.check_distortion(width_, height_);
  set_sky();
}

Camera Camera::with_window(const ImageRegion& window) const {
  Camera result = *this;
  result.window_ = window;
  return result;
}

void Camera::set_sky() {
  if (const std::optional<TangentPlane> plane = TangentPlane::of(*wcs_)) {
    plane_ = std::make_shared<const TangentPlane>(*plane);
  }
  position_ = {0, 0, 0};
  // Sizes of pixels spread over the image, and the first pixel that shows sky.
  constexpr int places = 8;
  bool found = false;
  for (const int order : {0, 1}) {
    for (int j = 0; j <= places; ++j) {
      for (int i = 0; i <= places; ++i) {
        // The middle pixel comes first.
        const bool is_middle = 2 * i == places && 2 * j == places;
        if (is_middle != (order == 0)) continue;
        const double x = (width_ - 1) * static_cast<double>(i) / places;
        const double y = (height_ - 1) * static_cast<double>(j) / places;
        const std::optional<Ray> here = ray(x, y);
        if (!here) continue;
        const auto left = ray(x - 0.5, y), right = ray(x + 0.5, y);
        const auto below = ray(x, y - 0.5), above = ray(x, y + 0.5);
        if (left && right && below && above) {
          const double across = glm::length(right->direction - left->direction);
          const double along = glm::length(above->direction - below->direction);
          pixel_ = std::max({pixel_, across, along});
          const double shorter = std::min(across, along);
          shortest_ = shortest_ > 0 ? std::min(shortest_, shorter) : shorter;
        }
        if (found) continue;
        found = true;
        back_ = -here->direction;
        up_ = up_at(here->direction);
        right_ = glm::cross(up_, back_);
      }
    }
  }
}

std::optional<Ray> Camera::ray(double x, double y) const {
  if (plane_) return Ray{position_, plane_->direction(x, y)};
  if (wcs_) {
    const std::optional<SkyPosition> sky = wcs_->sky({x + 1, y + 1});
    if (!sky) return std::nullopt;
    return Ray{position_, direction_of(*sky)};
  }
  if (sphere_) {
    const std::optional<glm::dvec3> way = sphere_->direction(x, y);
    if (!way) return std::nullopt;
    return Ray{position_, way->x * right_ + way->y * up_ - way->z * back_};
  }
  const glm::dvec3 offset =
      pixel_ * (x - middle_pixel(width_)) * right_ + pixel_ * (y - middle_pixel(height_)) * up_;
  if (projection_ == Projection::perspective) return Ray{position_, glm::normalize(offset - back_)};
  return Ray{position_ + offset, -back_};
}

void Camera::rays(std::span<const glm::dvec2> places, std::span<std::optional<Ray>> out) const {
  if (!wcs_ || plane_) {
    for (std::size_t i = 0; i < places.size(); ++i) out[i] = ray(places[i].x, places[i].y);
    return;
  }
  std::vector<PixelPosition> pixels;
  pixels.reserve(places.size());
  for (const glm::dvec2& place : places) pixels.push_back({place.x + 1, place.y + 1});
  std::vector<SkyPosition> sky(places.size());
  wcs_->sky(pixels, sky);
  for (std::size_t i = 0; i < places.size(); ++i) {
    out[i].reset();
    if (!std::isnan(sky[i].ra)) out[i] = Ray{position_, direction_of(sky[i])};
  }
}

bool Camera::is_flat() const {
  return plane_ || projection_ == Projection::perspective ||
         projection_ == Projection::orthographic;
}

Camera::HalfSpace Camera::beyond(int axis, double place) const {
  if (plane_) return {plane_->inward(axis, place), 0};
  const glm::dvec3& across = axis == 0 ? right_ : up_;
  const double offset = pixel_ * (place - middle_pixel(axis == 0 ? width_ : height_));
  if (projection_ == Projection::orthographic) return {across, offset};
  return {across + offset * back_, 0};
}

std::optional<glm::dvec2> Camera::pixel(const glm::dvec3& point) const {
  if (plane_) return plane_->pixel(point);
  if (wcs_) {
    const std::optional<PixelPosition> pixel = wcs_->pixel(sky_of(point));
    if (!pixel) return std::nullopt;
    return glm::dvec2(pixel->x - 1, pixel->y - 1);
  }
  const glm::dvec3 way = point - position_;
  const double along = -glm::dot(way, back_);
  if (sphere_) {
    const double length = glm::length(way);
    if (!(length > 0)) return std::nullopt;
    return sphere_->pixel(glm::dvec3(glm::dot(way, right_), glm::dot(way, up_), along) / length);
  }
  if (!(along > 0)) return std::nullopt;
  const double unit = projection_ == Projection::perspective ? pixel_ * along : pixel_;
  return glm::dvec2(middle_pixel(width_) + glm::dot(way, right_) / unit,
                    middle_pixel(height_) + glm::dot(way, up_) / unit);
}

double Camera::solid_angle(double x, double y) const {
  if (sphere_) return sphere_->solid_angle(x, y);
  if (projection_ == Projection::orthographic) return pixel_ * pixel_;
  if (projection_ == Projection::perspective) {
    const double u = pixel_ * (x - middle_pixel(width_)), v = pixel_ * (y - middle_pixel(height_));
    return pixel_ * pixel_ / std::pow(1 + u * u + v * v, 1.5);
  }
  // Parallelogram of the pixel's middle lines; at the edge of the sky a smaller one, scaled up.
  constexpr int most_halvings = 10;
  double half = 0.5;
  for (int i = 0; i < most_halvings; ++i, half *= 0.5) {
    const Cross cross = cross_at({x, y}, half);
    std::array<std::optional<Ray>, std::tuple_size_v<Cross>> ends;
    rays(cross, ends);
    if (const auto angle = angle_across(ends, half)) return *angle;
  }
  return 0;
}

void Camera::solid_angles(int y, std::span<const int> x, std::span<double> out) const {
  constexpr double half = 0.5;
  std::vector<glm::dvec2> places;
  if (wcs_) {
    for (const int column : x) {
      const Cross cross = cross_at({column, y}, half);
      places.insert(places.end(), cross.begin(), cross.end());
    }
  }
  std::vector<std::optional<Ray>> ends(places.size());
  rays(places, ends);
  constexpr std::size_t each = std::tuple_size_v<Cross>;
  for (std::size_t i = 0; i < x.size(); ++i) {
    std::optional<double> angle;
    if (wcs_) angle = angle_across(std::span(ends).subspan(each * i).first<each>(), half);
    out[i] = angle ? *angle : solid_angle(x[i], y);
  }
}

double Camera::pixel_size(const glm::dvec3& point) const {
  return projection_ == Projection::orthographic ? pixel_ : pixel_ * distance(point);
}

bool Camera::has_edge() const {
  return projection_ == Projection::sky || projection_ == Projection::fisheye;
}

glm::ivec2 Camera::neighbour(const glm::dvec2& at, int x, int y) const {
  return sphere_ ? sphere_->neighbour(at, x, y) : glm::ivec2(x, y);
}

glm::ivec2 Camera::pixel_at(const glm::dvec2& at) const {
  return neighbour(at, static_cast<int>(std::round(at.x)), static_cast<int>(std::round(at.y)));
}

glm::dvec3 Camera::up_at(const glm::dvec3& point) const {
  if (!wcs_) return up_;
  const double across = std::hypot(point.x, point.y);
  if (across == 0) return {point.z > 0 ? -1 : 1, 0, 0};
  // d(direction)/d(dec).
  const double length = glm::length(point);
  return glm::dvec3(-point.z * point.x / across, -point.z * point.y / across, across) / length;
}

glm::dvec3 Camera::towards(const glm::dvec3& point) const {
  if (projection_ == Projection::orthographic) return back_;
  const glm::dvec3 way = position_ - point;
  const double length = glm::length(way);
  return length > 0 ? way / length : back_;
}

double Camera::distance(const glm::dvec3& point) const {
  return projection_ == Projection::orthographic ? 0 : glm::length(point - position_);
}

std::vector<std::string> Camera::wcs_records() const {
  FitsHeader header(wcs_->records());
  map_pixels(header,
             {.x0 = -static_cast<double>(window_.left), .y0 = -static_cast<double>(window_.bottom)},
             "image.region");
  const bool is_part = window_.left != 0 || window_.bottom != 0 || window_.width != width_ ||
                       window_.height != height_;
  for (const char* key : {"CRPIX1", "CRPIX2"}) {
    std::optional<Card> card = header.card(key);
    if (!is_part || !card || card->comment != view_middle) continue;
    card->comment = "middle of the whole image";
    header.set(*card);
  }
  return header.records();
}

LinearAxis Camera::x_axis() const {
  const bool is_perspective = projection_ == Projection::perspective;
  const double step = is_perspective ? glm::degrees(pixel_) : pixel_;
  return {is_perspective ? "XTAN" : "X", is_perspective ? "deg" : unit_,
          middle_pixel(width_) + 1 - window_.left, 0, step};
}

LinearAxis Camera::y_axis() const {
  LinearAxis axis = x_axis();
  axis.type = projection_ == Projection::perspective ? "YTAN" : "Y";
  axis.reference_pixel = middle_pixel(height_) + 1 - window_.bottom;
  return axis;
}

Camera make_camera(RenderParameters& parameters, Resources& resources) {
  if (parameters.camera.projection != Projection::sky || parameters.camera.header.empty()) {
    return Camera(parameters);
  }
  const std::string& name = parameters.camera.header;
  const Resources::Text* text = resources.recorded(header_name);
  try {
    if (text == nullptr) {
      const std::filesystem::path beside =
          std::filesystem::path(parameters.camera.header_where.file).parent_path() / name;
      // A file beside the parameters that cannot be examined still counts as existing.
      std::error_code error;
      const bool is_there = std::filesystem::exists(header_file(beside), error) || error;
      const std::filesystem::path path = is_there ? beside : std::filesystem::path(name);
      resources.add_file(header_file(path));
      text = &resources.add({header_name, name, header_text(path)});
    }
    const int width = header_size(text->content, "NAXIS1", name);
    const int height = header_size(text->content, "NAXIS2", name);
    const ParameterSet& image = parameters.section("image");
    if (image.is_given("size") && (parameters.width != width || parameters.height != height)) {
      throw input_error(image.where("size"), "size = {} x {} is not that of camera.header, {} x {}",
                        parameters.width, parameters.height, width, height);
    }
    parameters.set("image", "size", std::vector<double>{double(width), double(height)});
    CelestialWcs wcs = CelestialWcs::from_header(text->content, name);
    check_sky_header(text->content, name);
    return Camera(parameters, std::move(wcs));
  } catch (const InputError& error) {
    if (std::string_view(error.what()).starts_with(parameters.camera.header_where.file + ":"))
      throw;
    throw InputError(parameters.camera.header_where, error.what());
  }
}

}  // namespace gamer
