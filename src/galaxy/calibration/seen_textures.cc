#include "galaxy/calibration/seen_textures.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gamer {
namespace {

/// Phi of a texture for rays that resolve everything, at points that were turned back by its twirl.
void evaluate_whole(const Texture& texture, const Points& points, float* out) {
  BatchArray phi;
  std::uint64_t evaluations = 0;
  texture.evaluate(points, nullptr, nullptr, {}, std::span(&phi, 1), evaluations);
  std::copy_n(phi.data(), padded(points.size), out);
}

}  // namespace

void SeenTextures::see(const Component& component, const Points& points, const BatchArray& shear,
                       std::span<const double> widths, bool wants_coherent,
                       std::span<SeenNoise> out) {
  const Texture& texture = *component.texture();
  BatchArray stretched;
  for (std::size_t i = 0; i < points.size; ++i) {
    stretched[i] = static_cast<float>(component.footprint_scale() *
                                      stretch_of(texture.twirl() * double{shear[i]}));
  }
  std::vector<BatchArray> footprints(widths.size());
  std::vector<const float*> sets;
  for (std::size_t w = 0; w < widths.size(); ++w) {
    const auto width = static_cast<float>(widths[w]);
    for (std::size_t i = 0; i < points.size; ++i) footprints[w][i] = width * stretched[i];
    sets.push_back(footprints[w].data());
  }
  std::uint64_t evaluations = 0;
  texture.see(points, sets, wants_coherent, out, evaluations);
}

void SeenTextures::expect(const Component& component, const Points& points, const BatchArray& shear,
                          std::span<const double> widths, std::span<BatchArray> out) {
  const auto seen = std::make_unique_for_overwrite<SeenNoise[]>(widths.size());
  see(component, points, shear, widths, false, {seen.get(), widths.size()});
  for (std::size_t w = 0; w < widths.size(); ++w) {
    component.texture()->expect(points.size, seen[w], nullptr, {}, out.subspan(w, 1));
  }
}

void SeenTextures::phi(std::size_t c, const Points& points, std::span<const double> widths,
                       std::span<BatchArray> out) const {
  BatchArray shear;
  fill_shear(points, shear);
  if (at(c).texture() != nullptr) {
    expect(at(c), points, shear, widths, out);
  } else {
    for (BatchArray& phi : out) std::fill_n(phi.data(), batch_capacity, 1.0f);
  }
  multiply_followed(c, points, shear, widths, out);
}

void SeenTextures::multiply_followed(std::size_t c, const Points& points, const BatchArray& shear,
                                     std::span<const double> widths,
                                     std::span<BatchArray> out) const {
  if (galaxy_->followed(c) < 0) return;
  BatchArray x, y, z;
  std::vector<BatchArray> phi(widths.size());
  expect(followed_by(c), turn_to_followed(c, points, x, y, z), shear, widths, phi);
  for (std::size_t w = 0; w < widths.size(); ++w) {
    for (std::size_t i = 0; i < points.size; ++i) out[w][i] *= phi[w][i];
  }
}

void SeenTextures::phi_of_followed(std::size_t c, const Points& points, float* out) const {
  BatchArray x, y, z;
  evaluate_whole(*followed_by(c).texture(), turn_to_followed(c, points, x, y, z), out);
}

Points SeenTextures::turn_to_followed(std::size_t c, const Points& points, BatchArray& x,
                                      BatchArray& y, BatchArray& z) const {
  // The cloud is turned by this component's twirl; the followed noise has a twirl of its own.
  const Texture* texture = at(c).texture();
  const double twirl = texture != nullptr ? texture->twirl() : 0.0;
  const double followed_twirl = followed_by(c).texture()->twirl();
  if (!at(c).is_warped() && !followed_by(c).is_warped()) {
    return galaxy_->turn_back(points, followed_twirl - twirl, x, y, z);
  }
  // Heights above one mid-plane become heights above the other at the place itself.
  BatchArray heights;
  std::copy_n(points.z, padded(points.size), heights.data());
  const Points place = galaxy_->turn_back(points, -twirl, x, y, z);
  galaxy_->add_lift(c, place, 1, heights.data());
  galaxy_->add_lift(static_cast<std::size_t>(galaxy_->followed(c)), place, -1, heights.data());
  BatchArray place_x = x, place_y = y;
  return galaxy_->turn_back({place_x.data(), place_y.data(), heights.data(), points.size},
                            followed_twirl, x, y, z);
}

void SeenTextures::fill_shear(const Points& points, BatchArray& out) const {
  std::fill_n(out.data(), batch_capacity, 0.0f);
  if (!galaxy_->needs_winding()) return;
  BatchArray r;
  for (std::size_t i = 0; i < padded(points.size); ++i) {
    r[i] = std::sqrt(points.x[i] * points.x[i] + points.y[i] * points.y[i]);
  }
  galaxy_->arms().shear(r.data(), points.size, out.data());
}

}  // namespace gamer
