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
#include <utility>

vtkStandardNewMacro(vtkUltrasoundPrintableSource);

vtkUltrasoundParametersMacro(vtkUltrasoundPrintableSource);

vtkUltrasoundPrintableSource::vtkUltrasoundPrintableSource()
{
  this->SetNumberOfInputPorts(0);
}

echorama::ParameterList vtkUltrasoundPrintableSource::Parameters()
{
  using echorama::Parameter;
  echorama::ParameterList rig{
      Parameter("Scale", this->RigValues.scale, {0.2, 5}, "", "Size of the whole rig."),
      Parameter("BaseMm", this->RigValues.baseMm, {0, 20, true}, "mm", "Thickness of the base."),
      Parameter("StemRadiusMm", this->RigValues.stemRadiusMm, {0, 5, true}, "mm",
                "Radius of the pins; never wider than 0.6 of a ball."),
  };
  echorama::ParameterList clip = echorama::Without(Describe(this->ClipValues), {"TieWidthMm", "ArmWidthMm", "SensorClearanceMm"});
  for (Parameter& parameter : rig) {
    parameter.When("Kind", "rig");
  }
  for (Parameter& parameter : clip) {
    parameter.When("Kind", "clip");
  }
  return echorama::Join({{Parameter("Kind", echorama::Choice(this->Printed, {"rig", "clip"}),
                                    "What is made: the rig of balls, or the clip that holds a sensor to a probe."),
                          Parameter("Resolution", this->CellMm, {0.1, 5}, "mm", "Edge of the sampling cells.")},
                         std::move(rig),
                         std::move(clip)});
}

int vtkUltrasoundPrintableSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    Mesh(this->Printed == RIG ? echorama::PrintableRig(this->RigValues) : echorama::PrintableClip(this->ClipValues), this->CellMm,
         vtkPolyData::GetData(outputs), progress);
  });
}

void vtkUltrasoundPrintableSource::Mesh(const echorama::PrintableSolid& solid, double resolution, vtkPolyData* output,
                                        const echorama::Progress& progress)
{
  using echorama::Error;
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
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
