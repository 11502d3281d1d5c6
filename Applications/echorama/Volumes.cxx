// SPDX-License-Identifier: BSD-3-Clause
#include "Volumes.h"
#include "Core/Base/Angles.h"
#include "Core/Base/JsonPlace.h"
#include "Readers/OutputFiles.h"
#include <sstream>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkCompositeDataSet.h>
#include <vtkImageAlgorithm.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUltrasoundReader.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

std::vector<std::string> LinesOf(const std::string& text)
{
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

LoadedVolume LoadVolume(Session& session, const std::string& file, const VolumeReading& reading)
{
  vtkNew<vtkUltrasoundReader> reader;
  reader->SetFileName(file.c_str());
  reader->SetSpacingMm(reading.parameters.spacingMm);
  reader->SetStackSpacingMm(reading.parameters.stackSpacingMm.data());
  reader->SetStride(reading.parameters.stride);
  LoadedVolume volume;
  volume.file = file;
  volume.content.format = FormatOfContent(file);
  if (volume.content.format != FileFormat::VtkXmlImage)
    volume.content = OpenVolume(file, reading.parameters)->Content();
  const std::vector<double>& times = volume.content.times;
  if (reading.step > 0 && reading.step >= static_cast<int>(times.size()))
    throw Error(Error::Kind::InvalidParameter, "--time " + std::to_string(reading.step) + ": " + file + " holds " +
                                                   (times.empty() ? "one volume" : std::to_string(times.size()) + " volumes") +
                                                   ", counted from 0");
  if (reading.beams && !volume.content.beams)
    throw Error(Error::Kind::InvalidParameter, "--beams: " + file + " holds no samples along beams");
  const int port = reading.beams ? 1 : 0;
  session.Watch(reader, "read", file, [&] {
    reader->UpdateInformation();
    if (!times.empty())
      reader->GetOutputInformation(port)->Set(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(),
                                              times[static_cast<std::size_t>(reading.step)]);
    reader->Update(port);
  });
  volume.image = vtkImageData::SafeDownCast(reader->GetOutputDataObject(port));
  if (volume.image->GetNumberOfPoints() == 0)
    throw Error(Error::Kind::BadFile, file + ": it cannot be read");
  for (const std::string& note : LinesOf(reader->GetNotes()))
    session.Note(file + ": " + note);
  volume.geometry = vtkUltrasoundVolume::GeometryOf(volume.image);
  return volume;
}

std::vector<LoadedVolume> LoadVolumes(Session& session, const std::vector<std::string>& files, const VolumeReading& reading)
{
  std::vector<LoadedVolume> volumes;
  for (const std::string& file : files)
    volumes.push_back(LoadVolume(session, file, reading));
  return volumes;
}

std::vector<std::string> WithoutCompanions(Session& session, const std::vector<std::string>& files)
{
  const std::vector<bool> areCompanions = AreCompanions(files);
  std::vector<std::string> volumes;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (areCompanions[i])
      session.Note(files[i] + ": not a volume of its own, but a part of one that is named too; left out");
    else
      volumes.push_back(files[i]);
  }
  return volumes;
}

bool IsWrittenBySlabs(const std::string& path)
{
  const FileFormat format = FormatOfName(path);
  return format == FileFormat::MetaImage || format == FileFormat::Nrrd || format == FileFormat::Nifti;
}

void WriteBySlabs(Session& session, vtkImageAlgorithm* source, int slabs, const std::string& path, const std::string& stage,
                  const std::function<void(vtkImageData*)>& take)
{
  vtkNew<vtkCallbackCommand> made;
  const std::function<void()> takeOutput = [&] { take(source->GetOutput()); };
  made->SetClientData(const_cast<void*>(static_cast<const void*>(&takeOutput)));
  made->SetCallback(
      [](vtkObject*, unsigned long, void* function, void*) { (*static_cast<const std::function<void()>*>(function))(); });
  const unsigned long tag = source->AddObserver(vtkCommand::EndEvent, made);
  vtkNew<vtkUltrasoundWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputConnection(source->GetOutputPort());
  writer->SetNumberOfSlabs(slabs);
  bool written = false;
  session.Watch(writer, stage, {}, [&] { written = writer->Write() != 0; });
  source->RemoveObserver(tag);
  if (!written)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written");
}

void MoveVolume(LoadedVolume& volume, const Pose& pose)
{
  vtkUltrasoundVolume::Move(volume.image, pose);
  volume.volumeToWorld = pose * volume.volumeToWorld;
}

const VolumePose& PoseIn(const std::vector<VolumePose>& poses, const std::string& path, const LoadedVolume& volume)
{
  try {
    return PoseFor(poses, volume.file, volume.geometry);
  } catch (const Error& error) {
    throw Error(error.GetKind(), path + ": " + error.what());
  }
}

void RehearsePoses(Session& session, const std::vector<LoadedVolume>& volumes, const std::string& path)
{
  std::vector<VolumePose> poses;
  for (const LoadedVolume& volume : volumes)
    poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
  FileReplacement files; // never put in its place
  WritePoses(session.Stage(files, path), poses);
}

vtkSmartPointer<vtkMultiBlockDataSet> BlocksOf(const std::vector<LoadedVolume>& volumes)
{
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  blocks->SetNumberOfBlocks(static_cast<unsigned int>(volumes.size()));
  for (unsigned int i = 0; i < volumes.size(); ++i) {
    blocks->SetBlock(i, volumes[i].image);
    blocks->GetMetaData(i)->Set(vtkCompositeDataSet::NAME(), volumes[i].file);
  }
  return blocks;
}

std::vector<std::string> SaveVolume(Session& session, vtkImageData* image, const std::string& path)
{
  vtkNew<vtkUltrasoundWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(image);
  bool written = false;
  session.Watch(writer, "write", {}, [&] { written = writer->Write() != 0; });
  if (!written)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written");
  return LinesOf(writer->GetNotes());
}

nlohmann::ordered_json JsonOf(const Eigen::Vector3d& v)
{
  return JsonPlace::ListOf(v);
}

nlohmann::ordered_json JsonOf(const Pose& pose)
{
  return JsonOf(Eigen::Affine3d(pose));
}

nlohmann::ordered_json JsonOf(const Eigen::Affine3d& matrix)
{
  return JsonPlace::RowsOf(matrix.matrix());
}

nlohmann::ordered_json JsonOf(const ProbeGeometry& g)
{
  nlohmann::ordered_json json{{"fan_degrees", g.fanAngle * DegreesPerRadian},
                              {"fan_mm", g.fanWidth},
                              {"sweep_degrees", g.sweepAngle * DegreesPerRadian},
                              {"sweep_mm", g.sweepWidth},
                              {"depth_mm", {g.depthMin, g.depthMax}}};
  if (g.fanOffset != 0.0)
    json["fan_offset_degrees"] = g.fanOffset * DegreesPerRadian;
  return json;
}

std::string ProbeText(const ProbeGeometry& g)
{
  return "fan " + Fixed(g.fanAngle * DegreesPerRadian, 1) + " degrees, " + Fixed(g.fanWidth, 1) + " mm" +
         (g.fanOffset != 0.0 ? ", off centre by " + Fixed(g.fanOffset * DegreesPerRadian, 1) + " degrees" : "") + "; sweep " +
         Fixed(g.sweepAngle * DegreesPerRadian, 1) + " degrees, " + Fixed(g.sweepWidth, 1) + " mm; depth " +
         Fixed(g.depthMin, 1) + " to " + Fixed(g.depthMax, 1) + " mm";
}

const char* TypeText(VoxelType type)
{
  static const int types[] = {VTK_SIGNED_CHAR,  VTK_UNSIGNED_CHAR, VTK_SHORT,       VTK_UNSIGNED_SHORT, VTK_INT,
                              VTK_UNSIGNED_INT, VTK_TYPE_INT64,    VTK_TYPE_UINT64, VTK_FLOAT,          VTK_DOUBLE};
  return vtkImageScalarTypeNameMacro(types[static_cast<int>(type)]);
}

std::string Triple(const Eigen::Vector3d& v, const char* separator, int digits)
{
  return Fixed(v[0], digits) + separator + Fixed(v[1], digits) + separator + Fixed(v[2], digits);
}

} // namespace echorama
