// SPDX-License-Identifier: BSD-3-Clause
// Displacements are files of their own beside the poses: images that ParaView and other programs of VTK read as they are.
#include "Displacements.h"
#include "Core/Base/Error.h"
#include "Readers/VtkXmlFile.h"
#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkUltrasoundDeformableAligner.h>
#include <vtkUltrasoundDisplacement.h>
#include <vtkUltrasoundVolume.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLImageDataWriter.h>

namespace echorama {
namespace {

vtkSmartPointer<vtkImageData> ReadDisplacement(Session& session, const std::string& path)
{
  std::error_code unknown; // of a name that no file can have
  if (!std::filesystem::exists(path, unknown))
    throw Error(Error::Kind::FileSystem, path + ": a displacement that the poses name is not there");
  CheckVtkXmlFile(path);
  const vtkNew<vtkXMLImageDataReader> reader;
  reader->SetFileName(path.c_str());
  try {
    session.Update(reader, "read", path);
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::Cancelled)
      throw;
    throw Error(error.GetKind(), path + ": " + error.what());
  }
  vtkUltrasoundDisplacement::FieldOf(reader->GetOutput(), path); // or be told what is wrong with it
  return reader->GetOutput();
}

} // namespace

std::optional<DisplacementField> DisplacementOf(Session& session, const VolumePose& pose)
{
  if (pose.displacement.empty())
    return {};
  return vtkUltrasoundDisplacement::FieldOf(ReadDisplacement(session, pose.displacement), pose.displacement);
}

void WriteDisplacement(vtkImageData* image, const std::string& path)
{
  const vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(image);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToBinary();
  if (!writer->Write() || writer->GetErrorCode() != vtkErrorCode::NoError)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written");
}

std::string DisplacementPath(const std::string& poses, std::size_t number)
{
  const std::filesystem::path path(poses);
  return (path.parent_path() / (path.stem().string() + ".displacement-" + std::to_string(number + 1) + ".vti")).string();
}

void DeformVolumes(Session& session, vtkUltrasoundDeformableAligner* aligner, const std::vector<LoadedVolume>& volumes,
                   const std::vector<bool>& aligned, int fixed, const std::function<std::string()>& output,
                   FileReplacement& files, std::vector<VolumePose>& poses)
{
  std::vector<LoadedVolume> placed;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < volumes.size(); ++i)
    if (aligned[i]) {
      if (static_cast<int>(i) == fixed)
        aligner->SetFixedVolume(static_cast<int>(placed.size()));
      placed.push_back(volumes[i]);
      numbers.push_back(i);
    } else {
      session.Note(volumes[i].file + ": it is not aligned, and is not bent");
    }
  if (placed.size() < 2)
    return;
  aligner->SetInputDataObject(BlocksOf(placed));
  session.Update(aligner, "deform");
  const std::string posesFile = output();
  for (std::size_t p = 0; p < placed.size(); ++p) {
    const auto block = static_cast<unsigned int>(p);
    const std::size_t number = numbers[p];
    if (static_cast<int>(number) == fixed)
      continue;
    const DeformableAlignResult& found = aligner->Result(p);
    nlohmann::ordered_json told{{"applied", found.isApplied},
                                {"reason", found.reason},
                                {"similarity_before", found.similarityBefore},
                                {"similarity_after", found.similarityAfter},
                                {"largest_mm", found.largestMm},
                                {"smallest_determinant", found.smallestDeterminant},
                                {"bending_mm", found.bendingEnergy}};
    if (found.isApplied) {
      const std::string place = DisplacementPath(posesFile, number);
      poses[number].displacement = session.Stage(files, place);
      WriteDisplacement(
          vtkImageData::SafeDownCast(vtkMultiBlockDataSet::SafeDownCast(aligner->GetOutputDataObject(1))->GetBlock(block)),
          poses[number].displacement);
      told["file"] = place;
    }
    session.result["volumes"][number]["deformation"] = told;
    session.Say(volumes[number].file + ": " +
                (found.isApplied ? "bent by up to " + Fixed(found.largestMm, 2) + " mm" : "not bent: " + found.reason));
  }
}

vtkSmartPointer<vtkMultiBlockDataSet> DisplacementsOf(Session& session, const std::vector<LoadedVolume>& volumes,
                                                      const std::string& path)
{
  if (path.empty())
    return nullptr;
  const std::vector<VolumePose> poses = ReadPoses(path);
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  bool any = false;
  for (unsigned int i = 0; i < volumes.size(); ++i) {
    const LoadedVolume& volume = volumes[i];
    const std::string& file = PoseIn(poses, path, volume).displacement;
    vtkSmartPointer<vtkImageData> image;
    if (!file.empty()) {
      image = ReadDisplacement(session, file);
      any = true;
    } else {
      ImageGeometry somewhere;
      somewhere.dimensions = {2, 2, 2};
      image = vtkSmartPointer<vtkImageData>::New();
      vtkUltrasoundDisplacement::ImageOf(DisplacementField(somewhere), image);
    }
    blocks->SetBlock(i, image);
    blocks->GetMetaData(i)->Set(vtkCompositeDataSet::NAME(), volume.file.c_str());
  }
  return any ? blocks : nullptr;
}

} // namespace echorama
