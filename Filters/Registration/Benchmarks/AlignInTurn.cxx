// SPDX-License-Identifier: BSD-3-Clause
// k volumes need k - 1 searches; the order between them costs k (k - 1) / 2 overlaps, measured at the coarsest resolution,
// a millisecond or two each. Overlaps are measured anew after each search, because the set of placed volumes has grown.
#include "Filters/Registration/Benchmarks/AlignInTurn.h"
#include "Core/Base/Error.h"
#include "Filters/Registration/VolumeOverlap.h"

namespace echorama {

std::vector<AlignSearchResult> AlignInTurn(std::vector<PlacedVolume> volumes, int fixed, const AlignSearchParameters& p,
                                           const Progress& progress)
{
  p.Check();
  const std::size_t count = volumes.size();
  if (count < 2)
    throw Error(Error::Kind::BadInput,
                "two volumes are needed to align; there " + std::string(count == 1 ? "is one" : "are none"));
  CheckFixedVolume(fixed, count);

  std::vector<AlignSearchResult> results(count);
  results[static_cast<std::size_t>(fixed)].volumeToWorld = volumes[static_cast<std::size_t>(fixed)].volumeToWorld;
  std::vector<PlacedVolume> placed{volumes[static_cast<std::size_t>(fixed)]};
  std::vector<bool> isPlaced(count, false);
  isPlaced[static_cast<std::size_t>(fixed)] = true;
  for (std::size_t turn = 1; turn < count; ++turn) {
    std::size_t next = count;
    double most = -1.0;
    for (std::size_t v = 0; v < count; ++v) {
      if (isPlaced[v])
        continue;
      const double overlap = OverlapOf(placed, volumes[v], p.points, p.seed);
      if (overlap > most) {
        most = overlap;
        next = v;
      }
    }
    const double steps = static_cast<double>(count - 1);
    results[next] = AlignSearch(placed, volumes[next], p,
                                progress.Part(static_cast<double>(turn - 1) / steps, static_cast<double>(turn) / steps));
    volumes[next].volumeToWorld = results[next].volumeToWorld;
    placed.push_back(volumes[next]);
    isPlaced[next] = true;
  }
  return results;
}

} // namespace echorama
