// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundPoseEditor
 * @brief moves chosen volumes by hand, as a step of the pipeline that stays editable
 *
 * Input 0 (repeatable): volumes (vtkImageData, or the image leaves of vtkDataObjectTree). Output: a vtkMultiBlockDataSet with the
 * same volumes in the same order, one block each, with the same NAME(). Voxels are shared, nothing is resampled; of the chosen
 * volumes geometry, `ProbeToWorld` and `ImageToWorld` are new. In ParaView a box in the 3D view is the handle.
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

#ifndef __VTK_WRAP__
#include "Core/Geometry/RigidTransform.h"
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

  ///@{
  /** mm, in the world. Default 0. */
  vtkSetVector3Macro(Translation, double);
  vtkGetVector3Macro(Translation, double);
  ///@}

  ///@{
  /** Degrees about the world's x, y and z: turned about y first, then x, then z. Default 0. */
  vtkSetVector3Macro(Rotation, double);
  vtkGetVector3Macro(Rotation, double);
  ///@}

  enum RotateAbouts {
    WORLD_ORIGIN = 0, ///< the world's origin: what ParaView's box writes
    MIDDLE = 1,       ///< the middle of the chosen volumes
    CENTRE = 2        ///< Centre
  };
  ///@{
  /** What the rotation turns about. Default WORLD_ORIGIN. */
  vtkSetClampMacro(RotateAbout, int, WORLD_ORIGIN, CENTRE);
  vtkGetMacro(RotateAbout, int);
  ///@}

  ///@{
  /** The point that the rotation turns about with RotateAbout CENTRE, mm. Default 0. */
  vtkSetVector3Macro(Centre, double);
  vtkGetVector3Macro(Centre, double);
  ///@}

  ///@{
  /** The volume that stays unless it is named, and on which alignment and truth are taken to agree; counted from 0. Default 0. */
  vtkSetClampMacro(FixedVolume, int, 0, VTK_INT_MAX);
  vtkGetMacro(FixedVolume, int);
  ///@}

  ///@{
  /** Points of each volume that are scored, in [1, 10000000], and their seed, >= 0. Defaults 2000 and 1. */
  vtkSetClampMacro(Points, int, 1, 10000000);
  vtkGetMacro(Points, int);
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** Where the volumes belong: adds one to input 1, or sets it. */
  void AddTruthConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddTruthData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllTruths() { this->SetInputConnection(1, nullptr); }
  ///@}

  /** The score of the last update, mm. NaN without truth or when it failed. */
  double GetScore() const { return this->Score; }

  /** The motion of the last update: from where the input was to where the output is. Identity before the first. */
  void GetMotion(vtkMatrix4x4* motion) const;

protected:
  vtkUltrasoundPoseEditor();
  ~vtkUltrasoundPoseEditor() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundPoseEditor(const vtkUltrasoundPoseEditor&) = delete;
  void operator=(const vtkUltrasoundPoseEditor&) = delete;

#ifndef __VTK_WRAP__
  std::vector<int> Volumes;
  double Translation[3] = {0.0, 0.0, 0.0};
  double Rotation[3] = {0.0, 0.0, 0.0};
  int RotateAbout = WORLD_ORIGIN;
  double Centre[3] = {0.0, 0.0, 0.0};
  int FixedVolume = 0;
  int Points = 2000;
  int Seed = 1;
  double Score;
  echorama::Pose Motion = echorama::Pose::Identity();
  // The points that are scored, by what they were drawn from: the handle asks for a score many times a second.
  using DrawnFrom = std::array<unsigned long long, 4>;
  std::map<DrawnFrom, std::vector<Eigen::Vector3d>> Drawn;
#endif
};

#endif
