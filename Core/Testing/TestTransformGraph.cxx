// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Geometry/TransformGraph.h"
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

using Names = std::vector<std::string>;

Eigen::Affine3d SomeAffine(std::uint64_t seed, double scale = 1.0)
{
  Random random(seed);
  Eigen::Affine3d a;
  a.linear() = scale * ExpRotation(2.0 * random.Direction());
  a.translation() = 50.0 * random.Direction();
  a.makeAffine();
  return a;
}

NamedTransform Link(const std::string& name, const Eigen::Affine3d& matrix = Eigen::Affine3d::Identity(),
                    TransformStatus status = TransformStatus::Valid, std::optional<double> errorMm = {})
{
  const auto frames = FramesOf(name);
  EXPECT_TRUE(frames) << name;
  return {frames->first, frames->second, matrix, status, errorMm, ""};
}

// The graph of a tracked probe whose world moves with a reference.
TransformGraph TrackedProbe()
{
  return TransformGraph({Link("ImageToProbe", SomeAffine(1, 0.08)), Link("ProbeToTracker", SomeAffine(2)),
                         Link("ReferenceToTracker", SomeAffine(3)), Link("PhantomToReference", SomeAffine(4))});
}

double Difference(const Eigen::Affine3d& a, const Eigen::Affine3d& b)
{
  double largest = 0.0;
  for (int i = 0; i < 16; ++i)
    largest = std::max(largest, std::abs(a.data()[i] - b.data()[i]));
  return largest;
}

template <class Function>
void ExpectError(const Function& function, Error::Kind kind, const Names& words)
{
  try {
    function();
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what() << " lacks " << word;
  }
}

} // namespace

TEST(TransformGraph, NamesAreCutWherePlusCutsThem)
{
  using Frames = std::pair<std::string, std::string>;
  EXPECT_EQ(FramesOf("ImageToProbe"), Frames("Image", "Probe"));
  EXPECT_EQ(FramesOf("ImageToProbeTransform"), Frames("Image", "Probe"));
  EXPECT_EQ(FramesOf("StylusTipToStylus"), Frames("StylusTip", "Stylus"));
  EXPECT_EQ(FramesOf("TorsoToTorsoRef"), Frames("Torso", "TorsoRef"));
  EXPECT_EQ(FramesOf("TestToolToTracker"), Frames("TestTool", "Tracker"));
  EXPECT_EQ(FramesOf("ImageToToolTip"), Frames("Image", "ToolTip"));
  EXPECT_EQ(FramesOf("TransducerOriginPixelToTransducerOrigin"), Frames("TransducerOriginPixel", "TransducerOrigin"));
  EXPECT_EQ(FramesOf("StepperEncoderValuesToStepperHomeTransform"), Frames("StepperEncoderValues", "StepperHome"));
  EXPECT_EQ(FramesOf("imageToProbe"), Frames("Image", "Probe"));
  EXPECT_EQ(FramesOf("Marker_1To2ndTracker"), Frames("Marker_1", "2ndTracker"));
  EXPECT_EQ(FramesOf("axleToBed"), Frames("Axle", "Bed"));
  EXPECT_EQ(FramesOf("zoomToBed"), Frames("Zoom", "Bed"));
  EXPECT_FALSE(FramesOf("BedToaxle"));
  EXPECT_FALSE(FramesOf("BedTozoom"));
  for (const char* name : {"", "To", "Image", "ImageTo", "ToProbe", "ImageToTransform", "AToBToC", "ImagetoProbe", "Imagetoprobe",
                           "TotoTotoro", "Torso", "Image ToProbe", "ImageToProbe ", "Image\nToProbe", "Transform",
                           "ImageToProbeTransformStatus", "Timestamp", "FrameNumber"})
    EXPECT_FALSE(FramesOf(name)) << name;
}

TEST(TransformGraph, StatusWords)
{
  for (const TransformStatus status : {TransformStatus::Valid, TransformStatus::Missing, TransformStatus::OutOfRange})
    EXPECT_EQ(TransformStatusOf(TransformStatusText(status)), status);
  EXPECT_EQ(TransformStatusOf("OUT_OF_VOLUME"), TransformStatus::OutOfRange);
  EXPECT_EQ(TransformStatusOf("TOOL_OUT_OF_VIEW"), TransformStatus::OutOfRange);
  EXPECT_EQ(TransformStatusOf("ok"), TransformStatus::Valid);
  for (const char* word : {"INVALID", "REQ_TIMEOUT", "UNKNOWN", "", "OKAY"})
    EXPECT_EQ(TransformStatusOf(word), TransformStatus::Missing) << word;
}

TEST(TransformGraph, ComposesAlongTheWay)
{
  const TransformGraph graph = TrackedProbe();
  const ComposedTransform found = graph.Find("Image", "Phantom");
  EXPECT_EQ(found.path,
            (Names{"ImageToProbe", "ProbeToTracker", "inverse of ReferenceToTracker", "inverse of PhantomToReference"}));
  const Eigen::Affine3d expected = SomeAffine(4).inverse() * SomeAffine(3).inverse() * SomeAffine(2) * SomeAffine(1, 0.08);
  EXPECT_LT(Difference(found.matrix, expected), 1e-12);
  EXPECT_EQ(found.status, TransformStatus::Valid);
  EXPECT_FALSE(found.errorMm);
  EXPECT_LT(Difference(graph.Find("Phantom", "Image").matrix * found.matrix, Eigen::Affine3d::Identity()), 1e-11);

  // One edge, as it was given: to the last bit.
  EXPECT_EQ(graph.Find("Image", "Probe").matrix.matrix(), SomeAffine(1, 0.08).matrix());
  const ComposedTransform none = graph.Find("Probe", "Probe");
  EXPECT_EQ(none.matrix.matrix(), Eigen::Matrix4d::Identity());
  EXPECT_TRUE(none.path.empty());
  EXPECT_EQ(graph.Frames(), (Names{"Image", "Phantom", "Probe", "Reference", "Tracker"}));
  EXPECT_EQ(graph.ReachableFrom("Image"), (Names{"Phantom", "Probe", "Reference", "Tracker"}));
}

TEST(TransformGraph, SetReplaces)
{
  TransformGraph graph = TrackedProbe();
  graph.Set(Link("ProbeToTracker", SomeAffine(9), TransformStatus::Missing));
  EXPECT_EQ(graph.Edges().size(), 4u);
  EXPECT_EQ(graph.Find("Probe", "Tracker").matrix.matrix(), SomeAffine(9).matrix());
  EXPECT_EQ(graph.Find("Image", "Reference").status, TransformStatus::Missing);
  ASSERT_TRUE(graph.Edge("Probe", "Tracker"));
  EXPECT_EQ(graph.Edge("Probe", "Tracker")->Name(), "ProbeToTracker");
  EXPECT_FALSE(graph.Edge("Tracker", "Probe"));
}

TEST(TransformGraph, WorstStatusAndCombinedError)
{
  TransformGraph graph({Link("AToB", SomeAffine(1), TransformStatus::OutOfRange, 3.0), Link("CToB", SomeAffine(2), {}, 4.0),
                        Link("CToD", SomeAffine(3), TransformStatus::Missing)});
  const ComposedTransform both = graph.Find("A", "C");
  EXPECT_EQ(both.status, TransformStatus::OutOfRange);
  ASSERT_TRUE(both.errorMm);
  EXPECT_DOUBLE_EQ(*both.errorMm, 5.0);
  EXPECT_TRUE(both.errorIsComplete);
  const ComposedTransform all = graph.Find("D", "A");
  EXPECT_EQ(all.status, TransformStatus::Missing) << "worse than out of range";
  EXPECT_DOUBLE_EQ(all.errorMm.value_or(0.0), 5.0);
  EXPECT_FALSE(all.errorIsComplete) << "CToD states none";
  EXPECT_FALSE(graph.Find("C", "D").errorMm);
}

TEST(TransformGraph, TheShortestWayAndThenTheFirstByName)
{
  // A-X-Z and A-B-Z are equally short; A-C-D-Z is longer. The order of Set plays no role.
  const std::vector<NamedTransform> edges{Link("AToX"), Link("XToZ"), Link("CToA"), Link("DToC"),
                                          Link("DToZ"), Link("ZToB"), Link("BToA")};
  std::vector<NamedTransform> reversed(edges.rbegin(), edges.rend());
  for (const auto& order : {edges, reversed})
    EXPECT_EQ(TransformGraph(order).Find("A", "Z").path, (Names{"inverse of BToA", "inverse of ZToB"}));
  TransformGraph graph(edges);
  graph.Set(Link("ZToA"));
  EXPECT_EQ(graph.Find("A", "Z").path, (Names{"inverse of ZToA"}));
  graph.Set(Link("AToZ"));
  EXPECT_EQ(graph.Find("A", "Z").path, (Names{"AToZ"})) << "the edge along the way, not the other's inverse";
  EXPECT_EQ(graph.Find("Z", "A").path, (Names{"ZToA"}));
  graph.Set(Link("AToZ", {}, TransformStatus::Missing));
  EXPECT_EQ(graph.Find("A", "Z").path, (Names{"inverse of ZToA"})) << "the one of the pair that is known";
  graph.Set(Link("ZToA", {}, TransformStatus::Missing));
  EXPECT_EQ(graph.Find("A", "Z").path, (Names{"AToZ"})) << "no longer way, whatever the status";
}

TEST(TransformGraph, AValidEdgeCountsForMoreThanItsInverseThatIsMissing)
{
  NamedTransform along, against;
  along.from = against.to = "A";
  along.to = against.from = "B";
  along.status = TransformStatus::Missing;
  along.matrix.matrix().setConstant(std::numeric_limits<double>::quiet_NaN()); // nothing was measured
  against.matrix.translation() = Eigen::Vector3d(1, 2, 3);
  const ComposedTransform found = TransformGraph({along, against}).Find("A", "B");
  EXPECT_EQ(found.status, TransformStatus::Valid);
  EXPECT_EQ(found.path, std::vector<std::string>{"inverse of BToA"});
  EXPECT_EQ(found.matrix.translation(), Eigen::Vector3d(-1, -2, -3));
}

TEST(TransformGraph, SingularMatricesLeadOneWay)
{
  Eigen::Affine3d flat = Eigen::Affine3d::Identity();
  flat.linear().col(2).setZero();
  TransformGraph graph({Link("ImageToProbe", flat), Link("ProbeToTracker", SomeAffine(1))});
  EXPECT_NO_THROW(graph.Find("Image", "Tracker"));
  EXPECT_TRUE(graph.CheckCycles().empty());
  ExpectError([&] { graph.Find("Tracker", "Image"); }, Error::Kind::NotPossible, {"from Tracker to Image", "to Probe"});
  EXPECT_EQ(graph.ReachableFrom("Tracker"), Names{"Probe"});
  graph.Set(Link("ImageToProbe", flat, TransformStatus::Missing));
  const ComposedTransform unknown = graph.Find("Tracker", "Image");
  EXPECT_EQ(unknown.status, TransformStatus::Missing) << "a zero matrix where nothing was measured: the way stays";
  EXPECT_TRUE(unknown.matrix.translation().array().isNaN().all()) << "and is no transform by mistake";

  Eigen::Affine3d thin = Eigen::Affine3d::Identity(); // small is not singular
  thin.linear() *= 1e-9;
  graph.Set(Link("ImageToProbe", thin));
  EXPECT_DOUBLE_EQ(graph.Find("Probe", "Image").matrix(2, 2), 1e9);

  // Flat is what is thinner than the rounding of doubles leaves it, 1e-12.
  for (const double thickness : {2e-12, 5e-13}) {
    Eigen::Affine3d plate = Eigen::Affine3d::Identity();
    plate.linear()(2, 2) = thickness;
    EXPECT_EQ(TransformGraph({Link("ImageToProbe", plate)}).ReachableFrom("Probe").size(), thickness > 1e-12 ? 1u : 0u);
  }
}

TEST(TransformGraph, SaysWhatIsMissing)
{
  TransformGraph graph = TrackedProbe();
  graph.Set(Link("StylusTipToStylus"));
  ExpectError([&] { graph.Find("Image", "World"); }, Error::Kind::BadInput, {"\"World\"", "Image, Phantom, Probe"});
  ExpectError([&] { graph.Find("World", "World"); }, Error::Kind::BadInput, {"\"World\""});
  ExpectError([&] { graph.Find("Image", "Stylus"); }, Error::Kind::NotPossible, {"from Image to Stylus", "Phantom, Probe"});
  ExpectError([] { TransformGraph().Find("A", "B"); }, Error::Kind::BadInput, {"none at all"});
}

TEST(TransformGraph, RefusesBadEdges)
{
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  TransformGraph graph;
  const auto refused = [&](NamedTransform edge, const std::string& words) {
    ExpectError([&] { graph.Set(edge); }, Error::Kind::BadInput, {words});
  };
  const NamedTransform good = Link("AToB");
  NamedTransform bad = good;
  bad.to = "A";
  refused(bad, "AToA leads from a frame to itself");
  bad.to = "";
  refused(bad, "\"\"");
  bad.to = "B C";
  refused(bad, "blanks");
  bad = good;
  bad.matrix.translation()[1] = nan;
  refused(bad, "AToB: the matrix");
  bad.matrix.matrix() = Eigen::Matrix4d::Identity() * 2.0;
  refused(bad, "last row");
  bad = good;
  bad.errorMm = -1.0;
  refused(bad, "error");
  bad.errorMm = nan;
  refused(bad, "error");
  EXPECT_TRUE(graph.Empty());
  bad = good;
  bad.matrix.translation()[1] = nan;
  bad.status = TransformStatus::Missing;
  graph.Set(bad); // no measurement, no matrix
  EXPECT_EQ(graph.Find("A", "B").status, TransformStatus::Missing);
}

TEST(TransformGraph, CyclesThatClose)
{
  TransformGraph graph = TrackedProbe();
  EXPECT_TRUE(graph.CheckCycles({0.0, 0.0, 100.0}).empty()) << "a tree has no cycle, however strict the tolerance is";
  graph.Set({"Image", "Phantom", graph.Find("Image", "Phantom").matrix, {}, {}, ""});
  graph.Set({"Tracker", "Image", graph.Find("Tracker", "Image").matrix, {}, {}, ""});
  graph.Set({"Tracker", "Probe", graph.Find("Tracker", "Probe").matrix, {}, {}, ""});
  EXPECT_TRUE(graph.CheckCycles({1e-9, 1e-6, 100.0}).empty());
  EXPECT_TRUE(TransformGraph({Link("AToB"), Link("BToA")}).CheckCycles({0.0, 0.0, 100.0}).empty()) << "exactly";
}

TEST(TransformGraph, OpenCyclesAreMeasuredInMillimetres)
{
  // 0.08 mm pixels: an error of 2 mm is 25 pixels, and must be reported as 2 mm, wherever the cycle was found to begin.
  TransformGraph graph = TrackedProbe();
  Eigen::Affine3d wrong = graph.Find("Image", "Reference").matrix;
  wrong.pretranslate(Eigen::Vector3d(0.0, 2.0, 0.0));
  graph.Set({"Image", "Reference", wrong, {}, {}, ""});
  std::vector<OpenCycle> open = graph.CheckCycles();
  ASSERT_EQ(open.size(), 1u);
  EXPECT_NEAR(open[0].mm, 2.0, 1e-9);
  EXPECT_NEAR(open[0].degrees, 0.0, 1e-5);
  EXPECT_NE(open[0].frame, "Image");
  EXPECT_EQ(open[0].edges.size(), 4u) << open[0].Text();
  EXPECT_NE(open[0].Text().find("off by 2 mm"), std::string::npos) << open[0].Text();
  for (const char* name : {"ImageToReference", "ReferenceToTracker", "ProbeToTracker", "ImageToProbe"})
    EXPECT_NE(open[0].Text().find(name), std::string::npos) << open[0].Text();
  EXPECT_TRUE(graph.CheckCycles({2.1, 1.0, 100.0}).empty());

  // A turn by one degree moves what is 100 mm away by 1.745 mm.
  graph = TransformGraph(
      {Link("AToB", SomeAffine(5)),
       Link("BToA", SomeAffine(5).inverse() * Eigen::AngleAxisd(RadiansPerDegree, Eigen::Vector3d(1, 2, 2) / 3.0))});
  open = graph.CheckCycles();
  ASSERT_EQ(open.size(), 1u) << "the two directions of one pair are a cycle too";
  EXPECT_NEAR(open[0].degrees, 1.0, 1e-6);
  EXPECT_GT(open[0].mm, 1.74);
  EXPECT_LT(open[0].mm, 2.65); // 1.75 by the lever, at most 0.88 by where it turns
  EXPECT_EQ(graph.CheckCycles({1.2, 10.0, 100.0}).size(), 1u);
  EXPECT_TRUE(graph.CheckCycles({1.2, 10.0, 10.0}).empty()) << "a shorter lever moves less";
  EXPECT_EQ(graph.CheckCycles({10.0, 1.1, 100.0}).size(), 0u);
  EXPECT_EQ(graph.CheckCycles({10.0, 0.9, 100.0}).size(), 1u);
  graph.Set(Link("BToA", SomeAffine(5), TransformStatus::OutOfRange));
  EXPECT_TRUE(graph.CheckCycles().empty()) << "what is not valid is not compared";
}

// A ring of four units that does not close by 2 mm: in all orders, and with each edge the wrong one.
TEST(TransformGraph, OpenCyclesAreMeasuredWhereTheUnitIsLargest)
{
  std::array<double, 4> units{0.08, 0.3, 0.5, 1.0};
  do
    for (std::size_t wrong = 0; wrong < 4; ++wrong)
      for (const bool turned : {false, true}) {
        TransformGraph graph;
        for (std::size_t i = 0; i < 4; ++i) {
          std::size_t from = i, to = (i + 1) % 4;
          if (turned && i % 2 == 0)
            std::swap(from, to);
          const Eigen::Vector3d off(0.0, i == wrong ? 2.0 : 0.0, 0.0); // mm
          const auto toWorld = [&](std::size_t frame) { return SomeAffine(20 + frame, units[frame]); };
          const std::string names = "ABCD";
          const Eigen::Affine3d matrix = toWorld(to).inverse() * Eigen::Translation3d(off) * toWorld(from);
          graph.Set({names.substr(from, 1), names.substr(to, 1), matrix, {}, {}, ""});
        }
        const auto open = graph.CheckCycles();
        ASSERT_EQ(open.size(), 1u);
        const auto largest = std::max_element(units.begin(), units.end()) - units.begin();
        EXPECT_EQ(open[0].frame, std::string(1, static_cast<char>('A' + largest)));
        EXPECT_NEAR(open[0].mm, 2.0, 1e-9);
        EXPECT_EQ(open[0].edges.size(), 4u);
      }
  while (std::next_permutation(units.begin(), units.end()));
}

// C, D and E make a cycle that hangs on A by B: it is told without the way there.
TEST(TransformGraph, ACycleIsToldWithoutTheWayToIt)
{
  Eigen::Affine3d wrong = Eigen::Affine3d::Identity();
  wrong.linear()(0, 0) = 1.02; // stretched by 2% along one axis: 2 mm at 100 mm
  TransformGraph graph(
      {Link("AToB", SomeAffine(1)), Link("BToC", SomeAffine(2)), Link("CToD"), Link("CToE"), Link("DToE", wrong)});
  const auto open = graph.CheckCycles({1.0, 1.0, 100.0});
  ASSERT_EQ(open.size(), 1u);
  EXPECT_EQ(open[0].edges, (Names{"DToE", "inverse of CToE", "CToD"}));
  EXPECT_NEAR(open[0].mm, 2.0, 1e-9);
  EXPECT_TRUE(graph.CheckCycles({2.1, 1.0, 100.0}).empty());
}

TEST(TransformGraph, EveryWrongEdgeOpensACycle)
{
  // A complete graph of six frames at random places, in which one edge is wrong: it lies on some fundamental cycle.
  for (int wrong = 0; wrong < 15; ++wrong) {
    TransformGraph graph;
    int edge = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = i + 1; j < 6; ++j, ++edge) {
        Eigen::Affine3d matrix = SomeAffine(static_cast<std::uint64_t>(j)).inverse() * SomeAffine(static_cast<std::uint64_t>(i));
        if (edge == wrong)
          matrix.translate(Eigen::Vector3d(1.0, 0.0, 0.0));
        const std::string a(1, static_cast<char>('A' + i)), b(1, static_cast<char>('A' + j));
        graph.Set({a, b, matrix, {}, {}, ""});
      }
    const auto open = graph.CheckCycles();
    ASSERT_FALSE(open.empty()) << wrong;
    for (const OpenCycle& cycle : open) {
      EXPECT_NEAR(cycle.mm, 1.0, 1e-9);
      EXPECT_EQ(cycle.edges.size(), 3u) << "a tree of fewest edges gives short cycles";
    }
  }
}
