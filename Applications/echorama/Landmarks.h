// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Registration/LandmarkError.h"
#include "Session.h"
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace echorama {

/// The option --landmarks: a file for each volume, in the order of the volumes.
CLI::Option* AddLandmarksOption(CLI::App* options, std::vector<std::string>& files, const std::string& use);

/// The landmarks of each of \a volumes, none where the file is "-", their poses still to be set. Throws Error when there are not
/// as many files as volumes; \a whose tells where those are named.
std::vector<LandmarkList> ReadLandmarkLists(const std::vector<std::string>& files, std::size_t volumes, const std::string& whose);

/// How far they lie apart: said, and told as "landmarks" in the results. \param volumes their files
void TellLandmarkError(Session&, const std::vector<LandmarkList>&, const std::vector<std::string>& volumes);

} // namespace echorama
