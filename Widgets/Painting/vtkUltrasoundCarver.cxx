// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundCarver.h"

#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkImplicitFunction.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"

#include <algorithm>

vtkStandardNewMacro(vtkUltrasoundCarver);

vtkUltrasoundParametersMacro(vtkUltrasoundCarver);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundCarver::Parameters()
{
  using echorama::Parameter;
  return {
      Parameter("TakeAway", echorama::Choice(this->Taken, {"inside", "outside"}),
                "Which side of the shape leaves the valid region. The inside of a plane is the side that its normal points away "
                "from.")};
}

//----------------------------------------------------------------------------
vtkUltrasoundCarver::vtkUltrasoundCarver() = default;

//----------------------------------------------------------------------------
vtkUltrasoundCarver::~vtkUltrasoundCarver() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundCarver::SetShape(vtkImplicitFunction* shape)
{
  if (this->Shape != shape) {
    this->Shape = shape;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
vtkImplicitFunction* vtkUltrasoundCarver::GetShape() const
{
  return this->Shape;
}

//----------------------------------------------------------------------------
vtkMTimeType vtkUltrasoundCarver::GetMTime()
{
  const vtkMTimeType own = this->Superclass::GetMTime();
  return this->Shape ? std::max(own, this->Shape->GetMTime()) : own;
}

//----------------------------------------------------------------------------
void vtkUltrasoundCarver::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  progress(0.0);
  echorama::CheckRanges(this->Parameters());
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  output->ShallowCopy(image);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  const auto before = vtkUltrasoundVolume::ViewOf<const unsigned char>(input.ValidRegion, image);
  const auto after = vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output);

  // Slice by slice: what the shape says of many points at once, VTK finds out with all threads.
  const Eigen::Affine3d toWorld = vtkUltrasoundVolume::GeometryOf(output).IndexToWorld();
  const auto& n = after.Dimensions();
  vtkNew<vtkDoubleArray> points, sides;
  points->SetNumberOfComponents(3);
  points->SetNumberOfTuples(static_cast<vtkIdType>(n[0]) * n[1]);
  sides->SetNumberOfTuples(points->GetNumberOfTuples());
  for (int k = 0; k < n[2]; ++k) {
    if (this->Shape) {
      double* to = points->GetPointer(0);
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i, to += 3) {
          Eigen::Map<Eigen::Vector3d>{to} = toWorld * Eigen::Vector3d(i, j, k);
        }
      }
      points->Modified();
      this->Shape->FunctionValue(points, sides);
    }
    const std::ptrdiff_t first = after.Row(0, k) - after.Data();
    for (vtkIdType i = 0; i < sides->GetNumberOfTuples(); ++i) {
      const double side = this->Shape ? sides->GetValue(i) : 0.0;
      const bool taken = this->Shape && (this->Taken == INSIDE ? side <= 0.0 : side > 0.0);
      after[first + i] = taken ? 0 : before.Empty() ? 1 : before[first + i];
    }
    progress(static_cast<double>(k + 1) / n[2]);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundCarver::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Shape: " << (this->Shape ? this->Shape->GetClassName() : "(none)") << "\n";
}
