#pragma once

#include <filesystem>
#include <optional>

namespace gamer {

/// The CPU quota of a process in cores, rounded up: the smallest among its control groups and their
/// parents, of version 1 (cpu.cfs_quota_us) or 2 (cpu.max). None when there is no limit or it
/// cannot be read. `membership` is /proc/self/cgroup, `root` /sys/fs/cgroup.
std::optional<int> cgroup_cores(const std::filesystem::path& membership,
                                const std::filesystem::path& root);

}  // namespace gamer
