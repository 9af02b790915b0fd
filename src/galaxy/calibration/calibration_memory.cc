#include "gamer/galaxy/calibration/calibration_memory.h"

#include <algorithm>
#include <utility>

namespace gamer {
namespace {

/// Bytes of a part besides its name and numbers.
constexpr std::size_t overhead = 128;

}  // namespace

bool CalibrationMemory::recall(const std::string& name, std::span<double> numbers) {
  const std::lock_guard lock(mutex_);
  auto found = recent_.find(name);
  if (found == recent_.end()) {
    const auto older = older_.find(name);
    if (older == older_.end()) return false;
    std::vector<double> own = std::move(older->second);
    older_.erase(older);
    add(name, std::move(own));
    found = recent_.find(name);
  }
  if (found->second.size() > numbers.size()) return false;
  std::ranges::fill(std::ranges::copy(found->second, numbers.begin()).out, numbers.end(), 0.0);
  ++recalled_;
  return true;
}

void CalibrationMemory::keep(const std::string& name, std::span<const double> numbers) {
  while (!numbers.empty() && numbers.back() == 0) numbers = numbers.first(numbers.size() - 1);
  const std::lock_guard lock(mutex_);
  add(name, {numbers.begin(), numbers.end()});
  ++measured_;
}

void CalibrationMemory::add(const std::string& name, std::vector<double> numbers) {
  const std::size_t bytes = name.size() + numbers.size() * sizeof(double) + overhead;
  if (recent_bytes_ + bytes > most_bytes_ / 2) {
    older_ = std::exchange(recent_, {});
    recent_bytes_ = 0;
  }
  recent_bytes_ += bytes;
  recent_.insert_or_assign(name, std::move(numbers));
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
