// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// Names a tracker in one line, the same for programs, scripts and ParaView: SCHEME:PLACE?OPTION=VALUE&OPTION=VALUE
///
/// | scheme      | place                     | back end                                               |
/// | ----------- | ------------------------- | ------------------------------------------------------ |
/// | igtl        | //HOST:PORT               | OpenIGTLink, we are the client (of Plus, of Slicer)    |
/// | igtl-listen | //HOST:PORT               | OpenIGTLink, we are the server; loopback by default    |
/// | polhemus    | /dev/ttyUSB0              | Polhemus Patriot or Liberty on a serial line           |
/// | replay      | FILE                      | a recording                                            |
/// | simulated   | (none)                    | a tracker that does not exist, with its faults         |
/// | fused       | LINE|LINE                 | place by one tracker, orientation by another           |
/// | optical     | CAMERA                    | lights on a printed skin, seen by a camera inside it   |
///
/// Sources of frames (CameraSource) are named likewise: camera:0, recording:FILE, simulated:.
///
/// Lines within a line have options of their own: those of the whole follow another bar, fused:LINE|LINE|OPTION=VALUE.
struct TrackerAddress {
  std::string text; ///< as given
  std::string scheme, place;
  std::map<std::string, std::string> options;

  /// \throws Error(InvalidParameter) when the text is not of that form or an option is given twice.
  static TrackerAddress Parse(const std::string& text);

  /// Sets \a parameters by the options of their names: "noiseMm" (or "noise-mm") sets NoiseMm.
  /// \throws Error(InvalidParameter) that names the address and what is wrong: no such option, no such value, out of range
  void Set(ParameterList parameters) const;

  /// "HOST:PORT" of a place like //HOST:PORT. Without a host \a fallbackHost, without a port \a fallbackPort.
  /// \throws Error(InvalidParameter) for a port outside [0, 65535].
  struct Endpoint {
    std::string host;
    int port = 0;
  };
  Endpoint HostAndPort(const std::string& fallbackHost, int fallbackPort) const;
};

} // namespace echorama
