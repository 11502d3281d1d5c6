// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAcquisition
 * @brief what is known of how a volume was acquired, as named field data
 *
 * | field          | values                                                                                   |
 * | -------------- | ---------------------------------------------------------------------------------------- |
 * | ProbeGeometry  | 6 doubles: fan angle (degrees), fan width (mm), sweep angle, sweep width, depth from, to; |
 * |                | a 7th, in whole fans, where the fan is not centred on the array (ProbeGeometry::fanOffset)  |
 * | ProbeToWorld   | 16 doubles, row by row: from the probe frame to the world, mm                             |
 * | ImageToWorld   | 16 doubles, row by row: from pixel indices of a 2D frame to the world, mm; affine         |
 * | TimeStamp      | 1 double, seconds                                                                         |
 * | Seed           | 1 unsigned 64-bit number: the seed of a synthetic volume                                  |
 * | Scene          | a string: what a synthetic volume shows, enough to make it again                          |
 *
 * ImageToWorld is the exact place of a tracked frame, whose pixels may be sheared a little by its calibration; the geometry
 * of the image is the nearest without shear. A frame whose tracker saw nothing has none.
 *
 * Nobody else spells these names. It has no state.
 */
#ifndef vtkUltrasoundAcquisition_h
#define vtkUltrasoundAcquisition_h

#include "EchoramaCoreModule.h"
#include "vtkObject.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>
#endif

class vtkDataObject;
class vtkInformationVector;
class vtkMatrix4x4;

class ECHORAMACORE_EXPORT vtkUltrasoundAcquisition : public vtkObject {
public:
  static vtkUltrasoundAcquisition* New();
  vtkTypeMacro(vtkUltrasoundAcquisition, vtkObject);

  ///@{
  /** Names of the fields. */
  static const char* ProbeGeometryName() { return "ProbeGeometry"; }
  static const char* ProbeToWorldName() { return "ProbeToWorld"; }
  static const char* ImageToWorldName() { return "ImageToWorld"; }
  static const char* TimeStampName() { return "TimeStamp"; }
  static const char* SeedName() { return "Seed"; }
  static const char* SceneName() { return "Scene"; }
  ///@}

  /** Copies ProbeToWorld into \a pose. Returns false, and leaves \a pose alone, when the data has none. */
  static bool GetProbeToWorld(vtkDataObject* data, vtkMatrix4x4* pose);

#ifndef __VTK_WRAP__
  /** Every field name, in the order of the table. */
  static std::vector<std::string> Names();

  static std::optional<echorama::ProbeGeometry> ProbeGeometryOf(vtkDataObject* data);
  static void SetProbeGeometry(vtkDataObject* data, const echorama::ProbeGeometry& geometry);
  static std::optional<echorama::Pose> ProbeToWorldOf(vtkDataObject* data);
  static void SetProbeToWorld(vtkDataObject* data, const echorama::Pose& pose);
  /** The probes of a repeatable input; without ProbeToWorld one lies at the origin. Throws Error(BadInput) that names the number
   * of the one without geometry. */
  static std::vector<echorama::PlacedProbe> ProbesOf(vtkInformationVector* port);
  static std::optional<Eigen::Affine3d> ImageToWorldOf(vtkDataObject* data);
  static void SetImageToWorld(vtkDataObject* data, const Eigen::Affine3d& imageToWorld);
  static std::optional<double> TimeStampOf(vtkDataObject* data);
  static void SetTimeStamp(vtkDataObject* data, double seconds);
  static std::optional<std::uint64_t> SeedOf(vtkDataObject* data);
  static void SetSeed(vtkDataObject* data, std::uint64_t seed);
  static std::optional<std::string> SceneOf(vtkDataObject* data);
  static void SetScene(vtkDataObject* data, const std::string& scene);

  /** The fields that \a data has, by name, each as one line of text that gives it back to the last bit. */
  static std::vector<std::pair<std::string, std::string>> ToText(vtkDataObject* data);

  /** Sets the field \a name from such a line. Returns false when there is no such field or the text does not fit it. */
  static bool SetFromText(vtkDataObject* data, const std::string& name, const std::string& text);
#endif

protected:
  vtkUltrasoundAcquisition() = default;
  ~vtkUltrasoundAcquisition() override = default;

private:
  vtkUltrasoundAcquisition(const vtkUltrasoundAcquisition&) = delete;
  void operator=(const vtkUltrasoundAcquisition&) = delete;
};

#endif
