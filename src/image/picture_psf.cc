#include "image/picture_psf.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "image/convolution/convolution.h"

namespace gamer {
namespace {

constexpr double wing_exponent = 2.5;  // of the Moffat profile
constexpr double spike_core = 2;       // distance of half a spike's light, FWHM
constexpr double aureole_core = 4;     // of the aureole, FWHM
constexpr double aureole_share = 0.04;

/// Reach of the stamp, the spikes and the aureole, FWHM. It is 64 in narrow seeing, and falls to 24
/// in wide seeing.
double reach_of(double seeing) {
  constexpr double least = 24, most = 64, pixels = 192;
  return std::clamp(pixels / seeing, least, most);
}

/// A profile of light that ends smoothly at the reach. Distances from the middle are in FWHM.
double tapered(double distance, double reach, double core) {
  const double end = distance / reach, inner = distance / core;
  if (std::abs(end) >= 1) return 0;
  return (1 - end * end) * (1 - end * end) / (1 + inner * inner);
}

/// Spikes along rows.
double spike(double along, double across, double reach) {
  return tapered(along, reach, spike_core) * std::exp(-4 * std::numbers::ln2 * across * across);
}

/// Replaces the share `share` of a stamp's light by light with a profile, whose arguments are in
/// FWHM from the middle.
template <class Profile>
void mix_in(double share, double seeing, const Profile& profile, Stamp& stamp) {
  Stamp part = stamp;
  const int half = stamp.width / 2;
  auto value = part.values.begin();
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) *value++ = profile(x / seeing, y / seeing);
  }
  const double scale = share / part.sum();
  for (std::size_t i = 0; i < stamp.values.size(); ++i) {
    stamp.values[i] = (1 - share) * stamp.values[i] + scale * part.values[i];
  }
}

}  // namespace

int picture_psf_side(double seeing) {
  return 2 * std::max(1, static_cast<int>(std::ceil(reach_of(seeing) * seeing))) + 1;
}

Stamp picture_psf(const PictureStyle& style) {
  const double reach = reach_of(style.seeing);
  const Psf psf({.kind = PsfKind::moffat, .fwhm = style.seeing, .beta = wing_exponent});
  Stamp stamp = make_stamp(psf, {.size = picture_psf_side(style.seeing)});
  mix_in(
      aureole_share, style.seeing,
      [&](double x, double y) { return tapered(std::hypot(x, y), reach, aureole_core); }, stamp);
  if (style.spikes == 0) return stamp;
  mix_in(
      style.spikes, style.seeing,
      [&](double x, double y) { return spike(x, y, reach) + spike(y, x, reach); }, stamp);
  return stamp;
}

std::uint64_t blur_memory(int width, int height, const PictureStyle& style) {
  const auto square = [](int side) { return static_cast<std::uint64_t>(side) * side; };
  const int side = picture_psf_side(style.seeing);
  // Memory holds a copy of a channel, copies of the stamp, and transforms. The side of a transform
  // is at most `transform` or twice the stamp's side, whichever is larger.
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
