// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Tracking/Optical/MarkerPattern.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

TEST(MarkerPattern, ChecksumIsThatOfTheStandard)
{
  EXPECT_EQ(Crc24("123456789"), 0x21CF02u); // the check value that catalogues of CRCs give for CRC-24/OPENPGP
  EXPECT_EQ(Crc24(""), 0xB704CEu);
}

TEST(MarkerPattern, NumbersComeBackAndAnyWrongBitIsNoticed)
{
  for (const std::uint32_t id : {0u, 1u, 0x00ff00u, 0xabcdefu, 0xffffffu}) {
    MarkerPattern pattern = MarkerPattern::Of(id);
    ASSERT_TRUE(pattern.Id());
    EXPECT_EQ(*pattern.Id(), id);
    for (auto& row : pattern.bits)
      for (bool& bit : row) {
        bit = !bit;
        EXPECT_FALSE(pattern.Id());
        bit = !bit;
      }
  }
  EXPECT_THROW(MarkerPattern::Of(1u << 24), Error);
}

TEST(MarkerPattern, OneCellOfEachPairIsDark)
{
  const MarkerPattern pattern = MarkerPattern::Of(0x123456);
  for (int column = 0; column < MarkerPattern::columns; ++column)
    for (int row = 0; row < MarkerPattern::rows; row += 2)
      EXPECT_NE(pattern.IsDark(row, column), pattern.IsDark(row + 1, column));
  EXPECT_FALSE(pattern.IsDark(-1, 3) || pattern.IsDark(6, 3) || pattern.IsDark(2, -1) || pattern.IsDark(2, 19));
}

// Upside down, or in a mirror, the fixed columns are wrong.
TEST(MarkerPattern, TurnedOrMirroredItIsNone)
{
  const MarkerPattern pattern = MarkerPattern::Of(0x5a5a5a);
  MarkerPattern mirrored, turned;
  for (std::size_t pair = 0; pair < 3; ++pair)
    for (std::size_t column = 0; column < 19; ++column) {
      mirrored.bits[pair][column] = pattern.bits[pair][18 - column];
      turned.bits[pair][column] = !pattern.bits[2 - pair][18 - column];
    }
  EXPECT_FALSE(mirrored.Id());
  EXPECT_FALSE(turned.Id());
}

} // namespace
