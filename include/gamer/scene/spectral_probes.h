#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// The galaxies of an image whose dust and light decide its spectral nodes.
struct SpectralProbes {
  /// A component of dust.
  struct Dust {
    std::shared_ptr<const Galaxy> galaxy;
    double redshift;
    std::size_t component;
    std::size_t row;  ///< of the catalogue, from 0
  };
  /// A galaxy that shines.
  struct Light {
    std::shared_ptr<const Galaxy> galaxy;
    double redshift;
    std::size_t row;
  };
  std::vector<Dust> dust;         ///< by redshift
  std::optional<Light> farthest;  ///< the galaxy of the greatest redshift that shines

  /// The rows without repetition, ascending.
  std::set<std::size_t> rows() const;
};

/// The SED of a galaxy's first component that shines; null where there is none.
const Sed* first_light(const Galaxy& galaxy);

/// Chooses the probes among an image's galaxies. Candidates are the first galaxy with each pair of
/// redshift and extinction curve. At most six are taken, evenly spread over the redshifts.
class ProbeChooser {
 public:
  void add(const std::shared_ptr<const Galaxy>& galaxy, double redshift, std::size_t row);
  SpectralProbes choose() const;

 private:
  std::set<std::pair<double, const ExtinctionCurve*>> known_;
  std::vector<SpectralProbes::Dust> dust_;  ///< in the order of add()
  std::optional<SpectralProbes::Light> farthest_;
};

/// Name of the recorded text with the probes of a region; probes may lie outside the region.
inline constexpr const char* recorded_probes = "scene.probes";

/// The place of a probe in a recorded scene list.
struct RecordedProbe {
  std::size_t row;                       ///< of the list, from 0
  std::optional<std::size_t> component;  ///< component of dust; none for the farthest light
};

/// A line for each probe: its row of the list, from 1, and the number of its component of dust,
/// from 1, or "light". `list_rows` maps rows of the catalogue to the list.
std::string probes_text(const SpectralProbes& probes,
                        const std::map<std::size_t, std::size_t>& list_rows);
/// Reads such a text. Throws InputError with `label`.
std::vector<RecordedProbe> read_probes(std::string_view text, const std::string& label);

}  // namespace gamer
