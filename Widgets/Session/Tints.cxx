// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/Tints.h"
#include "Core/Base/Error.h"

namespace echorama {

const std::vector<TintSet>& TintSets()
{
  static const std::vector<TintSet> sets{{"many",
                                          {{1.0, 1.0, 1.0},
                                           {1.0, 0.72, 0.38},
                                           {0.45, 0.78, 1.0},
                                           {0.60, 0.92, 0.50},
                                           {1.0, 0.58, 0.80},
                                           {0.92, 0.90, 0.42},
                                           {0.70, 0.64, 1.0}}},
                                         {"grey-amber", {{1.0, 1.0, 1.0}, {1.0, 0.72, 0.20}, {0.45, 0.78, 1.0}}},
                                         {"blue-orange", {{0.40, 0.68, 1.0}, {1.0, 0.68, 0.36}, {1.0, 1.0, 1.0}}}};
  return sets;
}

const TintSet& TintSetOf(const std::string& name)
{
  for (const TintSet& set : TintSets())
    if (set.name == name)
      return set;
  throw Error(Error::Kind::InvalidParameter, "there are no tints called " + name + "; there are many, grey-amber, blue-orange");
}

} // namespace echorama
