// SPDX-License-Identifier: BSD-3-Clause
// The voxels of one volume of vtkUltrasoundAlignmentSession, or of a project that a command reads: shared with what was given
// until the first stroke, from then on a copy that VoxelEdits writes to.
#ifndef vtkUltrasoundSessionVoxels_h
#define vtkUltrasoundSessionVoxels_h

#include "Core/Imaging/ValidPoints.h"
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
#include <vector>

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

  /** With the background that was invented around it as if it were real, for views. */
  vtkImageData* Shown()
  {
    vtkDataArray* labels = this->Image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
    vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(this->Image);
    if (!labels || !valid || labels->GetDataType() != VTK_UNSIGNED_CHAR || labels->GetNumberOfComponents() != 1) {
      return this->Image;
    }
    if (!this->ShownRegion || this->ShownOf != valid || this->ShownRegion->GetMTime() < valid->GetMTime()) {
      constexpr unsigned char Invented = 3; // see vtkUltrasoundEmbedder
      this->ShownRegion = CopyOf(valid);
      this->ShownOf = valid;
      const auto of = vtkUltrasoundVolume::ViewOf<const unsigned char>(labels, this->Image);
      const auto shown = vtkUltrasoundVolume::ViewOf<unsigned char>(this->ShownRegion, this->Image);
      std::transform(shown.begin(), shown.end(), of.begin(), shown.begin(),
                     [](unsigned char real, unsigned char label) -> unsigned char { return real != 0 || label == Invented; });
      this->ShownRegion->Modified();
    }
    this->ShownImage->ShallowCopy(this->Image);
    this->ShownImage->GetPointData()->AddArray(this->ShownRegion);
    return this->ShownImage;
  }

  /** As the file would have it: without strokes. */
  vtkSmartPointer<vtkImageData> Unpainted()
  {
    const auto copy = vtkSmartPointer<vtkImageData>::New();
    const StrokeChain chain = this->At;
    if (chain) {
      this->Edits->GoTo(nullptr);
    }
    copy->ShallowCopy(this->Base);
    if (this->Edits) {
      SetArrays(copy, CopyOf(this->Intensity), CopyOf(this->Valid));
    }
    if (chain) {
      this->Edits->GoTo(chain);
    }
    return copy;
  }

  /** Brings the voxels to a chain of strokes. Returns whether any has changed. */
  bool GoTo(const StrokeChain& chain)
  {
    if (chain == this->At) {
      return false;
    }
    this->Prepare();
    const auto changed = this->Edits->GoTo(chain);
    this->At = chain;
    return this->Touched(changed);
  }

  ///@{
  /** A stroke in the making, in the physical space of the file. */
  void Begin(const Brush& brush)
  {
    CheckRanges(brush);
    this->Prepare();
    this->Edits->Begin(brush);
  }
  bool TakeBack() { return this->Edits && this->Touched(this->Edits->End(this->At)); }
  bool Extend(const Eigen::Vector3d& point) { return this->Touched(this->Edits->Extend(point)); }
  bool End(const StrokeChain& chain)
  {
    const auto changed = this->Edits->End(chain);
    this->At = chain;
    return this->Touched(changed);
  }
  ///@}

  /** Some of the grey levels that are real, at most about so many, are added to \a levels. */
  void SampleGreyLevels(std::ptrdiff_t samples, std::vector<double>& levels) const
  {
    const auto valid = this->ValidView();
    vtkUltrasoundVolume::Dispatch(vtkUltrasoundVolume::GetIntensity(this->Base), [&](auto type) {
      const auto view = this->IntensityView(type);
      const std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, view.Size() / samples) | 1; // odd: not along columns alone
      for (std::ptrdiff_t i = 0; i < view.Size(); i += step) {
        if ((valid.Empty() || valid[i]) && std::isfinite(static_cast<double>(view[i]))) {
          levels.push_back(static_cast<double>(view[i]));
        }
      }
    });
  }

  /** The voxel that is nearest to a point of the world; -1: none that is real. */
  vtkIdType VoxelAt(const Eigen::Vector3d& world) const
  {
    const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(this->Image);
    const Eigen::Vector3d index = geometry.WorldToIndex() * world;
    vtkIdType voxel = 0, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double nearest = std::round(index[axis]);
      const int size = geometry.dimensions[static_cast<std::size_t>(axis)];
      if (!(nearest >= 0.0 && nearest < size)) {
        return -1;
      }
      voxel += stride * static_cast<vtkIdType>(nearest);
      stride *= size;
    }
    const auto valid =
        vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(this->Image), this->Image);
    return valid.Empty() || valid[voxel] ? voxel : -1;
  }

  /** ValidPoints of it. */
  std::vector<Eigen::Vector3d> Points(int count, std::uint64_t seed) const
  {
    std::vector<Eigen::Vector3d> points;
    vtkUltrasoundVolume::Dispatch(vtkUltrasoundVolume::GetIntensity(this->Base), [&](auto type) {
      points = ValidPoints(this->IntensityView(type), this->ValidView(), count, seed);
    });
    return points;
  }

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
  template <class T>
  VolumeView<const T> IntensityView(T) const
  {
    return vtkUltrasoundVolume::ViewOf<const T>(vtkUltrasoundVolume::GetIntensity(this->Base), this->Base);
  }
  VolumeView<const unsigned char> ValidView() const
  {
    return vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(this->Base), this->Base);
  }

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
        this->Valid = vtkUltrasoundVolume::NewArray(VTK_UNSIGNED_CHAR, this->Base->GetNumberOfPoints(),
                                                    vtkUltrasoundVolume::ValidRegionName());
        std::transform(voxels.begin(), voxels.end(), static_cast<unsigned char*>(this->Valid->GetVoidPointer(0)),
                       [](T value) -> unsigned char { return std::isfinite(static_cast<double>(value)) ? 1 : 0; });
      }
      this->Edits = std::make_unique<VoxelEdits<T>>(voxels, vtkUltrasoundVolume::ViewOf<unsigned char>(this->Valid, this->Base),
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

  bool Touched(const AnyVoxelEdits::Box& changed)
  {
    if (!changed.Empty()) {
      this->Intensity->Modified();
      this->Valid->Modified();
      this->Image->Modified();
      this->KeptIntensity = nullptr;
      this->KeptValid = nullptr;
    }
    return !changed.Empty();
  }

  vtkSmartPointer<vtkImageData> Base = vtkSmartPointer<vtkImageData>::New();
  vtkSmartPointer<vtkDataArray> Intensity, Valid;         ///< our own, once painted
  vtkSmartPointer<vtkDataArray> KeptIntensity, KeptValid; ///< what was handed out last
  vtkSmartPointer<vtkImageData> ShownImage = vtkSmartPointer<vtkImageData>::New();
  vtkSmartPointer<vtkDataArray> ShownRegion; ///< of an embedded volume
  vtkDataArray* ShownOf = nullptr;           ///< the region that it was made of
  std::unique_ptr<AnyVoxelEdits> Edits;
  StrokeChain At; ///< the strokes that the voxels have
};

} // namespace echorama

#endif
