// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundPoseEditor
 * @brief moves chosen volumes by hand, as a step of the pipeline that stays editable
 *
 * Input 0 (repeatable): volumes (vtkImageData, or the image leaves of vtkDataObjectTree). Output: a vtkMultiBlockDataSet with the
 * same volumes in the same order, one block each, with the same NAME(). Voxels are shared, nothing is resampled; of the chosen
 * volumes geometry, `ProbeToWorld` and `ImageToWorld` are new. In ParaView a box in the 3D view, around these volumes, is the
 * handle.
 *
 * The motion is the rotation (about the world's y, then x, then z, as vtkProp3D::SetOrientation has it) about the centre, then
 * the translation.
 *
 * Input 1 (optional, repeatable): the same volumes, in the same order, where they belong. Then the output tells how far they are
 * from there, as vtkUltrasoundAlignmentScore does.
 *
 * Field data of each block: VolumeToWorld, 16 doubles row by row, the motion here after the one that the input tells (an
 * aligner's), if any. With a truth, field data of the whole: Score, the mean of the volumes' scores in mm, the fixed one not
 * counted, and VolumeScore, mm, one per volume.
 *
 * Fails with a message when a chosen volume is not there, or the truth has not as many volumes, of the same dimensions and
 * spacing, and two or more.
 *
 * @sa vtkUltrasoundAlignmentSession, vtkUltrasoundAlignmentScore, vtkUltrasoundAligner
 */
#ifndef vtkUltrasoundPoseEditor_h
#define vtkUltrasoundPoseEditor_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignmentScore.h"
#include "Filters/Registration/PoseEdit.h"
#include <array>
#include <map>
#include <vector>
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundPoseEditor : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundPoseEditor* New();
  vtkTypeMacro(vtkUltrasoundPoseEditor, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volumes that are moved, counted from 0. Default none named: all but the fixed one, or the only one there is. */
  void AddVolume(int volume);
  void ClearVolumes();
  int GetNumberOfChosenVolumes() const { return static_cast<int>(this->Volumes.size()); }
  ///@}

  // BEGIN parameters
  enum RotateAbouts { WORLD_ORIGIN = 0, MIDDLE = 1, CENTRE = 2 };

  ///@{
  /**
   * What the rotation turns about. The box in ParaView's view shows the motion with the world's origin; the middle of the chosen
   * volumes is handier to turn by numbers. Default world-origin. There are WORLD_ORIGIN, MIDDLE, CENTRE.
   */
  vtkUltrasoundChoiceMacro(RotateAbout);
  void SetRotateAboutToWorldOrigin() { this->SetRotateAbout(WORLD_ORIGIN); }
  void SetRotateAboutToMiddle() { this->SetRotateAbout(MIDDLE); }
  void SetRotateAboutToCentre() { this->SetRotateAbout(CENTRE); }
  ///@}

  /** Motion along the axes of the world, after the rotation. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Translation);

  /** Turns about the axes of the world: about y first, then x, then z. In degrees; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Rotation);

  /** The point that the rotation turns about. Used when RotateAbout is centre. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Centre);

  /**
   * The volume that stays unless it is named, and on which alignment and truth are taken to agree; counted from 0. At least 0;
   * default 0.
   */
  vtkUltrasoundIntegerMacro(FixedVolume);

  /** Points of each volume that are scored. In [1, 10000000]; default 2000. */
  vtkUltrasoundIntegerMacro(Points);

  /** The same seed draws the same points. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Where the volumes belong: adds one to input 1, or sets it. */
  void AddTruthConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddTruthData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllTruths() { this->SetInputConnection(1, nullptr); }
  ///@}

  /** The score of the last update, mm. NaN without truth or when it failed. */
  double GetScore() const { return this->Score; }

  /**
   * The box of the volumes that are moved, along the axes of the world, where the input has them, mm: xmin, xmax, ymin, ymax,
   * zmin, zmax. It is known as soon as the input is made; before that (0, 1, 0, 1, 0, 1).
   */
  vtkGetVector6Macro(BoxBounds, double);

  /** The motion of the last update: from where the input was to where the output is. Identity before the first. */
  void GetMotion(vtkMatrix4x4* motion) const;

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundPoseEditor();
  ~vtkUltrasoundPoseEditor() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundPoseEditor(const vtkUltrasoundPoseEditor&) = delete;
  void operator=(const vtkUltrasoundPoseEditor&) = delete;

#ifndef __VTK_WRAP__
  std::vector<bool> Moves(int count) const;
  void PlaceBox(const std::vector<vtkUltrasoundVolume::Input>& volumes, const std::vector<bool>& moves);

  std::vector<int> Volumes;
  struct Settings {
    enum class Centre { WorldOrigin, Middle, Given } rotateAbout = Centre::WorldOrigin;
    echorama::PoseEdit edit;
    echorama::ScoreParameters score;
  };
  Settings Values;
  double Score;
  echorama::Pose Motion = echorama::Pose::Identity();
  // The points that are scored, by what they were drawn from: the handle asks for a score many times a second.
  using DrawnFrom = std::array<unsigned long long, 4>;
  std::map<DrawnFrom, std::vector<Eigen::Vector3d>> Drawn;
#endif
  double BoxBounds[6] = {0.0, 1.0, 0.0, 1.0, 0.0, 1.0};
};

#endif
