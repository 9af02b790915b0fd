#include <algorithm>
#include <cmath>

#include "core/message.h"
#include "gamer/sed/igm.h"
#include "scene/scene_reader.h"

namespace gamer {

// The brightness of a scene's objects, and the check that their spectra cover an image's planes.

namespace {

constexpr double ten_parsec = 1e-5;  // Mpc

// Largest flux (nJy) and pi times the brightness (nJy/sr) of a galaxy. Its peaks then fit a pixel
// in any unit; pixel values end at 3e38.
constexpr double largest_flux = 1e28;
constexpr double largest_brightness = 1e35;

}  // namespace

void SceneReader::choose_unit() {
  const bool has_magnitudes = row_.has(column::magnitude) || row_.has(column::apparent_magnitude);
  scene_.unit =
      parameters_.image.unit.value_or(has_magnitudes ? PixelUnit::nanojansky : PixelUnit::relative);
  // Pixels of relative images are sampled by a fixed grid of rays, as with camera.supersample.
  if (scene_.unit == PixelUnit::relative) library_.keep_closures_apart();
  if (has_magnitudes && scene_.unit == PixelUnit::relative) {
    throw input_error(parameters_.image.unit_where,
                      "unit = \"relative\", but the objects of {} have magnitudes",
                      catalogue_.label());
  }
  if (!has_magnitudes && scene_.unit != PixelUnit::relative) {
    throw input_error(
        parameters_.image.unit_where,
        "unit = {} needs magnitudes; {} has no column 'magnitude' or 'apparent_magnitude'{}",
        value_text(parameters_.section("image").value("unit")), catalogue_.label(),
        columns_hint(catalogue_, row_.sources(),
                     std::vector{column::magnitude, column::apparent_magnitude}));
  }
  if (has_magnitudes) reference_ = load_reference_band(parameters_, resources_);
}

double SceneReader::flux_scale(const Position& position, double rest, double observed) const {
  using namespace column;
  const bool is_absolute = row_.is_given(magnitude);
  if (is_absolute && row_.is_given(apparent_magnitude)) {
    row_.fail(apparent_magnitude, "both magnitude and apparent_magnitude; give one");
  }
  if (!is_absolute && !row_.is_given(apparent_magnitude)) {
    row_.fail(galaxy, "no magnitude: objects with and without cannot be mixed");
  }
  const auto checked = [&](double flux, Column given) {
    if (flux <= largest_flux) return flux;
    row_.fail(given,
              "{} = {} makes it of apparent magnitude {:.1f}, too bright for the numbers of an "
              "image: above {:.1f} is right",
              scene_columns()[given].name, row_.number(given), ab_magnitude(flux),
              ab_magnitude(largest_flux));
  };
  if (!is_absolute) {
    return checked(nanojansky(row_.number(apparent_magnitude)), apparent_magnitude) / observed;
  }
  if (!position.luminosity_distance) {
    row_.fail(magnitude, "{}",
              is_sky_
                  ? "magnitude without a distance; give redshift or distance, or apparent_magnitude"
              : has_place(camera_.projection())
                  ? "magnitude without a distance: scene.unit is arbitrary"
                  : "magnitude without a distance: an orthographic view has none; give redshift or "
                    "distance, or apparent_magnitude");
  }
  const double ratio = ten_parsec / *position.luminosity_distance;
  return checked(nanojansky(row_.number(magnitude)) * ratio * ratio, magnitude) / rest;
}

void SceneReader::check_band(const Sed& sed, const Bandpass& band, double redshift,
                             const std::string& what, const SourceLocation& where) const {
  if (covers(sed, band, redshift)) return;
  const Sed::Range seen = band.range(), known = sed.range();
  throw input_error(
      where,
      "{} ({:.6g} to {:.6g} A) is outside the range of SED '{}' at redshift {}, {:.6g} to {:.6g} A",
      what, seen.low, seen.high, sed.name(), redshift, known.low * (1 + redshift),
      known.high * (1 + redshift));
}

void SceneReader::check_planes(const PlacedGalaxy& placed) {
  // Spectra that cover the planes at two redshifts cover them at all redshifts between.
  const auto [known, is_new] =
      checked_.try_emplace(placed.galaxy.get(), placed.redshift, placed.redshift);
  auto& [least, greatest] = known->second;
  if (!is_new && placed.redshift >= least && placed.redshift <= greatest) return;
  const double stretch = 1 + placed.redshift;
  for (const auto& component : placed.galaxy->components()) {
    const Sed* sed = component->sed();
    const Sed::Range range = sed != nullptr ? sed->range() : component->extinction()->range();
    for (const SpectralPlane& plane : spectrum_.planes) {
      const Sed::Range seen = plane.range();
      // Shortward of the Lyman limit no light is left to absorb, so that dust needs no curve there.
      const bool is_fine =
          (seen.low >= range.low * stretch ||
           (sed == nullptr && plane.band != nullptr && range.low <= lyman_limit)) &&
          seen.high <= range.high * stretch;
      if (is_fine) continue;
      const std::string what =
          plane.band != nullptr
              ? fmt::format("band '{}', {:.6g} to {:.6g} A,", plane.label, seen.low, seen.high)
              : fmt::format("wavelength {} A", plane.wavelength);
      const std::string whose =
          sed != nullptr ? fmt::format("SED '{}'", sed->name()) : "the extinction curve";
      const std::string at =
          placed.redshift > 0 ? fmt::format(" at redshift {}", placed.redshift) : "";
      const double as_nanometres = 10 * plane.wavelength / stretch;
      const bool may_be_nanometres = plane.band == nullptr && seen.low < range.low * stretch &&
                                     as_nanometres > range.low && as_nanometres < range.high;
      const std::string advice =
          may_be_nanometres
              ? fmt::format("; {0} nm are {1} Angstrom", plane.wavelength, 10 * plane.wavelength)
              : "";
      throw input_error(
          plane.band != nullptr ? parameters_.spectrum.bands_where
                                : parameters_.spectrum.wavelengths_where,
          "{} is outside the range {:.6g} to {:.6g} A of {}{} (galaxy '{}', component '{}'){}",
          what, range.low * stretch, range.high * stretch, whose, at, placed.type.str(),
          component->name(), advice);
    }
  }
  least = std::min(least, placed.redshift);
  greatest = std::max(greatest, placed.redshift);
}

double SceneReader::angle_of_unit(const Position& position) const {
  const std::optional<double> unit = parameters_.megaparsec();
  if (!unit || !position.luminosity_distance) {
    row_.fail(column::galaxy,
              "image.unit is one of surface brightness: an orthographic view needs {}",
              unit ? "the redshift or distance" : "scene.unit");
  }
  const double stretch = 1 + position.redshift;
  return *unit * stretch * stretch / *position.luminosity_distance;
}

void SceneReader::note_unlikely(double magnitude, const SourceLocation& where) {
  constexpr double brightest = 5, faintest = 40;
  if (!is_sky_ || (magnitude >= brightest && magnitude <= faintest)) return;
  if (scene_.unlikely.number++ == 0) {
    scene_.unlikely.magnitude = magnitude;
    scene_.unlikely.where = where;
  }
}

double SceneReader::brightness(const PlacedGalaxy& placed, const Position& position) {
  const double stretch = 1 + position.redshift;
  if (scene_.unit == PixelUnit::relative) return 1 / std::pow(stretch, 4);
  double rest = 0, observed = 0;
  const auto components = placed.galaxy->components();
  const bool is_absolute = row_.is_given(column::magnitude);
  const bool has_light = std::ranges::any_of(
      components, [](const auto& c) { return std::as_const(*c).sed() != nullptr; });
  // A galaxy of dust alone needs no magnitude.
  if (!has_light && !is_absolute && !row_.is_given(column::apparent_magnitude)) return 1;
  for (std::size_t c = 0; c < components.size(); ++c) {
    const Sed* sed = components[c]->sed();
    if (sed == nullptr) continue;
    check_band(*sed, *reference_, is_absolute ? 0 : position.redshift,
               fmt::format("reference_band '{}'", reference_->name()),
               row_.where(is_absolute ? column::magnitude : column::apparent_magnitude));
    const double light = placed.galaxy->luminosity(c);
    if (is_absolute) {
      rest += light * band_flux(*sed, *reference_, 0);
    } else {
      observed += light * band_flux(*sed, *reference_, position.redshift, spectrum_.igm);
    }
  }
  if (!(rest + observed > 0)) {
    row_.fail(column::galaxy, "galaxy '{}' has no light in {} that a magnitude could give",
              placed.type.str(), reference_->name());
  }
  const double scale = flux_scale(position, rest, observed);
  note_unlikely(ab_magnitude(scale * (rest + observed)),
                row_.where(is_absolute ? column::magnitude : column::apparent_magnitude));
  double angle = placed.radius;
  if (camera_.projection() != Projection::orthographic) {
    angle /= is_sky_ ? position.comoving_distance : distance_of(placed.centre);
  } else if (!counts_flux(scene_.unit)) {
    angle *= angle_of_unit(position);
  }
  if (!(scale * (rest + observed) <= largest_brightness * angle * angle)) {
    row_.fail(column::galaxy,
              "galaxy '{}' is too bright for its size, {:g} {}: pixels would overflow",
              placed.type.str(), angle,
              camera_.projection() == Projection::orthographic ? "scene units" : "rad");
  }
  return scale / (angle * angle);
}

}  // namespace gamer
