// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAnatomySource.h"

#include "Anatomy.h"
#include "CalibrationRig.h"
#include "Core/Base/Error.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundVolume.h"

vtkStandardNewMacro(vtkUltrasoundAnatomySource);

vtkUltrasoundParametersMacro(vtkUltrasoundAnatomySource);

struct vtkUltrasoundAnatomySource::Settings {
  enum class Kind { Anatomy, CalibrationRig } kind = Kind::Anatomy;
  echorama::AnatomyParameters anatomy;
  echorama::CalibrationRigParameters rig;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundAnatomySource::Parameters()
{
  echorama::ParameterList anatomy = Describe(this->Values->anatomy);
  echorama::ParameterList rig = Renamed(Describe(this->Values->rig), "Scale", "RigScale");
  rig = Renamed(Renamed(rig, "DetailMm", "BallDetailMm"), "Material", "BallMaterial");
  for (echorama::Parameter& parameter : anatomy) {
    parameter.When("Kind", "anatomy");
  }
  for (echorama::Parameter& parameter : rig) {
    parameter.When("Kind", "calibration-rig");
  }
  return echorama::Join({{echorama::Parameter("Kind", echorama::Choice(this->Values->kind, {"anatomy", "calibration-rig"}),
                                              "What is made: an invented abdomen, or a rig of balls in a water bath.")},
                         anatomy,
                         rig});
}

//----------------------------------------------------------------------------
vtkUltrasoundAnatomySource::vtkUltrasoundAnatomySource() : Values(new Settings)
{
  this->SetNumberOfInputPorts(0);
}

//----------------------------------------------------------------------------
vtkUltrasoundAnatomySource::~vtkUltrasoundAnatomySource() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::AddBall(const char* name, const double centre[3], double radius)
{
  this->Values->rig.balls.push_back({name ? name : "", {centre[0], centre[1], centre[2]}, radius});
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::ClearBalls()
{
  this->Values->rig.balls.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
int vtkUltrasoundAnatomySource::GetNumberOfBalls() const
{
  return static_cast<int>(this->Values->rig.balls.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::GetLandmarks(vtkPoints* centres, vtkStringArray* names)
{
  centres->Initialize();
  centres->SetDataTypeToDouble();
  names->Initialize();
  try {
    echorama::CheckRanges(this->Parameters());
    for (const echorama::Landmark& landmark : echorama::CalibrationLandmarks(this->Values->rig)) {
      centres->InsertNextPoint(landmark.position.data());
      names->InsertNextValue(landmark.label);
    }
  } catch (const echorama::Error& error) {
    vtkErrorMacro(<< error.what());
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundAnatomySource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    const Settings& v = *this->Values;
    const echorama::TissueSurface tissue = v.kind == Settings::Kind::Anatomy ? echorama::MakeAnatomy(v.anatomy, progress)
                                                                             : echorama::MakeCalibrationRig(v.rig, progress);
    vtkUltrasoundTissue::Set(vtkPolyData::GetData(outputs), tissue);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Balls: " << this->Values->rig.balls.size() << "\n";
}
