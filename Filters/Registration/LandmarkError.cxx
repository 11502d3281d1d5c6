// SPDX-License-Identifier: BSD-3-Clause
// Labels are looked up in one ordered map per list: n log n for lists of n landmarks, for each pair of lists.
#include "LandmarkError.h"
#include "Core/Base/Error.h"
#include "Core/Base/Percentile.h"
#include <map>

namespace echorama {
namespace {

using Placed = std::map<std::string, Eigen::Vector3d>; // by label, in the world

Placed Place(const LandmarkList& list)
{
  const auto fail = [&list](const std::string& reason) { throw Error(Error::Kind::BadInput, list.name + ": " + reason); };
  if (!list.volumeToWorld.matrix().allFinite())
    fail("its pose is not finite");
  Placed placed;
  for (const Landmark& landmark : list.landmarks) {
    if (landmark.label.empty())
      fail("a landmark has no label; landmarks are paired by their labels");
    if (!landmark.position.allFinite())
      fail("the landmark \"" + landmark.label + "\" is not finite");
    if (!placed.emplace(landmark.label, list.volumeToWorld * landmark.position).second)
      fail("two landmarks have the label \"" + landmark.label + "\"");
  }
  return placed;
}

} // namespace

LandmarkError MeasureLandmarkError(const std::vector<LandmarkList>& lists)
{
  if (lists.size() < 2)
    throw Error(Error::Kind::BadInput, "landmarks of at least two volumes are needed");
  std::vector<Placed> placed;
  for (const LandmarkList& list : lists)
    placed.push_back(Place(list));

  LandmarkError result;
  std::vector<double> lengths;
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (std::size_t j = i + 1; j < lists.size(); ++j)
      for (const Landmark& landmark : lists[i].landmarks) {
        const auto other = placed[j].find(landmark.label);
        if (other == placed[j].end())
          continue;
        const Eigen::Vector3d place = placed[i].at(landmark.label), error = other->second - place;
        result.distances.push_back({landmark.label, static_cast<int>(i), static_cast<int>(j), place, error});
        lengths.push_back(error.norm());
        sum += lengths.back();
        squares += error.squaredNorm();
      }
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
