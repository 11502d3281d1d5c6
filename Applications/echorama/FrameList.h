// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <vector>

namespace echorama {

/// The frames that a list such as "0:44,46:94:2,139" names: single ones, and from:to:step with both ends; left out are the
/// first, the last and 1. They come in the order of the list; an empty list is all. Counts from 0.
/// Throws Error(InvalidParameter) that says what is wrong and how many frames \a count are there.
std::vector<int> FramesInList(const std::string& list, int count);

} // namespace echorama
