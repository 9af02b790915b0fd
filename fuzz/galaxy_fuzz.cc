// Fuzzes galaxy files with any text and, after a NUL, a table of luminosities. A galaxy that is
// read has finite densities everywhere, and stars that shine.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include "expectations.h"
#include "gamer/core/batch.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/galaxy/kinds/star_field.h"
#include "gamer/noise/noise.h"
#include "named_texts.h"

namespace {

// Few points check a galaxy as well as many.
constexpr std::size_t cloud_points = 2 * gamer::batch_capacity;

bool is_proper(double value) { return std::isfinite(value) && value >= 0; }

/// Points from the centre outwards, some in the plane and some on the axis.
struct SomePoints {
  gamer::BatchArray x{}, y{}, z{};
  SomePoints() {
    for (std::size_t i = 0; i < gamer::batch_capacity; ++i) {
      const double share = static_cast<double>(i) / gamer::batch_capacity;
      const double angle = 40 * share;
      x[i] = i % 5 == 1 ? 0.0f : static_cast<float>(share * share * std::cos(angle));
      y[i] = i % 5 <= 1 ? 0.0f : static_cast<float>(share * share * std::sin(angle));
      z[i] = i % 5 == 2 ? 0.0f : static_cast<float>(0.9 * share * share * share * (i % 2 ? -1 : 1));
    }
  }
};

void check_densities(const gamer::Galaxy& galaxy, const gamer::RayBatch* rays) {
  static const SomePoints some;
  std::vector<gamer::BatchArray> densities(galaxy.components().size());
  gamer::EvaluationCounts counts;
  galaxy.evaluate({some.x.data(), some.y.data(), some.z.data(), gamer::batch_capacity}, 0, rays, {},
                  densities, counts);
  for (const gamer::BatchArray& density : densities) {
    expect(std::all_of(density.data(), density.data() + gamer::batch_capacity, is_proper),
           "densities are finite and not negative");
  }
}

void check_plan(const gamer::Component& component) {
  for (const double tilt : {0.0, 1e-6, 0.5, 1.0}) {
    const double across = std::sqrt(1 - tilt * tilt);
    const gamer::BallRay ray{{0.01 - across, 0.02, -tilt}, {across, 0, tilt}, 0, 2};
    gamer::RayPlan plan;
    plan.clear();
    component.plan(ray, gamer::Accuracy::from_tolerance(1e-3), plan);
    for (const gamer::Focus& focus : plan.focuses) {
      expect(std::isfinite(focus.centre) && focus.width > 0 && focus.rate >= 0 &&
                 std::isfinite(focus.rate),
             "focuses are finite");
    }
  }
}

void check_stars(const gamer::StarField& field, double largest_phi) {
  for (std::size_t k = 0; k < field.population().size(); ++k) {
    const gamer::StellarPopulation::Class& stars = field.population().at(k);
    expect(is_proper(stars.number) && is_proper(stars.light) && stars.low <= stars.high,
           "classes are proper");
    // Only so many cells are opened, since there may be very many.
    int cells = 100;
    field.walk(
        k, largest_phi, [&](const gamer::StarField::Cell&) { return --cells > 0; },
        [&](const gamer::StarField::Candidate& candidate) {
          const double luminosity = field.luminosity(k, candidate);
          const double temperature = field.temperature(luminosity, candidate);
          expect(luminosity > 0 && std::isfinite(luminosity), "a luminosity is proper");
          expect(temperature > 0 && std::isfinite(temperature), "a temperature is proper");
        });
  }
}

void read(std::string_view text) {
  const std::size_t end = text.find('\0');
  gamer::Resources texts =
      end == std::string_view::npos ? named_texts() : named_texts(text.substr(end + 1));
  gamer::GalaxySettings settings;
  settings.noise_kind = &gamer::simplex_noise();
  settings.most_cloud_points = cloud_points;
  const auto galaxy = gamer::Galaxy::parse(text.substr(0, end), "x.toml", settings, texts);
  check_densities(*galaxy, nullptr);
  gamer::RayBatch rays{};
  std::fill_n(rays.footprint.data(), gamer::batch_capacity, 0.05f);
  check_densities(*galaxy, &rays);
  for (std::size_t c = 0; c < galaxy->components().size(); ++c) {
    const auto& component = galaxy->components()[c];
    check_plan(*component);
    if (const gamer::StarField* field = component->star_field()) {
      check_stars(*field, galaxy->largest_phi(c));
    }
    expect(is_proper(component->face_on_column()), "the column is proper");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  expect_errors_only([&] { read({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
