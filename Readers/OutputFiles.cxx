// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/OutputFiles.h"
#include "Core/Base/Error.h"
#include "Readers/ImageHeader.h"
#include "Readers/SequenceFile.h"
#include "Readers/VolumeFile.h"
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <unistd.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

[[noreturn]] void Fail(const fs::path& path, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, path.string() + ": " + reason);
}

// The files that reading a volume may touch.
std::vector<fs::path> FilesOfInput(const std::string& input)
{
  std::error_code none;
  std::vector<fs::path> files{input};
  if (fs::is_directory(input, none)) { // a series of slices, one a file
    for (fs::recursive_directory_iterator entry(input, none), end; !none && entry != end; entry.increment(none))
      files.push_back(entry->path());
    return files;
  }
  for (const std::string& companion : CompanionPaths(input))
    files.emplace_back(companion);
  for (std::size_t i = files.size(); i-- > 0;) {
    for (const char* extension : {".hdr", ".img"}) // NIfTI in two files
      if (files[i].extension() == ".hdr" || files[i].extension() == ".img")
        files.push_back(fs::path(files[i]).replace_extension(extension));
    const std::string file = files[i].string();
    try {
      FrameAxis axis;
      axis.field = [](auto...) {};
      files.emplace_back(LooksLikeSequence(file) ? ReadSequenceHeader(file, axis).dataPath : ReadImageHeader(file).dataPath);
    } catch (const Error&) {
      // Not there, or without a header: then there are no detached voxels.
    }
  }
  return files;
}

// The files that writing it may touch.
std::vector<fs::path> FilesOfOutput(const std::string& output)
{
  std::vector<fs::path> files{output};
  for (const std::string& companion : CompanionPaths(output))
    files.emplace_back(companion);
  for (std::size_t i = files.size(); i-- > 0;)
    for (const char* extension : {".raw", ".zraw", ".raw.gz"})
      if (files[i].extension() == ".mhd" || files[i].extension() == ".nhdr")
        files.push_back(fs::path(files[i]).replace_extension(extension));
  return files;
}

} // namespace

std::vector<std::string> CompanionPaths(const std::string& path)
{
  std::vector<std::string> files{CompanionPath(path, "ValidRegion")};
  for (const char* array : CompanionArrays)
    files.push_back(CompanionPath(path, array));
  return files;
}

std::vector<std::string> FilesOfVolume(const std::string& path)
{
  std::vector<std::string> files;
  std::error_code none;
  if (!fs::exists(path, none))
    return files;
  for (const fs::path& file : FilesOfInput(path))
    if (const std::string name = file.lexically_normal().string();
        fs::is_regular_file(file, none) && std::find(files.begin(), files.end(), name) == files.end())
      files.push_back(name);
  return files;
}

std::vector<bool> AreCompanions(const std::vector<std::string>& files)
{
  const auto normal = [](const std::string& path) { return fs::path(path).lexically_normal(); };
  std::set<fs::path> companions;
  for (const std::string& file : files)
    for (const std::string& companion : CompanionPaths(file))
      companions.insert(normal(companion));
  std::vector<bool> are(files.size());
  std::transform(files.begin(), files.end(), are.begin(), [&](const auto& file) { return companions.count(normal(file)) > 0; });
  return are;
}

void CheckOutput(const std::string& name, const std::vector<std::string>& inputs)
{
  const fs::path path(name), folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code none;
  if (!path.has_filename() || fs::is_directory(path, none))
    Fail(path, "it is a folder; a file is needed");
  if (!fs::is_directory(folder, none))
    Fail(path, "its folder does not exist");
  if (fs::exists(path, none) && !fs::is_regular_file(path, none))
    Fail(path, "it is not a regular file");
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    Fail(path, std::string("its folder cannot be written in: ") + std::strerror(errno));
  const std::vector<fs::path> writes = FilesOfOutput(name);
  for (const std::string& input : inputs)
    for (const fs::path& read : FilesOfInput(input))
      for (const fs::path& write : writes)
        if (fs::equivalent(write, read, none))
          Fail(write, "it is, or belongs to, the input " + input + "; inputs are never overwritten");
}

void CheckVolumeOutput(const std::string& path, const std::vector<std::string>& inputs)
{
  CheckOutput(path, inputs);
  if (FormatOfName(path) == FileFormat::Unknown)
    throw Error(Error::Kind::InvalidParameter,
                path +
                    ": the extension names none of the formats that are written (.mha .mhd .nrrd .nhdr .nii .nii.gz .vdb .vti)");
}

OutputFolder::OutputFolder(const std::string& path, const std::vector<std::string>& inputs) : inputs_(inputs), folder_(path)
{
  fs::path folder;
  for (const fs::path& part : folder_) {
    folder /= part;
    std::error_code error;
    if (fs::create_directory(folder, error))
      made_.push_back(folder);
    else if (error)
      Fail(folder_, "the folder cannot be made: " + error.message());
  }
  if (access(folder_.c_str(), W_OK | X_OK) != 0)
    Fail(folder_, std::string("the folder cannot be written in: ") + std::strerror(errno));
  stage_ = place_.Stage((folder_ / ".files").string());
  std::error_code error;
  fs::remove(stage_, error);
  if (!fs::create_directory(stage_, error))
    Fail(folder_, "the folder cannot be written in: " + error.message());
}

OutputFolder::~OutputFolder()
{
  std::error_code none;
  fs::remove_all(stage_, none);
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder)
    fs::remove(*folder, none); // only when it is empty
}

std::string OutputFolder::Stage(const std::string& name)
{
  CheckOutput(Final(name), inputs_);
  if (std::find(names_.begin(), names_.end(), name) != names_.end())
    Fail(Final(name), "it would be written twice, because two volumes have this name");
  names_.push_back(name);
  return (stage_ / name).string();
}

void OutputFolder::Commit()
{
  FileReplacement none;
  Commit(none);
}

void OutputFolder::Commit(FileReplacement& others)
{
  for (const std::string& name : names_)
    for (const std::string& companion : CompanionPaths(name)) // of an earlier file of this name
      if (!fs::exists(stage_ / companion))
        others.Remove((folder_ / companion).string());
  for (const auto& entry : fs::directory_iterator(stage_))
    fs::rename(entry.path(), others.Stage(Final(entry.path().filename().string())));
  others.Commit();
  made_.clear();
}

} // namespace echorama
