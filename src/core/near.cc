#include "gamer/core/near.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace gamer {
namespace {

constexpr std::size_t max_names = 3;
constexpr std::size_t max_quoted_bytes = 200;

/// Words of other programs and papers, each with the word of this program.
constexpr std::pair<std::string_view, std::string_view> synonyms[] = {
    {"scale_length", "rh"},
    {"scale_radius", "rh"},
    {"scale_height", "z0"},
    {"color", "sed"},
    {"colour", "sed"},
    {"spectrum", "sed"},
    {"type", "class"},
    {"kind", "class"},
    {"tau", "optical_depth"},
    {"extinction_v", "optical_depth"},
    {"position_angle", "pa"},
    {"incl", "inclination"},
    {"mag", "apparent_magnitude"},
    {"absolute_magnitude", "magnitude"},
    {"z", "redshift"},
    {"n", "index"},
    {"n", "sersic_index"},
    {"q", "axis_ratio"},
    {"r_e", "effective_radius"},
    {"re", "effective_radius"},
    {"r_e", "half_light_radius"},
    {"re", "half_light_radius"},
    {"hlr", "half_light_radius"},
    {"filters", "bands"},
    {"filter", "bands"},
    {"look_at", "target"},
    {"samples", "supersample"},
    {"arms", "count"},
    {"pitch", "pitch_angle"},
    {"file", "output"},
    {"filename", "output"},
    {"shear1", "g1"},
    {"shear2", "g2"},
    {"convergence", "kappa"},
    {"barred", "ngc1300"},
    {"barred", "dusty_barred"},
    {"whirlpool", "m51"},
    {"ngc5194", "m51"},
    {"m100", "ngc4321"},
    {"sombrero", "ngc4594"},
    {"m104", "ngc4594"},
    {"edge_on", "ngc891"},
};

std::size_t distance(const std::string& a, const std::string& b) {
  // Rows of the table in use: i - 2 (for transpositions), i - 1 and i.
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(before, last);
    std::swap(last, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

std::string did_you_mean(std::string_view name, std::span<const std::string> known) {
  const std::string asked = lower(name);
  const std::size_t limit = 1 + asked.size() / 4;
  std::vector<std::pair<std::size_t, std::string>> near;
  for (const std::string& candidate : known) {
    const auto [shorter, longer] = std::minmax({asked.size(), candidate.size()});
    if (longer - shorter > limit) continue;
    const std::size_t d = distance(asked, lower(candidate));
    const bool is_new =
        std::ranges::none_of(near, [&](const auto& n) { return n.second == candidate; });
    if (d <= limit && d < longer && is_new) near.emplace_back(d, candidate);
  }
  for (const auto& synonym : synonyms) {
    const std::string_view word = synonym.first, meant = synonym.second;
    const bool is_new =
        std::ranges::none_of(near, [&](const auto& n) { return n.second == meant; });
    if (word == asked && is_new && std::ranges::find(known, meant) != known.end()) {
      near.emplace_back(0, meant);
    }
  }
  if (near.empty()) return "";
  std::ranges::stable_sort(near, [](const auto& a, const auto& b) { return a.first < b.first; });
  near.resize(std::min(near.size(), max_names));
  std::string result = "; did you mean ";
  for (std::size_t i = 0; i < near.size(); ++i) {
    if (i > 0) result += i + 1 == near.size() ? " or " : ", ";
    result += in_quotes(near[i].second);
  }
  return result + "?";
}

std::string in_quotes(std::string_view text) {
  std::string result = "'";
  for (const char c : text.substr(0, max_quoted_bytes)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result + (text.size() > max_quoted_bytes ? "...'" : "'");
}

}  // namespace gamer
