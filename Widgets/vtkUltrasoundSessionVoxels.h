// SPDX-License-Identifier: BSD-3-Clause
// The voxels of one volume of vtkUltrasoundAlignmentSession, or of a project that a command reads: shared with what was given
// until the first stroke, from then on a copy that VoxelEdits writes to.
#ifndef vtkUltrasoundSessionVoxels_h
#define vtkUltrasoundSessionVoxels_h

#include "Widgets/Painting/VoxelEdits.h"
#include "Widgets/Session/SessionState.h"

#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace echorama {

class SessionVoxels {
public:
  /** Where the image lies now. Its arrays change when it is painted. */
  vtkSmartPointer<vtkImageData> Image = vtkSmartPointer<vtkImageData>::New();
  /** As it came: file, name, geometry. */
  SessionVolume Known;

  SessionVoxels(const SessionVolume& volume, vtkImageData* image) : Known(volume)
  {
    this->Base->ShallowCopy(image);
    vtkUltrasoundVolume::SetGeometry(this->Base, volume.geometry);
    this->Known.strokes.reset();
  }

  void Place(const Pose& volumeToWorld)
  {
    this->Image->ShallowCopy(this->Base);
    vtkUltrasoundVolume::Move(this->Image, volumeToWorld);
  }

  /** As the file stands, with what was painted. */
  vtkImageData* GetBase() const { return this->Base; }

  /** Brings the voxels to a chain of strokes. Returns whether any has changed. */
  bool GoTo(const StrokeChain& chain)
  {
    if (chain == this->At) {
      return false;
    }
    this->Prepare();
    const bool changed = this->Edits->GoTo(chain);
    this->At = chain;
    return this->Touched(changed);
  }

  ///@{
  /** A stroke in the making, in the physical space of the file. */
  void Begin(const Brush& brush)
  {
    brush.Check();
    this->Prepare();
    this->Edits->Begin(brush);
  }
  bool TakeBack() { return this->Edits && this->Touched(this->Edits->End(this->At)); }
  bool Extend(const Eigen::Vector3d& point) { return this->Touched(this->Edits->Extend(point)); }
  bool End(const StrokeChain& chain)
  {
    const bool changed = this->Edits->End(chain);
    this->At = chain;
    return this->Touched(changed);
  }
  ///@}

  /** Copies the voxels ahead of the first stroke. */
  void Prepare()
  {
    if (!this->Edits) {
      this->MakeEdits();
    }
  }

  /** The image as it is, for somebody who keeps it: what is painted later does not reach it. */
  vtkSmartPointer<vtkImageData> Snapshot()
  {
    const auto copy = vtkSmartPointer<vtkImageData>::New();
    copy->ShallowCopy(this->Image);
    if (this->Edits) {
      if (!this->KeptIntensity) {
        this->KeptIntensity = CopyOf(this->Intensity);
        this->KeptValid = CopyOf(this->Valid);
      }
      SetArrays(copy, this->KeptIntensity, this->KeptValid);
    }
    return copy;
  }

private:
  /** VoxelEdits of any voxel type. */
  struct AnyEdits {
    virtual ~AnyEdits() = default;
    virtual bool GoTo(const StrokeChain& chain) = 0;
    virtual void Begin(const Brush& brush) = 0;
    virtual bool Extend(const Eigen::Vector3d& point) = 0;
    virtual bool End(const StrokeChain& chain) = 0;
  };
  template <class T>
  struct EditsOf : AnyEdits {
    VoxelEdits<T> Edits;
    EditsOf(VolumeView<T> intensity, VolumeView<unsigned char> valid, const ImageGeometry& geometry)
      : Edits(intensity, valid, geometry)
    {
    }
    bool GoTo(const StrokeChain& chain) override { return !this->Edits.GoTo(chain).Empty(); }
    void Begin(const Brush& brush) override { this->Edits.Begin(brush); }
    bool Extend(const Eigen::Vector3d& point) override { return !this->Edits.Extend(point).Empty(); }
    bool End(const StrokeChain& chain) override { return !this->Edits.End(chain).Empty(); }
  };

  static vtkSmartPointer<vtkDataArray> CopyOf(vtkDataArray* array)
  {
    const auto copy = vtkSmartPointer<vtkDataArray>::Take(array->NewInstance());
    copy->DeepCopy(array); // with its name
    return copy;
  }

  static void SetArrays(vtkImageData* image, vtkDataArray* intensity, vtkDataArray* valid)
  {
    vtkPointData* arrays = image->GetPointData();
    const bool active = !arrays->GetScalars() || arrays->GetScalars() == vtkUltrasoundVolume::GetIntensity(image);
    arrays->AddArray(intensity); // in the place of the one of its name
    if (active) {
      arrays->SetActiveScalars(intensity->GetName());
    }
    arrays->AddArray(valid);
  }

  void MakeEdits()
  {
    vtkDataArray* given = vtkUltrasoundVolume::GetIntensity(this->Base);
    this->Intensity = CopyOf(given);
    const bool named = given->GetName() != nullptr;
    if (!this->Intensity->GetName()) {
      this->Intensity->SetName(vtkUltrasoundVolume::IntensityName());
    }
    vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(this->Base);
    this->Valid = valid ? CopyOf(valid) : nullptr;
    vtkUltrasoundVolume::Dispatch(this->Intensity, [this](auto type) {
      using T = decltype(type);
      const auto voxels = vtkUltrasoundVolume::ViewOf<T>(this->Intensity, this->Base);
      if (!this->Valid) // every voxel that is a number is real
      {
        this->Valid = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(VTK_UNSIGNED_CHAR));
        this->Valid->SetName(vtkUltrasoundVolume::ValidRegionName());
        this->Valid->SetNumberOfTuples(this->Base->GetNumberOfPoints());
        std::transform(voxels.begin(), voxels.end(), static_cast<unsigned char*>(this->Valid->GetVoidPointer(0)),
                       [](T value) -> unsigned char { return std::isfinite(static_cast<double>(value)) ? 1 : 0; });
      }
      this->Edits = std::make_unique<EditsOf<T>>(voxels, vtkUltrasoundVolume::ViewOf<unsigned char>(this->Valid, this->Base),
                                                 this->Known.geometry);
    });
    if (named && valid) // what was given serves as a snapshot until something is painted
    {
      this->KeptIntensity = given;
      this->KeptValid = valid;
    }
    SetArrays(this->Base, this->Intensity, this->Valid);
    SetArrays(this->Image, this->Intensity, this->Valid);
  }

  bool Touched(bool changed)
  {
    if (changed) {
      this->Intensity->Modified();
      this->Valid->Modified();
      this->Image->Modified();
      this->KeptIntensity = nullptr;
      this->KeptValid = nullptr;
    }
    return changed;
  }

  vtkSmartPointer<vtkImageData> Base = vtkSmartPointer<vtkImageData>::New();
  vtkSmartPointer<vtkDataArray> Intensity, Valid;         ///< our own, once painted
  vtkSmartPointer<vtkDataArray> KeptIntensity, KeptValid; ///< what was handed out last
  std::unique_ptr<AnyEdits> Edits;
  StrokeChain At; ///< the strokes that the voxels have
};

} // namespace echorama

#endif
