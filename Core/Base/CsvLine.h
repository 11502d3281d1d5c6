// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// The cells of one line of a table, blanks included: text in double quotes may hold separators, and two quotation marks for
/// one. \returns false when a quotation mark is not closed
bool SplitCsvLine(std::string_view line, char separator, std::vector<std::string>& cells);

} // namespace echorama
