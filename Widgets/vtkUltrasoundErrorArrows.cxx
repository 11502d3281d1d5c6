// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundErrorArrows.h"

#include "vtkActor.h"
#include "vtkArrowSource.h"
#include "vtkColorTransferFunction.h"
#include "vtkFloatArray.h"
#include "vtkGlyph3D.h"
#include "vtkLookupTable.h"
#include "vtkMath.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkRenderer.h"
#include "vtkScalarBarActor.h"
#include "vtkTextProperty.h"
#include "vtkUltrasoundAlignmentSession.h"

#include <algorithm>
#include <cmath>

namespace echorama {

namespace {
// The least of 1, 2, 5, 10, ... that is not below x: a scale that does not change with every millimetre.
double RoundUp(double x)
{
  if (!(x > 0.0)) {
    return 1.0;
  }
  const double ten = std::pow(10.0, std::floor(std::log10(x)));
  return (x <= ten ? 1.0 : x <= 2.0 * ten ? 2.0 : x <= 5.0 * ten ? 5.0 : 10.0) * ten;
}
} // namespace

ErrorArrows::ErrorArrows(vtkRenderer* renderer)
{
  vtkNew<vtkColorTransferFunction> ramp; // from dark blue over green to yellow: brightness follows the length
  ramp->SetColorSpaceToLab();
  ramp->AddRGBPoint(0.0, 0.27, 0.30, 0.75);
  ramp->AddRGBPoint(0.5, 0.13, 0.68, 0.55);
  ramp->AddRGBPoint(1.0, 0.99, 0.90, 0.15);
  this->Colours->SetNumberOfTableValues(256);
  for (int i = 0; i < 256; ++i) {
    double rgb[3];
    ramp->GetColor(i / 255.0, rgb);
    this->Colours->SetTableValue(i, rgb[0], rgb[1], rgb[2], 1.0);
  }
  vtkNew<vtkArrowSource> arrow;
  arrow->SetTipResolution(8);
  arrow->SetShaftResolution(6);
  arrow->SetTipRadius(0.12);
  arrow->SetShaftRadius(0.04);
  vtkNew<vtkGlyph3D> arrows;
  arrows->SetInputData(this->Errors);
  arrows->SetSourceConnection(arrow->GetOutputPort());
  arrows->SetVectorModeToUseVector();
  arrows->SetScaleModeToScaleByVector();
  arrows->SetColorModeToColorByScalar();
  arrows->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Length");
  arrows->SetInputArrayToProcess(1, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Way");
  arrows->SetInputArrayToProcess(3, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Length");
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(arrows->GetOutputPort());
  mapper->SetLookupTable(this->Colours);
  mapper->UseLookupTableScalarRangeOn();
  this->Actor->SetMapper(mapper);
  this->Actor->PickableOff();
  this->Scale->SetLookupTable(this->Colours);
  this->Scale->SetTitle("error, mm");
  this->Scale->SetNumberOfLabels(3);
  this->Scale->SetLabelFormat("%-#.3g");
  this->Scale->SetUnconstrainedFontSize(true);
  this->Scale->GetTitleTextProperty()->SetFontSize(14);
  this->Scale->GetLabelTextProperty()->SetFontSize(13);
  for (vtkTextProperty* text : {this->Scale->GetTitleTextProperty(), this->Scale->GetLabelTextProperty()}) {
    text->SetFontFamilyToArial();
    text->ItalicOff();
    text->ShadowOff();
    text->BoldOff();
  }
  this->Scale->SetPosition(0.88, 0.08);
  this->Scale->SetWidth(0.1);
  this->Scale->SetHeight(0.4);
  renderer->AddActor(this->Actor);
  renderer->AddActor2D(this->Scale);
  this->Update(nullptr);
}

ErrorArrows::~ErrorArrows() = default;

void ErrorArrows::Update(vtkUltrasoundAlignmentSession* session)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> ways, lengths;
  ways->SetName("Way");
  ways->SetNumberOfComponents(3);
  lengths->SetName("Length");
  double longest = 0.0;
  if (session && session->HasTruth()) {
    vtkNew<vtkPolyData> vectors;
    session->GetErrorVectors(vectors);
    vtkDataArray* errors = vectors->GetPointData()->GetArray("Error");
    vtkDataArray* ids = vectors->GetPointData()->GetArray("Volume");
    for (vtkIdType p = 0; p < vectors->GetNumberOfPoints(); ++p) {
      if (session->GetVisible(static_cast<int>(ids->GetComponent(p, 0)))) {
        double error[3];
        errors->GetTuple(p, error);
        const double length = vtkMath::Norm(error);
        points->InsertNextPoint(vectors->GetPoint(p));
        ways->InsertNextTuple3(-error[0], -error[1], -error[2]);
        lengths->InsertNextValue(static_cast<float>(length));
        longest = std::max(longest, length);
      }
    }
  }
  this->Errors->Initialize();
  this->Errors->SetPoints(points);
  this->Errors->GetPointData()->AddArray(ways);
  this->Errors->GetPointData()->AddArray(lengths);
  this->Colours->SetTableRange(0.0, RoundUp(longest));
  this->Actor->SetVisibility(points->GetNumberOfPoints() > 0);
  this->Scale->SetVisibility(points->GetNumberOfPoints() > 0);
}

} // namespace echorama
