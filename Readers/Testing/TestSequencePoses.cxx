// SPDX-License-Identifier: BSD-3-Clause
// Which frame is the world, and poses in it against products of matrices written out.
#include "Core/Base/Random.h"
#include "Readers/SequencePoses.h"
#include "Readers/Testing/Effort.h"
#include "Testing/TemporaryFolder.h"

using namespace echorama;
using namespace echorama::testing;

namespace {

TransformGraph Graph(const std::vector<std::string>& names)
{
  TransformGraph graph;
  for (const std::string& name : names) {
    NamedTransform edge;
    std::tie(edge.from, edge.to) = FramesOf(name).value();
    graph.Set(edge);
  }
  return graph;
}

std::string World(const std::vector<std::string>& names, const std::string& requested = "", const std::string& image = "Image")
{
  return ChooseWorldFrame(Graph(names), image, requested);
}

Eigen::Affine3d Moved(double x, double degrees)
{
  return Eigen::Translation3d(x, 2.0 * x, -x) * Eigen::AngleAxisd(degrees * 0.0174532925, Eigen::Vector3d(1, 2, 2) / 3.0);
}

} // namespace

TEST(SequencePosesTest, TheWorldIsChosenByASimpleRule)
{
  EXPECT_EQ(World({}), "");
  EXPECT_EQ(World({"ImageToReference"}), "Reference");
  EXPECT_EQ(World({"ImageToProbe", "ProbeToTracker", "ReferenceToTracker"}), "Reference");
  EXPECT_EQ(World({"ImageToProbe", "ProbeToTracker", "TrackerToWorld"}), "World");
  EXPECT_EQ(World({"ImageToProbe", "ProbeToTracker"}), "Tracker");
  EXPECT_EQ(World({"ImageToProbe", "ProbeToTracker"}, "Probe"), "Probe");
  EXPECT_EQ(World({"ImageToProbe", "ProbeToTracker"}, "tracker"), "Tracker");
  // The stepper: no usual name, one frame at the end.
  EXPECT_EQ(World({"ImageToProbe", "ProbeToStepperHome", "TemplateToStepperHome"}), "StepperHome");
  // Without the image, all frames count.
  EXPECT_EQ(World({"StylusToTracker", "ReferenceToTracker"}), "Reference");
  EXPECT_EQ(World({"ProbeToStepperHome"}, "Probe"), "Probe");
  // What the image does not reach does not count.
  EXPECT_EQ(World({"ImageToRobot", "StylusToReference"}), "Robot");

  const auto refused = [](const std::vector<std::string>& names, const std::string& requested, const std::string& words) {
    ExpectRefused([&] { World(names, requested); }, Error::Kind::NotPossible, "world", words);
  };
  refused({"ImageToA", "ImageToB"}, "", "name one of A, B");
  refused({"ImageToA", "AToImage"}, "", "name one of A");
  refused({"ImageToReference"}, "Tracker", "\"Tracker\"; the choices are Reference");
  refused({"ImageToRobot", "StylusToReference"}, "Reference", "the choices are Robot");
  refused({}, "Reference", "none");
}

TEST(SequencePosesTest, PosesAreComposedFrameByFrame)
{
  SequenceContent content;
  content.path = "some.mha";
  content.transforms = {"ProbeToTracker", "ReferenceToTracker", "StylusToTracker"};
  NamedTransform calibration;
  calibration.from = "Image";
  calibration.to = "Probe";
  calibration.matrix = Moved(3.0, 10.0);
  calibration.matrix.linear() *= 0.2;
  SequencePoses poses(content, {calibration});
  EXPECT_EQ(poses.World(), "Reference");
  EXPECT_TRUE(poses.ImageIsPlaced());
  EXPECT_FALSE(poses.Reaches("Nowhere"));
  EXPECT_FALSE(SequencePoses(content, {}).ImageIsPlaced());
  EXPECT_EQ(poses.Tools(), (std::vector<std::string>{"Probe", "Stylus"}));

  SequenceFrame frame;
  frame.transforms.resize(2);
  frame.transforms[0].name = "ProbeToTracker";
  frame.transforms[0].matrix = Moved(5.0, 20.0);
  frame.transforms[1].name = "ReferenceToTracker";
  frame.transforms[1].matrix = Moved(-7.0, 40.0);
  poses.MoveTo(frame);
  const ComposedTransform found = poses.Find("Image");
  EXPECT_EQ(found.status, TransformStatus::Valid);
  const Eigen::Affine3d expected = Moved(-7.0, 40.0).inverse() * Moved(5.0, 20.0) * calibration.matrix;
  for (Eigen::Index i = 0; i < 16; ++i)
    EXPECT_NEAR(found.matrix(i / 4, i % 4), expected(i / 4, i % 4), 1e-12);
  EXPECT_EQ(poses.Find("Stylus").status, TransformStatus::Missing); // the frame has none

  frame.transforms[0].status = TransformStatus::OutOfRange;
  poses.MoveTo(frame);
  EXPECT_EQ(poses.Find("Image").status, TransformStatus::OutOfRange);
  frame.transforms[1].status = TransformStatus::Missing;
  poses.MoveTo(frame);
  EXPECT_EQ(poses.Find("Image").status, TransformStatus::Missing);
  poses.MoveTo({});
  EXPECT_EQ(poses.Find("Probe").status, TransformStatus::Missing);

  ExpectRefused([&] { SequencePoses(content, {calibration}, "Image", "Mars"); }, Error::Kind::NotPossible, "some.mha", "Mars");
}

TEST(SequencePosesTest, TheGridOfAFrameIsTheNearestWithoutShear)
{
  // Without shear: exactly that grid.
  Eigen::Affine3d exact = Moved(4.0, 30.0);
  exact.linear().col(0) *= 0.2;
  exact.linear().col(1) *= 0.3;
  exact.linear().col(2) *= -1.0; // Plus's third axis may point either way
  const ImageGeometry grid = FrameGeometry(exact, {820, 616, 1});
  EXPECT_NO_THROW(grid.Check("grid"));
  for (const Eigen::Vector3d& pixel : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(819, 615, 0)})
    for (Eigen::Index i = 0; i < 3; ++i)
      EXPECT_NEAR((grid.IndexToWorld() * pixel)[i], (exact * pixel)[i], 1e-10);

  // With shear the middle stays and both axes turn by half of the angle.
  Eigen::Affine3d sheared = exact;
  const double angle = 0.01;
  sheared.linear().col(1) = 0.3 * (std::cos(angle) * grid.direction.col(1) + std::sin(angle) * grid.direction.col(0));
  const ImageGeometry nearest = FrameGeometry(sheared, {820, 616, 1});
  EXPECT_NO_THROW(nearest.Check("grid"));
  const Eigen::Vector3d middle(409.5, 307.5, 0.0);
  for (Eigen::Index i = 0; i < 3; ++i)
    EXPECT_NEAR((nearest.IndexToWorld() * middle)[i], (sheared * middle)[i], 1e-10);
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(nearest.spacing[axis], axis == 0 ? 0.2 : 0.3, 1e-12);
    EXPECT_NEAR(std::acos(nearest.direction.col(axis).dot(sheared.linear().col(axis).normalized())), angle / 2.0, 1e-9);
  }
}

TEST(SequencePosesTest, FramesOfSeveralSlicesAreNeitherMirroredNorSheared)
{
  Eigen::Affine3d pose = Moved(4.0, 30.0);
  pose.linear() *= 0.5;
  const Eigen::Vector3d last(9, 7, 4);
  const ImageGeometry grid = FrameGeometry(pose, {10, 8, 5});
  for (Eigen::Index i = 0; i < 3; ++i)
    EXPECT_NEAR((grid.IndexToWorld() * last)[i], (pose * last)[i], 1e-10);
  const auto refused = [](const Eigen::Affine3d& matrix) {
    EXPECT_NO_THROW(FrameGeometry(matrix, {10, 8, 1}));
    ExpectRefused([&] { FrameGeometry(matrix, {10, 8, 5}); }, Error::Kind::NotPossible, "5 slices", "left-handed");
  };
  Eigen::Affine3d wrong = pose;
  wrong.linear().col(2) *= -1.0;
  refused(wrong);
  wrong = pose;
  wrong.linear().col(2) += 0.1 * wrong.linear().col(0);
  refused(wrong);
}

TEST(SequencePosesTest, EffortGrowsWithTheNumberOfTransforms)
{
  const auto names = [](int count) {
    std::vector<std::string> list;
    for (int i = 0; i < count; ++i)
      list.push_back("A" + std::to_string(i) + "ToB");
    return list;
  };
  const auto choosing = [&](int count) {
    const TransformGraph graph = Graph(names(count));
    return ProcessorSeconds([&] { EXPECT_EQ(ChooseWorldFrame(graph, "Image", ""), "B"); });
  };
  const auto moving = [&](int count) {
    SequenceContent content;
    content.transforms = names(count);
    SequenceFrame frame;
    for (const std::string& name : content.transforms)
      frame.transforms.push_back({name});
    SequencePoses poses(content, {});
    return ProcessorSeconds([&] { poses.MoveTo(frame); });
  };
  // 32 times as many must not cost 1024 times the effort.
  EXPECT_LT(choosing(32000), 400 * choosing(1000));
  EXPECT_LT(moving(32000), 400 * moving(1000));
}
