#include "sed/two_columns.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>
#include <system_error>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr std::string_view blanks = " \t\r\f\v";

struct Unit {
  std::string_view name;
  double angstrom;
};
constexpr std::array<Unit, 3> wavelength_units = {{{"Angstrom", 1.0}, {"nm", 10.0}, {"um", 1e4}}};

/// Number of the interval that holds a wavelength: the upper bits of the double, 64 intervals per
/// octave.
constexpr int dropped_bits = 46;
std::uint64_t start_of(double wavelength) {
  return std::bit_cast<std::uint64_t>(wavelength) >> dropped_bits;
}

struct Word {
  std::string_view text;
  int column;
};

std::vector<Word> split(std::string_view line) {
  std::vector<Word> words;
  std::size_t first = line.find_first_not_of(blanks);
  while (first != std::string_view::npos) {
    const std::size_t last = std::min(line.find_first_of(blanks, first), line.size());
    words.push_back({line.substr(first, last - first), static_cast<int>(first) + 1});
    first = line.find_first_not_of(blanks, last);
  }
  return words;
}

double parse_number(std::string_view word, const SourceLocation& where) {
  const std::string_view digits =
      word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::invalid_argument || end != digits.data() + digits.size()) {
    throw InputError(where, in_quotes(word) + " is not a number");
  }
  if (error == std::errc::result_out_of_range) {
    throw InputError(where, in_quotes(word) + " is too large or too small for a number");
  }
  if (!std::isfinite(value)) throw InputError(where, in_quotes(word) + " is not finite");
  return value;
}

struct HeadEntry {
  std::string key;
  std::string value;
  SourceLocation where;
};

// Adds the "key: value" of a comment's text; other text is ignored.
void read_head_line(std::string_view line, std::size_t hash, const SourceLocation& where,
                    std::vector<HeadEntry>& head) {
  const std::size_t colon = line.find(':', hash);
  if (colon == std::string_view::npos) return;
  const std::string_view key = trimmed(line.substr(hash + 1, colon - hash - 1), blanks);
  const std::string_view value = trimmed(line.substr(colon + 1), blanks);
  SourceLocation value_where = where;
  value_where.column = static_cast<int>(value.data() - line.data()) + 1;
  head.push_back({lower(key), std::string(value), value_where});
}

// The head's entry of `key`, or null.
const HeadEntry* find_entry(const std::vector<HeadEntry>& head, const std::string& key) {
  const HeadEntry* entry = nullptr;
  for (const HeadEntry& candidate : head) {
    if (candidate.key != key) continue;
    if (entry != nullptr) {
      throw input_error(candidate.where, "'{}' is given twice, first in line {}", key,
                        entry->where.line);
    }
    entry = &candidate;
  }
  return entry;
}

double read_number(const std::vector<HeadEntry>& head, const HeadNumber& number) {
  const HeadEntry* entry = find_entry(head, number.key);
  if (entry == nullptr) return number.default_value;
  const double value = parse_number(entry->value, entry->where);
  if (!number.interval.contains(value)) {
    throw input_error(entry->where, "{} {} is outside {}", number.key, entry->value,
                      number.interval.text());
  }
  return value;
}

// Index of the one of `choices` that the head gives for `key`.
std::size_t choose(const std::vector<HeadEntry>& head, const std::string& label,
                   const std::string& key, const std::vector<std::string>& choices) {
  const HeadEntry* entry = find_entry(head, key);
  if (entry == nullptr) {
    std::string others;
    for (std::size_t i = 1; i < choices.size(); ++i) {
      others += (i == 1 ? " (or " : ", ") + choices[i];
    }
    if (!others.empty()) others += ")";
    throw input_error({label, 1, 1}, "the head does not say the {0}; add the line '# {0}: {1}'{2}",
                      key, choices.front(), others);
  }
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (lower(choices[i]) == lower(entry->value)) return i;
  }
  std::string known = choices.front();
  for (std::size_t i = 1; i < choices.size(); ++i) known += ", " + choices[i];
  const std::string near = did_you_mean(entry->value, choices);
  throw input_error(entry->where, "unknown {} {}, known: {}{}", key, in_quotes(entry->value), known,
                    near);
}

/// A row of numbers, as the text has them.
struct Row {
  Word wavelength;
  Word value;
  int line;
};

/// Splits a text into the entries of its head and its rows. Returns the number of its lines.
int split_text(std::string_view text, const std::string& label, std::vector<HeadEntry>& head,
               std::vector<Row>& rows) {
  int line_number = 0;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string_view line = text.substr(start, end - start);
    start = end + 1;
    ++line_number;

    const std::size_t hash = line.find('#');
    const std::vector<Word> words = split(line.substr(0, hash));
    if (words.empty()) {
      if (hash != std::string_view::npos && rows.empty()) {
        read_head_line(line, hash, {label, line_number, 1}, head);
      }
      continue;
    }
    if (words.size() != 2) {
      const Word& first_wrong = words[words.size() == 1 ? 0 : 2];
      throw input_error({label, line_number, first_wrong.column},
                        "{} column{} where 2 are expected", words.size(),
                        words.size() == 1 ? "" : "s");
    }
    rows.push_back({words[0], words[1], line_number});
  }
  return line_number;
}

/// Checks a row and appends its numbers.
void add_row(const Row& row, const std::string& label, const Unit& unit, const std::string& key,
             TwoColumns& result) {
  const SourceLocation wavelength_where{label, row.line, row.wavelength.column};
  const SourceLocation value_where{label, row.line, row.value.column};
  const double wavelength = unit.angstrom * parse_number(row.wavelength.text, wavelength_where);
  const double value = parse_number(row.value.text, value_where);
  if (!(wavelength > 0) || !std::isfinite(wavelength)) {
    throw input_error(wavelength_where, "wavelength {} {} is outside ]0, inf[", row.wavelength.text,
                      unit.name);
  }
  if (!result.wavelengths.empty() && !(wavelength > result.wavelengths.back())) {
    throw input_error(wavelength_where, "wavelengths are not ascending: {} after {}",
                      wavelength / unit.angstrom, result.wavelengths.back() / unit.angstrom);
  }
  if (value < 0) throw input_error(value_where, "negative {}: {}", key, row.value.text);
  result.wavelengths.push_back(wavelength);
  result.values.push_back(value);
  result.where.push_back(value_where);
}

}  // namespace

void TwoColumns::make_starts() {
  const std::uint64_t first = start_of(wavelengths.front()), last = start_of(wavelengths.back());
  std::size_t i = 1;
  for (std::uint64_t start = first; start <= last; ++start) {
    // The lowest row, except the very first, that lies above the interval's beginning.
    const double begin = std::bit_cast<double>(start << dropped_bits);
    while (i + 1 < wavelengths.size() && wavelengths[i] <= begin) ++i;
    starts_.push_back(static_cast<std::uint32_t>(i));
  }
}

double TwoColumns::interpolate(double wavelength) const {
  assert(covers(wavelength));
  std::size_t i = starts_[start_of(wavelength) - start_of(wavelengths.front())];
  while (i + 1 < wavelengths.size() && wavelengths[i] <= wavelength) ++i;
  const double t = (wavelength - wavelengths[i - 1]) / (wavelengths[i] - wavelengths[i - 1]);
  return std::lerp(values[i - 1], values[i], t);
}

bool TwoColumns::covers(double wavelength) const {
  return wavelength >= wavelengths.front() && wavelength <= wavelengths.back();
}

TwoColumns parse_two_columns(std::string_view text, const std::string& label,
                             const TwoColumnFormat& format) {
  std::vector<HeadEntry> head;
  std::vector<Row> rows;
  const int line_number = split_text(text, label, head, rows);
  std::vector<std::string> units;
  for (const Unit& unit : wavelength_units) units.emplace_back(unit.name);
  const Unit& unit = wavelength_units[choose(head, label, "wavelength", units)];
  TwoColumns result;
  result.kind = format.kinds[choose(head, label, format.key, format.kinds)];
  for (const HeadNumber& number : format.numbers) {
    result.numbers.push_back(read_number(head, number));
  }
  for (const Row& row : rows) add_row(row, label, unit, format.key, result);
  if (rows.size() < 2) {
    throw input_error({label, std::max(line_number, 1), 1}, "{} row{} where at least 2 are needed",
                      rows.size(), rows.size() == 1 ? "" : "s");
  }
  if (std::ranges::all_of(result.values, [](double v) { return v == 0; })) {
    throw input_error(result.where.front(), "the {} is zero in all rows", format.key);
  }
  result.make_starts();
  return result;
}

}  // namespace gamer
