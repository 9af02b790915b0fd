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

Stamp picture_psf(const PictureStyle& style) {
  const int half = std::max(1, static_cast<int>(std::ceil(reach * style.seeing)));
  const Psf psf({.kind = PsfKind::moffat, .fwhm = style.seeing, .beta = wing_exponent});
  Stamp stamp = make_stamp(psf, {.size = 2 * half + 1});
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

void blur(Image& channels, const Stamp& psf) {
  for (int plane = 0; plane < channels.planes(); ++plane) {
    const PlanePtr seen =
        convolved(memory_plane(channels, plane), psf, {.edge = EdgeMode::reflect});
    seen->read(seen->whole(), channels.plane(plane));
  }
}

}  // namespace gamer
