#include "gamer/job/truth_table.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "core/message.h"
#include "core/no_value.h"
#include "gamer/core/units.h"
#include "gamer/image/new_file.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/sed/photometry.h"
#include "image/image_suffix.h"
#include "scene/other_columns.h"

namespace gamer {

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
    throw input_error("gamer: --truth-table {}: {}", path.string(), reason);
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

namespace {

/// The rows of the truth table.
class TruthRows {
 public:
  explicit TruthRows(const RenderJob& job);

  /// Numbers of an object: those of Value, then by plane its light with and without dust.
  std::size_t size() const { return first_plane + 2 * planes(); }
  /// Fills the numbers of an object.
  void describe(std::size_t object, std::span<double> row) const;
  /// The table of the numbers of all objects.
  DataTable table(std::span<const double> all) const;

 private:
  enum Value {
    x,
    y,
    ra,
    dec,
    redshift,
    inclination,
    radius,
    half_light_radius,
    e1,
    e2,
    bulge_to_total,
    optical_depth,
    first_plane
  };
  std::size_t planes() const { return job_.spectrum.planes.size(); }
  bool is_sky() const { return job_.camera.projection() == Projection::sky; }
  bool is_relative() const { return job_.scene->unit == PixelUnit::relative; }
  /// Sets x and y to the window's FITS pixel for a place of the whole image.
  void set_place(const glm::dvec2& pixel, std::span<double> row) const;
  void describe_star(const PlacedStar& star, std::span<double> row) const;
  void describe_galaxy(const PlacedGalaxy& placed, std::span<double> row) const;
  void describe_light(const PlacedGalaxy& placed, const GalaxyMeasure& measured,
                      std::span<double> row) const;

  const RenderJob& job_;
  std::vector<const PlacedGalaxy*> galaxies_;  ///< by object; null for stars
  std::vector<const PlacedStar*> stars_;
};

TruthRows::TruthRows(const RenderJob& job)
    : job_(job), galaxies_(job.scene->objects, nullptr), stars_(job.scene->objects, nullptr) {
  for (const PlacedGalaxy& placed : job.scene->galaxies) galaxies_[placed.object] = &placed;
  for (const PlacedStar& star : job.scene->stars) stars_[star.object] = &star;
}

void TruthRows::describe(std::size_t object, std::span<double> row) const {
  std::ranges::fill(row, no_value);
  if (stars_[object] != nullptr) {
    describe_star(*stars_[object], row);
  } else {
    describe_galaxy(*galaxies_[object], row);
  }
}

void TruthRows::set_place(const glm::dvec2& pixel, std::span<double> row) const {
  row[x] = pixel.x - job_.camera.window().left + 1;
  row[y] = pixel.y - job_.camera.window().bottom + 1;
}

void TruthRows::describe_star(const PlacedStar& star, std::span<double> row) const {
  const SkyPosition sky = sky_of(star.direction);
  set_place(star.pixel, row);
  row[ra] = sky.ra;
  row[dec] = sky.dec;
  for (std::size_t p = 0; p < planes(); ++p) {
    row[first_plane + p] = row[first_plane + planes() + p] = ab_magnitude(star.flux[p]);
  }
}

void TruthRows::describe_galaxy(const PlacedGalaxy& placed, std::span<double> row) const {
  const Camera& camera = job_.camera;
  if (const auto pixel = camera.pixel(placed.centre)) set_place(*pixel, row);
  const SkyPosition sky = sky_of(placed.centre);
  row[ra] = sky.ra;
  row[dec] = sky.dec;
  row[redshift] = placed.redshift;
  const double cosine = std::abs(glm::dot(placed.pole, camera.towards(placed.centre)));
  row[inclination] = glm::degrees(std::acos(std::min(cosine, 1.0)));
  const double length = is_sky() ? arcsecond * glm::length(placed.centre) : 1;
  row[radius] = placed.radius / length;
  const auto place = static_cast<std::size_t>(&placed - job_.scene->galaxies.data());
  const GalaxyMeasure measured = measure_for_truth(job_, place);
  row[half_light_radius] = measured.half_light_radius / length;
  row[e1] = measured.e1;
  row[e2] = measured.e2;
  row[optical_depth] = measured.optical_depth;
  describe_light(placed, measured, row);
}

void TruthRows::describe_light(const PlacedGalaxy& placed, const GalaxyMeasure& measured,
                               std::span<double> row) const {
  const std::vector<double> free = dust_free_flux(placed, job_.camera, job_.spectrum);
  const std::vector<double> bulge = dust_free_flux(placed, job_.camera, job_.spectrum, true);
  row[bulge_to_total] = free.front() > 0 ? bulge.front() / free.front() : no_value;
  for (std::size_t p = 0; p < planes(); ++p) {
    double flux = free[p];
    if (is_relative()) {
      const double wavelength = job_.spectrum.planes[p].wavelength;
      flux /= wavelength * wavelength;
    }
    const double seen = flux * measured.attenuation[p];
    row[first_plane + p] = is_relative() ? seen : ab_magnitude(seen);
    const double bare = flux * measured.dust_free[p];
    row[first_plane + planes() + p] = is_relative() ? bare : ab_magnitude(bare);
  }
}

DataTable TruthRows::table(std::span<const double> all) const {
  DataTable table;
  table.name = "TRUTH";
  const std::size_t objects = galaxies_.size();
  const auto numbers = [&](const std::string& name, const std::string& unit,
                           const std::string& description, std::size_t value) {
    std::vector<double> column;
    for (std::size_t object = 0; object < objects; ++object) {
      column.push_back(all[object * size() + value]);
    }
    table.columns.push_back({name, unit, description, std::move(column)});
  };
  std::vector<std::int64_t> number, seed;
  std::vector<std::string> id, type;
  for (std::size_t object = 0; object < objects; ++object) {
    const PlacedGalaxy* placed = galaxies_[object];
    number.push_back(static_cast<std::int64_t>(object) + 1);
    id.push_back(placed != nullptr ? placed->id : stars_[object]->id);
    type.push_back(placed != nullptr ? placed->type.str() : "star");
    seed.push_back(placed != nullptr ? static_cast<std::int64_t>(placed->seed) : 0);
  }
  table.columns.push_back({"object", "", "number in the segmentation, from 1", number});
  table.columns.push_back({"id", "", "the scene's", integers_or_texts(std::move(id))});
  table.columns.push_back({"galaxy", "", "type", type});
  numbers("x", "pixel", "centre, FITS pixel", x);
  numbers("y", "pixel", "centre, FITS pixel", y);
  if (is_sky()) {
    numbers("ra", "deg", "right ascension", ra);
    numbers("dec", "deg", "declination", dec);
  }
  const std::string length = is_sky() ? "arcsec" : job_.parameters.scene.unit;
  numbers("redshift", "", "", redshift);
  table.columns.push_back({"seed", "", "", seed});
  numbers("inclination", "deg", "0 is face-on", inclination);
  numbers("radius", length, "of the galaxy's ball", radius);
  const std::string quantity = is_relative() ? "flux" : "mag";
  const std::string unit = is_relative() ? "" : "mag";
  for (std::size_t p = 0; p < planes(); ++p) {
    const std::string& label = job_.spectrum.planes[p].label;
    numbers(quantity + "_" + label, unit, "as seen through its dust", first_plane + p);
    numbers(quantity + "_dustfree_" + label, unit, "without dust", first_plane + planes() + p);
  }
  numbers("half_light_radius", length, "first plane, through its dust", half_light_radius);
  numbers("e1", "", "(Q_NN - Q_EE)/(Q_NN + Q_EE), first plane", e1);
  numbers("e2", "", "2 Q_NE/(Q_NN + Q_EE)", e2);
  numbers("bulge_to_total", "", "light without dust, first plane", bulge_to_total);
  numbers("optical_depth", "", "through the centre, first plane", optical_depth);
  return table;
}

}  // namespace

GalaxyMeasure measure_for_truth(const RenderJob& job, std::size_t galaxy) {
  if (!job.measures.empty() && job.measures[galaxy]) return *job.measures[galaxy];
  return measure(job.scene->galaxies[galaxy], job.parameters, job.camera, job.spectrum);
}

DataTable truth_table(const RenderJob& job, Executor& executor,
                      const std::function<void(int)>& count) {
  const TruthRows truth(job);
  const std::size_t per_object = truth.size();
  std::vector<double> all(job.scene->objects * per_object, no_value);
  executor.run(
      even_blocks(static_cast<int>(job.scene->objects), 1), per_object,
      [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          truth.describe(
              static_cast<std::size_t>(row),
              values.subspan(static_cast<std::size_t>(row - rows.first) * per_object, per_object));
        }
      },
      [&](RowRange rows, std::span<const double> values) {
        std::ranges::copy(
            values, all.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(rows.first) *
                                                              per_object));
        if (count) count(rows.size());
      });
  return truth.table(all);
}

}  // namespace gamer
