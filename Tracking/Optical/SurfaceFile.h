// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/BlinkCode.h"
#include "Tracking/Optical/BrightnessCalibration.h"
#include "Tracking/Optical/LightTracker.h"
#include "Tracking/Optical/SurfaceMap.h"
#include <string>
#include <vector>

namespace echorama {

/// How good a calibration was when it was made.
struct SurfaceAccuracy {
  int marks = 0, inliers = 0;
  double medianMm = 0.0, mm95 = 0.0, mostMm = 0.0; ///< at marks that were left out
  double scatterMm = 0.0;                          ///< how well the light was put down, per axis
  double ownMm = 0.0;                              ///< of the map itself, radius of 95%
  double coverage = 0.0;                           ///< of the skin's picture
};

/// The lights that a calibration was made with. All that tells whose a light is lies in the words.
struct SurfaceLights {
  int lights = 1, offSlots = 2;
  bool alternating = false; ///< BlinkCode::Alternating; else BlinkCode::Make(lights, offSlots)

  BlinkCode Code() const; ///< \throws Error(InvalidParameter)
};

/// A printed skin with its camera, calibrated: all that a tracker needs.
struct CalibratedSurface {
  SurfaceMap map;
  std::string shell;  ///< what its marker says; empty: it has none
  std::string camera; ///< the line that the camera was opened with, for people
  std::string date;   ///< "2026-11-26", for people
  SurfaceLights lights;
  SpotTracksParameters tracks;
  SpotDetectorParameters detector;
  BrightnessCalibration brightness; ///< may be empty
  SurfaceAccuracy accuracy;
  std::vector<Eigen::Vector3d> marks; ///< in their order: for drift checks

  /// What finds lights in this camera's frames. \throws Error(InvalidParameter)
  LightTracker MakeTracker() const { return LightTracker(detector, tracks, lights.Code(), brightness); }
  /// \throws Error(BadInput) when the camera's pictures are of another size than when it was calibrated. \param name of the
  /// calibration, for the message
  void CheckPicture(int width, int height, const std::string& name) const;
  /// \throws Error(BadInput) when another shell is mounted. \param mounted what its marker says
  void CheckShell(const std::string& mounted, const std::string& name) const;
};

/// Where the mesh of a calibration is written: NAME.mesh.stl of NAME.json. \throws Error(InvalidParameter) for another extension
std::string SurfaceMeshFile(const std::string& path);

/// Writes the calibration \a path (`echorama-surface-1`, JSON) and, beside it, the mesh of the skin, SurfaceMeshFile(). Both
/// or none. Numbers come back to the last bit, points of the mesh as floats. \throws Error(FileSystem), Error(InvalidParameter)
/// for what a file cannot hold
void WriteSurface(const std::string& path, const CalibratedSurface& surface);

/// \throws Error(FileSystem) for a file that is missing or cannot be read, the mesh too; Error(BadFile) that names the way to the
/// key of what is damaged, and for a mesh that is not the one of the calibration
CalibratedSurface ReadSurface(const std::string& path);

} // namespace echorama
