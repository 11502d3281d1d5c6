// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Stitching/RowField.h"
#include <gtest/gtest.h>

using namespace echorama;

TEST(RowField, NumbersTheVoxelsOfItsSpans)
{
  const GridBox box{{2, 3, 4}, {10, 2, 2}};
  const auto spans = std::make_shared<const RowSpans>(box, std::vector<int>{2, 5, 0, 11}, std::vector<int>{4, 12, 0, 12});
  EXPECT_EQ(spans->Count(), 2 + 7 + 0 + 1);
  EXPECT_EQ(spans->Start(3, 4), 0);
  EXPECT_EQ(spans->Start(4, 4), 2);
  EXPECT_EQ(spans->Start(4, 5), 9);
  EXPECT_EQ(spans->First(4, 4), 5);
  EXPECT_EQ(spans->End(4, 4), 12);
  EXPECT_EQ(spans->First(3, 5), spans->End(3, 5));
  EXPECT_EQ(spans->First(9, 4), spans->End(9, 4)) << "rows outside of the box are empty";
  RowField<int> field(spans);
  EXPECT_EQ(field.Row(3, 5), nullptr);
  field.Row(4, 5)[0] = 1;
  EXPECT_EQ(field.values.back(), 1);
  EXPECT_EQ(field.values.front(), 0);
}

TEST(RowField, RefusesSpansOutsideOfTheirBox)
{
  const GridBox box{{0, 0, 0}, {4, 1, 1}};
  EXPECT_THROW(RowSpans(box, {0}, {5}), Error);
  EXPECT_THROW(RowSpans(box, {-1}, {2}), Error);
  EXPECT_THROW(RowSpans(box, {3}, {2}), Error);
  EXPECT_THROW(RowSpans(box, {0, 1}, {1, 2}), Error);
  EXPECT_EQ(RowSpans(GridBox{}, {}, {}).Count(), 0);
}
