// SPDX-License-Identifier: BSD-3-Clause
// Names are looked up by the system's asynchronous resolver, since the plain one can hang for half a minute where a name server
// does not answer; a lookup that cannot be taken back is left to end by itself.
#include "Tracking/Devices/HostLookup.h"
#include "Core/Base/Error.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <arpa/inet.h>
#include <memory>
#include <netdb.h>

namespace echorama {
namespace {

constexpr long SliceNanoseconds = 100000000;

// What the system's resolver works on; it must stay where it is until the resolver has done with it.
struct Lookup {
  std::string host;
  addrinfo hints{};
  gaicb request{};
  ~Lookup()
  {
    if (request.ar_result)
      freeaddrinfo(request.ar_result);
  }
};

[[noreturn]] void RefuseHost(const std::string& place, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, place + ": " + reason);
}

} // namespace

std::vector<in_addr> LookUpHost(const std::string& host, const std::string& place, double seconds,
                                const std::function<bool()>& stopped)
{
  in_addr number{};
  if (inet_pton(AF_INET, host.c_str(), &number) == 1)
    return {number};

  const double until = ClockNow() + seconds;
  auto lookup = std::make_unique<Lookup>();
  lookup->host = host;
  lookup->hints.ai_family = AF_INET;
  lookup->hints.ai_socktype = SOCK_STREAM; // one answer per address
  lookup->request.ar_name = lookup->host.c_str();
  lookup->request.ar_request = &lookup->hints;
  gaicb* list[1] = {&lookup->request};
  if (const int failed = getaddrinfo_a(GAI_NOWAIT, list, 1, nullptr))
    RefuseHost(place, gai_strerror(failed));
  while (gai_error(&lookup->request) == EAI_INPROGRESS) {
    const bool late = ClockNow() > until;
    if (late || (stopped && stopped())) {
      if (gai_cancel(&lookup->request) == EAI_NOTCANCELED)
        lookup.release(); // the resolver still writes to it
      if (!late)
        return {};
      RefuseHost(place, "the name was not found in time");
    }
    const timespec wait{0, SliceNanoseconds};
    gai_suspend(list, 1, &wait);
  }
  if (const int failed = gai_error(&lookup->request))
    RefuseHost(place, gai_strerror(failed));
  std::vector<in_addr> found;
  for (const addrinfo* info = lookup->request.ar_result; info; info = info->ai_next) {
    const in_addr address = reinterpret_cast<const sockaddr_in*>(info->ai_addr)->sin_addr;
    const auto same = [&address](const in_addr& other) { return other.s_addr == address.s_addr; };
    if (std::none_of(found.begin(), found.end(), same))
      found.push_back(address);
  }
  return found;
}

std::string HostNumber(const in_addr& address)
{
  char text[INET_ADDRSTRLEN] = "";
  inet_ntop(AF_INET, &address, text, sizeof text);
  return text;
}

} // namespace echorama
