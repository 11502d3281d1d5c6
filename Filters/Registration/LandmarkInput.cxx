// SPDX-License-Identifier: BSD-3-Clause
#include "LandmarkInput.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/LandmarkFile.h"
#include "Index.h"
#include <algorithm>

namespace echorama {

int LandmarkInput::Count() const
{
  const int byPoints = points.empty() ? 0 : points.rbegin()->first + 1;
  return std::max(static_cast<int>(files.size()), byPoints);
}

std::vector<std::vector<Landmark>> LandmarkInput::Lists(int volumes) const
{
  if (Count() > volumes || (!points.empty() && points.begin()->first < 0))
    throw Error(Error::Kind::BadInput, "there are landmarks of volume " +
                                           std::to_string(Count() > volumes ? Count() - 1 : points.begin()->first) +
                                           ", counted from 0, and there are " + std::to_string(volumes) + " volumes");
  std::vector<std::vector<Landmark>> lists(Index(volumes));
  for (std::size_t i = 0; i < files.size(); ++i)
    if (!files[i].empty())
      lists[i] = ReadLandmarks(files[i]);
  for (const auto& [volume, more] : points)
    lists[Index(volume)].insert(lists[Index(volume)].end(), more.begin(), more.end());
  return lists;
}

} // namespace echorama
