// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAnatomySource.h"

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

//----------------------------------------------------------------------------
vtkUltrasoundAnatomySource::vtkUltrasoundAnatomySource() : Kind(Anatomy)
{
  this->SetNumberOfInputPorts(0);
  const echorama::AnatomyParameters anatomy;
  this->Seed = static_cast<vtkTypeInt64>(anatomy.seed);
  this->Variation = anatomy.variation;
  this->DetailMm = anatomy.detailMm;
  this->OrganScale = anatomy.organScale;
  this->TrunkWidthMm = anatomy.trunkWidthMm;
  this->TrunkLengthMm = anatomy.trunkLengthMm;
  this->TrunkDepthMm = anatomy.trunkDepthMm;
  this->StandoffMm = anatomy.standoffMm;
  this->UndulationMm = anatomy.undulationMm;
  this->SkinMm = anatomy.skinMm;
  this->FatMm = anatomy.fatMm;
  this->MuscleMm = anatomy.muscleMm;
  this->FasciaMm = anatomy.fasciaMm;
  this->Septa = anatomy.septa;
  this->Lumps = anatomy.lumps;
  this->Liver = anatomy.liver;
  this->Kidney = anatomy.kidney;
  this->Gallbladder = anatomy.gallbladder;
  this->CapsuleMm = anatomy.capsuleMm;
  this->Stones = anatomy.stones;
  this->StoneMm = anatomy.stoneMm;
  this->GreatVessels = anatomy.greatVessels;
  this->Generations = anatomy.generations;
  this->VesselRadiusMm = anatomy.vesselRadiusMm;
  this->SmallestVesselMm = anatomy.smallestVesselMm;
  this->BranchAsymmetry = anatomy.branchAsymmetry;
  this->WallShare = anatomy.wallShare;
  this->Cysts = anatomy.cysts;
  this->DarkLesions = anatomy.darkLesions;
  this->BrightLesions = anatomy.brightLesions;
  this->LesionRadiusMm = anatomy.lesionRadiusMm;
  this->Ribs = anatomy.ribs;
  this->Spine = anatomy.spine;
  const echorama::CalibrationRigParameters rig;
  this->RigScale = rig.scale;
  this->PlateDepthMm = rig.plateDepthMm;
  this->PlateMm = rig.plateMm;
  this->BaseMm = rig.baseMm;
  this->StemRadiusMm = rig.stemRadiusMm;
  this->WaterCelsius = rig.waterCelsius;
  this->BallDetailMm = rig.detailMm;
  this->BallMaterial = rig.material;
  this->Balls = rig.balls;
}

//----------------------------------------------------------------------------
vtkUltrasoundAnatomySource::~vtkUltrasoundAnatomySource() = default;

//----------------------------------------------------------------------------
echorama::AnatomyParameters vtkUltrasoundAnatomySource::AnatomyParameters() const
{
  echorama::AnatomyParameters anatomy;
  anatomy.seed = static_cast<std::uint64_t>(this->Seed);
  anatomy.variation = this->Variation;
  anatomy.detailMm = this->DetailMm;
  anatomy.organScale = this->OrganScale;
  anatomy.trunkWidthMm = this->TrunkWidthMm;
  anatomy.trunkLengthMm = this->TrunkLengthMm;
  anatomy.trunkDepthMm = this->TrunkDepthMm;
  anatomy.standoffMm = this->StandoffMm;
  anatomy.undulationMm = this->UndulationMm;
  anatomy.skinMm = this->SkinMm;
  anatomy.fatMm = this->FatMm;
  anatomy.muscleMm = this->MuscleMm;
  anatomy.fasciaMm = this->FasciaMm;
  anatomy.septa = this->Septa;
  anatomy.lumps = this->Lumps;
  anatomy.liver = this->Liver;
  anatomy.kidney = this->Kidney;
  anatomy.gallbladder = this->Gallbladder;
  anatomy.capsuleMm = this->CapsuleMm;
  anatomy.stones = this->Stones;
  anatomy.stoneMm = this->StoneMm;
  anatomy.greatVessels = this->GreatVessels;
  anatomy.generations = this->Generations;
  anatomy.vesselRadiusMm = this->VesselRadiusMm;
  anatomy.smallestVesselMm = this->SmallestVesselMm;
  anatomy.branchAsymmetry = this->BranchAsymmetry;
  anatomy.wallShare = this->WallShare;
  anatomy.cysts = this->Cysts;
  anatomy.darkLesions = this->DarkLesions;
  anatomy.brightLesions = this->BrightLesions;
  anatomy.lesionRadiusMm = this->LesionRadiusMm;
  anatomy.ribs = this->Ribs;
  anatomy.spine = this->Spine;
  return anatomy;
}

//----------------------------------------------------------------------------
echorama::CalibrationRigParameters vtkUltrasoundAnatomySource::RigParameters() const
{
  echorama::CalibrationRigParameters rig;
  rig.scale = this->RigScale;
  rig.plateDepthMm = this->PlateDepthMm;
  rig.plateMm = this->PlateMm;
  rig.baseMm = this->BaseMm;
  rig.stemRadiusMm = this->StemRadiusMm;
  rig.waterCelsius = this->WaterCelsius;
  rig.detailMm = this->BallDetailMm;
  rig.material = this->BallMaterial;
  rig.balls = this->Balls;
  return rig;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::AddBall(const char* name, const double centre[3], double radius)
{
  this->Balls.push_back({name ? name : "", {centre[0], centre[1], centre[2]}, radius});
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::ClearBalls()
{
  this->Balls.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
int vtkUltrasoundAnatomySource::GetNumberOfBalls() const
{
  return static_cast<int>(this->Balls.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::GetLandmarks(vtkPoints* centres, vtkStringArray* names)
{
  centres->Initialize();
  centres->SetDataTypeToDouble();
  names->Initialize();
  try {
    for (const echorama::Landmark& landmark : echorama::CalibrationLandmarks(this->RigParameters())) {
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
    const echorama::TissueSurface tissue = this->Kind == Anatomy ? echorama::MakeAnatomy(this->AnatomyParameters(), progress)
                                                                 : echorama::MakeCalibrationRig(this->RigParameters(), progress);
    vtkUltrasoundTissue::Set(vtkPolyData::GetData(outputs), tissue);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAnatomySource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Kind: " << (this->Kind == Anatomy ? "Anatomy" : "CalibrationRig") << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "Variation: " << this->Variation << "\n";
  os << indent << "DetailMm: " << this->DetailMm << "\n";
  os << indent << "OrganScale: " << this->OrganScale << "\n";
  os << indent << "TrunkWidthMm: " << this->TrunkWidthMm << "\n";
  os << indent << "TrunkLengthMm: " << this->TrunkLengthMm << "\n";
  os << indent << "TrunkDepthMm: " << this->TrunkDepthMm << "\n";
  os << indent << "StandoffMm: " << this->StandoffMm << "\n";
  os << indent << "UndulationMm: " << this->UndulationMm << "\n";
  os << indent << "SkinMm: " << this->SkinMm << "\n";
  os << indent << "FatMm: " << this->FatMm << "\n";
  os << indent << "MuscleMm: " << this->MuscleMm << "\n";
  os << indent << "FasciaMm: " << this->FasciaMm << "\n";
  os << indent << "Septa: " << this->Septa << "\n";
  os << indent << "Lumps: " << this->Lumps << "\n";
  os << indent << "Liver: " << this->Liver << "\n";
  os << indent << "Kidney: " << this->Kidney << "\n";
  os << indent << "Gallbladder: " << this->Gallbladder << "\n";
  os << indent << "CapsuleMm: " << this->CapsuleMm << "\n";
  os << indent << "Stones: " << this->Stones << "\n";
  os << indent << "StoneMm: " << this->StoneMm << "\n";
  os << indent << "GreatVessels: " << this->GreatVessels << "\n";
  os << indent << "Generations: " << this->Generations << "\n";
  os << indent << "VesselRadiusMm: " << this->VesselRadiusMm << "\n";
  os << indent << "SmallestVesselMm: " << this->SmallestVesselMm << "\n";
  os << indent << "BranchAsymmetry: " << this->BranchAsymmetry << "\n";
  os << indent << "WallShare: " << this->WallShare << "\n";
  os << indent << "Cysts: " << this->Cysts << "\n";
  os << indent << "DarkLesions: " << this->DarkLesions << "\n";
  os << indent << "BrightLesions: " << this->BrightLesions << "\n";
  os << indent << "LesionRadiusMm: " << this->LesionRadiusMm << "\n";
  os << indent << "Ribs: " << this->Ribs << "\n";
  os << indent << "Spine: " << this->Spine << "\n";
  os << indent << "RigScale: " << this->RigScale << "\n";
  os << indent << "PlateDepthMm: " << this->PlateDepthMm << "\n";
  os << indent << "PlateMm: " << this->PlateMm << "\n";
  os << indent << "BaseMm: " << this->BaseMm << "\n";
  os << indent << "StemRadiusMm: " << this->StemRadiusMm << "\n";
  os << indent << "WaterCelsius: " << this->WaterCelsius << "\n";
  os << indent << "BallDetailMm: " << this->BallDetailMm << "\n";
  os << indent << "BallMaterial: " << this->BallMaterial << "\n";
  os << indent << "Balls: " << this->Balls.size() << "\n";
}
