// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A parameter that gets another name keeps the former one for one version. That is said where it is described:
//
//   Formerly(Parameter("DetailScale", p.detailScale, {1, 100}, "voxels", "What counts as smooth."), "DetailSize", "0.3")
//
// From then on --detail-size of a command, SetDetailSize and "DetailSize" by name set it, with a warning that tells the new name
// and the version in which the former one goes. In that version Formerly() is taken away.
#include "Core/Base/Parameters.h"
#include <functional>

namespace echorama {

struct FormerName {
  std::string name, until;

  std::string Warning(const std::string& asGiven, const std::string& now) const; ///< "--detail-size is now --detail-scale; ..."
};

/// \returns \a parameter. Its former name lasts as long as the process: descriptions are made anew for each use.
Parameter Formerly(Parameter parameter, const std::string& name, const std::string& until);

std::vector<FormerName> FormerNamesOf(const Parameter& parameter);

/// As Named(), also by a former name, of which \a warn is told. A parameter of that very name comes first.
Parameter& NamedOrFormerly(ParameterList& parameters, std::string_view name, const std::function<void(const std::string&)>& warn);

} // namespace echorama
