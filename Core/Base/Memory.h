// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>

namespace echorama {

/// Bytes of memory that this process can have without swapping: what the machine has left, or less where a control group (a
/// container, a job of a cluster) limits it. Where neither tells, all that the machine has.
/// \param root where /proc and /sys lie
double FreeMemory(const std::string& root = "/");

/// Three digits of \a bytes, in 10^9 bytes, for messages: "0.749 GB".
std::string GigabytesText(double bytes);

} // namespace echorama
