// SPDX-License-Identifier: BSD-3-Clause
// Bodies that a probe presses against each other across empty cells: beside one block of both, beside a probe of the shape of one
// of them, folded, turned, lifted off; forces in balance; nothing in anything.
#include "Core/Base/Parallel.h"
#include "Filters/Physics/TissuePress.h"
#include "Testing/Sanitized.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr double Width = 4.0; // of a cell, mm
constexpr int Upper = 0, Lower = 1, Thread = 2;

// Blocks of cells that stand on the back, with threads of nearly nothing from upper ones to the fixed side, so that they are
// held.
TissueBody Scene(const std::array<int, 3>& cells, const TissueMaterial& upper, const TissueMaterial& lower,
                 const std::function<int(int, int, int)>& material)
{
  TissueBody body;
  body.nodes.dimensions = {cells[0] + 1, cells[1] + 1, cells[2] + 1};
  body.nodes.spacing.setConstant(Width);
  TissueMaterial thread;
  thread.youngKPa = 0.2; // so that what they carry does not count
  thread.poisson = 0.0;
  body.materials = {upper, lower, thread};
  ForNodes(cells, [&](int i, int j, int k) { body.cells.push_back(material(i, j, k)); });
  return body;
}

TissueMaterial Tissue(double youngKPa, double poisson)
{
  TissueMaterial material;
  material.youngKPa = youngKPa;
  material.poisson = poisson;
  return material;
}

// A block of 8 x 8 cells over a wide one, with a gap of so many cells.
TissueBody Punch(int gap, const TissueMaterial& upper, const TissueMaterial& lower)
{
  return Scene({24, 20, 16 + gap}, upper, lower, [gap](int i, int j, int k) {
    if (k >= 6 + gap)
      return Lower;
    const bool isBeside = j < 6 || j >= 14 || k >= 6;
    return isBeside ? -1 : i >= 8 && i < 16 ? Upper : k < 3 ? Thread : -1;
  });
}

TissuePressParameters Held()
{
  TissuePressParameters parameters;
  parameters.fixXMin = parameters.fixXMax = true;
  return parameters;
}

Pose At(double x, double y, double z)
{
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

std::shared_ptr<const ProbeShape> Plate()
{
  return std::make_shared<const ProbeShape>(ProbeGeometry::Linear(40.0, 40.0, 0.0, 100.0));
}

// What the fixed nodes are held with, N.
Eigen::Vector3d Reaction(const TissueBody& body, const TissuePress& press)
{
  const std::array<int, 3>& size = body.nodes.dimensions;
  const LatticeShape shape(size);
  TissueCells cells(size);
  std::size_t n = 0;
  ForNodes(cells.cells, [&](int i, int j, int k) {
    const int label = body.cells[n++];
    if (label < 0)
      return;
    const TissueMaterial& m = body.materials[static_cast<std::size_t>(label)];
    cells.shear[cells.At(i, j, k)] = static_cast<float>(m.youngKPa / (2.0 * (1.0 + m.poisson)));
    cells.bulk[cells.At(i, j, k)] = static_cast<float>(m.youngKPa * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson)));
  });
  LatticeField<double> displacement(shape), force(shape);
  const std::vector<Eigen::Vector3d> u = press.Displacements();
  const std::vector<unsigned char> isTissue = press.TissueNodes();
  n = 0;
  ForNodes(size, [&](int i, int j, int k) {
    if (isTissue[n])
      displacement.Set(shape.At(i, j, k), body.nodes.direction.transpose() * u[n]);
    ++n;
  });
  TissueForce(cells, body.nodes.spacing, displacement, force);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  ForNodes(size, [&](int i, int j, int k) {
    if (i == 0 || i == size[0] - 1 || k == size[2] - 1)
      sum += force.Get(shape.At(i, j, k));
  });
  return -1e-3 * (body.nodes.direction * sum);
}

double Longest(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b = {})
{
  double longest = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
    longest = std::max(longest, (b.empty() ? a[n] : Eigen::Vector3d(a[n] - b[n])).norm());
  return longest;
}

// Of all nodes, how deep the deepest lies in a cell that it does not belong to, in parts of a cell: of six tetrahedra.
double Deepest(const TissueBody& body, const TissuePress& press)
{
  const std::array<int, 3>& size = body.nodes.dimensions;
  const std::vector<Eigen::Vector3d> u = press.Displacements();
  const std::vector<unsigned char> isTissue = press.TissueNodes();
  std::vector<Eigen::Vector3d> places;
  ForNodes(size, [&](int i, int j, int k) {
    const Eigen::Vector3d moved = body.nodes.direction.transpose() * u[places.size()];
    places.push_back(body.nodes.spacing.cwiseProduct(Eigen::Vector3d(i, j, k)) + moved);
  });
  constexpr int orders[6][3] = {{1, 2, 4}, {1, 4, 2}, {2, 1, 4}, {2, 4, 1}, {4, 1, 2}, {4, 2, 1}};
  double deepest = 0.0;
  std::size_t cell = 0;
  ForNodes({size[0] - 1, size[1] - 1, size[2] - 1}, [&](int i, int j, int k) {
    if (body.cells[cell++] < 0)
      return;
    std::size_t at[8];
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
      const int index[3] = {i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)};
      at[corner] = static_cast<std::size_t>((index[2] * size[1] + index[1]) * size[0] + index[0]);
      box.extend(places[at[corner]]);
    }
    for (std::size_t n = 0; n < places.size(); ++n) {
      if (!isTissue[n] || !box.contains(places[n]) || std::find(at, at + 8, n) != at + 8)
        continue;
      for (const auto& order : orders) {
        Eigen::Matrix3d edges;
        int corner = 0;
        for (int step = 0; step < 3; ++step) {
          corner += order[step];
          edges.col(step) = places[at[corner]] - places[at[0]];
        }
        const Eigen::Vector3d part = edges.inverse() * (places[n] - places[at[0]]);
        deepest = std::max(deepest, std::min(part.minCoeff(), 1.0 - part.sum()));
      }
    }
  });
  return deepest;
}

TissuePressParameters Precise()
{
  TissuePressParameters parameters = Held();
  parameters.toleranceMm = 1e-3;
  return parameters;
}

TEST(TissueContact, BlocksThatMeetAreAsStiffAsOneOfBoth)
{
  ECHORAMA_SKIP_SANITIZED();
  const TissueMaterial material = Tissue(20.0, 0.45);
  const TissueBody one = Punch(0, material, material);
  TissuePress whole(one, Precise());
  whole.Move(Plate(), At(48.0, 40.0, 4.0));
  for (const int gap : {1, 2}) {
    const TissueBody body = Punch(gap, material, material);
    TissuePress press(body, Precise());
    const double depth = Width * gap + 4.0;
    press.Move(Plate(), At(48.0, 40.0, depth));
    EXPECT_NEAR(Reaction(body, press).z() / press.Force().z(), 1.0, 0.005);
    EXPECT_NEAR(press.Force().z() / whole.Force().z(), 1.0, 0.04); // grown together they do not slide on each other
    EXPECT_LT(Deepest(body, press), 0.02);
    EXPECT_FALSE(press.Work().energyGrew);
    press.Move(Plate(), At(48.0, 40.0, -1.0));
    EXPECT_LT(Longest(press.Displacements()), 1e-3 * depth);
  }
}

TEST(TissueContact, StiffBlockPressesAsAProbeOfItsShape)
{
  ECHORAMA_SKIP_SANITIZED();
  const TissueMaterial soft = Tissue(20.0, 0.45);
  const TissueBody body = Punch(1, Tissue(2000.0, 0.3), soft);
  TissuePress press(body, Precise());
  press.Move(Plate(), At(48.0, 40.0, Width + 4.0));
  TissueBody alone = Punch(1, Tissue(2000.0, 0.3), soft);
  for (std::size_t n = 0; n < 24 * 20 * 7; ++n)
    alone.cells[n] = -1;
  TissuePress direct(alone, Precise());
  ProbeHead head;
  head.marginMm = 1.0;
  head.edgeMm = 0.0;
  const auto probe = std::make_shared<const ProbeShape>(ProbeGeometry::Linear(32.0, 32.0, 0.0, 100.0), head);
  for (double depth = 0.5; depth <= 4.0; depth += 0.5) // in so small steps that nothing evades it sideways
    direct.Move(probe, At(48.0, 40.0, 28.0 + depth));
  EXPECT_NEAR(Reaction(body, press).z() / press.Force().z(), 1.0, 0.005);
  EXPECT_NEAR(press.Force().z() / direct.Force().z(), 1.0, 0.03);
  EXPECT_LT(Deepest(body, press), 0.02);
  EXPECT_FALSE(press.Work().energyGrew);
}

// A notch of one cell, open on one side, that closes.
TEST(TissueContact, FoldedBodyDoesNotEnterItself)
{
  const TissueBody body =
      Scene({12, 10, 10}, Tissue(20.0, 0.4), Tissue(20.0, 0.4), [](int i, int, int k) { return k == 3 && i < 9 ? -1 : Upper; });
  TissuePressParameters parameters;
  parameters.fixXMax = true;
  TissuePress press(body, parameters);
  const auto probe = std::make_shared<const ProbeShape>(ProbeGeometry::Convex(0.8, 25.0, 0.5, 20.0, 0.0, 100.0));
  press.Move(probe, At(16.0, 20.0, 10.0));
  const std::vector<Eigen::Vector3d> u = press.Displacements();
  const auto z = [&](int i, int j, int k) { return u[static_cast<std::size_t>((k * 11 + j) * 13 + i)].z(); };
  EXPECT_NEAR(Reaction(body, press).z() / press.Force().z(), 1.0, 0.005);
  EXPECT_GT(z(4, 5, 4), 1.0); // what lies below the notch gives way
  EXPECT_NEAR(z(4, 5, 3) - z(4, 5, 4), Width, 0.1);
  EXPECT_LT(Deepest(body, press), 0.02);
  EXPECT_FALSE(press.Work().energyGrew);
}

TEST(TissueContact, TurnedWorldTurnsTheAnswerAndThreadsDoNotChangeIt)
{
  ECHORAMA_SKIP_SANITIZED();
  TissueBody body = Punch(1, Tissue(20.0, 0.45), Tissue(10.0, 0.45));
  std::vector<Eigen::Vector3d> straight, again;
  for (int threads = 1; threads <= 2; ++threads) {
    const ThreadLimit limit(threads);
    TissuePress press(body, Precise());
    press.Move(Plate(), At(48.0, 40.0, 8.0));
    (threads == 1 ? straight : again) = press.Displacements();
  }
  EXPECT_EQ(Longest(straight, again), 0.0);
  const Pose turn = MotionAbout({10, 20, 30}, {0.4, -0.8, 1.1}, {100, -50, 7});
  body.nodes = body.nodes.Moved(turn);
  TissuePress press(body, Precise());
  press.Move(Plate(), turn * At(48.0, 40.0, 8.0));
  std::vector<Eigen::Vector3d> turned = press.Displacements();
  for (auto& u : turned)
    u = turn.linear().transpose() * u;
  EXPECT_LT(Longest(turned, straight), 1e-3);
}

TEST(TissueContact, NodesInOtherTissueAreSeenAndTheEmptyCellIsNamed)
{
  const std::array<int, 3> nodes{4, 4, 6};
  TissueCells cells(nodes);
  ForNodes(cells.cells, [&](int i, int j, int k) { cells.shear[cells.At(i, j, k)] = k == 2 ? 0.0f : 7.0f; });
  const LatticeShape shape(nodes);
  const BodyContact contact(cells, shape, Eigen::Vector3d::Ones());
  EXPECT_TRUE(contact.IsPossible());
  LatticeField<double> u(shape);
  const auto press = [&](double depth) {
    ForNodes({4, 4, 3}, [&](int i, int j, int k) { u.Set(shape.At(i, j, k), Eigen::Vector3d(0.3, 0.3, depth)); });
    return contact.EnteredCell(cells, u);
  };
  EXPECT_FALSE(press(0.9));
  EXPECT_FALSE(press(1.04)); // less than a twentieth of a cell
  const auto cell = press(1.2);
  ASSERT_TRUE(cell);
  EXPECT_EQ((*cell)[2], 2);
  // Where nothing can meet, nothing is looked for.
  ForNodes(cells.cells, [&](int i, int j, int k) { cells.shear[cells.At(i, j, k)] = k < 2 ? 0.0f : 7.0f; });
  EXPECT_FALSE(BodyContact(cells, shape, Eigen::Vector3d::Ones()).IsPossible());
}

} // namespace
