// SPDX-License-Identifier: BSD-3-Clause
#include "LineProfile.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/Sampling.h"
#include <limits>

namespace echorama {

std::vector<double> LineProfile(const AnyPosedVolume& volume, const Eigen::Vector3d& from, const Eigen::Vector3d& to, int count)
{
  if (count < 2)
    throw Error(Error::Kind::InvalidParameter, "a profile needs at least two places, not " + std::to_string(count));
  if (!from.allFinite() || !to.allFinite())
    throw Error(Error::Kind::InvalidParameter, "the ends of a profile must be finite");
  std::vector<double> values(static_cast<std::size_t>(count), std::numeric_limits<double>::quiet_NaN());
  std::visit(
      [&](const auto& posed) {
        posed.geometry.Check("the volume of a profile");
        const Sampler sampler(posed.intensity, posed.valid);
        const Eigen::Affine3d toIndex = posed.geometry.WorldToIndex();
        for (int i = 0; i < count; ++i) {
          const Eigen::Vector3d at = toIndex * Eigen::Vector3d(from + (to - from) * i / (count - 1));
          sampler.Linear(at.x(), at.y(), at.z(), values[static_cast<std::size_t>(i)]);
        }
      },
      volume);
  return values;
}

} // namespace echorama
