#include "gamer/job/star_table.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "core/message.h"
#include "gamer/sed/photometry.h"
#include "image/image_suffix.h"
#include "image/memory.h"

namespace gamer {
namespace {

// Rows of the image whose stars one worker finds together.
constexpr int strip_rows = 64;

/// Names of a header's longitude and latitude; empty where it has none.
std::pair<const char*, const char*> angle_names(const RenderParameters& parameters) {
  if (parameters.camera.projection == Projection::sky) return {"ra", "dec"};
  if (!is_sphere(parameters.camera.projection)) return {"", ""};
  switch (parameters.camera.frame) {
    case SphereFrame::galactic: return {"l", "b"};
    case SphereFrame::equatorial: return {"ra", "dec"};
    case SphereFrame::ecliptic: break;
  }
  return {"lambda", "beta"};
}

/// The rows of the table.
class StarRows {
 public:
  StarRows(const RenderJob& job, const Renderer& renderer) : job_(job), renderer_(renderer) {}

  int strips() const { return (renderer_.height() + strip_rows - 1) / strip_rows; }
  int rows_of(int strip) const { return lines(strip).size(); }
  /// Numbers of a star: those of Value, then by plane its light with and without dust.
  std::size_t size() const { return first_plane + 2 * planes(); }
  int count(int strip) const;
  /// The numbers of a strip's stars, in the order of their pixels.
  std::vector<double> describe(int strip) const;
  /// The table of the numbers of all stars.
  DataTable table(const std::vector<double>& all) const;

 private:
  enum Value {
    x,
    y,
    longitude,
    latitude,
    distance,
    optical_depth,
    temperature,
    luminosity,
    share,
    object,
    field,
    first_plane
  };
  RowRange lines(int strip) const {
    return {strip * strip_rows, std::min((strip + 1) * strip_rows, renderer_.height())};
  }
  std::size_t planes() const { return job_.spectrum.planes.size(); }
  bool is_relative() const { return job_.scene->unit == PixelUnit::relative; }
  void set_angles(const glm::dvec3& place, std::span<double> row) const;
  void fill(const StarPainter::Seen& star, glm::ivec2 pixel, std::span<double> row) const;
  std::vector<Card> cards() const;

  const RenderJob& job_;
  const Renderer& renderer_;
};

int StarRows::count(int strip) const {
  int stars = 0;
  renderer_.visit_field_stars(lines(strip), StarPainter::Detail::places,
                              [&](const StarPainter::Seen&, glm::ivec2) { ++stars; });
  return stars;
}

std::vector<double> StarRows::describe(int strip) const {
  std::vector<double> rows;
  renderer_.visit_field_stars(lines(strip), StarPainter::Detail::light,
                              [&](const StarPainter::Seen& star, glm::ivec2 pixel) {
                                rows.resize(rows.size() + size());
                                fill(star, pixel, std::span(rows).last(size()));
                              });
  const std::size_t stars = rows.size() / size();
  std::vector<std::size_t> order(stars);
  for (std::size_t i = 0; i < stars; ++i) order[i] = i;
  const auto key = [&](std::size_t i) {
    const double* row = &rows[i * size()];
    return std::tuple(std::round(row[y]), std::round(row[x]), row[y], row[x], row[luminosity]);
  };
  std::ranges::stable_sort(order, {}, key);
  std::vector<double> sorted;
  sorted.reserve(rows.size());
  for (const std::size_t i : order) {
    const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(i * size());
    sorted.insert(sorted.end(), begin, begin + static_cast<std::ptrdiff_t>(size()));
  }
  return sorted;
}

void StarRows::set_angles(const glm::dvec3& place, std::span<double> row) const {
  const Camera& camera = job_.camera;
  if (camera.projection() == Projection::sky) {
    const SkyPosition sky = sky_of(place);
    row[longitude] = sky.ra;
    row[latitude] = sky.dec;
    return;
  }
  const glm::dvec3 way = glm::normalize(place - camera.origin());
  const double ahead = -glm::dot(way, camera.back()), left = -glm::dot(way, camera.right());
  const double angle = glm::degrees(std::atan2(left, ahead));
  row[longitude] = angle < 0 ? angle + 360 : angle;
  row[latitude] = glm::degrees(std::asin(std::clamp(glm::dot(way, camera.up()), -1.0, 1.0)));
}

void StarRows::fill(const StarPainter::Seen& star, glm::ivec2 pixel, std::span<double> row) const {
  const ImageRegion& window = job_.camera.window();
  // At a seam `pixel`, which holds the star, may lie on the other side of the image than
  // `star.pixel`. Only the place within the pixel is therefore taken from `star.pixel`.
  row[x] = pixel.x + (star.pixel.x - std::round(star.pixel.x)) - window.left + 1;
  row[y] = pixel.y + (star.pixel.y - std::round(star.pixel.y)) - window.bottom + 1;
  set_angles(star.place, row);
  row[distance] = star.distance;
  row[temperature] = star.temperature;
  row[luminosity] = star.luminosity;
  row[share] = star.weight;
  row[object] =
      static_cast<double>(job_.scene->galaxies[static_cast<std::size_t>(star.galaxy)].object + 1);
  row[field] = static_cast<double>(star.field + 1);
  row[optical_depth] = std::log(star.dust_free[0] / star.flux[0]);
  for (std::size_t p = 0; p < planes(); ++p) {
    const double wavelength = job_.spectrum.planes[p].wavelength;
    const double unit = star.weight * (is_relative() ? wavelength * wavelength : 1);
    const double seen = star.flux[p] / unit, free = star.dust_free[p] / unit;
    row[first_plane + p] = is_relative() ? seen : ab_magnitude(seen);
    row[first_plane + planes() + p] = is_relative() ? free : ab_magnitude(free);
  }
}

std::vector<Card> StarRows::cards() const {
  std::vector<Card> cards;
  for (std::size_t i = 0; i < renderer_.star_fields().fields().size(); ++i) {
    const StarFields::Field& star_field = renderer_.star_fields().fields()[i];
    cards.push_back(
        {fmt::format("FIELD{}", i + 1), star_field.stars->name(), "component of the stars"});
    if (std::isinf(star_field.limit)) continue;
    cards.push_back({fmt::format("QLIMIT{}", i + 1), star_field.limit,
                     "all stars of larger luminosity/distance^2"});
  }
  return cards;
}

DataTable StarRows::table(const std::vector<double>& all) const {
  DataTable table;
  table.name = "STARS";
  table.cards = cards();
  const std::size_t stars = all.size() / size();
  const auto add = [&](const std::string& name, const std::string& unit,
                       const std::string& description, std::size_t value) {
    std::vector<double> column(stars);
    for (std::size_t i = 0; i < stars; ++i) column[i] = all[i * size() + value];
    table.columns.push_back({name, unit, description, std::move(column)});
  };
  const auto add_integers = [&](const std::string& name, const std::string& description,
                                std::size_t value) {
    std::vector<std::int64_t> column(stars);
    for (std::size_t i = 0; i < stars; ++i) {
      column[i] = static_cast<std::int64_t>(all[i * size() + value]);
    }
    table.columns.push_back({name, "", description, std::move(column)});
  };
  const Projection projection = job_.camera.projection();
  if (projection != Projection::healpix) {
    add("x", "pixel", "FITS pixel", x);
    add("y", "pixel", "FITS pixel", y);
  }
  if (const auto [east, north] = angle_names(job_.parameters); *east != '\0') {
    add(east, "deg", "longitude", longitude);
    add(north, "deg", "latitude", latitude);
  }
  if (projection != Projection::orthographic) {
    const bool is_sky = projection == Projection::sky;
    add("distance", is_sky ? "Mpc" : job_.parameters.scene.unit,
        is_sky ? "comoving" : "from the camera", distance);
  }
  const std::string quantity = is_relative() ? "flux" : "mag";
  const std::string unit = is_relative() ? "" : "mag";
  for (std::size_t p = 0; p < planes(); ++p) {
    const std::string& label = job_.spectrum.planes[p].label;
    add(quantity + "_" + label, unit, "as seen through all dust", first_plane + p);
    add(quantity + "_dustfree_" + label, unit, "without dust", first_plane + planes() + p);
  }
  add("optical_depth", "", "of all dust in front, first plane", optical_depth);
  add("temperature", "K", "of its blackbody", temperature);
  add("luminosity", "", "at 5500 Angstrom, unit of its field", luminosity);
  add("share", "", "of its light drawn as a point; the rest is smooth light", share);
  add_integers("object", "row of the scene, from 1", object);
  add_integers("field", "number of the card FIELDn", field);
  return table;
}

/// Throws RunError where the table does not fit into memory.
void check_memory(std::int64_t stars, std::size_t values) {
  // The numbers, and the columns that are made of them.
  const std::uint64_t needed = 2 * static_cast<std::uint64_t>(stars) * values * sizeof(double);
  const std::uint64_t available = available_memory();
  if (needed <= available) return;
  throw run_error(
      "table STARS of {} stars needs {} of memory, {} is available; a smaller "
      "sampling.stars_per_pixel or a region has fewer stars",
      stars, bytes_text(needed), bytes_text(available));
}

bool has_star_field(const Scene& scene) {
  return std::ranges::any_of(scene.galaxies, [](const PlacedGalaxy& placed) {
    return std::ranges::any_of(placed.galaxy->components(), [](const auto& component) {
      return component->star_field() != nullptr;
    });
  });
}

}  // namespace

void check_star_table(const RenderJob& job) {
  const RenderParameters& parameters = job.parameters;
  if (!parameters.stars.table) return;
  const auto fail = [&](const std::string& reason) {
    throw InputError(parameters.section("stars").where("table"), "stars.table: " + reason);
  };
  const std::optional<ImageSuffix> suffix = image_suffix(parameters.image.output.path);
  if (suffix == ImageSuffix::png || suffix == ImageSuffix::bmp) {
    fail(fmt::format("a picture has no tables; give image.output a name in .fits, not '{}'",
                     parameters.image.output.path.filename().string()));
  }
  if (parameters.image.output.layout == ImageLayout::stamps) {
    fail("stamps have no table of stars; give image.layout another value");
  }
  // A scene without the galaxies outside the image, such as a film's frame, may have no star field.
  const bool is_whole = job.scene->objects == job.scene->rows;
  if (is_whole && !has_star_field(*job.scene)) {
    fail(
        "no galaxy of the scene has a component of class starfield; objects of the scene and field "
        "stars are in table TRUTH (--truth)");
  }
  if (!parameters.sampling.draws_stars()) {
    fail("sampling.stars_per_pixel = 0 draws no star; give a larger value");
  }
  if (is_whole && std::ranges::none_of(job.scene->galaxies, &PlacedGalaxy::draws_stars)) {
    fail("galaxies of at most 256 pixels across draw no stars; give sampling.stars_per_pixel");
  }
}

DataTable star_table(const RenderJob& job, const Renderer& renderer, Executor& executor,
                     const std::function<void(int)>& count) {
  const StarRows stars(job, renderer);
  const int strips = stars.strips();
  std::vector<int> counts(static_cast<std::size_t>(strips));
  executor.run(
      even_blocks(strips, 1), 1,
      [&](RowRange rows, std::span<double> values) {
        for (int strip = rows.first; strip < rows.last; ++strip) {
          values[static_cast<std::size_t>(strip - rows.first)] = stars.count(strip);
        }
      },
      [&](RowRange rows, std::span<const double> values) {
        for (int strip = rows.first; strip < rows.last; ++strip) {
          counts[static_cast<std::size_t>(strip)] =
              static_cast<int>(values[static_cast<std::size_t>(strip - rows.first)]);
        }
      });
  // Each strip has `capacity` rows of the executor. A star's row is its number in its strip, after
  // the rows of all strips before.
  const int capacity = std::numeric_limits<int>::max() / strips;
  std::vector<RowRange> blocks;
  std::vector<std::int64_t> first(static_cast<std::size_t>(strips));
  std::int64_t total = 0;
  for (int strip = 0; strip < strips; ++strip) {
    const int count_here = counts[static_cast<std::size_t>(strip)];
    first[static_cast<std::size_t>(strip)] = total;
    total += count_here;
    if (count_here > 0) blocks.push_back({strip * capacity, strip * capacity + count_here});
  }
  const std::size_t values_per_star = stars.size();
  check_memory(total, values_per_star);
  std::vector<double> all(static_cast<std::size_t>(total) * values_per_star);
  executor.run(
      blocks, values_per_star,
      [&](RowRange rows, std::span<double> values) {
        const int strip = rows.first / capacity;
        const std::vector<double> described = stars.describe(strip);
        const auto skipped = static_cast<std::size_t>(rows.first % capacity) * values_per_star;
        std::ranges::copy(std::span(described).subspan(skipped, values.size()), values.begin());
      },
      [&](RowRange rows, std::span<const double> values) {
        const int strip = rows.first / capacity;
        const std::int64_t to = first[static_cast<std::size_t>(strip)] + rows.first % capacity;
        std::ranges::copy(values,
                          all.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(to) *
                                                                    values_per_star));
        if (count) count(stars.rows_of(strip));
      });
  return stars.table(all);
}

}  // namespace gamer
