#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/core/parameter.h"
#include "gamer/core/units.h"
#include "gamer/galaxy/sample_batch.h"
#include "scene/catalogue_readers.h"
#include "scene/made_galaxy.h"

namespace gamer {
namespace {

// The words of a row as SkyMaker reads them (its src/list.c, config/sample.list) and Stuff writes
// them (its doc/src/Output.rst). Positions are FITS pixels. Position angles are degrees
// counterclockwise from the image's x axis to the major axis; radii lie along it (src/galaxies.c,
// make_sersic). SkyMaker's output has one more word, the noise area.
struct Word {
  enum Index : std::size_t {
    code,
    x,
    y,
    magnitude,
    bulge_share,
    bulge_radius,  // effective, arcsec
    bulge_aspect,
    bulge_angle,
    scale_length,  // of the disk, arcsec
    disk_aspect,
    disk_angle,
    redshift,
    hubble_type,
    noise_area,
    word_count
  };
};

constexpr std::array<const char*, Word::word_count> names = {
    "the code",
    "x",
    "y",
    "the magnitude",
    "the bulge's share of the light",
    "the bulge's effective radius",
    "the bulge's aspect ratio",
    "the bulge's position angle",
    "the disk's scale length",
    "the disk's aspect ratio",
    "the disk's position angle",
    "the redshift",
    "the Hubble type",
    "the noise area",
};

constexpr double star_code = 100;
constexpr double galaxy_code = 200;
constexpr std::size_t star_words = Word::magnitude + 1;
constexpr std::size_t galaxy_words = Word::disk_angle + 1;

// SkyMaker draws no disk with a smaller share of the light.
constexpr double smallest_disk_share = 0.001;

// Radii in arcsec; values outside can only be mistakes.
constexpr double smallest_radius = 1e-6;
constexpr double largest_radius = 1e6;

// Radii up to which the envelopes are complete, in effective radii and scale lengths. 1 % of a
// bulge's light lies farther out, and 0.05 % of a disk's.
constexpr double bulge_reach = 20;
constexpr double disk_reach = 10;

// Smallest size of a bulge or disk, as a share of the ball's radius; smaller ones get this size. It
// is small enough to look like a point, and large enough for densities in single precision.
constexpr double smallest_share = 1e-6;

constexpr double smallest_flattening = 0.1;

constexpr double edge_on = 90;
constexpr const char* star = "star";

/// The numbers of a row, with their places for messages.
class Row {
 public:
  Row(const std::string& label, const TextLine& line, const std::vector<LineWord>& words)
      : label_(label), line_(line), words_(words) {
    const std::size_t count = std::min<std::size_t>(words.size(), Word::word_count);
    for (std::size_t i = 0; i < count; ++i) values_[i] = parse(static_cast<Word::Index>(i));
  }

  bool has(Word::Index word) const { return word < words_.size(); }
  double operator[](Word::Index word) const { return values_[word]; }

  double within(Word::Index word, const Interval& interval, const char* unit = "") const {
    if (!interval.contains(values_[word])) {
      fail(word, fmt::format("{} = {} is outside {}{}", names[word], words_[word].text,
                             interval.text(), unit));
    }
    return values_[word];
  }

  [[noreturn]] void fail(std::size_t word, const std::string& message) const {
    throw InputError(location(label_, line_, words_[word].begin), message);
  }

 private:
  double parse(Word::Index word) const {
    std::string_view text = words_[word].text;
    // std::from_chars rejects the plus sign that SkyMaker writes.
    if (!text.starts_with("+-")) text = without_plus(text);
    const std::optional<double> value = number_of<double>(text);
    if (!value || !std::isfinite(*value)) {
      fail(word, fmt::format("{} must be a finite number, not {}", names[word],
                             in_quotes(words_[word].text)));
    }
    return *value;
  }

  const std::string& label_;
  const TextLine& line_;
  const std::vector<LineWord>& words_;
  std::array<double, Word::word_count> values_{};
};

/// SED of a disk: that of the nearest of Stuff's types, and of the later one midway between two.
/// Its default SEDs are E (types -6, -2), Sbc (2, 4), Scd (6) and Im (10).
const char* disk_sed(double type) {
  constexpr double first_sbc = 0;
  constexpr double first_scd = 5;
  constexpr double first_im = 8;
  if (type < first_sbc) return "E";
  if (type < first_scd) return "Sbc";
  return type < first_im ? "Scd" : "Im";
}

/// The made galaxy of a row, its size and orientation.
struct Shape {
  std::string type;
  double radius;       ///< of the ball, arcsec
  double inclination;  ///< deg
  double angle;        ///< of the line of nodes, from the x axis, deg
};

/// cos^2 of the inclination at which a disk has the aspect ratio q. In second moments
///   q^2 = cos^2 i + q0^2 sin^2 i,  q0 = (pi/6) z0/rh,
/// since <x^2> = 3 rh^2 along the disk and <z^2> = (pi^2/12) z0^2 across it.
double disk_cosine2(double aspect) {
  constexpr double q0 = std::numbers::pi / 6 * made_disk_thickness;
  return std::clamp((aspect * aspect - q0 * q0) / (1 - q0 * q0), 0.0, 1.0);
}

/// Flattening of an oblate bulge whose aspect ratio is q at that inclination: q^2 = cos^2 i +
/// (c/a)^2 sin^2 i. Where none fits, the nearest possible one.
double bulge_flattening(double aspect, double cosine2) {
  if (cosine2 == 1) return 1;
  const double square = (aspect * aspect - cosine2) / (1 - cosine2);
  return std::clamp(std::sqrt(std::max(square, 0.0)), smallest_flattening, 1.0);
}

Shape shape_of(const Row& row) {
  const Interval lengths = Interval::closed(smallest_radius, largest_radius);
  const Interval aspects = Interval::left_open(0, 1);
  constexpr const char* arcsec = " (arcsec)";
  MadeGalaxy made;
  made.bulge_share = row.within(Word::bulge_share, Interval::closed(0, 1));
  if (1 - made.bulge_share <= smallest_disk_share) made.bulge_share = 1;
  made.bulge_sed = "E";
  made.disk_sed = disk_sed(row[Word::hubble_type]);
  const bool bulge = made.bulge_share > 0;
  const bool disk = made.bulge_share < 1;
  double effective = 0, scale = 0, radius = 0;
  if (bulge) {
    effective = row.within(Word::bulge_radius, lengths, arcsec);
    radius = bulge_reach * effective;
    made.flattening = row.within(Word::bulge_aspect, aspects);
  }
  if (disk) {
    scale = row.within(Word::scale_length, lengths, arcsec);
    radius = std::max(radius, disk_reach * scale);
  }
  radius /= taper_start;
  made.bulge_radius = std::max(effective / radius, smallest_share);
  made.scale_length = std::max(scale / radius, smallest_share);

  Shape shape{"", radius, edge_on, row[disk ? Word::disk_angle : Word::bulge_angle]};
  if (disk) {
    const double cosine2 = disk_cosine2(row.within(Word::disk_aspect, aspects));
    shape.inclination = std::acos(std::sqrt(cosine2)) / degree;
    if (bulge) made.flattening = bulge_flattening(made.flattening, cosine2);
  } else {
    // Any flattening up to the aspect ratio fits. Here it equals the aspect ratio, as for a bulge
    // seen edge-on.
    made.flattening = std::max(made.flattening, smallest_flattening);
  }
  shape.type = made.name();
  return shape;
}

/// The columns that rows of a list become.
class Columns {
 public:
  void reserve(std::size_t rows) {
    types_.reserve(rows);
    ids_.reserve(rows);
    for (std::vector<double>* column :
         {&px_, &py_, &magnitudes_, &sizes_, &inclinations_, &angles_, &redshifts_}) {
      column->reserve(rows);
    }
  }
  bool empty() const { return types_.empty(); }
  void add(const Row& row);
  /// Moves the columns into a table.
  void move_to(TextCatalogue& table, const std::string& label);

 private:
  std::vector<std::string> types_;
  std::vector<double> px_, py_, magnitudes_, sizes_, inclinations_, angles_, redshifts_;
  std::vector<std::int64_t> ids_;
};

void Columns::add(const Row& row) {
  px_.push_back(row[Word::x]);
  py_.push_back(row[Word::y]);
  magnitudes_.push_back(row[Word::magnitude]);
  ids_.push_back(static_cast<std::int64_t>(ids_.size()) + 1);
  if (row[Word::code] == star_code) {
    types_.emplace_back(star);
    for (std::vector<double>* column : {&sizes_, &inclinations_, &angles_, &redshifts_}) {
      column->push_back(no_value);
    }
    return;
  }
  Shape shape = shape_of(row);
  types_.push_back(std::move(shape.type));
  sizes_.push_back(shape.radius);
  inclinations_.push_back(shape.inclination);
  angles_.push_back(shape.angle - 90);
  redshifts_.push_back(row.has(Word::redshift) ? row[Word::redshift] : no_value);
}

void Columns::move_to(TextCatalogue& table, const std::string& label) {
  const auto add = [&](const char* name, const char* unit, Word::Index word,
                       Catalogue::Cells cells) {
    table.columns.push_back({name, unit, {label, 0, 0}, std::move(cells), {}});
    table.places.words.push_back(word);
  };
  add("galaxy", "", Word::code, std::move(types_));
  add("px", "pixel", Word::x, std::move(px_));
  add("py", "pixel", Word::y, std::move(py_));
  add("apparent_magnitude", "mag", Word::magnitude, std::move(magnitudes_));
  add("size_arcsec", "arcsec", Word::bulge_radius, std::move(sizes_));
  add("inclination", "deg", Word::disk_aspect, std::move(inclinations_));
  add("pa", "deg", Word::disk_angle, std::move(angles_));
  add("redshift", "", Word::redshift, std::move(redshifts_));
  add("id", "", Word::code, std::move(ids_));
}

/// Refuses a row of `count` words whose code is unknown or whose number of words is wrong.
void check_row(const Row& row, const std::vector<LineWord>& words, std::size_t count) {
  if (row[Word::code] != star_code && row[Word::code] != galaxy_code) {
    row.fail(Word::code, fmt::format("the code {} is neither {} (a star) nor {} (a galaxy)",
                                     words[Word::code].text, star_code, galaxy_code));
  }
  const bool is_galaxy = row[Word::code] == galaxy_code;
  if (count > Word::word_count || count < (is_galaxy ? galaxy_words : star_words)) {
    row.fail(words.size() - 1,
             fmt::format("the row of a {} has {} value{}, not {} to {}",
                         is_galaxy ? "galaxy" : star, count, count == 1 ? "" : "s",
                         is_galaxy ? galaxy_words : star_words, std::size_t{Word::word_count}));
  }
}

}  // namespace

bool opens_skymaker(const std::vector<LineWord>& words) {
  return words.size() >= star_words &&
         (words[Word::code].text == "100" || words[Word::code].text == "200");
}

TextCatalogue read_skymaker(std::string_view text, const std::string& label) {
  Columns columns;
  TextCatalogue table;
  table.places.text = text;
  LineReader lines(text);
  TextLine line;
  std::vector<LineWord> words;
  while (lines.next(line)) {
    const std::size_t count =
        split_line(line, TextRows::Separator::blanks, label, Word::word_count + 1, words);
    if (count == 0) continue;
    const Row row(label, line, words);
    check_row(row, words, count);
    if (columns.empty()) columns.reserve(expected_rows(text, line.begin, star_words));
    columns.add(row);
    table.places.begins.push_back(line.begin);
    table.places.lines.push_back(line.number);
  }
  columns.move_to(table, label);
  return table;
}

}  // namespace gamer
