#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "gamer/parallel/executor.h"
#include "parallel/cgroup.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

using Cores = std::optional<double>;

Cores smaller(Cores a, Cores b) {
  if (!a || !b) return a ? a : b;
  return std::min(*a, *b);
}

Cores ratio(double quota, double period) {
  if (quota > 0 && period > 0) return quota / period;
  return std::nullopt;
}

/// The quota in the folder of one control group.
Cores quota_of(const fs::path& folder) {
  double quota = 0;
  double period = 0;
  // Version 2: "max 100000" or "150000 100000"; "max" is no number and means no limit.
  if (std::ifstream file(folder / "cpu.max"); file >> quota >> period) return ratio(quota, period);
  std::ifstream quota_file(folder / "cpu.cfs_quota_us");
  std::ifstream period_file(folder / "cpu.cfs_period_us");
  if (quota_file >> quota && period_file >> period) return ratio(quota, period);
  return std::nullopt;
}

/// The smallest quota from the group `path` (absolute, as the kernel writes it) up to `hierarchy`.
Cores quota_up_from(const fs::path& hierarchy, const fs::path& path) {
  Cores cores = quota_of(hierarchy);
  fs::path folder = hierarchy;
  for (const fs::path& part : path.relative_path()) {
    folder /= part;
    cores = smaller(cores, quota_of(folder));
  }
  return cores;
}

bool lists_cpu(std::string_view controllers) {
  while (!controllers.empty()) {
    const std::size_t comma = controllers.find(',');
    if (controllers.substr(0, comma) == "cpu") return true;
    if (comma == std::string_view::npos) break;
    controllers.remove_prefix(comma + 1);
  }
  return false;
}

int affinity_cores() {
  // The kernel refuses masks smaller than its own, and does not tell that size; the mask is doubled
  // until it fits.
  constexpr std::size_t largest_mask = 1 << 20;
  for (std::size_t cpus = CPU_SETSIZE; cpus <= largest_mask; cpus *= 2) {
    std::vector<cpu_set_t> mask(cpus / CPU_SETSIZE);
    const std::size_t bytes = mask.size() * sizeof(cpu_set_t);
    if (sched_getaffinity(0, bytes, mask.data()) == 0) return CPU_COUNT_S(bytes, mask.data());
  }
  return static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

std::optional<int> cgroup_cores(const fs::path& membership, const fs::path& root) {
  Cores cores;
  std::ifstream file(membership);
  // Lines are "number:controllers:path"; version 2 has no controllers.
  for (std::string line; std::getline(file, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path path = line.substr(second + 1);
    if (controllers.empty()) {
      cores = smaller(cores, quota_up_from(root, path));
    } else if (lists_cpu(controllers)) {
      cores = smaller(cores, quota_up_from(root / controllers, path));
    }
  }
  if (!cores) return std::nullopt;
  return static_cast<int>(std::ceil(*cores));
}

int available_cores() {
  int cores = std::max(1, affinity_cores());
  if (const auto quota = cgroup_cores("/proc/self/cgroup", "/sys/fs/cgroup")) {
    cores = std::min(cores, *quota);
  }
  return cores;
}

}  // namespace gamer
