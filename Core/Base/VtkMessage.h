// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <vector>

namespace echorama {

/// What a VTK class reports, as one sentence on one line: "ERROR: In FILE, line N\nvtkClass (0x1234): message\n\n" is
/// "message". Texts of another form keep all their words.
std::string SentenceOfVtkMessage(std::string text);

/// The first of several such errors that gives a reason: the executive only tells that an algorithm failed, sometimes before
/// the class that ran it tells why. Empty: there are none.
std::string ReasonAmong(const std::vector<std::string>& errors);

} // namespace echorama
