// The figures of docs/noise.md: slices through noises as tiles, a PNG file per figure, in the
// directory that the argument names.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "gamer/image/picture.h"
#include "gamer/noise/fractal.h"

namespace gamer {
namespace {

constexpr int side = 96;    // pixels of a tile
constexpr int greys = 127;  // few steps keep files small
constexpr int gap = 4;

using Colour = std::array<BatchArray, 3>;

/// The colours of a tile at (x, y) in [0, 1[, for a row of points at a time.
using Tile = std::function<void(const Points& points, Colour& out)>;

struct Cell {
  Tile tile;
  double black, white;  ///< the values that are black and white
};

/// A tile without colours.
Cell grey(std::function<void(const Points&, float*)> value, double black, double white) {
  return {[value = std::move(value)](const Points& points, Colour& out) {
            value(points, out[0].data());
            out[1] = out[2] = out[0];
          },
          black, white};
}

/// Tiles of `size` pixels in rows of `columns`.
void draw(const std::filesystem::path& path, std::size_t columns, const std::vector<Cell>& cells,
          int size = side) {
  const std::size_t rows = (cells.size() + columns - 1) / columns;
  Picture picture;
  picture.width = static_cast<int>(columns) * (size + gap) - gap;
  picture.height = static_cast<int>(rows) * (size + gap) - gap;
  picture.rgb.assign(static_cast<std::size_t>(picture.width * picture.height) * 3, 0xFFFF);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const int left = static_cast<int>(c % columns) * (size + gap);
    const int top = static_cast<int>(c / columns) * (size + gap);
    const auto width = static_cast<std::size_t>(size);
    for (int row = 0; row < size; ++row) {
      BatchArray x, y, z;
      Colour out;
      for (std::size_t i = 0; i < width; ++i) {
        x[i] = (static_cast<float>(i) + 0.5f) / static_cast<float>(size);
        y[i] = 1 - (static_cast<float>(row) + 0.5f) / static_cast<float>(size);
        z[i] = 0.37f;
      }
      cells[c].tile({x.data(), y.data(), z.data(), width}, out);
      for (int i = 0; i < size; ++i) {
        const auto pixel = static_cast<std::size_t>((top + row) * picture.width + left + i);
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const double value = double{out[channel][static_cast<std::size_t>(i)]};
          const double share =
              std::clamp((value - cells[c].black) / (cells[c].white - cells[c].black), 0.0, 1.0);
          picture.rgb[3 * pixel + channel] = to_16_bits(std::round(greys * share) / greys);
        }
      }
    }
  }
  // 8 bits suffice and keep files small.
  PictureFile file({path.string(), PictureFormat::png, 8, true, ""}, picture.width, picture.height);
  for (int row = 0; row < picture.height; ++row) {
    const auto length = static_cast<std::size_t>(3 * picture.width);
    file.write_row(std::span(picture.rgb).subspan(static_cast<std::size_t>(row) * length, length));
  }
  file.finish();
}

/// The sum or density S of a noise as pixels see it, from mean - 2.5 sigma to mean + 2.5 sigma, a
/// product from 0.
Cell slice(const FractalParameters& parameters) {
  using Kind = Combination::Kind;
  FractalNoise noise(parameters);
  std::vector<WeightedBatch> cloud(256);
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    cloud[b].size = batch_capacity;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      cloud[b].x[i] = (static_cast<float>(i) + 0.5f) / batch_capacity;
      cloud[b].y[i] = (static_cast<float>(b) + 0.5f) / batch_capacity;
      cloud[b].z[i] = 0.37f;
      cloud[b].weight[i] = 1;
    }
  }
  noise.normalise(cloud);
  const bool density = parameters.combination.kind == Kind::multiplicative;
  const double reach = 2.5 * noise.sigma();
  return grey(
      [noise](const Points& points, float* out) {
        BatchArray footprint;
        std::fill_n(footprint.data(), batch_capacity, 1.0f / side);
        SeenNoise seen;
        std::uint64_t evaluations = 0;
        const float* const footprints = footprint.data();
        noise.see(points, std::span(&footprints, 1), std::span(&seen, 1), evaluations);
        std::copy_n(seen.sum.data(), points.size, out);
      },
      density ? 0 : noise.mean() - reach, noise.mean() + reach);
}

FractalParameters octaves(const Noise& kind, int count, double frequency) {
  FractalParameters p;
  p.kind = &kind;
  p.octaves = count;
  p.frequency_scale = frequency;
  p.lacunarity = 2;
  p.seed = 4;
  return p;
}

FractalParameters combined(Combination::Kind kind, double amplitude = 1) {
  FractalParameters p = octaves(perlin_noise(), 6, 4);
  p.combination.kind = kind;
  p.amplitude = amplitude;
  return p;
}

FractalParameters warped(int count, double warp, int warp_octaves) {
  FractalParameters p = octaves(simplex_noise(), count, 5);
  p.warp = warp;
  p.warp_frequency = 2;
  p.warp_octaves = warp_octaves;
  return p;
}

/// Perlin noise in (ln r, angle) about the tile's centre: 12 cells around it.
Cell polar(bool identified) {
  std::vector<Octave> list(5);
  for (std::size_t k = 0; k < list.size(); ++k) {
    list[k].frequency = static_cast<float>(1 << k);
    list[k].weight = 1 / list[k].frequency;
    list[k].seed = static_cast<std::uint32_t>(k + 1);
    // One turn of the angle is 12 cells along it and 3 across: a spiral.
    if (identified) {
      list[k].translation[0] = 12 << k;
      list[k].translation[1] = 3 << k;
    }
  }
  return grey(
      [list](const Points& points, float* out) {
        BatchArray u, v;
        for (std::size_t i = 0; i < points.size; ++i) {
          const double x = double{points.x[i]} - 0.5, y = double{points.y[i]} - 0.5;
          const double turn = std::atan2(y, x) / (2 * std::numbers::pi);
          const double radius = 12 / (2 * std::numbers::pi) * std::log(std::hypot(x, y));
          u[i] = static_cast<float>(12 * turn);
          v[i] = static_cast<float>(radius + 3 * turn);
        }
        perlin_noise().sum({u.data(), v.data(), points.z, points.size}, list, out);
      },
      -0.75, 0.75);
}

// Cells of cell noise along a tile.
constexpr float cells_across = 12;

/// The three numbers of a cell for each point. The cell is `right` cells to the right of the
/// point's own cell, and `up` cells above it.
void cell_numbers(const Points& points, int right, int up, Colour& out) {
  BatchArray x, y;
  for (std::size_t i = 0; i < points.size; ++i) {
    x[i] = points.x[i] + static_cast<float>(right) / cells_across;
    y[i] = points.y[i] + static_cast<float>(up) / cells_across;
  }
  Octave octave;
  octave.frequency = cells_across;
  octave.seed = 7;
  float* const arrays[] = {out[0].data(), out[1].data(), out[2].data()};
  cell_noise().sum_vector({x.data(), y.data(), points.z, points.size}, std::span(&octave, 1),
                          arrays);
}

/// Calls visit(i, distance, numbers) for each point i, and for its own cell and the eight cells
/// around it. The first two numbers of a cell place a mark in it. `distance`, in cells, is the
/// distance from point i to this mark.
template <typename Visit>
void visit_cells(const Points& points, Visit&& visit) {
  Colour numbers;
  for (int up = -1; up <= 1; ++up) {
    for (int right = -1; right <= 1; ++right) {
      cell_numbers(points, right, up, numbers);
      for (std::size_t i = 0; i < points.size; ++i) {
        const float x = points.x[i] * cells_across, y = points.y[i] * cells_across;
        const float u = 0.5f + 0.5f * numbers[0][i], v = 0.5f + 0.5f * numbers[1][i];
        const float dx = std::floor(x) + static_cast<float>(right) + u - x;
        const float dy = std::floor(y) + static_cast<float>(up) + v - y;
        visit(i, std::hypot(dx, dy), std::array{numbers[0][i], numbers[1][i], numbers[2][i]});
      }
    }
  }
}

/// A star per cell: two numbers place it, the third is its magnitude.
void stars(const Points& points, float* out) {
  std::fill_n(out, points.size, 0.0f);
  visit_cells(points, [&](std::size_t i, float distance, const std::array<float, 3>& numbers) {
    // Counts rise as 10^(0.4 m). Stars brighter than white have larger discs.
    const float flux = 0.25f / std::max(0.5f + 0.5f * numbers[2], 0.01f);
    constexpr float width = 0.09f;
    out[i] += flux * std::exp(-0.5f * distance * distance / (width * width));
  });
}

/// Each point takes the colour of the nearest mark of the cells.
void mosaic(const Points& points, Colour& out) {
  BatchArray nearest;
  std::fill_n(nearest.data(), points.size, HUGE_VALF);
  visit_cells(points, [&](std::size_t i, float distance, const std::array<float, 3>& numbers) {
    if (distance >= nearest[i]) return;
    nearest[i] = distance;
    for (std::size_t channel = 0; channel < 3; ++channel) out[channel][i] = numbers[channel];
  });
}

std::vector<Cell> cell_tiles() {
  const Tile colours = [](const Points& points, Colour& out) { cell_numbers(points, 0, 0, out); };
  const auto first = [](const Points& points, float* out) {
    Colour numbers;
    cell_numbers(points, 0, 0, numbers);
    std::copy_n(numbers[0].data(), points.size, out);
  };
  return {grey(first, -1, 1), {colours, -1, 1}, grey(stars, 0, 1), {mosaic, -1, 1}};
}

void draw_all(const std::filesystem::path& directory) {
  using enum Combination::Kind;
  std::vector<Cell> kinds;
  for (const int count : {1, 6}) {
    for (const Noise* kind : noise_kinds()) kinds.push_back(slice(octaves(*kind, count, 6)));
  }
  draw(directory / "noise_kinds.png", noise_kinds().size(), kinds);
  draw(directory / "noise_combinations.png", 5,
       {slice(combined(additive)), slice(combined(multiplicative)),
        slice(combined(multiplicative, 2)), slice(combined(ridged)), slice(combined(billow))});
  draw(directory / "noise_warp.png", 3,
       {slice(warped(1, 0, 1)), slice(warped(1, 0.04, 1)), slice(warped(1, 0.05, 4)),
        slice(warped(6, 0, 1)), slice(warped(6, 0.04, 1)), slice(warped(6, 0.05, 4))});
  draw(directory / "noise_helix.png", 2, {polar(false), polar(true)});
  draw(directory / "noise_cells.png", 4, cell_tiles(), 2 * side);
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: noise_figures DIRECTORY\n";
    return 2;
  }
  gamer::draw_all(argv[1]);
}
