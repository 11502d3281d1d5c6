// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/ParameterJson.h"
#include <gtest/gtest.h>

using namespace echorama;

TEST(ParameterJson, SaysEveryKindOfValueUnderItsKey)
{
  enum class Kind { First, SecondOne } kind = Kind::SecondOne;
  double number = 0.1 + 0.2;
  int count = -3;
  std::uint64_t seed = 9223372036854775807u;
  bool on = true;
  std::string text = "a \"b\"";
  Eigen::Vector3d place(1.0, 2.5, -1.0 / 3.0);
  const auto json = JsonOf({Parameter("WidthMm", number, {}, "mm", ""), Parameter("Count", count, {}, "", ""),
                            Parameter("Seed", seed, {}, "", ""), Parameter("IsOn", on, ""), Parameter("Text", text, ""),
                            Parameter("Kind", Choice(kind, {"first", "second-one"}), ""), Parameter("Place", place, {}, "", "")});
  EXPECT_EQ(json.dump(), R"({"widthMm":0.30000000000000004,"count":-3,"seed":9223372036854775807,"isOn":true,)"
                         R"("text":"a \"b\"","kind":"second-one","place":[1.0,2.5,-0.3333333333333333]})");
}

TEST(ParameterJson, OfNoParametersIsAnEmptyObject)
{
  EXPECT_EQ(JsonOf(ParameterList()).dump(), "{}");
}
