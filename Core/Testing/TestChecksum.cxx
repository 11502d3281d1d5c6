// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Checksum.h"
#include <gtest/gtest.h>
#include <vector>

namespace {

using namespace echorama;

TEST(Checksum, SeesEveryByte)
{
  std::vector<unsigned char> bytes(1003);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    bytes[n] = static_cast<unsigned char>(n * 7);
  const std::string whole = Checksum(bytes.data(), bytes.size());
  EXPECT_EQ(whole.size(), 16u);
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    bytes[n] ^= 1;
    EXPECT_NE(Checksum(bytes.data(), bytes.size()), whole) << n;
    bytes[n] ^= 1;
  }
  EXPECT_EQ(Checksum(bytes.data(), bytes.size()), whole);
  EXPECT_NE(Checksum(bytes.data(), bytes.size() - 1), whole);
  EXPECT_NE(Checksum("\0\0", 1), Checksum("\0\0", 2));
}

// Files hold them: they stay what they are.
TEST(Checksum, IsWhatItWas)
{
  EXPECT_EQ(Checksum("echorama checksum", 17), "ac0e6d4904413094");
  EXPECT_TRUE(IsChecksum("ac0e6d4904413094"));
  EXPECT_FALSE(IsChecksum("ac0e6d490441309"));
  EXPECT_FALSE(IsChecksum("ac0e6d490441309G"));
}

} // namespace
