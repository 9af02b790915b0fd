#include "gamer/scene/measured_galaxies.h"

#include <algorithm>
#include <utility>

#include "gamer/core/error.h"

namespace gamer {
namespace {

constexpr std::uint64_t scenes_in_memory = 8;

bool is_unchanged(const Resources::Lookup& lookup, Resources& resources) {
  try {
    return resources.find(lookup.kind, lookup.name, lookup.beside, lookup.suffixes).content ==
           lookup.content;
  } catch (const InputError&) {
    // The galaxy is then made, which reports what is wrong.
    return false;
  }
}

}  // namespace

void MeasuredGalaxies::begin_scene() {
  const std::lock_guard lock(mutex_);
  ++scene_;
  std::erase_if(galaxies_,
                [&](const auto& known) { return known.second.scene + scenes_in_memory < scene_; });
}

std::optional<MeasuredGalaxies::Entry> MeasuredGalaxies::find(const std::string& key,
                                                              Resources& resources) {
  std::optional<Entry> found;
  {
    const std::lock_guard lock(mutex_);
    const auto known = galaxies_.find(key);
    if (known == galaxies_.end()) return std::nullopt;
    known->second.scene = scene_;
    found = known->second.entry;
  }
  const auto is_as_before = [&](const auto& lookup) { return is_unchanged(lookup, resources); };
  if (!std::ranges::all_of(found->lookups, is_as_before)) return std::nullopt;
  return found;
}

std::shared_ptr<const Galaxy> MeasuredGalaxies::latest(const std::string& label) {
  const std::lock_guard lock(mutex_);
  const Used* latest = nullptr;
  for (const auto& [key, known] : galaxies_) {
    const bool is_later = latest == nullptr || known.number > latest->number;
    if (is_later && known.entry.label == label) latest = &known;
  }
  return latest != nullptr ? latest->entry.galaxy : nullptr;
}

void MeasuredGalaxies::add(const std::string& key, Entry entry) {
  const std::lock_guard lock(mutex_);
  galaxies_.insert_or_assign(key, Used{std::move(entry), scene_, ++added_});
}

}  // namespace gamer
