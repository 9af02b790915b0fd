#include "scene/suspicious_values.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/message.h"

namespace gamer {
namespace {

using namespace column;

constexpr double whole_turn = 360;
/// Numbers of this size are flags, usually 1e20 or 1e30.
constexpr double huge_number = 1e19;

constexpr double flags[] = {-1,    -9, -99,  -99.9, -99.99, -999,  -999.9,
                            -9999, 99, 99.9, 99.99, 999,    999.9, 9999};

/// The interval of a column's plausible values, and the least size of values outside that are
/// flags.
struct Plausible {
  Interval interval;
  double least_flag = 1;
};

Plausible plausible(Column column) {
  constexpr double magnitude_end = 90, usual_redshift = 30, degrees = 90;
  switch (column) {
    case magnitude:
    case apparent_magnitude: return {Interval::open(-magnitude_end, magnitude_end)};
    case ra: return {Interval::closed(0, whole_turn), degrees};
    case pa: return {Interval::closed(-whole_turn, whole_turn)};
    case redshift: return {Interval::closed(0, usual_redshift)};
    default: return {scene_columns()[column].interval};
  }
}

bool is_flag(Column column, double value) {
  if (!std::isfinite(value) || std::abs(value) >= huge_number) return true;
  const Plausible expected = plausible(column);
  if (expected.interval.contains(value)) return false;
  if (column == magnitude || column == apparent_magnitude) return true;
  return std::abs(value) >= expected.least_flag &&
         std::ranges::find(flags, value) != std::end(flags);
}

/// A row needs a value in one of these columns. Without it the row is an error, or gets a default
/// that may be wrong.
struct KnownNeed {
  std::vector<Column> columns;
  bool of_stars;
  bool has_default;
};

const std::vector<KnownNeed>& known_needs() {
  static const std::vector<KnownNeed> all = {
      {{ra, dx, px}, true, false},
      {{dec, dy, py}, true, false},
      {{x}, true, false},
      {{y}, true, false},
      {{z}, true, false},
      {{magnitude, apparent_magnitude}, true, false},
      {{size_kpc, size_arcsec, half_light_radius, half_light_radius_kpc}, false, false},
      {{size}, false, true},
      {{redshift, distance}, false, true},
      {{inclination, axis_ratio}, false, true},
      {{pa}, false, true},
      {{g1}, false, true},
      {{g2}, false, true},
      {{kappa}, false, true},
  };
  return all;
}

/// Whether the selected row's galaxy looks round, so that a position angle means nothing.
bool is_round(const SceneRow& row) {
  return row.raw_number(axis_ratio) == 1 || row.raw_number(inclination) == 0 ||
         (!row.has(axis_ratio) && !row.has(inclination));
}

constexpr std::size_t most_named_rows = 5, most_findings = 5;

}  // namespace

SuspiciousValues::SuspiciousValues(const Catalogue& catalogue, SceneRow& row)
    : catalogue_(catalogue), row_(row) {
  if (catalogue.is_scene_list()) return;
  refuses_missing_ = !catalogue.has_galaxies();
  std::vector<Column> numbers;
  std::vector<bool> has_values(scene_columns().size());
  for (std::size_t c = 0; c < scene_columns().size(); ++c) {
    const auto column = static_cast<Column>(c);
    if (scene_columns()[c].type != ParameterType::number || !row.is_from_catalogue(column)) {
      continue;
    }
    numbers.push_back(column);
    for (std::size_t i = 0; i < catalogue.rows() && !has_values[c]; ++i) {
      row.select(i);
      has_values[c] = row.is_given(column);
    }
  }
  const std::vector<Need> needed = needs_of(has_values);
  for (std::size_t i = 0; i < catalogue.rows(); ++i) {
    row.select(i);
    for (const Column column : numbers) {
      const std::optional<double> value = row.raw_number(column);
      if (value && row.is_given(column) && is_flag(column, *value)) {
        add(i, column, row.word(column));
      }
    }
    if (!needed.empty()) find_missing(i, needed);
  }
}

std::vector<SuspiciousValues::Need> SuspiciousValues::needs_of(
    const std::vector<bool>& has_values) const {
  std::vector<Need> result;
  for (const KnownNeed& known : known_needs()) {
    if (known.has_default && !refuses_missing_) continue;
    // One of the columns has a constant for all rows, which suffices.
    if (std::ranges::any_of(known.columns,
                            [&](Column c) { return row_.has(c) && !row_.is_from_catalogue(c); })) {
      continue;
    }
    const auto named = std::ranges::find_if(known.columns, [&](Column c) { return has_values[c]; });
    if (named != known.columns.end()) result.push_back({known.columns, *named, known.of_stars});
  }
  return result;
}

void SuspiciousValues::find_missing(std::size_t row, const std::vector<Need>& needed) {
  const bool is_star = row_.is_star();
  for (const Need& need : needed) {
    if (is_star && !need.of_stars) continue;
    if (std::ranges::any_of(need.columns, [&](Column c) { return row_.is_given(c); })) continue;
    if (need.named == pa && is_round(row_)) continue;
    add(row, need.named, "");
  }
}

void SuspiciousValues::add(std::size_t row, Column column, const std::string& value) {
  if (flagged_.empty()) flagged_.resize(catalogue_.rows());
  if (!flagged_[row]) ++rows_;
  flagged_[row] = true;
  auto finding = std::ranges::find_if(findings_, [&](const Finding& known) {
    return known.column == column && known.value == value;
  });
  if (finding == findings_.end()) {
    // Further values are only counted.
    constexpr std::size_t most_kinds = 100;
    if (findings_.size() == most_kinds) return;
    findings_.push_back({column, value, row_.where(column), {}, 0});
    finding = findings_.end() - 1;
  }
  if (finding->number++ < most_named_rows) finding->rows.push_back(row + 1);
}

std::string SuspiciousValues::text(const Finding& finding) const {
  std::string rows =
      fmt::format("row{} {}", finding.number == 1 ? "" : "s", fmt::join(finding.rows, ", "));
  if (finding.number > finding.rows.size()) {
    rows += fmt::format(" and {} more", finding.number - finding.rows.size());
  }
  const std::string& name = scene_columns()[finding.column].name;
  const std::string& column_name = row_.column_name(finding.column);
  const std::string place =
      column_name == name ? rows : fmt::format("column {}, {}", column_name, rows);
  if (finding.value.empty()) return fmt::format("{} has no value ({})", name, place);
  return fmt::format("{} = {} looks like a flag for a missing value ({})", name, finding.value,
                     place);
}

void SuspiciousValues::refuse() const {
  std::vector<std::string> texts;
  SourceLocation where;
  std::size_t number = 0;
  for (const Finding& finding : findings_) {
    if (finding.value.empty() && !refuses_missing_) continue;
    if (number++ == 0) where = finding.where;
    if (texts.size() < most_findings) texts.push_back(text(finding));
  }
  if (number == 0) return;
  if (number > texts.size()) {
    texts.push_back(fmt::format("and {} more values", number - texts.size()));
  }
  throw input_error(where, "{}; with catalogue.skip_flagged = true such rows are left out",
                    fmt::join(texts, "; "));
}

}  // namespace gamer
