// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <string>
#include <vector>

namespace echorama {

using Tint = std::array<double, 3>; ///< RGB in [0, 1]

/// Tints that volumes get one after the other, under a name. All are light, so that grey levels stay readable through them.
struct TintSet {
  const char* name;
  std::vector<Tint> tints;
};

/// "many": seven, for eyes that see all colours. "grey-amber" and "blue-orange": three that also people can tell apart who see
/// no red or no green.
const std::vector<TintSet>& TintSets();
/// \throws Error(InvalidParameter) for a name that none has.
const TintSet& TintSetOf(const std::string& name);

} // namespace echorama
