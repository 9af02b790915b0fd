#include "parallel/cgroup.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace gamer::cgroup_test {
namespace {

namespace fs = std::filesystem;

class CgroupCores : public testing::Test {
 protected:
  CgroupCores()
      : root_(fs::path(testing::TempDir()) /
              ("gamer_cgroup_" +
               std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(root_);
  }
  ~CgroupCores() override { fs::remove_all(root_); }

  void write(const fs::path& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  std::optional<int> cores() { return cgroup_cores(root_ / "membership", root_); }

  fs::path root_;
};

TEST_F(CgroupCores, NoneWithoutFiles) { EXPECT_EQ(cores(), std::nullopt); }

TEST_F(CgroupCores, Version2RoundsUp) {
  write("membership", "0::/job\n");
  write("job/cpu.max", "250000 100000\n");
  EXPECT_EQ(cores(), 3);
}

TEST_F(CgroupCores, Version2MaxIsNoLimit) {
  write("membership", "0::/job\n");
  write("job/cpu.max", "max 100000\n");
  EXPECT_EQ(cores(), std::nullopt);
}

TEST_F(CgroupCores, ParentsLimitToo) {
  write("membership", "0::/slice/job/step\n");
  write("slice/cpu.max", "200000 100000\n");
  write("slice/job/step/cpu.max", "800000 100000\n");
  EXPECT_EQ(cores(), 2);
}

TEST_F(CgroupCores, NamespaceRoot) {
  write("membership", "0::/\n");
  write("cpu.max", "50000 100000\n");
  EXPECT_EQ(cores(), 1);
}

TEST_F(CgroupCores, Version1) {
  write("membership", "5:devices:/job\n4:cpu,cpuacct:/job\n0::/\n");
  write("cpu,cpuacct/job/cpu.cfs_quota_us", "600000\n");
  write("cpu,cpuacct/job/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(cores(), 6);
}

TEST_F(CgroupCores, Version1MinusOneIsNoLimit) {
  write("membership", "4:cpu:/\n");
  write("cpu/cpu.cfs_quota_us", "-1\n");
  write("cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(cores(), std::nullopt);
}

}  // namespace
}  // namespace gamer::cgroup_test
