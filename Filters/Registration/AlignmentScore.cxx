// SPDX-License-Identifier: BSD-3-Clause
// With A the aligned and T the true map from indices to the world, and f the fixed volume, the truth moved onto the
// alignment is A_f T_f^-1 T; a point u of another volume is at A u and belongs at A_f T_f^-1 T u. Nothing is inverted but
// T_f, so that an alignment that equals the truth scores 0 to rounding.
#include "AlignmentScore.h"
#include "Core/Base/Error.h"
#include "Core/Base/Percentile.h"
#include "PlacedVolume.h"
#include <algorithm>
#include <cmath>

namespace echorama {

ParameterList Describe(ScoreParameters& p)
{
  return {
      Parameter("FixedVolume", p.fixedVolume, {0, Unlimited}, "",
                "The volume that alignment and truth are taken to agree on, counted from 0."),
      Parameter("Points", p.points, {1, 1e7}, "", "Points of each volume that are scored."),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "The same seed draws the same points.").Advanced(),
  };
}

namespace {

void Check(const ScoredVolume& volume)
{
  volume.aligned.Check(volume.name);
  volume.truth.Check(volume.name + " (truth)");
  if (volume.aligned.dimensions != volume.truth.dimensions)
    throw Error(Error::Kind::BadInput, volume.name + ": its dimensions differ from those of its truth");
  if ((volume.aligned.spacing - volume.truth.spacing).cwiseAbs().maxCoeff() > 1e-6 * volume.truth.spacing.maxCoeff())
    throw Error(Error::Kind::BadInput, volume.name + ": its spacing differs from that of its truth");
  if (volume.indexPoints.empty())
    throw Error(Error::Kind::BadInput, volume.name + ": no voxel is valid and finite");
}

} // namespace

AlignmentScore ScoreAlignment(const std::vector<ScoredVolume>& volumes, int fixed)
{
  if (volumes.size() < 2)
    throw Error(Error::Kind::BadInput,
                "two volumes are needed to score an alignment; there " + std::string(volumes.empty() ? "are none" : "is one"));
  CheckFixedVolume(fixed, volumes.size());
  for (const ScoredVolume& volume : volumes)
    Check(volume);

  const ScoredVolume& gauge = volumes[static_cast<std::size_t>(fixed)];
  const Eigen::Affine3d truthToAligned = gauge.aligned.IndexToWorld() * gauge.truth.WorldToIndex();
  AlignmentScore score;
  for (const ScoredVolume& volume : volumes) {
    const Eigen::Affine3d toAligned = volume.aligned.IndexToWorld(), toPlace = truthToAligned * volume.truth.IndexToWorld();
    VolumeScore one;
    std::vector<double> distances;
    double squares = 0.0;
    for (const Eigen::Vector3d& u : volume.indexPoints) {
      one.points.push_back(toAligned * u);
      one.errors.push_back(one.points.back() - toPlace * u);
      distances.push_back(one.errors.back().norm());
      one.mean += distances.back();
      squares += one.errors.back().squaredNorm();
    }
    const double count = static_cast<double>(distances.size());
    one.mean /= count;
    one.rms = std::sqrt(squares / count);
    one.max = *std::max_element(distances.begin(), distances.end());
    one.median = Percentile(distances, 0.5);
    one.percentile95 = Percentile(distances, 0.95);
    if (&volume != &gauge)
      score.mean += one.mean / static_cast<double>(volumes.size() - 1);
    score.volumes.push_back(std::move(one));
  }
  return score;
}

} // namespace echorama
