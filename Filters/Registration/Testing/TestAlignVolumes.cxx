// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Base/TextFile.h"
#include "Filters/Registration/AlignVolumes.h"
#include "Filters/Registration/Metric.h"
#include "Testing/TemporaryFolder.h"
#include "Testing/ThreadRanks.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

namespace echorama {
namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;
using Numbers = std::pair<int, int>;

std::size_t Index(int number)
{
  return static_cast<std::size_t>(number);
}

// Boxes of 48 mm around a ring of 10, each overlapping the next two on either side by a half and a little. What aligns them is
// a stand-in that knows the truth, adds noise, and lies where it is told to; the volumes themselves are noise.
class Ring {
public:
  explicit Ring(int count = 10)
  {
    for (int v = 0; v < count; ++v) {
      const double angle = 6.283185307179586 * v / 10.0;
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation({0.0, 0.0, angle});
      pose.translation() = Eigen::Vector3d(22.0 * std::cos(angle), 22.0 * std::sin(angle), 0.0) + pose.linear() * Corner();
      truth.push_back(pose);
      ImageGeometry geometry;
      geometry.dimensions = {8, 8, 12};
      geometry.spacing.setConstant(4.0);
      Volume<float> voxels(geometry.dimensions);
      Random random(5, static_cast<std::uint64_t>(v));
      for (float& voxel : voxels.View())
        voxel = static_cast<float>(random.Uniform(0.0, 255.0));
      pyramids.push_back(BuildPyramid<float>({voxels.View(), {}, geometry}));
      const Pose knock = MotionAbout(Eigen::Vector3d(22.0 * std::cos(angle), 22.0 * std::sin(angle), 0.0),
                                     random.Direction() * (4.0 * RadiansPerDegree), random.Direction() * 4.0);
      starts.push_back(v == 0 ? pose : knock * pose);
    }
  }

  std::vector<PlacedVolume> Volumes() const
  {
    std::vector<PlacedVolume> volumes;
    for (std::size_t v = 0; v < truth.size(); ++v)
      volumes.push_back({&pyramids[v], starts[v], "volume " + std::to_string(v)});
    return volumes;
  }

  PairAligner Aligner()
  {
    return [this](const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures,
                  const PlacedVolume& moving, const std::shared_ptr<const MetricPyramid>& movingFeatures,
                  const AlignPairParameters& parameters, const Progress& progress) {
      EXPECT_TRUE(fixedFeatures && movingFeatures);
      progress(0.5);
      const std::lock_guard<std::mutex> lock(*mutex); // pairs are aligned side by side
      const Numbers pair(std::stoi(fixed.name.substr(7)), std::stoi(moving.name.substr(7)));
      if (calls.size() >= stopAfter)
        throw echorama::Error(echorama::Error::Kind::Cancelled, "stopped");
      calls.push_back({pair, parameters.start});
      const auto a = Index(pair.first), b = Index(pair.second);
      PairAlignment found;
      found.volumeToWorld = moving.volumeToWorld;
      const double apart = (truth[a] * -Corner() - truth[b] * -Corner()).norm();
      if (apart > 30.0) {
        found.reason = "no overlap";
        return found;
      }
      Random random(9, static_cast<std::uint64_t>(100 * pair.first + pair.second));
      Pose error = MotionAbout(truth[b] * -Corner(), random.Direction() * 0.002, random.Direction() * 0.05);
      const auto lie = lies.find(pair);
      if (lie != lies.end() && (isStubborn || parameters.start != AlignStart::Tracked))
        error = lie->second;
      const auto verdict = verdicts.find(pair);
      found.volumeToWorld = fixed.volumeToWorld * truth[a].inverse() * error * truth[b];
      found.verdict = verdict != verdicts.end() ? verdict->second : Verdict::Aligned;
      found.reason = found.verdict == Verdict::Aligned ? "" : "told so";
      found.overlap = 1.0 - apart / 30.0;
      found.similarity = 0.5;
      found.voxelMm = 1.0;
      found.centre = fixed.volumeToWorld * truth[a].inverse() * (0.5 * (truth[a] * -Corner() + truth[b] * -Corner()));
      found.information.diagonal() << Eigen::Vector3d::Constant(1.0 / (0.05 * 0.05)),
          Eigen::Vector3d::Constant(1.0 / (0.002 * 0.002));
      found.information /= looseness * looseness;
      return found;
    };
  }

  void Lie(int a, int b, std::uint64_t item, double mm = 20.0, double degrees = 15.0)
  {
    Random random(3, item);
    lies[{a, b}] =
        MotionAbout(truth[Index(b)] * -Corner(), random.Direction() * (degrees * RadiansPerDegree), random.Direction() * mm);
  }

  /// Mean distance of the volumes' centres from where they belong.
  double Error(const AlignVolumesResult& result) const
  {
    const Pose onto = truth[0] * result.volumes[0].volumeToWorld.inverse();
    double sum = 0.0;
    for (std::size_t v = 0; v < truth.size(); ++v)
      sum += (onto * result.volumes[v].volumeToWorld * -Corner() - truth[v] * -Corner()).norm();
    return sum / static_cast<double>(truth.size());
  }

  static Eigen::Vector3d Corner() { return {-14.0, -14.0, -22.0}; } // of a box, from its centre

  std::vector<Pose> truth, starts;
  std::vector<std::vector<PyramidLevel>> pyramids;
  std::map<Numbers, Pose> lies;
  std::map<Numbers, Verdict> verdicts;
  bool isStubborn = true; // lies again when asked again
  double looseness = 1.0; // how much less the pairs say that they know
  std::vector<std::pair<Numbers, AlignStart>> calls;
  std::unique_ptr<std::mutex> mutex = std::make_unique<std::mutex>();
  std::size_t stopAfter = 1000000; // calls
};

std::vector<Numbers> VotedDown(const AlignVolumesResult& result)
{
  std::vector<Numbers> pairs;
  for (const PairOfVolumes& pair : result.pairs)
    if (pair.votedDown)
      pairs.push_back({pair.fixed, pair.moving});
  return pairs;
}

AlignVolumesParameters Tracked()
{
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Tracked;
  return p;
}

// Half a ring: an open chain. What pairs leave open adds up along it, and what the speed of sound may bend grows with the
// distance.
TEST(AlignVolumes, ErrorsGrowAlongAChain)
{
  Ring ring(6);
  AlignVolumesParameters p = Tracked();
  p.pair.soundSpeedError = 0.0;
  const AlignVolumesResult open = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  p.pair.soundSpeedError = 0.03;
  const AlignVolumesResult bent = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  EXPECT_EQ(open.volumes[0].errorMm, 0.0);
  const Eigen::Vector3d first = ring.truth[0] * -Ring::Corner();
  for (std::size_t v = 1; v < 6; ++v) {
    EXPECT_EQ(bent.volumes[v].verdict, Verdict::Aligned) << bent.volumes[v].reason;
    EXPECT_GT(open.volumes[v].errorMm, v == 1 ? 0.05 : open.volumes[v - 1].errorMm);
    const double apart = (ring.truth[v] * -Ring::Corner() - first).norm();
    EXPECT_NEAR(bent.volumes[v].errorMm, std::hypot(open.volumes[v].errorMm, 0.03 * apart), 0.01);
  }

  p.pair.maximumErrorMm = 0.5 * (bent.volumes[3].errorMm + bent.volumes[4].errorMm);
  const AlignVolumesResult strict = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  EXPECT_EQ(strict.volumes[3].verdict, Verdict::Aligned);
  EXPECT_EQ(strict.volumes[4].verdict, Verdict::Ambiguous);
  EXPECT_NE(strict.volumes[4].reason.find("the speed of sound may have bent over the distance to volume 0"), std::string::npos)
      << strict.volumes[4].reason;
  EXPECT_EQ(strict.volumes[4].volumeToWorld.matrix(), bent.volumes[4].volumeToWorld.matrix()) << "only the verdict changes";
}

TEST(AlignVolumes, ARingComesTogether)
{
  Ring ring;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_LT(ring.Error(result), 0.1);
  for (const VolumeAlignment& volume : result.volumes) {
    EXPECT_EQ(volume.verdict, Verdict::Aligned) << volume.reason;
    EXPECT_TRUE(volume.reason.empty());
    EXPECT_GT(volume.overlap, 0.5);
    EXPECT_NEAR(volume.similarity, 0.5, 1e-12);
  }
  EXPECT_TRUE(VotedDown(result).empty());
  EXPECT_GE(result.pairs.size(), 20u);
  EXPECT_LT(ring.calls.size(), 45u); // not all pairs
  EXPECT_EQ(result.volumes[0].information, Information::Zero());
  EXPECT_GT(result.volumes[5].information(0, 0), 0.0);
  // A pair tells where its moving volume is beside where its fixed one is in the end.
  for (const PairOfVolumes& pair : result.pairs)
    if (pair.stands) {
      const Eigen::Vector3d centre = -Ring::Corner();
      EXPECT_LT((pair.alignment.volumeToWorld * centre - result.volumes[Index(pair.moving)].volumeToWorld * centre).norm(), 0.3);
      EXPECT_EQ(pair.verdict, Verdict::Aligned);
    }
}

TEST(AlignVolumes, TwoWrongPairsAreNamed)
{
  Ring ring;
  ring.Lie(3, 5, 1);
  ring.Lie(7, 8, 2);
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(VotedDown(result), (std::vector<Numbers>{{3, 5}, {7, 8}}));
  EXPECT_LT(ring.Error(result), 0.1);
  for (const PairOfVolumes& pair : result.pairs)
    if (pair.votedDown) {
      EXPECT_EQ(pair.verdict, Verdict::Failed);
      EXPECT_FALSE(pair.stands || pair.contested);
      EXPECT_EQ(pair.attempts, 2);
      EXPECT_GT(pair.residualMm, 15.0);
      EXPECT_NE(pair.reason.find("disagrees with the other pairs by "), std::string::npos) << pair.reason;
    }
  for (const VolumeAlignment& volume : result.volumes)
    EXPECT_EQ(volume.verdict, Verdict::Aligned) << volume.reason;
}

TEST(AlignVolumes, AWrongPairIsMeasuredAgain)
{
  Ring ring;
  ring.isStubborn = false;
  ring.Lie(3, 5, 1);
  const AlignVolumesResult result = AlignVolumes(
      ring.Volumes(), 0,
      [] {
        AlignVolumesParameters p;
        p.pair.start = AlignStart::HandMade;
        return p;
      }(),
      {}, ring.Aligner());
  EXPECT_EQ(VotedDown(result), (std::vector<Numbers>{{3, 5}}));
  for (const PairOfVolumes& pair : result.pairs)
    if (pair.votedDown) {
      EXPECT_EQ(pair.verdict, Verdict::Aligned);
      EXPECT_TRUE(pair.stands);
      EXPECT_NE(pair.reason.find("aligned again"), std::string::npos) << pair.reason;
    }
}

// A pair that nobody thought of from the start is found from where the others place the volumes.
TEST(AlignVolumes, PairsAreFoundAtTheSolution)
{
  Ring ring(5);
  ring.starts[4] = MotionAbout(ring.truth[4] * -Ring::Corner(), Eigen::Vector3d::Zero(), {0.0, 0.0, 30.0}) * ring.truth[4];
  AlignVolumesParameters p;
  p.pair.start = AlignStart::HandMade;
  p.pairsPerVolume = 3;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  EXPECT_LT(ring.Error(result), 0.1);
  EXPECT_TRUE(std::any_of(result.pairs.begin(), result.pairs.end(),
                          [](const PairOfVolumes& pair) { return pair.fixed == 3 && pair.moving == 4 && pair.stands; }));
}

TEST(AlignVolumes, TheLostAreSearchedForInAllRotations)
{
  Ring ring(4);
  ring.starts[3].translation() += Eigen::Vector3d(500.0, 0.0, 0.0);
  AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, {}, {}, ring.Aligner());
  EXPECT_EQ(result.volumes[3].verdict, Verdict::Aligned) << result.volumes[3].reason;
  EXPECT_LT(ring.Error(result), 0.1);
  const auto far =
      std::count_if(ring.calls.begin(), ring.calls.end(), [](const auto& call) { return call.second == AlignStart::Unknown; });
  EXPECT_TRUE(far >= 1 && far <= 3) << far;

  // Unless the start is said to be a good one.
  result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(result.volumes[3].verdict, Verdict::Failed);
  EXPECT_NE(result.volumes[3].reason.find("overlaps no other volume"), std::string::npos);
  EXPECT_EQ(result.volumes[3].volumeToWorld.matrix(), ring.starts[3].matrix());
}

TEST(AlignVolumes, ALostVolumeThatIsFoundInDoubtIsPlacedInDoubt)
{
  Ring ring(4);
  ring.starts[3].translation() += Eigen::Vector3d(500.0, 0.0, 0.0);
  ring.verdicts[{1, 3}] = Verdict::Failed;
  ring.verdicts[{2, 3}] = Verdict::Ambiguous;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, {}, {}, ring.Aligner());
  EXPECT_EQ(result.volumes[3].verdict, Verdict::Ambiguous) << result.volumes[3].reason;
  EXPECT_LT(ring.Error(result), 0.1);
}

// The third overlaps the fourth and the fifth alone, which are lost themselves until they are asked about.
TEST(AlignVolumes, TheLostAreFoundInAnyOrder)
{
  Ring ring(6);
  std::swap(ring.truth[3], ring.truth[5]);
  std::swap(ring.starts[3], ring.starts[5]);
  ring.starts[3].translation() += Eigen::Vector3d(500.0, 0.0, 0.0);
  ring.starts[4].translation() += Eigen::Vector3d(0.0, 500.0, 0.0);
  ring.starts[5].translation() += Eigen::Vector3d(0.0, -500.0, 0.0);
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, {}, {}, ring.Aligner());
  for (const std::size_t v : {3, 4, 5})
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Aligned) << v << ": " << result.volumes[v].reason;
  EXPECT_LT(ring.Error(result), 0.1);
}

TEST(AlignVolumes, WhereNothingIsKnownAllPairsAreTried)
{
  Ring ring(5);
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Unknown;
  p.rounds = 1;
  EXPECT_EQ(AlignVolumes(ring.Volumes(), 2, p, {}, ring.Aligner()).pairs.size(), 10u);
  for (const auto& call : ring.calls) {
    EXPECT_NE(call.first.second, 2); // the fixed one stays in its pairs too
    EXPECT_EQ(call.second, AlignStart::Unknown);
  }
}

// In a chain the pair's own verdict is all there is.
TEST(AlignVolumes, ChainsAreAsSureAsTheirPairs)
{
  Ring ring(3);
  ring.verdicts[{0, 2}] = Verdict::Failed;
  ring.verdicts[{1, 2}] = Verdict::Ambiguous;
  AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(result.volumes[1].verdict, Verdict::Aligned);
  EXPECT_EQ(result.volumes[2].verdict, Verdict::Ambiguous);
  EXPECT_NE(result.volumes[2].reason.find("volume 1 and volume 2 (told so)"), std::string::npos) << result.volumes[2].reason;

  ring.verdicts[{1, 2}] = Verdict::Failed;
  result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(result.volumes[2].verdict, Verdict::Failed);
  EXPECT_NE(result.volumes[2].reason.find("volume 0 and volume 2: told so"), std::string::npos) << result.volumes[2].reason;
  EXPECT_EQ(result.volumes[2].volumeToWorld.matrix(), ring.starts[2].matrix());

  // An ambiguous pair that the others agree with counts.
  ring.verdicts = {{{0, 2}, Verdict::Ambiguous}, {{1, 2}, Verdict::Ambiguous}};
  result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(result.volumes[2].verdict, Verdict::Aligned) << result.volumes[2].reason;
}

// Pairs with several answers that agree on one are right; pairs that leave a pose open may agree because one thing misled them
// all.
TEST(AlignVolumes, AgreementDeterminesNothingThatAllPairsLeaveOpen)
{
  Ring ring(3);
  AlignVolumesParameters p = Tracked();
  p.pair.maximumErrorMm = 100.0;
  for (const Numbers& pair : {Numbers(0, 1), Numbers(0, 2), Numbers(1, 2)})
    ring.verdicts[pair] = Verdict::Ambiguous;
  AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  for (const std::size_t v : {1u, 2u})
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Aligned) << result.volumes[v].reason;

  ring.looseness = 40.0;
  result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  for (const std::size_t v : {1u, 2u}) {
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Ambiguous);
    EXPECT_NE(result.volumes[v].reason.find("do not determine its pose"), std::string::npos) << result.volumes[v].reason;
    EXPECT_GT(result.volumes[v].errorMm, 1.0);
  }

  ring.verdicts.clear(); // what clear pairs place may add up to more than a voxel
  result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  for (const std::size_t v : {1u, 2u})
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Aligned) << result.volumes[v].reason;
}

TEST(AlignVolumes, ATriangleKnowsOnlyThatSomethingIsWrong)
{
  Ring ring(3);
  ring.Lie(0, 2, 1);
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, Tracked(), {}, ring.Aligner());
  ASSERT_EQ(VotedDown(result).size(), 1u);
  for (const std::size_t v : {1u, 2u}) {
    EXPECT_EQ(result.volumes[v].verdict, Verdict::Ambiguous);
    EXPECT_NE(result.volumes[v].reason.find("as many pairs"), std::string::npos) << result.volumes[v].reason;
    EXPECT_EQ(result.volumes[v].reason.find("more"), std::string::npos) << result.volumes[v].reason;
  }
}

// Nine pairs fail: five are named.
TEST(AlignVolumes, AReasonNamesFewOfManyPairs)
{
  Ring ring;
  for (int v = 0; v < 10; ++v)
    ring.verdicts[std::minmax(v, 5)] = Verdict::Failed;
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Unknown;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  EXPECT_EQ(result.volumes[5].verdict, Verdict::Failed);
  const std::string& reason = result.volumes[5].reason;
  EXPECT_EQ(reason.substr(0, 18), "no pair places it:") << reason;
  EXPECT_EQ(std::count(reason.begin(), reason.end(), ';'), 4) << reason;
  EXPECT_EQ(reason.substr(reason.size() - 11), " and 4 more") << reason;
}

// Seven triangles that meet in the first volume, in each of which something is wrong: five pairs are named, those of a volume
// first.
TEST(AlignVolumes, AReasonNamesAVolumesOwnPairsFirst)
{
  Ring ring(30);
  const std::vector<Numbers> triangles{{1, 2}, {8, 9}, {10, 20}, {11, 21}, {12, 22}, {18, 28}, {19, 29}}; // beside volume 0
  for (int a = 0; a < 30; ++a)
    for (int b = a + 1; b < 30; ++b)
      ring.verdicts[{a, b}] = Verdict::Failed;
  std::uint64_t item = 0;
  for (const auto& [a, b] : triangles) {
    for (const Numbers& pair : {Numbers(0, a), Numbers(0, b), Numbers(a, b)})
      ring.verdicts[pair] = Verdict::Aligned;
    ring.Lie(a, b, ++item);
  }
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Unknown;
  p.rounds = 1;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  int contested = 0;
  for (const PairOfVolumes& pair : result.pairs) {
    if (!pair.contested)
      continue;
    ++contested;
    const std::string first =
        "the pairs volume " + std::to_string(pair.fixed) + " and volume " + std::to_string(pair.moving) + "; ";
    for (const int v : {pair.fixed, pair.moving}) {
      if (v == 0)
        continue;
      const std::string& reason = result.volumes[Index(v)].reason;
      EXPECT_EQ(result.volumes[Index(v)].verdict, Verdict::Ambiguous);
      EXPECT_EQ(reason.substr(0, first.size()), first) << reason;
      EXPECT_EQ(std::count(reason.begin(), reason.end(), ';'), 4) << reason;
      EXPECT_NE(reason.find(" and 2 more disagree with the others"), std::string::npos) << reason;
    }
  }
  EXPECT_EQ(contested, 7);
}

TEST(AlignVolumes, ThoseHeldStayAndTheOthersComeToThem)
{
  Ring ring;
  AlignVolumesParameters parameters;
  for (const int v : {1, 2, 3, 5, 6, 7, 9}) {
    ring.starts[Index(v)] = ring.truth[Index(v)];
    parameters.held.push_back(v);
  }
  ring.Lie(3, 4, 1); // four volumes hold the volume 4: one of them may be wrong
  ring.isStubborn = true;
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, parameters, {}, ring.Aligner());
  for (const int v : parameters.held) {
    EXPECT_EQ(result.volumes[Index(v)].volumeToWorld.matrix(), ring.starts[Index(v)].matrix()) << v;
    EXPECT_EQ(result.volumes[Index(v)].verdict, Verdict::Aligned);
    EXPECT_TRUE(result.volumes[Index(v)].information.isZero());
  }
  for (const int v : {4, 8}) {
    EXPECT_EQ(result.volumes[Index(v)].verdict, Verdict::Aligned) << result.volumes[Index(v)].reason;
    EXPECT_LT((result.volumes[Index(v)].volumeToWorld * -Ring::Corner() - ring.truth[Index(v)] * -Ring::Corner()).norm(), 0.2)
        << v;
  }
  for (const auto& [pair, start] : ring.calls)
    EXPECT_TRUE(pair.second == 4 || pair.second == 8) << pair.first << " and " << pair.second;
  std::ptrdiff_t standing = 0;
  for (const PairOfVolumes& pair : result.pairs)
    if (pair.alignment.overlap > 0.0) {
      standing += pair.stands;
      EXPECT_EQ(pair.stands, !(pair.fixed == 3 && pair.moving == 4)) << pair.fixed << " and " << pair.moving;
    }
  EXPECT_EQ(standing, 7);
}

TEST(AlignVolumes, AVolumeHeldFarAwayIsNoReasonToMoveOthers)
{
  Ring ring;
  AlignVolumesParameters parameters;
  parameters.held = {5}; // on the other side: no pair joins it to the fixed one but through others
  ring.starts[5] = Eigen::Translation3d(500.0, 0.0, 0.0) * ring.truth[5];
  const AlignVolumesResult result = AlignVolumes(ring.Volumes(), 0, parameters, {}, ring.Aligner());
  EXPECT_EQ(result.volumes[5].volumeToWorld.matrix(), ring.starts[5].matrix());
  for (const int v : {1, 2, 3, 4, 6, 7, 8, 9})
    EXPECT_LT((result.volumes[Index(v)].volumeToWorld * -Ring::Corner() - ring.truth[Index(v)] * -Ring::Corner()).norm(), 0.3)
        << v;
}

TEST(AlignVolumes, TwoVolumesAreAPair)
{
  Ring ring(2);
  const auto volumes = ring.Volumes();
  AlignVolumesResult result = AlignVolumes(volumes, 1, {}, {}, ring.Aligner());
  ASSERT_EQ(ring.calls.size(), 1u);
  EXPECT_EQ(ring.calls[0], std::make_pair(Numbers(1, 0), AlignStart::Automatic));
  EXPECT_EQ(result.volumes[0].verdict, Verdict::Aligned);
  EXPECT_NEAR(result.volumes[0].information(0, 0), 400.0, 1e-3);

  ring.verdicts[{0, 1}] = Verdict::Failed;
  result = AlignVolumes(volumes, 0, {}, {}, ring.Aligner());
  EXPECT_EQ(result.volumes[1].verdict, Verdict::Failed);
  EXPECT_EQ(result.volumes[1].reason, "told so");
  EXPECT_EQ(result.pairs[0].reason, "told so");
  EXPECT_EQ(result.volumes[1].volumeToWorld.matrix(), ring.starts[1].matrix());
  EXPECT_TRUE(result.volumes[1].information.isZero());
}

TEST(AlignVolumes, VolumesThatCannotBeAlignedFailForThemselves)
{
  Ring ring(4);
  auto volumes = ring.Volumes();
  ImageGeometry geometry = ring.pyramids[2].front().geometry;
  const Volume<float> grey(geometry.dimensions, 5.0f);
  const auto constant = BuildPyramid<float>({grey.View(), {}, geometry});
  volumes[2].pyramid = &constant;
  const AlignVolumesResult result = AlignVolumes(volumes, 0, Tracked(), {}, ring.Aligner());
  EXPECT_EQ(result.volumes[2].verdict, Verdict::Failed);
  EXPECT_NE(result.volumes[2].reason.find("constant"), std::string::npos) << result.volumes[2].reason;
  EXPECT_EQ(result.volumes[1].verdict, Verdict::Aligned) << result.volumes[1].reason;
  EXPECT_THROW(AlignVolumes(volumes, 2, Tracked(), {}, ring.Aligner()), Error);
  EXPECT_THROW(AlignVolumes({volumes[1], volumes[2]}, 0, Tracked(), {}, ring.Aligner()), Error);
}

TEST(AlignVolumes, SameAnswerTwice)
{
  Ring one, two;
  one.Lie(0, 1, 4);
  two.Lie(0, 1, 4);
  const AlignVolumesResult a = AlignVolumes(one.Volumes(), 0, {}, {}, one.Aligner()),
                           b = AlignVolumes(two.Volumes(), 0, {}, {}, two.Aligner());
  for (Ring* ring : {&one, &two})
    std::sort(ring->calls.begin(), ring->calls.end()); // pairs side by side may change places
  EXPECT_EQ(one.calls, two.calls);
  for (std::size_t v = 0; v < 10; ++v)
    EXPECT_EQ(a.volumes[v].volumeToWorld.matrix(), b.volumes[v].volumeToWorld.matrix());
}

TEST(AlignVolumes, ProgressAndStopping)
{
  Ring ring(5);
  double last = 0.0;
  AlignVolumes(ring.Volumes(), 0, {}, Progress([&last](double fraction) {
                 EXPECT_GE(fraction, last);
                 last = fraction;
                 return true;
               }),
               ring.Aligner());
  EXPECT_EQ(last, 1.0);
  try {
    AlignVolumes(ring.Volumes(), 0, {}, Progress([](double fraction) { return fraction < 0.3; }), ring.Aligner());
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

// Volumes that are made when they are asked for; what pairs find tells what they were given.
class OnDemand {
public:
  explicit OnDemand(Ring& ring) : ring_(ring)
  {
    for (const PlacedVolume& volume : ring.Volumes()) {
      PlacedVolume placed = volume;
      placed.pyramid = nullptr;
      const auto number = volumes.size();
      volumes.push_back(
          {placed,
           [this, number](bool withReliability, const Progress&) {
             made += withReliability;
             PreparedVolume prepared;
             for (const PyramidLevel& level : ring_.pyramids[number]) {
               prepared.pyramid.push_back({Volume<float>(level.geometry.dimensions), level.geometry, level.realVoxels});
               std::copy(level.intensity.View().begin(), level.intensity.View().end(),
                         prepared.pyramid.back().intensity.View().begin());
             }
             return prepared;
           },
           "content " + std::to_string(number)});
    }
  }

  PairAligner Aligner()
  {
    return [this, inner = ring_.Aligner()](const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures,
                                           const PlacedVolume& moving, const std::shared_ptr<const MetricPyramid>& movingFeatures,
                                           const AlignPairParameters& p, const Progress& progress) {
      PairAlignment found = inner(fixed, fixedFeatures, moving, movingFeatures, p, progress);
      const auto seen = [](const PlacedVolume& volume, const MetricPyramid& features) {
        double sum = 0.0;
        for (const float voxel : volume.pyramid->front().intensity.View())
          sum += static_cast<double>(voxel);
        return sum + static_cast<double>(features.levels.front().seen[100].value);
      };
      found.score = seen(fixed, *fixedFeatures) + 0.5 * seen(moving, *movingFeatures);
      return found;
    };
  }

  std::vector<VolumeOnDemand> volumes;
  std::atomic<int> made{0};

private:
  Ring& ring_;
};

// To the last bit.
void ExpectSame(const AlignVolumesResult& a, const AlignVolumesResult& b)
{
  ASSERT_EQ(a.pairs.size(), b.pairs.size());
  for (std::size_t i = 0; i < a.pairs.size(); ++i) {
    EXPECT_EQ(a.pairs[i].fixed, b.pairs[i].fixed);
    EXPECT_EQ(a.pairs[i].moving, b.pairs[i].moving);
    EXPECT_EQ(a.pairs[i].verdict, b.pairs[i].verdict);
    EXPECT_EQ(a.pairs[i].reason, b.pairs[i].reason);
    EXPECT_EQ(a.pairs[i].attempts, b.pairs[i].attempts);
    EXPECT_EQ(a.pairs[i].alignment.score, b.pairs[i].alignment.score);
    EXPECT_EQ(a.pairs[i].alignment.volumeToWorld.matrix(), b.pairs[i].alignment.volumeToWorld.matrix());
    EXPECT_EQ(a.pairs[i].alignment.information, b.pairs[i].alignment.information);
  }
  ASSERT_EQ(a.volumes.size(), b.volumes.size());
  for (std::size_t v = 0; v < a.volumes.size(); ++v) {
    EXPECT_EQ(a.volumes[v].volumeToWorld.matrix(), b.volumes[v].volumeToWorld.matrix());
    EXPECT_EQ(a.volumes[v].covariance, b.volumes[v].covariance);
    EXPECT_EQ(a.volumes[v].verdict, b.volumes[v].verdict);
    EXPECT_EQ(a.volumes[v].reason, b.volumes[v].reason);
  }
}

TEST(AlignVolumes, LittleMemoryFindsTheSame)
{
  Ring ring;
  ring.Lie(2, 4, 1);
  OnDemand plenty(ring), little(ring);
  AlignVolumesParameters p = Tracked();
  p.resources.memoryGb = 1.0;
  const AlignVolumesResult all = AlignVolumesOnDemand(plenty.volumes, 0, p, {}, plenty.Aligner());
  EXPECT_EQ(all.timesPrepared, 10);
  EXPECT_EQ(plenty.made, 10);
  // Of caller's resolutions only the features are ours.
  const AlignVolumesResult kept = AlignVolumes(ring.Volumes(), 0, p, {}, plenty.Aligner());
  ExpectSame(all, kept);
  EXPECT_LT(kept.preparedBytes, 0.7 * all.preparedBytes);

  const double four = 0.41 * all.preparedBytes;
  p.resources.memoryGb = four * 1e-9;
  const AlignVolumesResult some = AlignVolumesOnDemand(little.volumes, 0, p, {}, little.Aligner());
  ExpectSame(all, some);
  EXPECT_LE(some.preparedBytes, four);
  EXPECT_GT(some.preparedBytes, 0.75 * four);
  EXPECT_GT(some.timesPrepared, 10);
  EXPECT_EQ(little.made, some.timesPrepared);
  const int pairs = static_cast<int>(ring.calls.size()) / 3;
  EXPECT_LT(some.timesPrepared, 2 * 2 * pairs / 3) << "volumes shall be kept between pairs";

  p.resources.memoryGb = 1e-9;
  const AlignVolumesResult least = AlignVolumesOnDemand(little.volumes, 0, p, {}, little.Aligner());
  ExpectSame(all, least);
  EXPECT_LT(some.timesPrepared, least.timesPrepared);
  EXPECT_NEAR(least.preparedBytes, 0.2 * all.preparedBytes, 1.0); // a pair needs two
}

TEST(AlignVolumes, VolumesOnDemandThatCannotBeAlignedFailForThemselves)
{
  Ring ring(5);
  for (PyramidLevel& level : ring.pyramids[3])
    for (float& voxel : level.intensity.View())
      voxel = 7.0f;
  OnDemand demand(ring);
  AlignVolumesParameters p = Tracked();
  for (const double gb : {1.0, 1e-9}) {
    p.resources.memoryGb = gb;
    const AlignVolumesResult result = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
    ExpectSame(result, AlignVolumes(ring.Volumes(), 0, p, {}, demand.Aligner()));
    EXPECT_EQ(result.volumes[3].verdict, Verdict::Failed);
    EXPECT_NE(result.volumes[3].reason.find("volume 3"), std::string::npos) << result.volumes[3].reason;
  }
}

class AlignVolumesFile : public testing::TemporaryFolder {};

TEST_F(AlignVolumesFile, GoesOnWhereItWasStopped)
{
  Ring ring;
  ring.Lie(2, 4, 1); // so that there is a second round
  OnDemand demand(ring);
  AlignVolumesParameters p = Tracked();
  const AlignVolumesResult whole = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  const std::size_t pairs = ring.calls.size();

  p.resources.finishedPairs = Path("finished.json");
  ring.calls.clear();
  ring.stopAfter = 7;
  EXPECT_THROW(AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner()), Error);
  ring.stopAfter = 1000000;
  ring.calls.clear();
  EXPECT_EQ(PlanAlignment(demand.volumes, 0, p, {}, demand.Aligner()).pairsFinishedBefore, 7);
  const std::size_t finished = 7 + ring.calls.size(); // with the plan's samples
  EXPECT_GE(finished, 10u);
  ring.calls.clear();
  AlignVolumesResult result = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  ExpectSame(whole, result);
  EXPECT_EQ(Index(result.pairsFinishedBefore), finished);
  EXPECT_EQ(ring.calls.size() + finished, pairs);

  // Nothing has changed: no pair is aligned, and no volume prepared for one.
  ring.calls.clear();
  demand.made = 0;
  result = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  ExpectSame(whole, result);
  EXPECT_TRUE(ring.calls.empty());
  EXPECT_EQ(demand.made, 0);

  // What concerns a volume that is another now, or starts elsewhere, or has landmarks, is aligned again.
  const auto again = [&] {
    ring.calls.clear();
    AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
    std::vector<Numbers> first; // round
    for (const auto& call : ring.calls)
      first.push_back(call.first);
    return first;
  };
  const auto concernsOnly = [](const std::vector<Numbers>& calls, int v, std::size_t atLeast) {
    EXPECT_GE(calls.size(), atLeast);
    for (const Numbers& call : calls)
      EXPECT_TRUE(call.first == v || call.second == v) << call.first << "-" << call.second;
  };
  p.rounds = 1;
  demand.volumes[5].content = "edited";
  concernsOnly(again(), 5, 4);
  demand.volumes[6].placed.volumeToWorld = Eigen::Translation3d(0.0, 0.0, 1e-9) * demand.volumes[6].placed.volumeToWorld;
  concernsOnly(again(), 6, 4);
  demand.volumes[8].placed.landmarks.push_back({"apex", Eigen::Vector3d::Zero()});
  concernsOnly(again(), 8, 4);
  EXPECT_TRUE(again().empty());
  p.pair.points = 1234;
  AlignVolumesParameters anew = p;
  anew.resources.finishedPairs.clear();
  ring.calls.clear();
  AlignVolumesOnDemand(demand.volumes, 0, anew, {}, demand.Aligner());
  const std::size_t all = ring.calls.size();
  EXPECT_GE(all, 20u);
  EXPECT_EQ(again().size(), all);
  demand.volumes[4].content.clear(); // not known: neither found nor kept
  concernsOnly(again(), 4, 4);
  concernsOnly(again(), 4, 4);
  EXPECT_EQ(ReadTextFile(p.resources.finishedPairs).find("nan"), std::string::npos);
}

TEST_F(AlignVolumesFile, OneThatIsSomethingElseIsLeftAlone)
{
  Ring ring(4);
  OnDemand demand(ring);
  AlignVolumesParameters p = Tracked();
  p.resources.finishedPairs = Path("finished.json");
  AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  const std::string good = ReadTextFile(p.resources.finishedPairs);
  const auto refuses = [&](const std::string& text) {
    WriteTextFile(p.resources.finishedPairs, text);
    try {
      AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
      ADD_FAILURE() << text.substr(0, 80);
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::BadFile) << error.what();
      EXPECT_EQ(std::string(error.what()).find(p.resources.finishedPairs), 0u) << error.what();
    }
    EXPECT_EQ(ReadTextFile(p.resources.finishedPairs), text);
  };
  std::string bent = good;
  const auto digit = bent.find_first_of("123456789", bent.find("\"VolumeToWorld\":[") + 20);
  bent[digit] = bent[digit] == '1' ? '2' : '1';
  refuses(bent); // one digit of a pose
  refuses(good.substr(0, good.size() / 2));
  refuses("{\"schema\": \"echorama-poses-1\"}");
  refuses("[]");
  refuses("poses of mine");
  std::string old = good;
  old.replace(old.find("pairs-1"), 7, "pairs-0");
  refuses(old);
  WriteTextFile(p.resources.finishedPairs, good);
  EXPECT_NO_THROW(AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner()));
}

TEST(AlignVolumes, ThePlanIsWhatIsDone)
{
  Ring ring;
  OnDemand demand(ring);
  AlignVolumesParameters p = Tracked();
  p.rounds = 1;
  p.resources.memoryGb = 1.0;
  const AlignVolumesPlan plan = PlanAlignment(demand.volumes, 0, p, {}, demand.Aligner());
  EXPECT_LE(ring.calls.size(), std::max(3u, std::thread::hardware_concurrency()));
  EXPECT_LE(demand.made, static_cast<int>(2 * ring.calls.size())); // the volumes of these pairs alone
  const AlignVolumesResult result = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  std::vector<Numbers> planned = plan.pairs, done;
  std::sort(planned.begin(), planned.end());
  for (const PairOfVolumes& pair : result.pairs)
    done.push_back({pair.fixed, pair.moving});
  EXPECT_EQ(planned, done);
  EXPECT_EQ(plan.timesPrepared, 10);
  EXPECT_NEAR(plan.bytesOfAll, result.preparedBytes, 1.0);
  EXPECT_EQ(plan.budgetBytes, 1e9);
  EXPECT_GT(plan.seconds, 0.0);
  p.resources.memoryGb = 0.41 * result.preparedBytes * 1e-9;
  OnDemand little(ring);
  const AlignVolumesPlan tight = PlanAlignment(little.volumes, 0, p, {}, little.Aligner());
  EXPECT_GT(tight.timesPrepared, 10);
  EXPECT_LT(tight.timesPrepared, static_cast<int>(2 * tight.pairs.size()));
}

// What ranks that share the pairs find, each with a ring of its own; \a calls of all of them.
std::vector<AlignVolumesResult> ByRanks(int ranks, const std::function<void(Ring&, AlignVolumesParameters&)>& change,
                                        std::vector<std::pair<Numbers, AlignStart>>* calls = nullptr)
{
  std::vector<AlignVolumesResult> results(Index(ranks));
  std::mutex mutex;
  const auto errors = ThreadRanks(ranks).Run([&](SharedWork& shared) {
    Ring ring;
    AlignVolumesParameters p = Tracked();
    change(ring, p);
    p.shared = &shared;
    OnDemand demand(ring);
    results[Index(shared.Rank())] = AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
    const std::lock_guard<std::mutex> lock(mutex);
    if (calls)
      calls->insert(calls->end(), ring.calls.begin(), ring.calls.end());
  });
  EXPECT_EQ(errors, std::vector<std::string>(Index(ranks)));
  return results;
}

TEST(AlignVolumes, RanksFindWhatOneFinds)
{
  const auto lies = [](Ring& ring, AlignVolumesParameters&) { // a second round
    ring.Lie(2, 4, 1);
    ring.Lie(7, 8, 2);
  };
  const auto lost = [](Ring& ring, AlignVolumesParameters& p) {
    p.pair.start = AlignStart::Automatic;
    ring.starts[3].translation() += Eigen::Vector3d(500.0, 0.0, 0.0);
    ring.starts[6].translation() += Eigen::Vector3d(0.0, 500.0, 0.0);
    ring.verdicts[{2, 3}] = Verdict::Ambiguous; // one of the first that are tried
  };
  const auto dull = [](Ring& ring, AlignVolumesParameters&) {
    for (const std::size_t v : {1u, 9u})
      for (PyramidLevel& level : ring.pyramids[v])
        for (float& voxel : level.intensity.View())
          voxel = 7.0f;
  };
  const std::vector<std::function<void(Ring&, AlignVolumesParameters&)>> cases{lies, lost, dull};
  for (std::size_t n = 0; n < cases.size(); ++n) {
    std::vector<std::pair<Numbers, AlignStart>> alone;
    const AlignVolumesResult one = ByRanks(1, cases[n], &alone).front();
    EXPECT_EQ(one.traffic.messages, 0);
    std::sort(alone.begin(), alone.end());
    for (const int ranks : {2, 3, 8}) {
      std::vector<std::pair<Numbers, AlignStart>> shared;
      for (const AlignVolumesResult& result : ByRanks(ranks, cases[n], &shared)) {
        ExpectSame(one, result);
        EXPECT_EQ(result.ranks, ranks);
        EXPECT_GT(result.traffic.messages, 0);
        EXPECT_GE(result.timesPrepared, 8);
      }
      std::sort(shared.begin(), shared.end());
      if (n != 1) { // what is lost is looked for in several places at once
        EXPECT_EQ(shared, alone) << "every pair is aligned by one rank";
      }
      EXPECT_TRUE(std::includes(shared.begin(), shared.end(), alone.begin(), alone.end()));
    }
  }
}

TEST(AlignVolumes, TwoVolumesAreForOneOfTheRanks)
{
  const auto pair = [](Ring& ring, AlignVolumesParameters&) { ring = Ring(2); };
  std::vector<std::pair<Numbers, AlignStart>> calls;
  const AlignVolumesResult one = ByRanks(1, pair).front();
  for (const AlignVolumesResult& result : ByRanks(3, pair, &calls))
    ExpectSame(one, result);
  EXPECT_EQ(calls.size(), 1u);
}

TEST(AlignVolumes, OneRankThatFailsEndsAll)
{
  for (const auto kind : {Error::Kind::FileSystem, Error::Kind::Cancelled}) {
    const auto errors = ThreadRanks(3).Run([kind](SharedWork& shared) {
      Ring ring;
      AlignVolumesParameters p = Tracked();
      p.shared = &shared;
      const PairAligner inner = ring.Aligner();
      std::atomic<int> calls{0};
      AlignVolumes(ring.Volumes(), 0, p, {},
                   [&](const auto& fixed, const auto& ofFixed, const auto& moving, const auto& ofMoving, const auto& q,
                       const auto& progress) {
                     if (shared.Rank() == 2 && ++calls > 3)
                       throw Error(kind, "the share is gone");
                     return inner(fixed, ofFixed, moving, ofMoving, q, progress);
                   });
    });
    for (const std::string& error : errors)
      EXPECT_EQ(error, kind == Error::Kind::Cancelled ? "the share is gone" : "rank 2: the share is gone");
  }
  // Not the same volumes, nor the same parameters.
  const auto differ = ThreadRanks(2).Run([](SharedWork& shared) {
    Ring ring;
    AlignVolumesParameters p = Tracked();
    p.pair.points += shared.Rank();
    p.shared = &shared;
    AlignVolumes(ring.Volumes(), 0, p, {}, ring.Aligner());
  });
  for (const std::string& error : differ)
    EXPECT_NE(error.find("the ranks do not work on the same (10 volumes "), std::string::npos) << error;
}

TEST_F(AlignVolumesFile, TheFirstRankKeepsTheFile)
{
  const std::string path = Path("finished.json");
  const auto withFile = [&path](Ring& ring, AlignVolumesParameters& p) {
    ring.Lie(2, 4, 1);
    p.resources.finishedPairs = path;
  };
  std::vector<std::pair<Numbers, AlignStart>> calls;
  const AlignVolumesResult first = ByRanks(3, withFile, &calls).front();
  EXPECT_EQ(first.pairsFinishedBefore, 0);
  EXPECT_GT(calls.size(), 20u);
  // Whatever number of ranks goes on from it, no pair is aligned.
  for (const int ranks : {1, 2, 5}) {
    const std::size_t before = calls.size();
    for (const AlignVolumesResult& result : ByRanks(ranks, withFile, &calls)) {
      ExpectSame(first, result);
      EXPECT_EQ(result.pairsFinishedBefore, static_cast<int>(before));
    }
    EXPECT_EQ(calls.size(), before);
  }
  WriteTextFile(path, "poses of mine");
  const auto errors = ThreadRanks(2).Run([&](SharedWork& shared) {
    Ring ring(4);
    OnDemand demand(ring);
    AlignVolumesParameters p = Tracked();
    p.shared = &shared;
    p.resources.finishedPairs = path;
    AlignVolumesOnDemand(demand.volumes, 0, p, {}, demand.Aligner());
  });
  for (const std::string& error : errors)
    EXPECT_EQ(error.find("rank 0: " + path), 0u) << error;
  EXPECT_EQ(ReadTextFile(path), "poses of mine");
}

TEST(AlignVolumes, RefusesWhatIsWrong)
{
  Ring ring(3);
  const auto volumes = ring.Volumes();
  EXPECT_THROW(AlignVolumes(volumes, 3), Error);
  EXPECT_THROW(AlignVolumes(volumes, -1), Error);
  EXPECT_THROW(AlignVolumes({volumes[0]}, 0), Error);
  EXPECT_THROW(AlignVolumes({}, 0), Error);
  EXPECT_THROW(AlignVolumes({volumes[0], {}, volumes[1]}, 0), Error);
  AlignVolumesParameters held;
  held.held = {3};
  EXPECT_THROW(AlignVolumes(volumes, 0, held), Error);
  held.held = {1, 2};
  EXPECT_THROW(AlignVolumes(volumes, 0, held), Error);
  const auto wrong = [](void (*change)(AlignVolumesParameters&)) {
    AlignVolumesParameters p;
    change(p);
    EXPECT_THROW(CheckRanges(p), Error);
  };
  wrong([](AlignVolumesParameters& p) { p.pairsPerVolume = 0; });
  wrong([](AlignVolumesParameters& p) { p.rounds = 0; });
  wrong([](AlignVolumesParameters& p) { p.floorVoxels = std::nan(""); });
  wrong([](AlignVolumesParameters& p) { p.outlierVoxels = -1.0; });
  wrong([](AlignVolumesParameters& p) { p.outlierSigmas = 0.0; });
  wrong([](AlignVolumesParameters& p) { p.pair.metric = "no such metric"; });
}

} // namespace
} // namespace echorama
