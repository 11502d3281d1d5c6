// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "SomeProject.h"
#include "Widgets/Session/AlignmentSession.h"
#include <cmath>

using namespace echorama;

namespace {

class MeasurementFile : public FolderTest {
protected:
  // A good project whose measurements are replaced.
  std::string Refusal(const std::string& list)
  {
    WriteProject(Path("good.json"), SomeProject(2, Path()));
    std::string text = Text(Path("good.json"));
    const std::string empty = "\"measurements\": []";
    const std::size_t at = text.find(empty);
    EXPECT_NE(at, std::string::npos);
    Put(Path("p.json"), text.replace(at, empty.size(), "\"measurements\": " + list));
    try {
      ReadProject(Path("p.json"));
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  }
};

} // namespace

TEST(Measurement, DistancesAndAnglesAreThoseOfTheWorld)
{
  EXPECT_DOUBLE_EQ((Measurement{1, {{1, 2, 3}, {3, 5, 9}}}.Value()), 7.0);
  EXPECT_DOUBLE_EQ((Measurement{1, {{5, 0, 0}, {0, 0, 0}, {0, 0, 2}}}.Value()), 90.0);
  EXPECT_NEAR((Measurement{1, {{1, 1, 1}, {0, 0, 0}, {2, 2, 2}}}.Value()), 0.0, 1e-12);
  EXPECT_NEAR((Measurement{1, {{1, 1, 1}, {0, 0, 0}, {-1, -1, -1}}}.Value()), 180.0, 1e-12);
  EXPECT_NEAR((Measurement{1, {{1, 0, 0}, {0, 0, 0}, {1, 1e-9, 0}}}.Value()), 180.0 / M_PI * 1e-9, 1e-15) << "no loss near 0";
  EXPECT_TRUE(std::isnan((Measurement{1, {{1, 0, 0}, {1, 0, 0}, {2, 1, 0}}}.Value()))) << "an arm of no length";
}

TEST(Measurement, TheyAreEditsAndStayWhereTheyAre)
{
  AlignmentSession session;
  EXPECT_EQ(session.NextMeasurementNumber(), 1);
  session.SetMeasurement({1, {{0, 0, 0}, {3, 4, 0}}});
  session.SetMeasurement({7, {{1, 0, 0}, {0, 0, 0}, {0, 1, 0}}});
  EXPECT_EQ(session.NextMeasurementNumber(), 8);
  session.SetMeasurement({1, {{0, 0, 0}, {6, 8, 0}}});
  ASSERT_EQ(session.State().measurements.size(), 2u) << "it changed, and is no other";
  EXPECT_DOUBLE_EQ(session.State().measurements[0].Value(), 10.0);
  session.Undo();
  EXPECT_DOUBLE_EQ(session.State().measurements[0].Value(), 5.0);
  session.RemoveMeasurement(1);
  EXPECT_EQ(session.State().measurements.size(), 1u);
  session.ClearMeasurements();
  EXPECT_TRUE(session.State().measurements.empty());
  session.Undo();
  session.Undo();
  EXPECT_EQ(session.State().measurements.size(), 2u);
  const SessionState before = session.State();
  const int entries = session.UndoCount();
  EXPECT_THROW(session.RemoveMeasurement(3), Error);
  EXPECT_THROW(session.SetMeasurement({0, {{0, 0, 0}, {1, 0, 0}}}), Error);
  EXPECT_THROW(session.SetMeasurement({2, {{0, 0, 0}}}), Error);
  EXPECT_THROW(session.SetMeasurement({2, {{0, 0, 0}, {0, NAN, 0}}}), Error);
  EXPECT_TRUE(session.State() == before);
  EXPECT_EQ(session.UndoCount(), entries);
}

TEST_F(MeasurementFile, EveryBitComesBackAndWhatIsNoneIsRefused)
{
  Project project = SomeProject(2, Path());
  project.state.measurements = {{2, {{1.0 / 3.0, -0.0, 5e-324}, {1, 2, 3}}}, {1, {{1, 0, 0}, {0, 0, 0}, {0, 1, 1e300}}}};
  WriteProject(Path("m.json"), project);
  EXPECT_TRUE(ReadProject(Path("m.json")) == project);
  const auto refused = [this](const char* list, const char* words) {
    const std::string told = Refusal(list);
    EXPECT_NE(told.find(words), std::string::npos) << list << ": " << told;
  };
  refused("3", "measurements: a list");
  refused("[{\"number\": 1}]", "measurement 1");
  refused("[{\"number\": 0, \"points\": [[1, 2, 3], [1, 2, 4]]}]", "measurement 1, number");
  refused("[{\"number\": 1, \"points\": [[1, 2, 3]]}]", "measurement 1, points");
  refused("[{\"number\": 1, \"points\": [[1, 2, 3], [1, 2]]}]", "measurement 1, points");
  refused("[{\"number\": 1, \"points\": [[1, 2, 3], [1, 2, 4]]}, {\"number\": 1, \"points\": [[1, 2, 3], [1, 2, 4]]}]",
          "measurement 2, number");
}
