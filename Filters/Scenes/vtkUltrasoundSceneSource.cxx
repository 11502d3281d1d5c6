// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSceneSource.h"

#include "Core/Base/Checksum.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/TextFile.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/ValidPoints.h"
#include "Core/Sharing/ControllerWork.h"
#include "Core/Sharing/ShareOut.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "SceneJson.h"
#include "vtkCellArray.h"
#include "vtkDataObject.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundGel.h"
#include "vtkUltrasoundMeshFile.h"
#include "vtkUltrasoundMessage.h"
#include "vtkUltrasoundSynthesizer.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundTissuePress.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundSceneSource);

vtkUltrasoundParametersMacro(vtkUltrasoundSceneSource);

namespace {

constexpr std::size_t MaximumVoxels = 536870912; // 2^29

enum Port { Volumes, Beams, Tissue, Truth };

void PutBlock(vtkMultiBlockDataSet* blocks, unsigned int block, vtkDataObject* data, const std::string& name)
{
  blocks->SetBlock(block, data);
  blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), name.c_str());
}

void FillLandmarks(vtkPolyData* data, const std::vector<echorama::Landmark>& landmarks, const echorama::Pose& knock)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkStringArray> labels;
  labels->SetName("Label");
  vtkNew<vtkCellArray> cells;
  for (const echorama::Landmark& landmark : landmarks) {
    const Eigen::Vector3d place = knock * landmark.position;
    const vtkIdType id = points->InsertNextPoint(place.data());
    labels->InsertNextValue(landmark.label);
    cells->InsertNextCell(1, &id);
  }
  data->SetPoints(points);
  data->SetVerts(cells);
  data->GetPointData()->AddArray(labels);
}

// A view as another rank gets it.
struct SentView {
  vtkSmartPointer<vtkMultiBlockDataSet> blocks; // its block of each port but the tissue
  vtkUltrasoundSceneSource::MadeView made;
};

template <class Bytes, class Scan>
void PackOrUnpackReport(Bytes& bytes, Scan& scan)
{
  auto& c = scan.cost;
  bytes(c.raysSeconds, c.scatterersSeconds, c.echoesSeconds, c.detectionSeconds, c.rays, c.segments, c.surfaceEchoes,
        c.scatterers, c.bytes, scan.pressSeconds, scan.gelSeconds);
  if (scan.pressed) {
    bytes(scan.pressed->forceN, scan.pressed->relativeVolume, scan.pressed->leastVolume);
  }
  if (scan.gel) {
    bytes(scan.gel->coupled, scan.gel->volumeMm3);
  }
  for (auto& landmark : scan.landmarks) {
    bytes(landmark.label, landmark.position);
  }
}

void Pack(echorama::Packed& to, const SentView& view)
{
  const echorama::SceneScan& scan = view.made.Scan;
  vtkUltrasoundMessage::Pack(to, view.blocks);
  to(view.made.Number, view.made.Knock, scan.pressed.has_value(), scan.gel.has_value(), scan.landmarks.size());
  PackOrUnpackReport(to, scan);
}

void Unpack(echorama::Unpacked& from, SentView& view)
{
  view.blocks = vtkMultiBlockDataSet::SafeDownCast(vtkUltrasoundMessage::Unpack(from));
  bool isPressed = false, hasGel = false;
  std::size_t landmarks = 0;
  echorama::SceneScan& scan = view.made.Scan;
  from(view.made.Number, view.made.Knock, isPressed, hasGel, landmarks);
  if (isPressed) {
    scan.pressed.emplace();
  }
  if (hasGel) {
    scan.gel.emplace();
  }
  scan.landmarks.resize(landmarks);
  PackOrUnpackReport(from, scan);
}

} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundSceneSource::vtkUltrasoundSceneSource()
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(4);
  this->SetController(vtkMultiProcessController::GetGlobalController());
}

//----------------------------------------------------------------------------
vtkUltrasoundSceneSource::~vtkUltrasoundSceneSource()
{
  this->SetController(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundSceneSource::SetController(vtkMultiProcessController* controller)
{
  vtkSetObjectBodyMacro(Controller, vtkMultiProcessController, controller);
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSceneSource::Parameters()
{
  using echorama::Parameter;
  Settings& v = this->Values;
  return {
      Parameter("FileName", v.fileName, "The scene, JSON; files that it names are looked for in its folder."),
      Parameter("Scene", v.scene,
                "The scene as a text, instead of a file; files that it names are looked for in the working folder.")
          .Advanced(),
      Parameter("DataFolder", v.dataFolder, "Folder of the meshes and recordings that the scene names, whatever folder it says."),
      Parameter("View", v.view, {0, echorama::SceneItem::mostViews}, "", "The number of the only view that is made; 0: all."),
      Parameter("Seed", v.seed, {-1, 9223372036854775807.0}, "", "Instead of the scene's seed; -1: the scene's."),
      Parameter("SpacingMm", v.spacingMm, {0, 20}, "mm", "Edge of the cubic voxels; 0: as the scene says."),
      Parameter("Landmarks", v.landmarks, {0, 10000}, "",
                "How many places that two views see are told as landmarks, besides the balls of a rig."),
  };
}

//----------------------------------------------------------------------------
int vtkUltrasoundSceneSource::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == Tissue ? "vtkPolyData" : "vtkMultiBlockDataSet");
  return 1;
}

//----------------------------------------------------------------------------
echorama::SynthesisScene vtkUltrasoundSceneSource::Read() const
{
  const Settings& v = this->Values;
  const auto seed = v.seed < 0 ? std::optional<std::uint64_t>() : static_cast<std::uint64_t>(v.seed);
  if (v.fileName.empty() == v.scene.empty()) {
    throw Error(Error::Kind::InvalidParameter, v.scene.empty() ? "there is no scene: set FileName, or Scene"
                                                               : "FileName and Scene are both set; one scene can be made");
  }
  echorama::SynthesisScene scene =
      v.scene.empty() ? echorama::ReadScene(v.fileName, seed) : echorama::SceneFromJson(v.scene, "the scene", seed);
  scene.dataFolder = v.dataFolder;
  if (v.spacingMm > 0.0) {
    scene.volume.spacingMm = v.spacingMm;
    scene.Check(v.fileName.empty() ? "the scene" : v.fileName);
  }
  return scene;
}

//----------------------------------------------------------------------------
echorama::SceneRun& vtkUltrasoundSceneSource::Prepare(const echorama::Progress& progress)
{
  echorama::CheckRanges(this->Parameters());
  echorama::SynthesisScene scene = this->Read();
  scene.MakeFilesAbsolute();
  // Files that the scene names may have changed too.
  const std::string made = echorama::SceneToJson(scene) + std::to_string(this->Values.landmarks) + scene.TimesOfFiles();
  if (!this->Run || this->RunOf != made) {
    this->Run.reset();
    this->Run = std::make_unique<echorama::SceneRun>(std::move(scene), this->Values.landmarks, echorama::ReadMesh,
                                                     vtkUltrasoundGel::SurfaceOf, progress);
    this->RunOf = made;
  }
  return *this->Run;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSceneSource::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  // Without this, ranks other than the first would not be asked for anything.
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port) {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSceneSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    this->Made.clear();
    this->Notes.clear();
    echorama::ControllerWork<vtkMultiProcessController> shared(this->Controller);
    shared.Run([&] { this->MakeViews(outputs, shared, progress); });
    this->Ranks = shared.Ranks();
    this->Told = shared.Told();
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundSceneSource::MakeViews(vtkInformationVector* outputs, echorama::SharedWork& shared,
                                         const echorama::Progress& progress)
{
  echorama::SceneRun& run = this->Prepare(progress.Part(0.0, 0.1));
  vtkUltrasoundTissue::Set(vtkPolyData::GetData(outputs, Tissue), run.Tissue());
  const int views = static_cast<int>(run.Views().size()), only = this->Values.view;
  if (only > views) {
    throw Error(Error::Kind::InvalidParameter,
                "View is " + std::to_string(only) + "; the scene has " + std::to_string(views) + " views");
  }
  const int first = only > 0 ? only : 1;
  const std::size_t count = only > 0 ? 1 : static_cast<std::size_t>(views);
  const auto make = [&](std::size_t i, std::size_t more, double begin, double end) {
    const auto at = [&](double part) { return 0.1 + 0.9 * (begin + (end - begin) / static_cast<double>(more) * part); };
    const int number = first + static_cast<int>(i);
    echorama::SceneScan scan = run.Make(static_cast<std::size_t>(number) - 1, progress.Part(at(0.0), at(0.95)));
    SentView view{vtkSmartPointer<vtkMultiBlockDataSet>::New(), {}};
    view.made = this->Put(scan, number, view.blocks, progress.Part(at(0.95), at(1.0)));
    scan.beams = {};
    scan.tissue = scan.gelSurface = {};
    view.made.Scan = std::move(scan);
    return std::vector<SentView>{std::move(view)};
  };
  const auto hear = [&](std::size_t i, const SentView& view) {
    unsigned int place = 0;
    for (const int port : {Volumes, Beams, Truth}) {
      PutBlock(vtkMultiBlockDataSet::GetData(outputs, port), static_cast<unsigned int>(i), view.blocks->GetBlock(place),
               view.blocks->GetMetaData(place)->Get(vtkCompositeDataSet::NAME()));
      ++place;
    }
  };
  const std::string about = std::to_string(count) + " views " + echorama::Checksum(this->RunOf.data(), this->RunOf.size());
  shared.Exchange({}, about); // a scene that is not there, or is another one, is heard of before views are made
  for (SentView& view : echorama::ShareOut<SentView>(shared, count, count, about, make, hear)) {
    this->Made.push_back(std::move(view.made));
  }
  echorama::Packed notes;
  for (const std::string& note : run.Notes()) {
    notes(note);
  }
  for (const std::string& told : shared.Exchange(notes.Bytes())) {
    for (echorama::Unpacked from(told); !from.AtEnd();) {
      std::string note;
      from(note);
      if (std::find(this->Notes.begin(), this->Notes.end(), note) == this->Notes.end()) {
        this->Notes.push_back(note);
      }
    }
  }
}

//----------------------------------------------------------------------------
vtkUltrasoundSceneSource::MadeView vtkUltrasoundSceneSource::Put(echorama::SceneScan& scan, int number,
                                                                 vtkMultiBlockDataSet* blocks, const echorama::Progress& progress)
{
  const echorama::SynthesisScene& scene = this->Run->Scene();
  const echorama::SynthesisParameters& p = scan.parameters;
  const std::string suffix = std::to_string(number);
  vtkNew<vtkImageData> volume, beams;
  const auto grid = echorama::ScanConversionGrid(p.probe, p.probeToWorld, scene.volume.spacingMm, MaximumVoxels);
  vtkUltrasoundSynthesizer::SetOutputs(p, scan.beams.View(), grid, volume, beams, progress);
  MadeView made;
  made.Number = number;
  made.Knock = Knock(volume, static_cast<std::size_t>(number) - 1, scene.seed, scene.volume.knockMm, scene.volume.knockDegrees);
  vtkUltrasoundAcquisition::SetProbeToWorld(beams, made.Knock * p.probeToWorld); // as the volume says
  PutBlock(blocks, 0, volume, "volume_" + suffix);
  PutBlock(blocks, 1, beams, "beams_" + suffix);

  vtkNew<vtkMultiBlockDataSet> truth;
  const auto put = [&truth](vtkDataObject* data, const char* name) { PutBlock(truth, truth->GetNumberOfBlocks(), data, name); };
  const auto putTissue = [&put](const echorama::TissueSurface& surface, const char* name) {
    vtkNew<vtkPolyData> data;
    vtkUltrasoundTissue::Set(data, surface);
    put(data, name);
  };
  if (!scan.tissue.materials.empty()) {
    putTissue(scan.tissue, "tissue");
  }
  if (scan.pressed) {
    vtkNew<vtkImageData> displacement;
    vtkUltrasoundTissuePress::SetOutput(*scan.pressed, displacement);
    put(displacement, "displacement");
  }
  if (scan.gel) {
    putTissue(scan.gelSurface, "gel");
    vtkNew<vtkPolyData> face;
    vtkUltrasoundGel::SetFace(*scan.gel, face);
    put(face, "face");
  }
  if (!scan.landmarks.empty()) {
    vtkNew<vtkPolyData> landmarks;
    FillLandmarks(landmarks, scan.landmarks, made.Knock);
    put(landmarks, "landmarks");
  }
  PutBlock(blocks, 2, truth, "view_" + suffix);
  return made;
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundSceneSource::Knock(vtkImageData* volume, std::size_t number, std::uint64_t seed, double mm,
                                               double degrees)
{
  if (number == 0) {
    return echorama::Pose::Identity();
  }
  std::ptrdiff_t count = 0;
  Eigen::Vector3d index = Eigen::Vector3d::Zero();
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(volume);
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    index = echorama::ValidCentroid<T>(
        vtkUltrasoundVolume::ViewOf<const T>(intensity, volume),
        vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(volume), volume), count);
  });
  const Eigen::Vector3d centre = vtkUltrasoundVolume::GeometryOf(volume).IndexToWorld() * index;
  const echorama::Pose knock = echorama::KnockedPose(seed, number, mm, degrees, centre);
  vtkUltrasoundVolume::Move(volume, knock);
  return knock;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSceneSource::GetNumberOfViews()
{
  int views = 0;
  vtkUltrasoundVolume::Run(this, nullptr, [this, &views](const echorama::Progress&) {
    views = static_cast<int>(echorama::ViewsOf(this->Read()).size());
  });
  return views;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundSceneSource::GetVolumeToWorld(int view, vtkMatrix4x4* volumeToWorld)
{
  for (const MadeView& made : this->Made) {
    if (made.Number == view) {
      vtkUltrasoundVolume::SetMatrix(volumeToWorld, made.Knock.inverse());
      return true;
    }
  }
  return false;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSceneSource::GetResolvedScene()
{
  std::string text;
  vtkUltrasoundVolume::Run(this, nullptr, [this, &text](const echorama::Progress&) {
    echorama::SynthesisScene scene = this->Read();
    scene.MakeFilesAbsolute();
    text = echorama::SceneToJson(scene);
  });
  return text;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSceneSource::GetNotes()
{
  std::string text;
  for (const std::string& note : this->Notes) {
    text += note + "\n";
  }
  return text;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSceneSource::GetReport()
{
  std::vector<const echorama::SceneScan*> scans;
  for (const MadeView& made : this->Made) {
    scans.push_back(&made.Scan);
  }
  return echorama::ReportOf(scans, this->Ranks, this->Told);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSceneSource::GetSceneSchema()
{
  return echorama::SceneSchema();
}

//----------------------------------------------------------------------------
void vtkUltrasoundSceneSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->GetNotes() << "\n";
}
