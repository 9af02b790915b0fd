#include "gamer/image/wcs.h"

#include <cel.h>
#include <prj.h>
#include <wcs.h>
#include <wcserr.h>
#include <wcsfix.h>
#include <wcshdr.h>
#include <wcstrig.h>
#include <wcsunits.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "image/fits/card_record.h"
#include "image/wcs_records.h"

namespace gamer {
namespace {

constexpr double arcseconds_per_degree = 3600, full_circle = 360;
/// Status of wcsp2s() and wcss2p(): some points have no counterpart; an array marks them.
constexpr int bad_pixels = 8, bad_world = 9;
/// Points converted in one call of WCSLIB.
constexpr std::size_t point_block = 256;
/// Limits of the sides of pixels. A right ascension of 360 deg has steps of 2e-10 arcsec in double
/// precision, 0.2 % of the smallest pixel. A single pixel of the largest size shows the whole sky.
constexpr double smallest_pixel = 1e-7 / arcseconds_per_degree, largest_pixel = full_circle;  // deg
/// Limit of the longer side of a pixel over the shorter; a matrix beyond it is nearly singular.
constexpr double largest_aspect = 1e6;
/// Largest distance of the reference pixel; double precision then resolves 1e-7 of a pixel.
constexpr double farthest_reference = 1e9;
/// Limit of a distortion's change of area: a factor of 4 along both sides, more than any camera's.
constexpr double largest_area_change = 16;

// ---- WCSLIB ------------------------------------------------------------------------------------

/// WCSLIB's message of the innermost reason for the last error of wcsset(), on one line.
std::string error_words(const wcsprm& wcs, int status) {
  std::string words = wcs_errmsg[status];
  for (const wcserr* error : {wcs.cel.prj.err, wcs.cel.err, wcs.lin.err, wcs.err}) {
    if (error == nullptr || error->msg == nullptr) continue;
    words = error->msg;
    break;
  }
  std::ranges::replace(words, '\n', ' ');
  return words;
}

/// An initialised wcsprm. WCSLIB writes into it while converting, so it serves one thread at a
/// time.
class Converter {
 public:
  Converter(const std::vector<std::string>& records, const std::string& label) {
    parse(records, label);
    set(records, label);
  }
  Converter& operator=(Converter&&) = delete;

  /// Throws InputError where the distortion does not suit an image of this size.
  void check_distortion(int width, int height, const std::string& label) {
    if (wcs_->lin.dispre == nullptr && wcs_->lin.disseq == nullptr) return;
    // Distortions have an order of 9 at most; the steps are much finer than their turning points.
    constexpr int step_count = 32;
    // Largest distance between a pixel and the place that the inverse gives it.
    constexpr double farthest = 0.1;
    const Jacobian middle = jacobian({(width + 1) / 2.0, (height + 1) / 2.0});
    middle.check_sides("the distortion (A_i_j, B_i_j, PVi_j...)", label);
    for (int j = 0; j <= step_count; ++j) {
      for (int i = 0; i <= step_count; ++i) {
        const PixelPosition place{0.5 + static_cast<double>(width) * i / step_count,
                                  0.5 + static_cast<double>(height) * j / step_count};
        const auto fail = [&](const std::string& what) {
          throw input_error({label, 0, 0},
                            "the distortion (A_i_j, B_i_j, PVi_j...) is no view of {} x {} pixels: "
                            "at pixel ({:.1f}, {:.1f}) {}",
                            width, height, place.x, place.y, what);
        };
        const double change = jacobian(place).area() / middle.area();
        if (!(change > 0)) fail("it folds the image");
        if (change > largest_area_change || 1 / change > largest_area_change) {
          fail(
              fmt::format("a pixel has {:.3g} times the area of the middle one; expected a factor "
                          "of {} at most",
                          change, largest_area_change));
        }
        const std::array<double, sky_axis_count> from = {place.x, place.y};
        std::array<double, sky_axis_count> intermediate, back{};
        const bool has_inverse =
            linp2x(&wcs_->lin, 1, sky_axis_count, from.data(), intermediate.data()) == 0 &&
            linx2p(&wcs_->lin, 1, sky_axis_count, intermediate.data(), back.data()) == 0 &&
            std::hypot(back[0] - place.x, back[1] - place.y) < farthest;
        if (!has_inverse) fail("it has no inverse");
      }
    }
  }

  std::optional<PixelPosition> tangent_point() const {
    constexpr double pole_latitude = 90;
    const bool is_distorted = wcs_->lin.dispre != nullptr || wcs_->lin.disseq != nullptr;
    if (is_distorted || std::string_view(wcs_->cel.prj.code) != "TAN" ||
        wcs_->cel.theta0 != pole_latitude) {
      return std::nullopt;
    }
    return PixelPosition{wcs_->crpix[0], wcs_->crpix[1]};
  }

  /// Converts pixels independently of each other; positions without sky are NaN.
  void to_sky(std::span<const PixelPosition> pixels, std::span<SkyPosition> out) {
    // WCSLIB 7.12 converts rows of equal x or y differently from their single points.
    const int category = wcs_->cel.prj.category;
    const std::size_t most = category == QUADCUBE || category == HEALPIX ? 1 : point_block;
    for (std::size_t first = 0; first < pixels.size(); first += most) {
      const std::size_t count = std::min(most, pixels.size() - first);
      const auto block = pixels.subspan(first, count);
      if (convert(block, out.subspan(first, count))) continue;
      // The block failed as a whole; single pixels may succeed.
      for (std::size_t i = 0; i < count; ++i) {
        if (!convert(block.subspan(i, 1), out.subspan(first + i, 1))) {
          out[first + i] = {no_value, no_value};
        }
      }
    }
  }

  std::optional<PixelPosition> to_pixel(const SkyPosition& sky) {
    std::array<double, sky_axis_count> from, intermediate, to;
    double phi = 0, theta = 0;
    int bad = 0;
    from[wcs_->lng] = sky.ra;
    from[wcs_->lat] = sky.dec;
    const int status = wcss2p(wcs_, 1, sky_axis_count, from.data(), &phi, &theta,
                              intermediate.data(), to.data(), &bad);
    is_failure(status, bad_world);
    if (status != 0 || !std::isfinite(to[0] + to[1])) return std::nullopt;
    return PixelPosition{to[0], to[1]};
  }

 private:
  /// Converts a block of pixels; false when WCSLIB converts none of them.
  bool convert(std::span<const PixelPosition> pixels, std::span<SkyPosition> out) {
    std::array<double, sky_axis_count * point_block> from, intermediate, to;
    std::array<double, point_block> phi, theta;
    std::array<int, point_block> bad;
    const std::size_t count = pixels.size();
    for (std::size_t i = 0; i < count; ++i) {
      from[sky_axis_count * i] = pixels[i].x;
      from[sky_axis_count * i + 1] = pixels[i].y;
    }
    const int status = wcsp2s(wcs_, static_cast<int>(count), sky_axis_count, from.data(),
                              intermediate.data(), phi.data(), theta.data(), to.data(), bad.data());
    if (is_failure(status, bad_pixels)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      const double ra = to[sky_axis_count * i + wcs_->lng],
                   dec = to[sky_axis_count * i + wcs_->lat];
      if (status != 0 && bad[i] != 0) {
        out[i] = {no_value, no_value};
      } else if (std::isfinite(ra + dec)) {
        out[i] = {in_circle(ra), dec};
      } else {
        out[i] = sky_beside(pixels[i]);
      }
    }
    return true;
  }

  /// WCSLIB finds no latitude exactly on the central meridian of PCO (7.12).
  SkyPosition sky_beside(const PixelPosition& pixel) {
    constexpr double nudge = 1e-7;  // pixels
    const std::array<double, sky_axis_count> from = {pixel.x + nudge, pixel.y + nudge};
    std::array<double, sky_axis_count> intermediate, to;
    double phi = 0, theta = 0;
    int bad = 0;
    const int status = wcsp2s(wcs_, 1, sky_axis_count, from.data(), intermediate.data(), &phi,
                              &theta, to.data(), &bad);
    if (status != 0 || !std::isfinite(to[0] + to[1])) return {no_value, no_value};
    return {in_circle(to[wcs_->lng]), to[wcs_->lat]};
  }

  static double in_circle(double ra) {
    if (ra < 0) ra += full_circle;
    return ra < full_circle ? ra : ra - full_circle;
  }

  /// Whether no point has a counterpart (a distortion that cannot be inverted...).
  static bool is_failure(int status, int some_bad) {
    if (status == WCSERR_MEMORY) throw RunError("out of memory in WCSLIB");
    return status != 0 && status != some_bad;
  }

  void parse(const std::vector<std::string>& records, const std::string& label) {
    std::string text;
    for (const std::string& record : records) {
      // Other records lead WCSLIB beyond their end (7.12).
      if (!is_printing(record) || has_open_string(record)) {
        throw input_error({label, 0, 0}, "cannot read the card {}", in_quotes(trimmed(record)));
      }
      text += record;
    }
    // Makes wcspih() remove the records that it understands.
    constexpr int remove_valid = -1;
    int rejected = 0;
    const int status = wcspih(text.data(), static_cast<int>(records.size()), WCSHDR_all,
                              remove_valid, &rejected, &all_.count, &all_.list);
    if (status != 0) {
      throw input_error({label, 0, 0}, "WCSLIB cannot read the header: {}", wcshdr_errmsg[status]);
    }
    if (rejected > 0) {
      const std::string rest = text.substr(0, std::min(text.find('\0'), record_width));
      throw input_error({label, 0, 0}, "cannot read the card {}", in_quotes(trimmed(rest)));
    }
    for (int i = 0; i < all_.count; ++i) {
      if (all_.list[i].alt[0] == ' ') wcs_ = &all_.list[i];
    }
    if (wcs_ == nullptr || wcs_->naxis != sky_axis_count) throw no_celestial_axes(label);
  }

  void set(const std::vector<std::string>& records, const std::string& label) {
    constexpr int no_translation = 0;
    unitfix(no_translation, wcs_);
    const int status = wcsset(wcs_);
    if (status == 0 && wcs_->lng >= 0 && wcs_->lat >= 0) {
      check_frame(label);
      check_projection_is_named(label);
      check_numbers(label);
      return;
    }
    check_types(label);
    if (status == 0) throw no_celestial_axes(label);
    check_units(label);
    // A second run from the start gives the details.
    all_.clear();
    parse(records, label);
    unitfix(no_translation, wcs_);
    wcserr_enable(1);
    wcsset(wcs_);
    const std::string words = error_words(*wcs_, status);
    wcserr_enable(0);
    throw InputError({label, 0, 0}, words);
  }

  static InputError no_celestial_axes(const std::string& label) {
    return {{label, 0, 0}, "no celestial axes; expected RA and DEC as axes 1 and 2"};
  }

  /// The coordinate of an axis, "RA" of "RA---TAN".
  std::string coordinate(int axis) const {
    const std::string_view type = wcs_->ctype[axis];
    return std::string(trimmed(type.substr(0, type.find('-'))));
  }

  void check_frame(const std::string& label) const {
    const std::string first = coordinate(0), second = coordinate(1);
    const auto [low, high] = std::minmax(first, second);
    if (low == "DEC" && high == "RA") return;
    throw input_error({label, 0, 0}, "axes 1 and 2 are {} and {}; expected RA and DEC",
                      in_quotes(first), in_quotes(second));
  }

  /// The projection of an axis, "TAN" of "RA---TAN".
  std::string projection(int axis) const {
    constexpr std::size_t place_begin = 5, image_width = 3;
    const std::string_view type = wcs_->ctype[axis];
    return std::string(
        trimmed(type.size() > place_begin ? type.substr(place_begin, image_width) : ""));
  }

  void check_projection_is_named(const std::string& label) const {
    for (int axis = 0; axis < sky_axis_count; ++axis) {
      if (!projection(axis).empty()) continue;
      throw input_error({label, 0, 0}, "CTYPE{} = {} names no projection", axis + 1,
                        in_quotes(trimmed(wcs_->ctype[axis])));
    }
  }

  /// Derivatives of intermediate world coordinates, deg per pixel.
  struct Jacobian {
    double xx, xy, yx, yy;

    double area() const { return xx * yy - xy * yx; }
    void check_sides(const std::string& what, const std::string& label) const {
      // Singular values of the matrix; NaN where a number is not finite.
      const double sum = std::hypot(xx + yy, yx - xy), difference = std::hypot(xx - yy, yx + xy);
      const double longest = (sum + difference) / 2, shortest = std::abs(sum - difference) / 2;
      if (longest <= largest_pixel && shortest >= smallest_pixel &&
          longest <= largest_aspect * shortest) {
        return;
      }
      throw input_error({label, 0, 0},
                        "{} gives pixels of {:.3g} x {:.3g} deg; expected sides from {:.3g} to {} "
                        "deg, the longer at most {:.0e} times the shorter",
                        what, longest, shortest, smallest_pixel, largest_pixel, largest_aspect);
    }
  };

  Jacobian jacobian(const PixelPosition& at) {
    constexpr int end_count = 4;
    const std::array<double, sky_axis_count* end_count> from = {
        at.x - 0.5, at.y, at.x + 0.5, at.y, at.x, at.y - 0.5, at.x, at.y + 0.5};
    std::array<double, sky_axis_count * end_count> to;
    to.fill(no_value);
    linp2x(&wcs_->lin, end_count, sky_axis_count, from.data(), to.data());
    return {to[2] - to[0], to[6] - to[4], to[3] - to[1], to[7] - to[5]};
  }

  void check_numbers(const std::string& label) const {
    for (int axis = 0; axis < sky_axis_count; ++axis) {
      const double pixel = wcs_->crpix[axis], value = wcs_->crval[axis];
      if (std::abs(pixel) <= farthest_reference && std::isfinite(value)) continue;
      throw input_error(
          {label, 0, 0},
          "CRPIX{0} = {1}, CRVAL{0} = {2}; expected finite numbers, CRPIX{0} within +-{3:.0e}",
          axis + 1, pixel, value, farthest_reference);
    }
    // wcsset() has converted CDi_j, CDELTi and CROTAi to these, in degrees.
    const double *matrix = wcs_->lin.pc, *step = wcs_->lin.cdelt;
    const Jacobian pixel{step[0] * matrix[0], step[0] * matrix[1], step[1] * matrix[2],
                         step[1] * matrix[3]};
    pixel.check_sides("the matrix CDi_j, or CDELTi times PCi_j,", label);
  }

  /// Fails with the reason why WCSLIB finds no celestial axes.
  void check_types(const std::string& label) const {
    if (coordinate(0).empty() || coordinate(1).empty()) throw no_celestial_axes(label);
    check_frame(label);
    check_projection_is_named(label);
    const std::vector<std::string> known = sky_projections();
    for (int axis = 0; axis < sky_axis_count; ++axis) {
      const std::string code = projection(axis);
      if (std::ranges::find(known, code) != known.end()) continue;
      throw input_error({label, 0, 0}, "CTYPE{}: unknown projection {}{}", axis + 1,
                        in_quotes(code), did_you_mean(code, known));
    }
  }

  /// WCSLIB's own messages about units leak memory (7.12).
  void check_units(const std::string& label) const {
    for (int axis = 0; axis < sky_axis_count; ++axis) {
      const std::string_view unit = trimmed(wcs_->cunit[axis]);
      double scale = 0, offset = 0, power = 0;
      if (unit.empty() || wcsunits(wcs_->cunit[axis], "deg", &scale, &offset, &power) == 0)
        continue;
      throw input_error({label, 0, 0}, "CUNIT{} = {} is no unit of angles", axis + 1,
                        in_quotes(unit));
    }
  }

  /// The output of wcspih(): one wcsprm per description of the axes.
  struct Descriptions {
    Descriptions() = default;
    Descriptions& operator=(Descriptions&&) = delete;
    ~Descriptions() { clear(); }
    void clear() { wcsvfree(&count, &list); }

    int count = 0;
    wcsprm* list = nullptr;
  };
  Descriptions all_;
  wcsprm* wcs_ = nullptr;
};

// ---- View --------------------------------------------------------------------------------------

/// The projection in WCSLIB's form. Throws InputError where it is unknown or its parameters are
/// bad.
prjprm checked_projection(const SkyView& view) {
  const std::vector<std::string> known = sky_projections();
  if (std::ranges::find(known, view.projection) == known.end()) {
    std::string near = did_you_mean(view.projection, known);
    if (near.empty()) near = fmt::format("; expected one of {}", fmt::join(known, ", "));
    throw input_error("unknown projection {}{}", in_quotes(view.projection), near);
  }
  prjprm projection;
  prjini(&projection);
  view.projection.copy(projection.code, sizeof projection.code - 1);
  // The set-up gives the number of parameters, even if it rejects their values.
  for (std::size_t i = 0; i < view.parameters.size() && i + 1 < PVN; ++i) {
    projection.pv[i + 1] = view.parameters[i];
  }
  const int status = prjset(&projection);
  constexpr int first_factor = 100;
  const int first = projection.pvrange / first_factor, count = projection.pvrange % first_factor;
  const auto most = static_cast<std::size_t>(std::max(first + count - 1, 0));
  std::string problem;
  if (view.parameters.size() > most) {
    problem = most == 0 ? "takes no parameters" : fmt::format("takes at most {} parameters", most);
    problem += fmt::format("; {} given", view.parameters.size());
  } else if (status != 0) {
    problem = fmt::format("bad parameters: [{}]", fmt::join(view.parameters, ", "));
  }
  const prjprm result = projection;
  prjfree(&projection);
  if (!problem.empty()) throw input_error("projection {}: {}", view.projection, problem);
  return result;
}

void check_finite(const SkyView& view) {
  double sum = view.center.ra + view.center.dec + view.pixel_scale + view.rotation;
  for (const double parameter : view.parameters) sum += parameter;
  if (!std::isfinite(sum)) throw std::invalid_argument("sky view: a number is not finite");
}

std::vector<std::string> view_records(const SkyView& view) {
  check_finite(view);
  constexpr double pole_latitude = 90;
  const bool zenithal = checked_projection(view).theta0 == pole_latitude;
  // The standard's default orientation at the pole differs by 180 deg from the one just beside the
  // pole. For zenithal projections LONPOLE states the latter. For others the right ascension, which
  // has no meaning at the pole, turns the image back.
  double ra = view.center.ra;
  if (!zenithal && view.center.dec == pole_latitude)
    ra += ra < pole_latitude * 2 ? pole_latitude * 2 : -pole_latitude * 2;
  std::vector<std::string> records;
  const auto text = [&](const char* key, const std::string& value, const char* comment) {
    records.push_back(make_text_record(key, value, comment));
  };
  const auto number = [&](const std::string& key, double value, const char* comment) {
    records.push_back(make_record(key, fits_number(value), comment));
  };
  text("CTYPE1", "RA---" + view.projection, "right ascension");
  text("CTYPE2", "DEC--" + view.projection, "declination");
  text("CUNIT1", "deg", "");
  text("CUNIT2", "deg", "");
  number("CRPIX1", (view.width + 1.0) / 2, "middle of the image");
  number("CRPIX2", (view.height + 1.0) / 2, "middle of the image");
  number("CRVAL1", ra, "right ascension there");
  number("CRVAL2", view.center.dec, "declination there");
  number("CDELT1", -view.pixel_scale / arcseconds_per_degree, "step per pixel");
  number("CDELT2", view.pixel_scale / arcseconds_per_degree, "step per pixel");
  // The image's +y points East by the sine and North by the cosine of its position angle.
  const double sine = sind(view.rotation), cosine = cosd(view.rotation);
  number("PC1_1", cosine, "rotation");
  number("PC1_2", -sine, "rotation");
  number("PC2_1", sine, "rotation");
  number("PC2_2", cosine, "rotation");
  for (std::size_t i = 0; i < view.parameters.size(); ++i) {
    number(fmt::format("PV2_{}", i + 1), view.parameters[i], "parameter of the projection");
  }
  if (zenithal) number("LONPOLE", pole_latitude * 2, "native longitude of the celestial pole");
  text("RADESYS", "ICRS", "");
  number("EQUINOX", 2000, "");
  return records;
}

}  // namespace

// ---- CelestialWcs ------------------------------------------------------------------------------

class CelestialWcs::Impl {
 public:
  Impl(std::vector<std::string> records, const std::string& label)
      : records_(std::move(records)), label_(label) {
    free_[own_place()] = make().release();
  }
  ~Impl() {
    for (const std::atomic<Converter*>& place : free_) delete place.load();
  }
  Impl& operator=(Impl&&) = delete;

  const std::vector<std::string>& records() const { return records_; }
  const std::string& label() const { return label_; }

  /// Runs `use` with a converter that no other thread uses.
  template <class Use>
  auto with_converter(Use use) const {
    std::atomic<Converter*>& place = free_[own_place()];
    std::unique_ptr<Converter> converter(place.exchange(nullptr));
    for (std::size_t i = 0; i < places && !converter; ++i) {
      converter.reset(free_[i].exchange(nullptr));
    }
    if (!converter) converter = make();
    struct Return {
      std::atomic<Converter*>& place;
      std::unique_ptr<Converter>& converter;
      ~Return() { delete place.exchange(converter.release()); }
    } give_back{place, converter};
    return use(*converter);
  }

 private:
  static constexpr std::size_t places = 64;
  /// The first place where this thread looks for a converter. Most threads thus find the converter
  /// that they used last, and no thread waits.
  static std::size_t own_place() {
    static std::atomic<std::size_t> threads = 0;
    thread_local const std::size_t own = threads++ % places;
    return own;
  }

  /// Makes one converter at a time: WCSLIB does not guarantee that its parsers are thread-safe.
  std::unique_ptr<Converter> make() const {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    return std::make_unique<Converter>(records_, label_);
  }

  std::vector<std::string> records_;
  std::string label_;
  /// Unused converters.
  mutable std::array<std::atomic<Converter*>, places> free_{};
};

CelestialWcs::CelestialWcs(const SkyView& view)
    : impl_(std::make_shared<Impl>(view_records(view),
                                   fmt::format("projection {}", view.projection))) {}

CelestialWcs CelestialWcs::from_header(std::string_view header, const std::string& label) {
  const std::vector<std::string> all = split_records(header);
  check_self_contained(all, label);
  CelestialWcs wcs(std::make_shared<Impl>(celestial_records(all), label));
  return wcs;
}

CelestialWcs::CelestialWcs(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
CelestialWcs::CelestialWcs(const CelestialWcs&) = default;
CelestialWcs& CelestialWcs::operator=(const CelestialWcs&) = default;
CelestialWcs::~CelestialWcs() = default;

std::optional<SkyPosition> CelestialWcs::sky(const PixelPosition& pixel) const {
  SkyPosition position;
  sky({&pixel, 1}, {&position, 1});
  if (std::isnan(position.ra)) return std::nullopt;
  return position;
}

std::optional<PixelPosition> CelestialWcs::pixel(const SkyPosition& sky) const {
  return impl_->with_converter([&](Converter& converter) { return converter.to_pixel(sky); });
}

void CelestialWcs::sky(std::span<const PixelPosition> pixels, std::span<SkyPosition> out) const {
  if (pixels.size() != out.size()) {
    throw std::invalid_argument("sky positions: arrays of different length");
  }
  impl_->with_converter([&](Converter& converter) { converter.to_sky(pixels, out); });
}

std::optional<PixelPosition> CelestialWcs::tangent_point() const {
  return impl_->with_converter(
      [](const Converter& converter) { return converter.tangent_point(); });
}

void CelestialWcs::check_distortion(int width, int height) const {
  impl_->with_converter(
      [&](Converter& converter) { converter.check_distortion(width, height, impl_->label()); });
}

const std::vector<std::string>& CelestialWcs::records() const { return impl_->records(); }

std::vector<std::string> sky_projections() { return {prj_codes, prj_codes + prj_ncode}; }

}  // namespace gamer
