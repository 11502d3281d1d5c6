// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/PoseFile.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Readers/OutputFiles.h"
#include "Session.h"
#include <CLI/App.hpp>
#include <cstdint>
#include <vector>

class vtkImageData;

namespace echorama {

/// What a set of volumes with truth looks like on disk: volume_1 ... volume_N, each but the first knocked out of place by a
/// known amount, truth.json with the poses that put them back, and landmarks_N.csv if there are landmarks. The first volume
/// stays where it is, so that poses found with it held fixed lie in the frame of the truth.
class SyntheticSet {
public:
  /// \param knockMm, knockDegrees how far every volume but the first is put out of place
  SyntheticSet(Session& session, OutputFolder& folder, const std::string& format, double knockMm, double knockDegrees);

  /// Writes the next volume, which the knock has moved already, and adds it to the results with the numbers of \a more.
  /// \param landmarks as the volume has them
  /// \param displacement how the tissue lay when it was scanned, from rest; the truth names it as that of the volume
  void Add(vtkImageData* image, const Pose& knock, const nlohmann::ordered_json& more,
           const std::vector<Landmark>& landmarks = {}, vtkImageData* displacement = nullptr);

  /// Writes the truth and commits the folder.
  void Finish();

private:
  Session& session_;
  OutputFolder& folder_;
  std::string format_;
  double knockMm_, knockDegrees_;
  std::vector<VolumePose> truth_;
};

/// The options --landmarks and --format.
void AddSetOptions(CLI::App& options, int& landmarks, std::string& format);

} // namespace echorama
