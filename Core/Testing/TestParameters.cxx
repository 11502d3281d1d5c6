// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/FormerNames.h"
#include "Core/Base/Json.h"
#include "Core/Base/Parameters.h"
#include <functional>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {
namespace {

enum class Shape { Ball, FlatBox };

struct Sample {
  double lengthMm = 1.5;
  int count = 3;
  std::uint64_t seed = 7;
  bool useMask = false;
  Shape shape = Shape::FlatBox;
  std::string title = "none";
  Eigen::Vector3d place = {1.0, 2.0, 3.0};
};

ParameterList Describe(Sample& s)
{
  return {Parameter("LengthMm", s.lengthMm, {0, 10, true}, "mm", "How long."),
          Parameter("Count", s.count, {1, 100}, "", "How many.").When("Shape", "ball").Advanced(),
          Parameter("Seed", s.seed, {0, 9223372036854775807.0}, "", "Seed."),
          Parameter("UseMask", s.useMask, "Whether the mask counts."),
          Parameter("Shape", Choice(s.shape, {"ball", "flat-box"}), "Which form."),
          Parameter("Title", s.title, "A name."),
          Parameter("Place", s.place, {-5, 5}, "mm", "Where.")};
}

std::string MessageOf(const std::function<void()>& action)
{
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    return error.what();
  }
  return "";
}

TEST(Parameters, SpellsNamesAsEachReaderExpects)
{
  Sample s;
  ParameterList list = Describe(s);
  EXPECT_EQ(Named(list, "UseMask").Label(), "Use Mask");
  EXPECT_EQ(Named(list, "LengthMm").Key(), "lengthMm");
  EXPECT_EQ(Named(list, "LengthMm").Flag(), "--length-mm");
  double frequency = 1.0;
  const Parameter megahertz("FrequencyMHz", frequency, {}, "MHz", "");
  EXPECT_EQ(megahertz.Label(), "Frequency MHz");
  EXPECT_EQ(megahertz.Key(), "frequencyMHz");
  EXPECT_EQ(megahertz.Flag(), "--frequency-mhz");
}

TEST(Parameters, WritesWhereTheStructLies)
{
  Sample s;
  ParameterList list = Describe(s);
  Named(list, "LengthMm").SetNumber(2.5);
  Named(list, "Count").SetNumber(9);
  Named(list, "UseMask").Set("on");
  Named(list, "Shape").Set("ball");
  Named(list, "Title").Set("a b");
  Named(list, "Place").Set("-1 0.5 4");
  Named(list, "Seed").Set("9007199254740993"); // 2^53 + 1: no double holds it
  EXPECT_EQ(s.lengthMm, 2.5);
  EXPECT_EQ(s.count, 9);
  EXPECT_TRUE(s.useMask);
  EXPECT_EQ(s.shape, Shape::Ball);
  EXPECT_EQ(s.title, "a b");
  EXPECT_EQ(s.place, Eigen::Vector3d(-1.0, 0.5, 4.0));
  EXPECT_EQ(s.seed, 9007199254740993u);
}

TEST(Parameters, ReadsWhatItWrote)
{
  Sample s;
  s.lengthMm = 0.1 + 0.2;
  s.place = {1.0 / 3.0, -0.0, 1e-300};
  Sample copy;
  ParameterList from = Describe(s), to = Describe(copy);
  for (std::size_t i = 0; i < from.size(); ++i)
    to[i].Set(from[i].Text());
  EXPECT_EQ(copy.lengthMm, s.lengthMm);
  EXPECT_EQ(copy.place, s.place);
  EXPECT_EQ(copy.shape, s.shape);
  EXPECT_EQ(copy.title, s.title);
  EXPECT_EQ(from[4].Number(), 1.0);
  EXPECT_EQ(from[3].Number(), 0.0);
}

TEST(Parameters, AChoiceIsNamedByABeginningThatNoOtherHas)
{
  int number = 0;
  Parameter choice("Way", Choice(number, {"log", "log-compressed", "rayleigh"}), "");
  choice.Set("ray");
  EXPECT_EQ(number, 2);
  choice.Set("log"); // a whole name, though another begins with it
  EXPECT_EQ(number, 0);
  EXPECT_NE(MessageOf([&] { choice.Set("l"); }), "");
  EXPECT_EQ(number, 0);
}

TEST(Parameters, ATextMayBeOneOfSomeNames)
{
  std::string metric = "ncc";
  Parameter choice("Metric", Choice(metric, {"local-ncc", "ncc", "lc2"}), "");
  EXPECT_EQ(choice.Number(), 1.0);
  choice.SetNumber(2);
  EXPECT_EQ(metric, "lc2");
  choice.Set("local");
  EXPECT_EQ(choice.Text(), "local-ncc");
  EXPECT_EQ(MessageOf([&] { choice.Check(); }), "");
  EXPECT_NE(DescriptionText({choice}).find(R"("type":"name","value":"local-ncc")"), std::string::npos);
  metric = "ssd";
  EXPECT_EQ(MessageOf([&] { choice.Check(); }), "Metric is 'ssd'; it must be one of local-ncc, ncc, lc2");
}

TEST(Parameters, RefusesWhatIsNoSuchValueAndKeepsTheOld)
{
  Sample s;
  ParameterList list = Describe(s);
  const auto refuse = [&list](const char* name, const char* text) { return MessageOf([&] { Named(list, name).Set(text); }); };
  EXPECT_EQ(refuse("Shape", "cone"), "Shape is 'cone'; it must be one of ball, flat-box");
  EXPECT_EQ(refuse("Count", "2.5"), "Count is '2.5'; it must be a whole number");
  EXPECT_EQ(refuse("UseMask", "yes"), "UseMask is 'yes'; it must be on or off");
  EXPECT_NE(refuse("Place", "1 2"), "");
  EXPECT_NE(refuse("Place", "1 2 3 4"), "");
  EXPECT_NE(refuse("Seed", "-1"), "");
  EXPECT_NE(refuse("Shape", ""), "");
  for (const double number : {2.5, 3e9, -3e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_NE(MessageOf([&] { Named(list, "Count").SetNumber(number); }), "") << number;
  for (const double number : {-1.0, 2.0, 0.5})
    EXPECT_NE(MessageOf([&] { Named(list, "Shape").SetNumber(number); }), "") << number;
  EXPECT_NE(MessageOf([&] { Named(list, "Seed").SetNumber(18446744073709551616.0); }), ""); // 2^64
  EXPECT_NE(MessageOf([&] { Named(list, "Title").SetNumber(1); }), "");
  EXPECT_EQ(s.count, 3);
  EXPECT_EQ(s.shape, Shape::FlatBox);
  EXPECT_EQ(s.place, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(MessageOf([&] { Named(list, "Width"); }),
            "there is no parameter 'Width'; there are LengthMm, Count, Seed, UseMask, Shape, Title, Place");
}

TEST(Parameters, ChecksRangesWithTheirEnds)
{
  Sample s;
  EXPECT_NO_THROW(CheckRanges(s));
  s.lengthMm = 10.0;
  s.count = 1;
  s.place = {-5.0, 5.0, 0.0};
  EXPECT_NO_THROW(CheckRanges(s));
  s.lengthMm = 0.0; // the low end is open
  EXPECT_EQ(MessageOf([&] { CheckRanges(s); }), "LengthMm is 0 mm; it must be in (0, 10]");
  s.lengthMm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(MessageOf([&] { CheckRanges(s); }), "");
  s.lengthMm = 1.0;
  s.count = 101;
  EXPECT_EQ(MessageOf([&] { CheckRanges(s); }), "Count is 101; it must be in [1, 100]");
  s.count = 100;
  s.place.z() = 5.5;
  EXPECT_EQ(MessageOf([&] { CheckRanges(s); }), "Place is (-5 5 5.5) mm; it must be in [-5, 5]");
}

TEST(Parameters, SaysRangesWithoutAnEnd)
{
  double value = -1.0;
  EXPECT_EQ(MessageOf([&] { Parameter("A", value, {0, Unlimited}, "", "").Check(); }), "A is -1; it must be at least 0");
  EXPECT_EQ(MessageOf([&] { Parameter("A", value, {-1, Unlimited, true}, "", "").Check(); }), "A is -1; it must be above -1");
  EXPECT_EQ(MessageOf([&] { Parameter("A", value, {-Unlimited, -2}, "", "").Check(); }), "A is -1; it must be at most -2");
  value = std::numeric_limits<double>::infinity();
  EXPECT_EQ(MessageOf([&] { Parameter("A", value, {}, "", "").Check(); }), "A is inf; it must be finite");
}

TEST(Parameters, ListsCanBeJoinedAndShortened)
{
  Sample a, b;
  ParameterList list = Join({Describe(a), Without(Describe(b), {"Seed", "Title"})});
  ASSERT_EQ(list.size(), 12u);
  EXPECT_EQ(Find(list, "Nothing"), nullptr);
  list[7].SetNumber(4.0);
  EXPECT_EQ(b.lengthMm, 4.0);
  EXPECT_EQ(a.lengthMm, 1.5);
}

TEST(Parameters, OneOfAListCanBeRenamed)
{
  Sample s;
  ParameterList list = Renamed(Describe(s), "Shape", "Form");
  EXPECT_EQ(Find(list, "Shape"), nullptr);
  EXPECT_EQ(Named(list, "Form").Text(), "flat-box");
  EXPECT_EQ(Named(list, "Count").whenName, "Form");
  s.count = 0;
  EXPECT_EQ(MessageOf([&] { CheckRanges(s, "box 2"); }), "box 2: Count is 0; it must be in [1, 100]");
}

TEST(Parameters, TellAllOfThemAsJson)
{
  Sample s;
  const nlohmann::json list = nlohmann::json::parse(DescriptionText(Describe(s)));
  ASSERT_EQ(list.size(), 7u);
  EXPECT_EQ(list[0], (nlohmann::json{{"name", "LengthMm"},
                                     {"label", "Length Mm"},
                                     {"type", "number"},
                                     {"value", 1.5},
                                     {"unit", "mm"},
                                     {"low", 0.0},
                                     {"high", 10.0},
                                     {"open", true},
                                     {"help", "How long."}}));
  EXPECT_EQ(list[1]["when"], (nlohmann::json{{"name", "Shape"}, {"values", {"ball"}}}));
  EXPECT_EQ(list[1]["advanced"], true);
  EXPECT_EQ(list[2]["type"], "integer64");
  EXPECT_EQ(list[4]["choices"], (nlohmann::json{"ball", "flat-box"}));
  EXPECT_EQ(list[4]["value"], 1);
  EXPECT_EQ(list[6]["value"], (nlohmann::json{1.0, 2.0, 3.0}));
  EXPECT_FALSE(list[3].contains("low"));
}

struct Renamed {
  double lengthMm = 1.5;
  bool isFast = false;
};

ParameterList Describe(Renamed& r)
{
  return {Formerly(Parameter("LengthMm", r.lengthMm, {0, 10}, "mm", "How long it is."), "SizeMm", "9.1"),
          Formerly(Formerly(Parameter("IsFast", r.isFast, "Whether it runs."), "Quick", "9.1"), "Hasty", "9.2")};
}

TEST(FormerNames, SetTheSameValueAndWarn)
{
  Renamed values;
  std::string warning;
  const auto warn = [&warning](const std::string& text) { warning += text; };
  ParameterList list = Describe(values);
  NamedOrFormerly(list, "SizeMm", warn).Set("7.5");
  EXPECT_EQ(values.lengthMm, 7.5);
  EXPECT_EQ(warning, "SizeMm is now LengthMm; the former name goes in version 9.1");
  warning.clear();
  NamedOrFormerly(list, "Hasty", warn).Set("on");
  EXPECT_TRUE(values.isFast);
  EXPECT_EQ(warning, "Hasty is now IsFast; the former name goes in version 9.2");
  warning.clear();
  NamedOrFormerly(list, "LengthMm", warn).Set("2");
  EXPECT_EQ(values.lengthMm, 2.0);
  EXPECT_EQ(warning, "");
  EXPECT_EQ(MessageOf([&] { NamedOrFormerly(list, "Sizemm", warn); }),
            "there is no parameter 'Sizemm'; there are LengthMm, IsFast");
}

TEST(FormerNames, AreThoseOfOneDescription)
{
  Renamed values;
  for (int i = 0; i < 3; ++i) // descriptions are made again and again
    EXPECT_EQ(FormerNamesOf(Describe(values)[1]).size(), 2u);
  double other = 0.0;
  ParameterList list{Parameter("LengthMm", other, {0, 10}, "mm", "Of something else."),
                     Parameter("SizeMm", other, {0, 10}, "mm", "Its own.")};
  EXPECT_TRUE(FormerNamesOf(list[0]).empty());
  EXPECT_EQ(&NamedOrFormerly(list, "SizeMm", [](const std::string&) { ADD_FAILURE(); }), &list[1]);
}

TEST(FormerNames, AreDescribed)
{
  Renamed values;
  const auto json = nlohmann::json::parse(DescriptionText(Describe(values)));
  EXPECT_EQ(json[0]["formerly"].dump(), R"([{"name":"SizeMm","until":"9.1"}])");
  EXPECT_EQ(json[1]["formerly"].size(), 2u);
  double other = 0.0;
  EXPECT_FALSE(nlohmann::json::parse(DescriptionText({Parameter("Other", other, {}, "", "One.")}))[0].contains("formerly"));
}

} // namespace
} // namespace echorama
