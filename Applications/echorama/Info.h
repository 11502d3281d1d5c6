// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Session.h"
#include <string>

namespace echorama {

// What info tells of one file, by its kind: lines for people, and the object that it returns. They lie in files of their own.
nlohmann::ordered_json DescribeVolume(Session&, const std::string& file);
nlohmann::ordered_json DescribeSequence(Session&, const std::string& file);
nlohmann::ordered_json DescribePoses(Session&, const std::string& file);
nlohmann::ordered_json DescribeTransforms(Session&, const std::string& file);

/// A line "  what        text", aligned with the others.
std::string Entry(const std::string& what, const std::string& text);

/// The header's other fields: all in the object, the first few, shortened, for people.
nlohmann::ordered_json DescribeFields(Session&, const std::vector<std::pair<std::string, std::string>>& fields);

} // namespace echorama
