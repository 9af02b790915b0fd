#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "gamer/core/cancellation.h"
#include "gamer/job/session.h"
#include "studio/message.h"
#include "studio/view.h"

namespace gamer {

/// The nodes of a grid along an axis of the ball, closer towards the middle. The place x has the
/// index
///   u(x) = (nodes - 1)/2 (1 + (1 - share) x + share asinh(x/core) / asinh(1/core)),
/// from 0 at x = -1 to nodes - 1 at x = 1.
struct DraftAxis {
  int nodes = 2;
  double core = 1;   ///< half width of the interval in which nodes are closest, galaxy radii
  double share = 0;  ///< share of the nodes that are close together

  double index(double x) const;
  /// du/dx, nodes per galaxy radius.
  double density(double x) const;
  /// The place of an index from 0 to nodes - 1, to the rounding of doubles.
  double place(double index) const;
  std::vector<double> places() const;  ///< of all nodes
  /// Factors of the values at the nodes, near 1. With them the integral over x of the
  /// interpolation, which is linear in u, equals the trapezoidal rule in u. That rule errs far less
  /// than the integral without factors.
  std::vector<double> weights() const;
};

/// Light and dust of a galaxy on a grid of its ball, from which a page draws it from any side.
struct Draft {
  struct Plane {
    std::string label;
    double wavelength = 0;
    double extinction = 0;  ///< relative to V, of the galaxy's light behind tau_V = 1
    double light = 0;       ///< brightness per galaxy radius of a voxel's number 1
  };
  std::array<DraftAxis, 3> axes;
  glm::dmat3 to_ball;  ///< PlacedGalaxy::to_ball
  glm::dvec3 centre;
  double radius = 1;  ///< scene units
  std::string unit;
  std::vector<Plane> planes;  ///< 1 to 3
  double depth = 0;           ///< optical depth at V per galaxy radius of a voxel's number 1
  /// Half-precision numbers [(z ny + y) nx + x][plane], then that of the dust.
  std::vector<std::uint16_t> voxels;
  /// [(z ny + y) nx + x][i]: the dust of the other variants of dust_variants.h; empty where no dust
  /// has any.
  std::vector<std::uint16_t> variants;

  static constexpr std::size_t numbers = 4;         ///< of a voxel
  static constexpr std::size_t other_variants = 2;  ///< of a voxel
};

/// Evaluates the one galaxy of a view for rays whose footprint is a 128th of the ball. Textures are
/// measured first. Throws Cancelled, RunError, and InputError for views that have no draft. These
/// are scenes with other objects, skies, more than three planes, pixels that count flux, and
/// galaxies whose orientation follows the camera.
Draft make_draft(const Session& session, const std::string& label, const DraftRequest& request,
                 const Cancellation& cancellation);

/// The message with `count` slices of a draft from z = `first` on: a head as that of FrameEncoder,
/// then packed_slices().
std::string encode_slices(const Draft& draft, std::int64_t id, int first, int count);
/// Sends a draft in messages of few slices, so that views need not wait for all of it. The last
/// message is returned.
std::string send_draft(const Draft& draft, std::int64_t id, const Send& send);

/// The half-precision number nearest to a value of 0 to 65504.
std::uint16_t half_of(float value);

}  // namespace gamer
