// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Memory.h"
#include "Testing/TemporaryFolder.h"

namespace echorama {
namespace {

// A root with files of its own in place of /proc and /sys.
class FreeMemoryOf : public testing::TemporaryFolder {
protected:
  void Place(const std::string& name, const std::string& content) const
  {
    std::filesystem::create_directories((folder / name).parent_path());
    Put(name, content);
  }
  double Free() const { return FreeMemory(folder.string()); }
};

TEST_F(FreeMemoryOf, TheMachineIsWhatItHasLeft)
{
  Place("proc/meminfo", "MemTotal:       16000000 kB\nMemFree:  2000000 kB\nMemAvailable:    8000000 kB\n");
  EXPECT_EQ(Free(), 8000000.0 * 1024.0);
}

TEST_F(FreeMemoryOf, AGroupIsWhatItsLimitsLeaveAndCachedFilesAreFree)
{
  Place("proc/meminfo", "MemAvailable:    8000000 kB\n");
  Place("proc/self/cgroup", "0::/job/step\n");
  Place("sys/fs/cgroup/job/step/memory.max", "max\n");
  Place("sys/fs/cgroup/job/step/memory.current", "900000000\n");
  EXPECT_EQ(Free(), 8000000.0 * 1024.0) << "without a limit";
  Place("sys/fs/cgroup/job/memory.max", "2000000000\n");
  Place("sys/fs/cgroup/job/memory.current", "1500000000\n");
  EXPECT_EQ(Free(), 5e8) << "the limit of the group above";
  Place("sys/fs/cgroup/job/memory.stat", "anon 1200000000\ninactive_file 200000000\nactive_file 100000000\n");
  EXPECT_EQ(Free(), 8e8);
  Place("sys/fs/cgroup/job/step/memory.max", "900000000\n");
  EXPECT_EQ(Free(), 0.0) << "nothing is left";
}

TEST_F(FreeMemoryOf, AGroupOfTheFirstVersion)
{
  Place("proc/meminfo", "MemAvailable:    8000000 kB\n");
  Place("proc/self/cgroup", "9:name=systemd:/\n4:memory:/job\n0::/\n");
  Place("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  Place("sys/fs/cgroup/memory/memory.usage_in_bytes", "1000\n");
  Place("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "3000000000\n");
  Place("sys/fs/cgroup/memory/job/memory.usage_in_bytes", "1000000000\n");
  Place("sys/fs/cgroup/memory/job/memory.stat", "active_file 7\ntotal_inactive_file 100000000\ntotal_active_file 0\n");
  EXPECT_EQ(Free(), 2.1e9);
}

TEST(FreeMemory, OfThisMachineIsSomethingButNotAll)
{
  EXPECT_GT(FreeMemory(), 1e6);
  EXPECT_LT(FreeMemory(), 1e15);
}

TEST(GigabytesText, HasThreeDigitsOrAllBeforeThePoint)
{
  EXPECT_EQ(GigabytesText(0.0), "0 GB");
  EXPECT_EQ(GigabytesText(748.6e6), "0.749 GB");
  EXPECT_EQ(GigabytesText(12e9), "12 GB");
  EXPECT_EQ(GigabytesText(999.6e9), "1000 GB");
  EXPECT_EQ(GigabytesText(12345e9), "12345 GB");
}

} // namespace
} // namespace echorama
