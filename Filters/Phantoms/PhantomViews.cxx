// SPDX-License-Identifier: BSD-3-Clause
// All steps from one view to the next are the same screw motion, so neighbours overlap alike; how far a step goes is found
// by bisection of the overlap, which falls with the length of the step.
#include "PhantomViews.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Phantom.h"
#include <cmath>

namespace echorama {
namespace {

constexpr double radiansPerDegree = 0.017453292519943295;

struct Counts {
  long here = 0, both = 0;
  Counts& operator+=(const Counts& other)
  {
    here += other.here;
    both += other.both;
    return *this;
  }
};

} // namespace

double OverlapFraction(const ProbeGeometry& probe, const Pose& pose)
{
  constexpr int n = 48;
  const Eigen::AlignedBox3d box = BoxAround(probe);
  const Pose back = pose.inverse();
  const Counts counts = ParallelSum<Counts>(n, 4, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Counts part;
    for (std::ptrdiff_t k = begin; k < end; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const Eigen::Vector3d fraction((i + 0.5) / n, (j + 0.5) / n, (static_cast<double>(k) + 0.5) / n);
          const Eigen::Vector3d point = box.min() + fraction.cwiseProduct(box.sizes());
          if (!BeamPointAt(probe, point))
            continue;
          ++part.here;
          part.both += BeamPointAt(probe, back * point) ? 1 : 0;
        }
    return part;
  });
  return counts.here > 0 ? static_cast<double>(counts.both) / static_cast<double>(counts.here) : 0.0;
}

std::vector<PhantomView> PhantomViews(const ProbeGeometry& probe, int count, double overlap)
{
  probe.Check();
  if (count < 1)
    throw Error(Error::Kind::InvalidParameter, "the number of views must be at least 1, not " + std::to_string(count));
  if (!(overlap >= 0.05 && overlap <= 0.95))
    throw Error(Error::Kind::InvalidParameter, "the overlap of neighbouring views must be in [0.05, 0.95]");
  // Per mm along x. Turning by -y while going along +x is how a probe follows a body that bulges towards it.
  Twist perMm;
  perMm << 1.0, 0.2, 0.0, 0.0004, -0.0022, 0.0009;
  double near = 0.0, far = BoxAround(probe).sizes().x();
  for (int step = 0; step < 10; ++step) {
    const double middle = 0.5 * (near + far);
    (OverlapFraction(probe, Exp(perMm * middle)) > overlap ? near : far) = middle;
  }
  const double gains[] = {0.0, 2.5, -1.5};
  std::vector<PhantomView> views(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    views[static_cast<std::size_t>(i)] = {Exp(perMm * (0.5 * (near + far) * (i - 0.5 * (count - 1)))), gains[i % 3]};
  return views;
}

Pose KnockedPose(std::uint64_t seed, std::uint64_t item, double mm, double degrees, const Eigen::Vector3d& centre)
{
  if (!(mm >= 0.0 && degrees >= 0.0) || !std::isfinite(mm) || !std::isfinite(degrees) || !centre.allFinite())
    throw Error(Error::Kind::InvalidParameter,
                "a knock needs a finite centre, and sizes in mm and degrees that are not negative");
  Random random(seed, item);
  const Eigen::Vector3d direction = random.Direction(), axis = random.Direction();
  return MotionAbout(centre, axis * (degrees * radiansPerDegree), direction * mm);
}

std::vector<Landmark> SharedPlaces(std::uint64_t seed, int count, const ProbeGeometry& probe, const std::vector<Pose>& views)
{
  std::vector<Landmark> places;
  Random random(seed, 0x1a4d);
  const Eigen::AlignedBox3d box = BoxAround(probe);
  for (int attempt = 0; attempt < 1000 * count && static_cast<int>(places.size()) < count; ++attempt) {
    const Pose& view = views[random.Below(views.size())];
    const Eigen::Vector3d share(random.Uniform(), random.Uniform(), random.Uniform());
    const Eigen::Vector3d place = view * (box.min() + share.cwiseProduct(box.sizes()));
    const auto sees = [&](const Pose& other) { return BeamPointAt(probe, other.inverse() * place).has_value(); };
    if (sees(view) && std::count_if(views.begin(), views.end(), sees) > 1)
      places.push_back({"L" + std::to_string(places.size() + 1), place});
  }
  return places;
}

} // namespace echorama
