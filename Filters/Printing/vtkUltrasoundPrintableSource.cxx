// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPrintableSource.h"

#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "vtkFloatArray.h"
#include "vtkFlyingEdges3D.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkUltrasoundVolume.h"

#include <cmath>

vtkStandardNewMacro(vtkUltrasoundPrintableSource);

vtkUltrasoundPrintableSource::vtkUltrasoundPrintableSource()
{
  const echorama::CalibrationRigParameters rig;
  this->Scale = rig.scale;
  this->BaseMm = rig.baseMm;
  this->StemRadiusMm = rig.stemRadiusMm;
  const echorama::ProbeClipParameters clip;
  this->HandleWidthMm = clip.handleWidthMm;
  this->HandleThicknessMm = clip.handleThicknessMm;
  this->LengthMm = clip.lengthMm;
  this->WallMm = clip.wallMm;
  this->ClearanceMm = clip.clearanceMm;
  this->OpeningMm = clip.openingMm;
  this->TieGrooves = clip.tieGrooves;
  this->ArmMm = clip.armMm;
  this->StandOffMm = clip.standOffMm;
  std::copy_n(clip.sensorMm.data(), 3, this->SensorMm);
  this->SetNumberOfInputPorts(0);
}

int vtkUltrasoundPrintableSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    echorama::PrintableSolid solid;
    if (this->Kind == Rig) {
      echorama::CalibrationRigParameters rig;
      rig.scale = this->Scale;
      rig.baseMm = this->BaseMm;
      rig.stemRadiusMm = this->StemRadiusMm;
      solid = echorama::PrintableRig(rig);
    } else {
      echorama::ProbeClipParameters clip;
      clip.handleWidthMm = this->HandleWidthMm;
      clip.handleThicknessMm = this->HandleThicknessMm;
      clip.lengthMm = this->LengthMm;
      clip.wallMm = this->WallMm;
      clip.clearanceMm = this->ClearanceMm;
      clip.openingMm = this->OpeningMm;
      clip.tieGrooves = this->TieGrooves;
      clip.armMm = this->ArmMm;
      clip.standOffMm = this->StandOffMm;
      clip.sensorMm = Eigen::Vector3d(this->SensorMm);
      solid = echorama::PrintableClip(clip);
    }
    Mesh(solid, this->Resolution, vtkPolyData::GetData(outputs), progress);
  });
}

void vtkUltrasoundPrintableSource::Mesh(const echorama::PrintableSolid& solid, double resolution, vtkPolyData* output,
                                        const echorama::Progress& progress)
{
  using echorama::Error;
  if (!(resolution >= 0.1 && resolution <= 5.0))
    throw Error(Error::Kind::InvalidParameter, "Resolution must be in [0.1, 5] mm");
  // A side that lies in a plane of samples would give triangles without area; this origin is no round number.
  const Eigen::Vector3d low = solid.bounds.min() - Eigen::Vector3d::Constant(1.3719 * resolution);
  Eigen::Array3i size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = static_cast<int>(std::ceil((solid.bounds.max()[axis] - low[axis]) / resolution)) + 3;
  if (size.cast<double>().prod() > 1073741824.0)
    throw Error(Error::Kind::TooLarge, "the printable solid would need more than 2^30 samples; ask for a coarser Resolution");
  vtkNew<vtkImageData> image;
  image->SetDimensions(size.data());
  image->SetOrigin(low.data());
  image->SetSpacing(resolution, resolution, resolution);
  image->AllocateScalars(VTK_FLOAT, 1);
  auto* samples = static_cast<float*>(image->GetScalarPointer());
  echorama::ParallelFor(size[2], progress.Part(0.0, 0.8), [&](std::ptrdiff_t k) {
    float* sample = samples + k * size[0] * size[1];
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        *sample++ = static_cast<float>(solid.distance(low + resolution * Eigen::Vector3d(i, j, static_cast<double>(k))));
  });
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 0.0);
  contour->ComputeNormalsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  output->SetPoints(contour->GetOutput()->GetPoints());
  output->SetPolys(contour->GetOutput()->GetPolys());
  vtkPoints* points = output->GetPoints();
  echorama::ParallelRanges(points->GetNumberOfPoints(), 1024, progress.Part(0.8, 1.0),
                           [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                             for (std::ptrdiff_t i = begin; i < end; ++i) {
                               Eigen::Vector3d point;
                               points->GetPoint(i, point.data());
                               point = solid.Snapped(point, 0.4 * resolution);
                               points->SetPoint(i, point.data());
                             }
                           });
}

void vtkUltrasoundPrintableSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Kind: " << (this->Kind == Rig ? "Rig" : "Clip") << "\n";
  os << indent << "Resolution: " << this->Resolution << "\n";
  os << indent << "Scale: " << this->Scale << "\n";
  os << indent << "BaseMm: " << this->BaseMm << "\n";
  os << indent << "StemRadiusMm: " << this->StemRadiusMm << "\n";
  os << indent << "Handle: " << this->HandleWidthMm << " x " << this->HandleThicknessMm << " mm\n";
  os << indent << "LengthMm: " << this->LengthMm << "\n";
  os << indent << "WallMm: " << this->WallMm << "\n";
  os << indent << "ClearanceMm: " << this->ClearanceMm << "\n";
  os << indent << "OpeningMm: " << this->OpeningMm << "\n";
  os << indent << "TieGrooves: " << this->TieGrooves << "\n";
  os << indent << "ArmMm: " << this->ArmMm << "\n";
  os << indent << "StandOffMm: " << this->StandOffMm << "\n";
  os << indent << "SensorMm: " << this->SensorMm[0] << " x " << this->SensorMm[1] << " x " << this->SensorMm[2] << "\n";
}
