#include "gamer/job/truth_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "gamer/core/units.h"
#include "gamer/image/new_file.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/sed/photometry.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Dust-free flux of a galaxy, in units of its brightness times scene units^2, in each plane.
std::vector<double> free_flux(const PlacedGalaxy& placed, const Spectrum& spectrum,
                              bool bulge_only) {
  std::vector<double> flux(spectrum.planes.size(), 0.0);
  const auto components = placed.galaxy->components();
  for (std::size_t c = 0; c < components.size(); ++c) {
    const Component& component = *components[c];
    if (component.absorbs() || (bulge_only && component.kind() != "bulge")) continue;
    for (std::size_t p = 0; p < flux.size(); ++p) {
      flux[p] += placed.galaxy->luminosity(c) * placed.radius * placed.radius *
                 spectrum.planes[p].flux(*component.sed(), placed.redshift, spectrum.igm);
    }
  }
  return flux;
}

bool has_dust(const PlacedGalaxy& placed) {
  const auto components = placed.galaxy->components();
  return std::any_of(components.begin(), components.end(),
                     [](const auto& component) { return component->absorbs(); });
}

}  // namespace

void check_truth_table(const std::filesystem::path& path, const OutputOptions& image) {
  if (path.empty()) {
    const std::optional<ImageSuffix> suffix = image_suffix(image.path);
    if (suffix != ImageSuffix::fits && suffix != ImageSuffix::fits_compressed) {
      throw InputError(
          "gamer: --truth puts its table into a FITS image; for a picture give --truth-table");
    }
    return;
  }
  const auto fail = [&](const std::string& reason) {
    throw InputError(fmt::format("gamer: --truth-table {}: {}", path.string(), reason));
  };
  if (path.extension() != ".ecsv" && path.extension() != ".fits") {
    fail("the suffix must be .fits or .ecsv");
  }
  if (path.lexically_normal() == image.path.lexically_normal()) fail("this is the image's file");
  check_new_file(path, image.overwrite);
}

void write_truth_table(const std::filesystem::path& path, const DataTable& table,
                       const std::string& date) {
  if (path.extension() == ".ecsv") {
    write_ecsv(path, table);
  } else {
    write_fits_table(path, table, {{"DATE", date, "time of writing (UTC)"}});
  }
}

void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, const Ranks& ranks, int threads, Scene& scene) {
  if (scene.unit == PixelUnit::relative) return;
  Spectrum band;
  band.planes = {
      {reference.name(), reference.pivot(), std::make_shared<const Bandpass>(reference)}};
  band.igm = parameters.igm;
  std::vector<PlacedGalaxy*> dusty;
  for (PlacedGalaxy& placed : scene.galaxies) {
    if (has_dust(placed)) dusty.push_back(&placed);
  }
  const auto count = static_cast<int>(dusty.size());
  constexpr int blocks_per_thread = 16;
  const int block = std::max(1, count / (blocks_per_thread * ranks.size() * threads));
  const std::vector<double> seen = ranks.compute_together(
      even_blocks(count, block), 1, threads, [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          PlacedGalaxy probe = *dusty[static_cast<std::size_t>(row)];
          if (probe.is_absolute) probe.redshift = 0;
          values[static_cast<std::size_t>(row - rows.first)] =
              measure(probe, parameters, camera, band).attenuation.front();
        }
      });
  for (std::size_t row = 0; row < dusty.size(); ++row) {
    if (seen[row] > 0) dusty[row]->brightness /= seen[row];
  }
}

DataTable truth_table(const RenderJob& job, Executor& executor) {
  const Scene& scene = *job.scene;
  const Camera& camera = job.camera;
  const std::size_t planes = job.spectrum.planes.size();
  const bool is_sky = camera.projection() == Projection::sky;
  const bool is_relative = scene.unit == PixelUnit::relative;
  std::vector<const PlacedGalaxy*> galaxies(scene.objects, nullptr);
  std::vector<const PlacedStar*> stars(scene.objects, nullptr);
  for (const PlacedGalaxy& placed : scene.galaxies) galaxies[placed.object] = &placed;
  for (const PlacedStar& star : scene.stars) stars[star.object] = &star;

  // x, y, ra, dec, redshift, inclination, radius, r50, e1, e2, B/T, tau, then with and without
  // dust.
  enum Value { x, y, ra, dec, redshift, inclination, radius, r50, e1, e2, ratio, depth, first };
  const std::size_t per_object = first + 2 * planes;
  std::vector<double> all(scene.objects * per_object, nan);
  const auto describe = [&](std::size_t object, std::span<double> row) {
    std::fill(row.begin(), row.end(), nan);
    if (const PlacedStar* star = stars[object]) {
      const SkyPosition sky = sky_of(star->direction);
      row[x] = star->pixel.x + 1;
      row[y] = star->pixel.y + 1;
      row[ra] = sky.ra;
      row[dec] = sky.dec;
      for (std::size_t p = 0; p < planes; ++p) {
        row[first + p] = row[first + planes + p] = ab_magnitude(star->flux[p]);
      }
      return;
    }
    const PlacedGalaxy& placed = *galaxies[object];
    if (const auto pixel = camera.pixel(placed.centre)) {
      row[x] = pixel->x + 1;
      row[y] = pixel->y + 1;
    }
    const SkyPosition sky = sky_of(placed.centre);
    row[ra] = sky.ra;
    row[dec] = sky.dec;
    row[redshift] = placed.redshift;
    // Row 2 of to_ball is the galaxy's axis over its semi-axis.
    const glm::dvec3 axis =
        glm::normalize(glm::dvec3(placed.to_ball[0].z, placed.to_ball[1].z, placed.to_ball[2].z));
    const double cosine = std::abs(glm::dot(axis, camera.towards(placed.centre)));
    row[inclination] = glm::degrees(std::acos(std::min(cosine, 1.0)));
    const double length = is_sky ? arcsecond * glm::length(placed.centre) : 1;
    row[radius] = placed.radius / length;
    const GalaxyMeasure measured = measure(placed, job.parameters, camera, job.spectrum);
    row[r50] = measured.half_light_radius / length;
    row[e1] = measured.e1;
    row[e2] = measured.e2;
    row[depth] = measured.optical_depth;
    const std::vector<double> free = free_flux(placed, job.spectrum, false);
    const std::vector<double> bulge = free_flux(placed, job.spectrum, true);
    row[ratio] = free.front() > 0 ? bulge.front() / free.front() : nan;
    const double distance = camera.distance(placed.centre);
    const bool has_angle = camera.projection() != Projection::orthographic;
    for (std::size_t p = 0; p < planes; ++p) {
      double flux = placed.brightness * free[p];
      if (has_angle) flux /= distance * distance;
      if (is_relative) {
        flux /= job.spectrum.planes[p].wavelength * job.spectrum.planes[p].wavelength;
      }
      const double seen = flux * measured.attenuation[p];
      row[first + p] = is_relative ? seen : ab_magnitude(seen);
      row[first + planes + p] = is_relative ? flux : ab_magnitude(flux);
    }
  };
  executor.run(
      even_blocks(static_cast<int>(scene.objects), 1), per_object,
      [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          describe(
              static_cast<std::size_t>(row),
              values.subspan(static_cast<std::size_t>(row - rows.first) * per_object, per_object));
        }
      },
      [&](RowRange rows, std::span<const double> values) {
        std::copy(values.begin(), values.end(),
                  all.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(rows.first) *
                                                            per_object));
      });

  DataTable table;
  table.name = "TRUTH";
  const auto numbers = [&](const std::string& name, const std::string& unit,
                           const std::string& description, std::size_t value) {
    std::vector<double> column;
    for (std::size_t object = 0; object < scene.objects; ++object) {
      column.push_back(all[object * per_object + value]);
    }
    table.columns.push_back({name, unit, description, std::move(column)});
  };
  std::vector<std::int64_t> number, seed;
  std::vector<std::string> id, type;
  for (std::size_t object = 0; object < scene.objects; ++object) {
    const PlacedGalaxy* placed = galaxies[object];
    number.push_back(static_cast<std::int64_t>(object) + 1);
    id.push_back(placed != nullptr ? placed->id : stars[object]->id);
    type.push_back(placed != nullptr ? placed->type.str() : "star");
    seed.push_back(placed != nullptr ? static_cast<std::int64_t>(placed->seed) : 0);
  }
  table.columns.push_back({"object", "", "number in the segmentation, from 1", number});
  table.columns.push_back({"id", "", "the scene's", id});
  table.columns.push_back({"galaxy", "", "type", type});
  numbers("x", "pixel", "centre, FITS pixel", x);
  numbers("y", "pixel", "centre, FITS pixel", y);
  if (is_sky) {
    numbers("ra", "deg", "right ascension", ra);
    numbers("dec", "deg", "declination", dec);
  }
  const std::string length = is_sky ? "arcsec" : job.parameters.unit;
  numbers("redshift", "", "", redshift);
  table.columns.push_back({"seed", "", "", seed});
  numbers("inclination", "deg", "0 is face-on", inclination);
  numbers("radius", length, "of the galaxy's ball", radius);
  const std::string quantity = is_relative ? "flux" : "mag";
  const std::string unit = is_relative ? "" : "mag";
  for (std::size_t p = 0; p < planes; ++p) {
    const std::string& label = job.spectrum.planes[p].label;
    numbers(quantity + "_" + label, unit, "as seen through its dust", first + p);
    numbers(quantity + "_dustfree_" + label, unit, "without dust", first + planes + p);
  }
  numbers("half_light_radius", length, "first plane, through its dust", r50);
  numbers("e1", "", "(Q_NN - Q_EE)/(Q_NN + Q_EE), first plane", e1);
  numbers("e2", "", "2 Q_NE/(Q_NN + Q_EE)", e2);
  numbers("bulge_to_total", "", "light without dust, first plane", ratio);
  numbers("optical_depth", "", "through the centre, first plane", depth);
  return table;
}

}  // namespace gamer
