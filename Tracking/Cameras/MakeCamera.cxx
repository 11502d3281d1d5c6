// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Tracking/Cameras/CameraSource.h"
#include "Tracking/Cameras/LiveCamera.h"
#include "Tracking/Cameras/RecordedSource.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/TrackerAddress.h"

namespace echorama {
namespace {

struct CameraKind {
  const char* scheme;
  std::unique_ptr<CameraSource> (*make)(const TrackerAddress& address);
};

template <class Source, class Parameters>
std::unique_ptr<CameraSource> MakeSourceBy(const TrackerAddress& address)
{
  return std::make_unique<Source>(Parameters::Of(address));
}

// Every kind of source, one line each.
const std::vector<CameraKind>& CameraKinds()
{
  static const std::vector<CameraKind> kinds = {
      {"camera",
       [](const TrackerAddress& address) -> std::unique_ptr<CameraSource> {
         return std::make_unique<LiveCamera>(LiveCameraParameters::Of(address));
       }},
      {"recording", MakeSourceBy<RecordedSource, RecordedSourceParameters>},
      {"simulated", MakeSourceBy<SimulatedSource, SimulatedSourceParameters>},
  };
  return kinds;
}

} // namespace

std::vector<std::string> CameraSchemes()
{
  std::vector<std::string> schemes;
  for (const CameraKind& kind : CameraKinds())
    schemes.push_back(kind.scheme);
  return schemes;
}

std::unique_ptr<CameraSource> MakeCamera(const TrackerAddress& address)
{
  for (const CameraKind& kind : CameraKinds())
    if (address.scheme == kind.scheme)
      return kind.make(address);
  throw Error(Error::Kind::InvalidParameter,
              address.text + ": there is no camera source " + address.scheme + "; there are: " + Joined(CameraSchemes()));
}

std::unique_ptr<CameraSource> MakeCamera(const std::string& line)
{
  return MakeCamera(TrackerAddress::Parse(line));
}

} // namespace echorama
