#include "gamer/scene/spectral_probes.h"

#include <algorithm>
#include <sstream>

#include "core/message.h"

namespace gamer {
namespace {

// Probes of at most this many galaxies choose the spectral nodes.
constexpr std::size_t most_probes = 6;

constexpr const char* light_word = "light";

}  // namespace

std::set<std::size_t> SpectralProbes::rows() const {
  std::set<std::size_t> result;
  for (const Dust& probe : dust) result.insert(probe.row);
  if (farthest) result.insert(farthest->row);
  return result;
}

const Sed* first_light(const Galaxy& galaxy) {
  for (const auto& component : galaxy.components()) {
    if (!component->absorbs()) return component->sed();
  }
  return nullptr;
}

void ProbeChooser::add(const std::shared_ptr<const Galaxy>& galaxy, double redshift,
                       std::size_t row) {
  if (first_light(*galaxy) != nullptr && (!farthest_ || redshift > farthest_->redshift)) {
    farthest_ = {galaxy, redshift, row};
  }
  const auto components = galaxy->components();
  for (std::size_t c = 0; c < components.size(); ++c) {
    if (!components[c]->absorbs()) continue;
    if (known_.emplace(redshift, components[c]->extinction()).second) {
      dust_.push_back({galaxy, redshift, c, row});
    }
  }
}

SpectralProbes ProbeChooser::choose() const {
  std::vector<SpectralProbes::Dust> all = dust_;
  std::ranges::stable_sort(all, {}, &SpectralProbes::Dust::redshift);
  SpectralProbes result;
  result.farthest = farthest_;
  const std::size_t count = std::min(all.size(), most_probes);
  for (std::size_t k = 0; k < count; ++k) {
    result.dust.push_back(all[count == 1 ? 0 : k * (all.size() - 1) / (count - 1)]);
  }
  return result;
}

std::string probes_text(const SpectralProbes& probes,
                        const std::map<std::size_t, std::size_t>& list_rows) {
  std::string text;
  for (const SpectralProbes::Dust& probe : probes.dust) {
    text += fmt::format("{} {}\n", list_rows.at(probe.row) + 1, probe.component + 1);
  }
  if (probes.farthest) {
    text += fmt::format("{} {}\n", list_rows.at(probes.farthest->row) + 1, light_word);
  }
  return text;
}

std::vector<RecordedProbe> read_probes(std::string_view text, const std::string& label) {
  std::vector<RecordedProbe> probes;
  std::istringstream lines{std::string(text)};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::size_t row = 0, component = 0;
    std::string what;
    words >> row >> what;
    const bool is_light = what == light_word;
    if (!is_light) std::istringstream(what) >> component;
    if (row == 0 || (!is_light && component == 0)) {
      throw input_error({label, number, 1}, "'{}' is no row and component of a galaxy", line);
    }
    probes.push_back({row - 1, is_light ? std::nullopt : std::optional(component - 1)});
  }
  return probes;
}

}  // namespace gamer
