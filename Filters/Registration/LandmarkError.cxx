// SPDX-License-Identifier: BSD-3-Clause
#include "LandmarkError.h"
#include "Core/Base/Error.h"
#include "Core/Base/Percentile.h"
#include "LandmarkTerm.h"
#include <set>

namespace echorama {

Eigen::Vector3d LandmarkList::Place(const Eigen::Vector3d& point) const
{
  const Eigen::Vector3d moved = volumeToWorld * point;
  if (!displacement)
    return moved;
  try {
    return displacement->Inverse(moved);
  } catch (const Error& error) {
    throw Error(error.GetKind(), name + ": " + error.what());
  }
}

LandmarkError MeasureLandmarkError(const std::vector<LandmarkList>& lists)
{
  if (lists.size() < 2)
    throw Error(Error::Kind::BadInput, "landmarks of at least two volumes are needed");
  for (const LandmarkList& list : lists)
    if (!list.volumeToWorld.matrix().allFinite())
      throw Error(Error::Kind::BadInput, list.name + ": its pose is not finite");

  LandmarkError result;
  std::vector<double> lengths;
  std::set<std::string> matched;
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (std::size_t j = i + 1; j < lists.size(); ++j)
      for (const LandmarkPair& pair : PairLandmarks(lists[i].landmarks, lists[i].name, lists[j].landmarks, lists[j].name)) {
        const Eigen::Vector3d place = lists[i].Place(pair.fixed), error = lists[j].Place(pair.moving) - place;
        result.distances.push_back({pair.label, static_cast<int>(i), static_cast<int>(j), place, error});
        matched.insert(pair.label);
        lengths.push_back(error.norm());
        sum += lengths.back();
        squares += error.squaredNorm();
      }
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const Landmark& landmark : lists[i].landmarks)
      if (matched.count(landmark.label) == 0)
        result.unmatched.push_back({landmark.label, static_cast<int>(i)});
  if (lengths.empty())
    throw Error(Error::Kind::BadInput, "no label is in two of the lists of landmarks");
  const double count = static_cast<double>(lengths.size());
  result.mean = sum / count;
  result.rms = std::sqrt(squares / count);
  result.median = Percentile(lengths, 0.5);
  result.percentile95 = Percentile(lengths, 0.95);
  result.max = *std::max_element(lengths.begin(), lengths.end());
  return result;
}

} // namespace echorama
