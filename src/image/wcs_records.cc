#include "image/wcs_records.h"

#include <algorithm>
#include <regex>
#include <utility>

#include "core/message.h"
#include "core/text.h"
#include "image/fits/card_record.h"

namespace gamer {
namespace {

std::string_view keyword_of(std::string_view record) {
  return trimmed(record.substr(0, keyword_width));
}

/// Whether a keyword describes the celestial axes 1 and 2, or their frame.
bool concerns_celestial_axes(const std::string& key) {
  static const std::regex pattern(
      // One axis: papers I and II (Greisen & Calabretta 2002; Calabretta & Greisen 2002).
      "(CTYPE|CRPIX|CRVAL|CDELT|CUNIT|CNAME|CROTA|CRDER|CSYER)[12][A-Z]?|(PC|CD)[12]_[12][A-Z]?|("
      "PC|CD)00[12]00[12]|(PV|PS)[12]_[0-9]+[A-Z]?|PROJP[0-9]|(WCSNAME|LONPOLE|LATPOLE|RADESYS|"
      "EQUINOX)[A-Z]?|RADECSYS|EPOCH|TIMESYS|DATE-OBS|MJD-OBS|MJDREF[IF]?"
      // Distortions: SIP, TNX and ZPX, paper IV.
      "|(A|B|AP|BP)_(ORDER|DMAX|[0-9]+_[0-9]+)|WAT[0-2]_[0-9]+|(CPDIS|CQDIS|CPERR|CQERR)[12][A-Z]?|"
      "DVERR[A-Z]?|(DP|DQ)[12][A-Z]?");
  return std::regex_match(key, pattern);
}

}  // namespace

bool is_printing(std::string_view record) {
  return std::ranges::all_of(record, [](char c) { return c >= ' ' && c <= '~'; });
}

bool has_open_string(std::string_view record) {
  const std::string_view value =
      trimmed(record.substr(std::min(record.size(), keyword_width + std::size_t{2})));
  return value.starts_with('\'') && value.find('\'', 1) == std::string_view::npos;
}

std::vector<std::string> split_records(std::string_view header) {
  std::vector<std::string> records;
  while (!header.empty()) {
    const std::size_t end = std::min(header.find_first_of("\r\n"), record_width);
    std::string record(header.substr(0, end));
    header.remove_prefix(std::min(end, header.size()));
    const bool is_line_end = !header.empty() && (header.front() == '\n' || header.front() == '\r');
    if (is_line_end) header.remove_prefix(1);
    if (record.empty()) continue;
    record.resize(record_width, ' ');
    if (keyword_of(record) == "END") break;
    records.push_back(std::move(record));
  }
  return records;
}

std::vector<std::string> celestial_records(const std::vector<std::string>& header) {
  std::vector<std::string> kept;
  bool keep = false;
  for (const std::string& record : header) {
    const std::string key(keyword_of(record));
    if (key != "CONTINUE") keep = concerns_celestial_axes(key);
    if (keep) kept.push_back(record);
  }
  return kept;
}

void check_self_contained(const std::vector<std::string>& header, const std::string& label) {
  static const std::regex coupling("(PC|CD)[12]_([3-9]|[1-9][0-9])");
  static const std::regex table("C[PQ]DIS[12] *= *'LOOKUP.*", std::regex::icase);
  for (const std::string& record : header) {
    const std::string key(keyword_of(record));
    if (std::regex_match(key, coupling)) {
      const std::size_t equals = record.find('=');
      const bool is_zero =
          equals != std::string::npos && std::atof(record.c_str() + equals + 1) == 0;
      if (is_zero) continue;
      throw input_error({label, 0, 0}, "{}: axes 1 and 2 depend on a further pixel axis", key);
    }
    if (std::regex_match(record, table)) {
      throw input_error({label, 0, 0}, "{}: distortions in look-up tables are not supported", key);
    }
  }
}

std::string make_record(const std::string& key, const std::string& value,
                        const std::string& comment) {
  constexpr int number_width = 20;
  std::string record =
      fmt::format("{:<{}}= {:>{}} / {}", key, keyword_width, value, number_width, comment);
  record.resize(record_width, ' ');
  return record;
}

std::string make_text_record(const std::string& key, const std::string& text,
                             const std::string& comment) {
  constexpr int least_width = 8, quoted_width = 20;
  const std::string quoted = fmt::format("'{:<{}}'", text, least_width);
  return make_record(key, fmt::format("{:<{}}", quoted, quoted_width), comment);
}

}  // namespace gamer
