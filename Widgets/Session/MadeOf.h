// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

struct SessionState;
struct SessionVolume;

/// What a volume of a session was made of: others of the session, as they were then, and how. The link from a result to its
/// sources.
struct MadeOf {
  struct Source {
    std::string name;       ///< in the session; follows when the volume is renamed
    std::string file;       ///< without its folder; empty: it was in none
    ImageGeometry geometry; ///< of its file
    Pose pose;              ///< of its file in the space of the result: both can be moved together
    std::string strokes;    ///< fingerprint of those that it had; empty: none
    std::string making;     ///< and, when it was a result itself, of its own MadeOf
  };
  std::vector<Source> sources;                ///< in the order in which they were taken
  std::map<std::string, std::string> options; ///< what whoever made it needs to make it again
};

bool operator==(const MadeOf&, const MadeOf&); ///< exact, names as well

/// The same for all that say the same, whatever volumes are called: results with one fingerprint have the same voxels.
std::string FingerprintOf(const MadeOf& madeOf);

/// What a result that lies in the world as it is made will have been made of. Take it before the work begins.
/// \throws Error(InvalidParameter) when there are no ids, or one is of no volume or given twice.
MadeOf RecordSources(const SessionState& state, const std::vector<int>& ids, std::map<std::string, std::string> options);

/// Where its sources are: ids in their order; 0: gone.
std::vector<int> SourcesOf(const SessionState& state, const MadeOf& madeOf);

/// Empty: there is none of this name.
std::string OptionOf(const MadeOf& madeOf, const std::string& name);

/// What has become of the sources of \a result since, for people: "A was moved; B is gone". Empty: they are as they were, and it
/// would be made as it is. Poses count beside that of the result, to a ten-thousandth of a millimetre at the volume's corners;
/// looks, visibility, landmarks and files that were moved do not.
std::string ChangesSince(const SessionState& state, const SessionVolume& result);

///@{ As JSON: {"sources": [{"name", "file", "geometry", "VolumeToResult", "strokes", "making"}], "options": {..}}.
std::string TextOf(const MadeOf& madeOf);
/// \throws Error(BadFile) that names \a place and the field.
MadeOf MadeOfText(const std::string& text, const std::string& place);
std::map<std::string, std::string> OptionsOfText(const std::string& text, const std::string& place);
///@}

} // namespace echorama
