// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <netinet/in.h>
#include <string>
#include <vector>

namespace echorama {

/// The IPv4 addresses of a host, given by name or number, in the system's order, each once; ports are 0. Nothing when \a stopped,
/// which is asked ten times a second, said so. \throws Error(FileSystem), which begins with \a place, when the host has none, or
/// none is found within \a seconds.
std::vector<in_addr> LookUpHost(const std::string& host, const std::string& place, double seconds,
                                const std::function<bool()>& stopped = nullptr);

/// "192.168.0.3"
std::string HostNumber(const in_addr& address);

} // namespace echorama
