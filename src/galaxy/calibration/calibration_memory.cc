#include "gamer/galaxy/calibration/calibration_memory.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace gamer {
namespace {

/// Bytes of a part besides its name and numbers.
constexpr std::size_t overhead = 128;

}  // namespace

const std::pmr::vector<double>* CalibrationMemory::Generation::find(const std::string& name) const {
  const auto found = parts.find(std::string_view(name));
  return found != parts.end() ? &found->second : nullptr;
}

bool CalibrationMemory::recall(const std::string& name, std::span<double> numbers) {
  const std::lock_guard lock(mutex_);
  const std::pmr::vector<double>* found = recent_->find(name);
  if (found == nullptr) {
    const std::pmr::vector<double>* const older = older_->find(name);
    if (older == nullptr) return false;
    const std::vector<double> own(older->begin(), older->end());
    found = &add(name, own);
  }
  if (found->size() > numbers.size()) return false;
  std::ranges::fill(std::ranges::copy(*found, numbers.begin()).out, numbers.end(), 0.0);
  ++recalled_;
  return true;
}

void CalibrationMemory::keep(const std::string& name, std::span<const double> numbers,
                             bool is_measured) {
  while (!numbers.empty() && numbers.back() == 0) numbers = numbers.first(numbers.size() - 1);
  const std::lock_guard lock(mutex_);
  add(name, numbers);
  if (is_measured) ++measured_;
}

const std::pmr::vector<double>& CalibrationMemory::add(const std::string& name,
                                                       std::span<const double> numbers) {
  const std::size_t bytes = name.size() + numbers.size() * sizeof(double) + overhead;
  if (recent_bytes_ + bytes > most_bytes_ / 2) {
    older_ = std::exchange(recent_, std::make_unique<Generation>());
    recent_bytes_ = 0;
  }
  recent_bytes_ += bytes;
  std::pmr::vector<double>& kept = recent_->parts[std::pmr::string(name, recent_->blocks.get())];
  kept.assign(numbers.begin(), numbers.end());
  return kept;
}

std::size_t CalibrationMemory::recalled() const {
  const std::lock_guard lock(mutex_);
  return recalled_;
}

std::size_t CalibrationMemory::measured() const {
  const std::lock_guard lock(mutex_);
  return measured_;
}

}  // namespace gamer
