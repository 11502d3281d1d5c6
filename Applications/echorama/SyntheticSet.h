// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/PoseFile.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Readers/OutputFiles.h"
#include "Session.h"
#include <CLI/App.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

class vtkImageData;

namespace echorama {

/// What a set of volumes with truth looks like on disk: volume_1 ... volume_N, each but the first knocked out of place by a
/// known amount, truth.json with the poses that put them back, and landmarks_N.csv if there are landmarks. The first volume
/// stays where it is, so that poses found with it held fixed lie in the frame of the truth.
class SyntheticSet {
public:
  /// How far every volume but the first is put out of place.
  struct Knock {
    double mm = 8.0, degrees = 6.0;
    std::uint64_t seed = 1;
  };

  SyntheticSet(Session& session, OutputFolder& folder, const std::string& format, const Knock& knock);

  /// Where a place of the tissue (mm, world) is seen in the volume before the knock; nothing where it is not seen.
  using SeenAt = std::function<std::optional<Eigen::Vector3d>(const Eigen::Vector3d& place)>;

  /// Knocks the next volume, writes it, and adds it to the results with the numbers of \a more. Returns the knock.
  /// \param displacement how the tissue lay when it was scanned, from rest; the truth names it as that of the volume
  Pose Add(vtkImageData* image, const nlohmann::ordered_json& more, const std::vector<Landmark>& places = {},
           const SeenAt& seenAt = {}, vtkImageData* displacement = nullptr);

  /// Writes the truth and commits the folder.
  void Finish();

private:
  Session& session_;
  OutputFolder& folder_;
  std::string format_;
  Knock knock_;
  std::vector<VolumePose> truth_;
};

/// The options --landmarks and --format.
void AddSetOptions(CLI::App& options, int& landmarks, std::string& format);

/// Places of the tissue that two views at least see, at random: \a count of them, or fewer when they are hard to find.
std::vector<Landmark> SharedPlaces(std::uint64_t seed, int count, const ProbeGeometry& probe, const std::vector<Pose>& views);

} // namespace echorama
