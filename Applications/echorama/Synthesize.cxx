// SPDX-License-Identifier: BSD-3-Clause
// echorama synthesize: overlapping volumes of a scene, from several poses of a probe, with everything that is known of them.
#include "Commands.h"
#include "Core/Base/TextFile.h"
#include "Filters/Scenes/SceneJson.h"
#include "ParameterOptions.h"
#include "SyntheticSet.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkCompositeDataSet.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundSceneSource.h>
#include <vtkXMLPolyDataWriter.h>

namespace echorama {
namespace {

struct SynthesizeOptions {
  std::string scene, folder, data, format = "mha";
  std::optional<std::uint64_t> seed;
  SceneVolume volume;
  CLI::Option* spacing = nullptr;
  int landmarks = 0;
};

void WriteSurface(Session& session, vtkPolyData* surface, const std::string& path)
{
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surface);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  session.Watch(writer, "write", path, [&] {
    if (!writer->Write() || writer->GetErrorCode() != vtkErrorCode::NoError)
      throw Error(Error::Kind::FileSystem, path + ": it cannot be written (is the disk full?)");
  });
}

template <class T>
T* BlockOf(vtkMultiBlockDataSet* blocks, const std::string& name)
{
  for (unsigned int n = 0; n < blocks->GetNumberOfBlocks(); ++n)
    if (blocks->GetMetaData(n)->Get(vtkCompositeDataSet::NAME()) == name)
      return T::SafeDownCast(blocks->GetBlock(n));
  return nullptr;
}

void Synthesize(Session& session, const SynthesizeOptions& options)
{
  SynthesisScene scene = ReadScene(options.scene, options.seed);
  scene.dataFolder = options.data;
  std::vector<std::string> inputs = scene.MakeFilesAbsolute();
  const int views = static_cast<int>(ViewsOf(scene).size());
  inputs.push_back(options.scene);
  OutputFolder folder(options.folder, inputs);
  session.ShowAs(folder.StageFolder(), options.folder);
  session.result["folder"] = options.folder;

  vtkNew<vtkUltrasoundSceneSource> source;
  source->SetFileName(options.scene.c_str());
  source->SetDataFolder(options.data.c_str());
  source->SetLandmarks(options.landmarks);
  if (options.seed)
    source->SetSeed(static_cast<vtkTypeInt64>(*options.seed));
  if (options.spacing->count() > 0)
    source->SetSpacingMm(options.volume.spacingMm);
  SyntheticSet set(session, folder, options.format, scene.volume.knockMm, scene.volume.knockDegrees);
  for (int number = 1; number <= views; ++number) {
    const std::string suffix = std::to_string(number);
    source->SetView(number);
    session.Update(source, "synthesize", "volume_" + suffix);
    if (number == 1) {
      auto* tissue = vtkPolyData::SafeDownCast(source->GetOutputDataObject(2));
      session.result["triangles"] = tissue->GetNumberOfPolys();
      session.result["seed"] = scene.seed;
      WriteTextFile(folder.Stage("scene.json"), source->GetResolvedScene() + "\n");
      WriteSurface(session, tissue, folder.Stage("geometry.vtp"));
    }
    const vtkUltrasoundSceneSource::MadeView& made = source->Views().front();
    auto* truth =
        vtkMultiBlockDataSet::SafeDownCast(vtkMultiBlockDataSet::SafeDownCast(source->GetOutputDataObject(3))->GetBlock(0));
    const auto first = [&source](int port) {
      return vtkImageData::SafeDownCast(vtkMultiBlockDataSet::SafeDownCast(source->GetOutputDataObject(port))->GetBlock(0));
    };
    nlohmann::ordered_json told = ToJson(made.Scan);
    for (const auto& [key, block] : {std::pair<const char*, const char*>{"surface", "gel"}, {"face", "face"}})
      if (auto* surface = BlockOf<vtkPolyData>(truth, block)) {
        const std::string file = std::string(block) + "_" + suffix + ".vtp";
        WriteSurface(session, surface, folder.Stage(file));
        told["gel"][key] = folder.Final(file);
      }
    const std::string beams = "beams_" + suffix + "." + options.format;
    told["beams"] = folder.Final(beams);
    std::vector<Landmark> landmarks = made.Scan.landmarks;
    for (Landmark& landmark : landmarks)
      landmark.position = made.Knock * landmark.position;
    set.Add(first(0), made.Knock, told, landmarks, BlockOf<vtkImageData>(truth, "displacement"));
    SaveVolume(session, first(1), folder.Stage(beams));
  }
  for (const std::string& note : LinesOf(source->GetNotes()))
    session.Note(note);
  set.Finish();
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<SynthesizeOptions>();
  options->add_option("scene", values->scene, "The scene, JSON (see Documentation/scenes.md)")->type_name("FILE")->required();
  options
      ->add_option("-o,--output", values->folder,
                   "Folder for the volumes, their beams, the geometry, the scene, and truth.json, the poses that put them back")
      ->type_name("FOLDER")
      ->required();
  options->add_option("--seed", values->seed, "Seed instead of the scene's")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 62));
  values->spacing = AddParameter(options, Describe(values->volume), "SpacingMm", "--spacing")->default_str("the scene's");
  options->add_option("--data", values->data, "Folder of the meshes and recordings that the scene names, whatever folder it says")
      ->type_name("FOLDER");
  AddSetOptions(*options, values->landmarks, values->format);
  action = [values](Session& session) { Synthesize(session, *values); };
}

} // namespace echorama
