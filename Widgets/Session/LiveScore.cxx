// SPDX-License-Identifier: BSD-3-Clause
// Volumes with a truth wait as ScoreAlignment takes them; an update puts in where they lie now and calls it, so that the live
// figure cannot differ from the final one. With 2000 points a volume that is some ten thousand multiplications.
#include "LiveScore.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {

int LiveScoreResult::IndexOf(int id) const
{
  const auto found = std::find(ids.begin(), ids.end(), id);
  return found == ids.end() ? -1 : static_cast<int>(found - ids.begin());
}

void LiveScore::Set(int id, const std::string& name, const ImageGeometry& truth, std::vector<Eigen::Vector3d> points)
{
  truth.Check(name + " (truth)");
  if (points.empty())
    throw Error(Error::Kind::BadInput, name + ": no voxel is valid and finite");
  volumes_[id] = {truth, truth, std::move(points), name};
}

LiveScoreResult LiveScore::Update(const std::map<int, ImageGeometry>& aligned, int fixed) const
{
  std::vector<ScoredVolume> volumes;
  std::vector<int> ids;
  int gauge = -1;
  for (const auto& [id, volume] : volumes_) {
    const auto place = aligned.find(id);
    if (place == aligned.end())
      continue;
    if (id == fixed)
      gauge = static_cast<int>(ids.size());
    ids.push_back(id);
    volumes.push_back(volume);
    volumes.back().aligned = place->second;
  }
  if (volumes.size() >= 2 && gauge < 0)
    throw Error(Error::Kind::InvalidParameter,
                "the fixed volume must be one of those that have a truth; volume " + std::to_string(fixed) + " is not");

  LiveScoreResult result;
  static_cast<AlignmentScore&>(result) = ScoreAlignment(volumes, gauge);
  result.ids = std::move(ids);
  const ScoredVolume& f = volumes[static_cast<std::size_t>(gauge)];
  const Eigen::Matrix3d truthToAligned = f.aligned.direction * f.truth.direction.transpose();
  for (const ScoredVolume& volume : volumes) {
    const Eigen::Matrix3d left = volume.aligned.direction * (truthToAligned * volume.truth.direction).transpose();
    result.degrees.push_back(LogRotation(left).norm() * 180.0 / M_PI);
  }
  return result;
}

} // namespace echorama
