#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace gamer {

/// A memory of measured parts of galaxies (GalaxyStatistics::name()), so that equal components are
/// measured once. It holds a limited number of bytes, and forgets the parts that were unused for
/// longest. Parts lie in large blocks of their own, which are freed together. Several threads may
/// use it.
class CalibrationMemory {
 public:
  static constexpr std::size_t usual_bytes = std::size_t{64} << 20;
  explicit CalibrationMemory(std::size_t most_bytes = usual_bytes) : most_bytes_(most_bytes) {}

  /// Whether the memory holds the part of this name. Its numbers then fill the beginning of
  /// `numbers`, and zeros the rest.
  bool recall(const std::string& name, std::span<double> numbers);
  /// Keeps the numbers of a part; zeros at their end take no room. `is_measured` is false for
  /// numbers from another source, such as a cache. Such numbers do not count in measured().
  void keep(const std::string& name, std::span<const double> numbers, bool is_measured = true);

  /// Number of recalled parts, and number of parts kept after a measurement.
  std::size_t recalled() const;
  std::size_t measured() const;

 private:
  /// Parts in blocks of their own.
  struct Generation {
    std::unique_ptr<std::pmr::monotonic_buffer_resource> blocks =
        std::make_unique<std::pmr::monotonic_buffer_resource>();
    std::pmr::map<std::pmr::string, std::pmr::vector<double>, std::less<>> parts{blocks.get()};

    /// The numbers of a part, or null.
    const std::pmr::vector<double>* find(const std::string& name) const;
  };
  const std::pmr::vector<double>& add(const std::string& name, std::span<const double> numbers);

  mutable std::mutex mutex_;
  std::size_t most_bytes_;
  std::size_t recalled_ = 0, measured_ = 0;
  /// `recent_` holds the parts used since it was last emptied. When it is full it becomes `older_`,
  /// and the former `older_` is forgotten.
  std::unique_ptr<Generation> recent_ = std::make_unique<Generation>();
  std::unique_ptr<Generation> older_ = std::make_unique<Generation>();
  std::size_t recent_bytes_ = 0;
};

}  // namespace gamer
