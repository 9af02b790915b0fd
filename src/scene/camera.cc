#include "gamer/scene/camera.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace gamer {
namespace {

/// Coordinate of the image's middle along a side of `size` pixels.
double middle(int size) { return 0.5 * (size - 1); }

}  // namespace

Camera::Camera(const RenderParameters& parameters)
    : width_(parameters.width),
      height_(parameters.height),
      perspective_(parameters.projection == Projection::perspective),
      position_(parameters.position),
      back_(glm::normalize(parameters.position - parameters.target)),
      unit_(parameters.unit) {
  const double across =
      perspective_ ? 2 * std::tan(glm::radians(parameters.fov) / 2) : parameters.camera_width;
  pixel_ = across / width_;
  right_ = glm::normalize(glm::cross(glm::normalize(parameters.up), back_));
  up_ = glm::cross(back_, right_);
}

Ray Camera::ray(double x, double y) const {
  const glm::dvec3 offset =
      pixel_ * (x - middle(width_)) * right_ + pixel_ * (y - middle(height_)) * up_;
  if (perspective_) return {position_, glm::normalize(offset - back_)};
  return {position_ + offset, -back_};
}

glm::dvec3 Camera::towards(const glm::dvec3& point) const {
  if (!perspective_) return back_;
  const glm::dvec3 way = position_ - point;
  const double distance = glm::length(way);
  return distance > 0 ? way / distance : back_;
}

LinearAxis Camera::x_axis() const {
  const double step = perspective_ ? glm::degrees(pixel_) : pixel_;
  return {perspective_ ? "XTAN" : "X", perspective_ ? "deg" : unit_, middle(width_) + 1, 0, step};
}

LinearAxis Camera::y_axis() const {
  LinearAxis axis = x_axis();
  axis.type = perspective_ ? "YTAN" : "Y";
  axis.reference_pixel = middle(height_) + 1;
  return axis;
}

}  // namespace gamer
