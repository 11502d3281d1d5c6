// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Tracking/Devices/FusedTracker.h"
#include "Tracking/Devices/OpenIgtLinkClient.h"
#include "Tracking/Devices/OpenIgtLinkListener.h"
#include "Tracking/Devices/OpticalTracker.h"
#include "Tracking/Devices/PolhemusTracker.h"
#include "Tracking/Devices/ReplayTracker.h"
#include "Tracking/Devices/SimulatedTracker.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"

namespace echorama {
namespace {

struct Kind {
  const char* scheme;
  std::unique_ptr<TrackerDevice> (*make)(const TrackerAddress& address);
};

template <class Device>
std::unique_ptr<TrackerDevice> Make(const TrackerAddress& address)
{
  return std::make_unique<Device>(address);
}
template <class Device, class Parameters>
std::unique_ptr<TrackerDevice> MakeBy(const TrackerAddress& address)
{
  return std::make_unique<Device>(Parameters::Of(address));
}

// Every kind of device, one line each.
const std::vector<Kind>& Kinds()
{
  static const std::vector<Kind> kinds = {
      {"replay", MakeBy<ReplayTracker, ReplayParameters>},
      {"simulated", MakeBy<SimulatedTracker, SimulatedTrackerParameters>},
      {OpenIgtLinkClient::Scheme, Make<OpenIgtLinkClient>},
      {OpenIgtLinkListener::Scheme, Make<OpenIgtLinkListener>},
      {PolhemusTracker::Scheme, Make<PolhemusTracker>},
      {FusedTracker::Scheme, MakeBy<FusedTracker, FusedTrackerParameters>},
      {OpticalTracker::Scheme, MakeBy<OpticalTracker, OpticalTrackerParameters>},
  };
  return kinds;
}

} // namespace

std::vector<std::string> TrackerSchemes()
{
  std::vector<std::string> schemes;
  for (const Kind& kind : Kinds())
    schemes.push_back(kind.scheme);
  return schemes;
}

std::unique_ptr<TrackerDevice> MakeTracker(const std::string& text)
{
  const TrackerAddress address = TrackerAddress::Parse(text);
  for (const Kind& kind : Kinds())
    if (address.scheme == kind.scheme)
      return kind.make(address);
  throw Error(Error::Kind::InvalidParameter,
              text + ": there is no tracker " + address.scheme + "; there are: " + Joined(TrackerSchemes()));
}

} // namespace echorama
