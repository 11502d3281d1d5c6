// SPDX-License-Identifier: BSD-3-Clause
// The poses of one tool out of a track: of vtkUltrasoundSequenceReader, or of anybody who names arrays alike.
#ifndef vtkUltrasoundTrackPoses_h
#define vtkUltrasoundTrackPoses_h

#include "Core/Base/Error.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/MotionPath.h"

#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <limits>
#include <string>
#include <vector>

namespace echorama {

struct TrackPoses {
  std::string tool; ///< empty: the track names none
  std::vector<TimedPose> poses;
};

/// Those of \a tool by its name in ToolNames; empty takes the only one. The point array \a array holds 16 numbers, row by row;
/// TimeStamp gives the times (NaN without it). Points whose array Status is not 0 are left out.
/// \throws Error(BadInput) that begins with \a name when there is no track, no such array, or no such tool; or several, and none
/// is named.
inline TrackPoses TrackPosesOf(vtkPolyData* track, const std::string& array, const std::string& tool, const std::string& name)
{
  const auto refuse = [&name](const std::string& reason) { throw Error(Error::Kind::BadInput, name + ": " + reason); };
  if (!track || track->GetNumberOfPoints() == 0) {
    refuse("it is empty; a track is needed, one point per pose");
  }
  vtkDataArray* matrices = track->GetPointData()->GetArray(array.c_str());
  if (!matrices || matrices->GetNumberOfComponents() != 16) {
    refuse("it has no point array \"" + array + "\" of 16 numbers");
  }
  vtkDataArray* times = track->GetPointData()->GetArray("TimeStamp");
  vtkDataArray* status = track->GetPointData()->GetArray("Status");
  vtkDataArray* tools = track->GetPointData()->GetArray("Tool");
  auto names = vtkStringArray::SafeDownCast(track->GetFieldData()->GetAbstractArray("ToolNames"));

  TrackPoses result;
  vtkIdType wanted = -1;
  if (tools && names) {
    std::string list;
    for (vtkIdType i = 0; i < names->GetNumberOfValues(); ++i) {
      const std::string& there = names->GetValue(i);
      list += (list.empty() ? "" : ", ") + there;
      if (there == tool || (tool.empty() && names->GetNumberOfValues() == 1)) {
        wanted = i;
        result.tool = there;
      }
    }
    if (wanted < 0) {
      refuse(tool.empty() ? "it has several tools; name one of " + list
                          : "there is no tool \"" + tool + "\"; there are: " + list);
    }
  } else if (!tool.empty()) {
    refuse("it names no tools (Tool, ToolNames), so there is no \"" + tool + "\"");
  }
  for (vtkIdType i = 0; i < track->GetNumberOfPoints(); ++i) {
    if ((wanted >= 0 && tools->GetComponent(i, 0) != static_cast<double>(wanted)) ||
        (status && status->GetComponent(i, 0) != 0.0)) {
      continue;
    }
    double rows[16];
    matrices->GetTuple(i, rows);
    const double time = times ? times->GetComponent(i, 0) : std::numeric_limits<double>::quiet_NaN();
    result.poses.push_back({time, FromRows<Pose>(rows)});
  }
  return result;
}

} // namespace echorama

#endif
