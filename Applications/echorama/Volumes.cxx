// SPDX-License-Identifier: BSD-3-Clause
#include "Volumes.h"

#include "Readers/VolumeFile.h"
#include <algorithm>
#include <filesystem>
#include <sstream>
#include <vtkCompositeDataSet.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkUltrasoundReader.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {
namespace {

std::vector<std::string> LinesOf(const std::string& text)
{
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

} // namespace

LoadedVolume LoadVolume(Session& session, const std::string& file)
{
  vtkNew<vtkUltrasoundReader> reader;
  reader->SetFileName(file.c_str());
  session.Update(reader, "read", file);
  LoadedVolume volume;
  volume.file = file;
  volume.image = reader->GetOutput();
  if (volume.image->GetNumberOfPoints() == 0)
    throw Error(Error::Kind::BadFile, file + ": it cannot be read");
  for (const std::string& note : LinesOf(reader->GetNotes()))
    session.Note(file + ": " + note);
  volume.geometry = vtkUltrasoundVolume::GeometryOf(volume.image);
  return volume;
}

std::vector<LoadedVolume> LoadVolumes(Session& session, const std::vector<std::string>& files)
{
  std::vector<LoadedVolume> volumes;
  for (const std::string& file : files)
    volumes.push_back(LoadVolume(session, file));
  return volumes;
}

std::vector<std::string> WithoutCompanions(Session& session, const std::vector<std::string>& files)
{
  const auto same = [](const std::string& a, const std::string& b) {
    return std::filesystem::path(a).lexically_normal() == std::filesystem::path(b).lexically_normal();
  };
  std::vector<std::string> volumes;
  for (const std::string& file : files) {
    const bool companion = std::any_of(files.begin(), files.end(), [&](const std::string& other) {
      return same(file, CompanionPath(other, "ValidRegion")) || same(file, CompanionPath(other, "Provenance"));
    });
    if (companion)
      session.Note(file + ": not a volume of its own, but a part of one that is named too; left out");
    else
      volumes.push_back(file);
  }
  return volumes;
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

void ApplyPoses(std::vector<LoadedVolume>& volumes, const std::string& path)
{
  if (path.empty())
    return;
  const std::vector<VolumePose> poses = ReadPoses(path);
  for (LoadedVolume& volume : volumes)
    MoveVolume(volume, PoseIn(poses, path, volume).volumeToWorld);
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
  return {v[0], v[1], v[2]};
}

nlohmann::ordered_json JsonOf(const Pose& pose)
{
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (int i = 0; i < 4; ++i)
    rows.push_back({pose(i, 0), pose(i, 1), pose(i, 2), pose(i, 3)});
  return rows;
}

std::string Triple(const Eigen::Vector3d& v, const char* separator, int digits)
{
  return Fixed(v[0], digits) + separator + Fixed(v[1], digits) + separator + Fixed(v[2], digits);
}

} // namespace echorama
