#include "image/picture_psf.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "image/convolution/convolution.h"

namespace gamer {
namespace {

constexpr double wing_exponent = 2.5;  // of the Moffat profile
constexpr double reach = 24;           // of the stamp and the spikes, FWHM
constexpr double spike_core = 2;       // distance of half a spike's light, FWHM

/// Spikes along rows; distances from the middle in FWHM.
double spike(double along, double across) {
  const double end = along / reach, core = along / spike_core;
  if (std::abs(end) >= 1) return 0;
  const double taper = (1 - end * end) * (1 - end * end);
  return taper / (1 + core * core) * std::exp(-4 * std::numbers::ln2 * across * across);
}

}  // namespace

int picture_psf_side(double seeing) {
  return 2 * std::max(1, static_cast<int>(std::ceil(reach * seeing))) + 1;
}

Stamp picture_psf(const PictureStyle& style) {
  const int side = picture_psf_side(style.seeing), half = side / 2;
  const Psf psf({.kind = PsfKind::moffat, .fwhm = style.seeing, .beta = wing_exponent});
  Stamp stamp = make_stamp(psf, {.size = side});
  if (style.spikes == 0) return stamp;
  Stamp spikes = stamp;
  auto value = spikes.values.begin();
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      const double dx = x / style.seeing, dy = y / style.seeing;
      *value++ = spike(dx, dy) + spike(dy, dx);
    }
  }
  const double scale = style.spikes / spikes.sum();
  for (std::size_t i = 0; i < stamp.values.size(); ++i) {
    stamp.values[i] = (1 - style.spikes) * stamp.values[i] + scale * spikes.values[i];
  }
  return stamp;
}

std::uint64_t blur_memory(int width, int height, const PictureStyle& style) {
  const auto square = [](int side) { return static_cast<std::uint64_t>(side) * side; };
  const int side = picture_psf_side(style.seeing);
  // A channel is copied. A stamp has copies, and transforms of at most twice its side or this.
  constexpr int transform = 2048;
  constexpr std::uint64_t stamps = 5, transforms = 3;
  const int longest = std::min(std::max(transform, 2 * side), std::max(width, height) + 2 * side);
  return sizeof(double) * (static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) +
                           stamps * square(side) + transforms * square(longest));
}

void blur(Image& channels, const Stamp& psf) {
  for (int plane = 0; plane < channels.planes(); ++plane) {
    const PlanePtr seen =
        convolved(memory_plane(channels, plane), psf, {.edge = EdgeMode::reflect});
    seen->read(seen->whole(), channels.plane(plane));
  }
}

}  // namespace gamer
