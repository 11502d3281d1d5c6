// SPDX-License-Identifier: BSD-3-Clause
// A project counts as written when its bytes and its name are on the disk: write, fsync, rename, fsync of the folder. Everything
// is checked on reading, with the place in the file in the message, because people and scripts write projects too.
//
// Nobody edits a backup, so it can carry a checksum: of the JSON as it is printed without it. A flipped digit is found that
// would still be JSON and a plausible pose.
#include "Widgets/Session/ProjectFile.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/TextFile.h"
#include "Core/Geometry/PoseJson.h"
#include "Widgets/Session/Checksum.h"
#include "Widgets/Session/MadeOfJson.h"
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <set>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace echorama {
namespace {

using Json = JsonPlace::Json;

constexpr const char* Schema = "echorama-project-1";
constexpr const char* PoseSchema = "echorama-poses-1";
constexpr int LargestBackup = 999999999;              // nine digits of a file's name, beyond those that a project may go on from
constexpr std::size_t Limit = std::size_t{512} << 20; // bytes of a file

fs::path Resolved(const fs::path& path)
{
  return ResolvedPath(path.string());
}

std::string Relative(const std::string& path, const fs::path& folder)
{
  if (path.empty())
    return path;
  const fs::path relative = Resolved(path).lexically_relative(folder);
  return (relative.empty() ? Resolved(path) : relative).generic_string();
}

bool IsThere(const fs::path& path)
{
  std::error_code error;
  return fs::exists(path, error) && !error;
}

Json JsonOf(const Stroke& stroke)
{
  const Brush& brush = stroke.brush;
  Json path = Json::array();
  for (const Eigen::Vector3d& point : stroke.pathMm)
    path.push_back(Json::array({point.x(), point.y(), point.z()}));
  return {{"mode", NameOf(brush.mode)}, {"radiusMm", brush.radiusMm}, {"intensity", brush.intensity},
          {"opacity", brush.opacity},   {"hardness", brush.hardness}, {"insideValid", brush.insideValid},
          {"pathMm", std::move(path)}};
}

bool YesOrNo(const Json& value, const JsonPlace& place)
{
  if (!value.is_boolean())
    place.Fail("true or false is needed");
  return value.get<bool>();
}

double UnitNumber(const Json& value, const JsonPlace& place)
{
  const double number = place.Number(value);
  if (!(number >= 0.0 && number <= 1.0))
    place.Fail("a number in [0, 1] is needed");
  return number;
}

int Count(const Json& value, const JsonPlace& place, int largest = LargestNumber)
{
  if (!value.is_number_integer() || value.get<double>() < 0.0 || value.get<double>() > largest)
    place.Fail("a whole number from 0 to " + std::to_string(largest) + " is needed");
  return value.get<int>();
}

Stroke ToStroke(const Json& value, const JsonPlace& place)
{
  Stroke stroke;
  Brush& brush = stroke.brush;
  const std::optional<BrushMode> mode = BrushModeNamed(place.In("mode").Text(place.Member(value, "mode")));
  if (!mode)
    place.In("mode").Fail("paint, carve or restore is needed");
  brush.mode = *mode;
  brush.radiusMm = place.In("radiusMm").Number(place.Member(value, "radiusMm"));
  brush.intensity = place.In("intensity").Number(place.Member(value, "intensity"));
  brush.opacity = place.In("opacity").Number(place.Member(value, "opacity"));
  brush.hardness = place.In("hardness").Number(place.Member(value, "hardness"));
  brush.insideValid = YesOrNo(place.Member(value, "insideValid"), place.In("insideValid"));
  const JsonPlace pathPlace = place.In("pathMm");
  const Json& path = place.Member(value, "pathMm");
  if (!path.is_array())
    pathPlace.Fail("a list of points is needed");
  stroke.pathMm.reserve(path.size());
  for (const Json& point : path)
    stroke.pathMm.push_back(pathPlace.Vector<3>(point));
  return stroke;
}

StrokeChain ToStrokes(const Json& value, const JsonPlace& place)
{
  if (!value.is_array())
    place.In("strokes").Fail("a list is needed");
  StrokeChain chain;
  for (const Json& each : value) {
    const JsonPlace strokePlace = place.In("stroke " + std::to_string((chain ? chain->count : 0) + 1));
    try {
      chain = Append(chain, ToStroke(each, strokePlace));
    } catch (const Error& error) {
      if (error.GetKind() == Error::Kind::BadFile)
        throw;
      strokePlace.Fail(error.what());
    }
  }
  return chain;
}

std::vector<Landmark> ToLandmarks(const Json& value, const JsonPlace& place)
{
  if (!value.is_array())
    place.Fail("a list is needed");
  std::vector<Landmark> landmarks;
  std::set<std::string> labels;
  for (const Json& each : value) {
    const JsonPlace here = place.In("landmark " + std::to_string(landmarks.size() + 1));
    const std::string label = here.In("label").Text(here.Member(each, "label"));
    if (label.empty() || !labels.insert(label).second)
      here.In("label").Fail("a label that no other landmark of the volume has is needed");
    landmarks.push_back({label, here.In("position").Vector<3>(here.Member(each, "position"))});
  }
  return landmarks;
}

// A relative name counts from the folder; from \a beside (where a link to the project lies) when only there is something.
fs::path Located(const fs::path& name, const fs::path& folder, const fs::path& beside)
{
  fs::path found = (folder / name).lexically_normal(); // an absolute name replaces the folder
  return !IsThere(found) && IsThere(beside / name) ? beside / name : found;
}

SessionVolume ToVolume(const Json& value, const JsonPlace& place, const fs::path& folder, const fs::path& beside)
{
  SessionVolume volume;
  const auto given = [&value](const char* key) { return value.contains(key) ? &value[key] : nullptr; };
  const std::string file = place.In("file").Text(place.Member(value, "file"));
  if (!file.empty()) {
    fs::path found = Located(file, folder, beside);
    if (const Json* path = given("path")) {
      const std::string second = place.In("path").Text(*path);
      if (!IsThere(found) && !second.empty() && IsThere(second))
        found = second;
    }
    volume.file = Resolved(found).string();
  }
  if (const Json* name = given("name"))
    volume.name = place.In("name").Text(*name);
  if (volume.name.empty())
    volume.name = fs::path(volume.file).stem().string();
  if (volume.name.empty())
    place.Fail("it has neither a name nor a file");
  if (const Json* geometry = given("geometry"))
    volume.geometry = PoseJson::ToGeometry(*geometry, place.In("geometry"));
  volume.volumeToWorld = PoseJson::ToPose(place.Member(value, "VolumeToWorld"), place.In("VolumeToWorld"));
  if (const Json* colour = given("colour")) {
    const Eigen::Vector3d rgb = place.In("colour").Vector<3>(*colour);
    for (int i = 0; i < 3; ++i)
      volume.colour[static_cast<std::size_t>(i)] = UnitNumber(rgb[i], place.In("colour"));
  }
  if (const Json* opacity = given("opacity"))
    volume.opacity = UnitNumber(*opacity, place.In("opacity"));
  if (const Json* visible = given("visible"))
    volume.visible = YesOrNo(*visible, place.In("visible"));
  if (const Json* group = given("group"))
    volume.group = Count(*group, place.In("group"));
  if (const Json* strokes = given("strokes"))
    volume.strokes = ToStrokes(*strokes, place);
  if (const Json* landmarks = given("landmarks"))
    volume.landmarks = ToLandmarks(*landmarks, place.In("landmarks"));
  if (const Json* madeOf = given("madeOf"))
    volume.madeOf = std::make_shared<const MadeOf>(MadeOfJson::ToMadeOf(*madeOf, place.In("madeOf")));
  return volume;
}

std::vector<Measurement> ToMeasurements(const Json& value, const JsonPlace& place)
{
  if (!value.is_array())
    place.Fail("a list is needed");
  std::vector<Measurement> measurements;
  for (const Json& each : value) {
    const JsonPlace here = place.In("measurement " + std::to_string(measurements.size() + 1)), points = here.In("points");
    Measurement measurement;
    measurement.number = Count(here.Member(each, "number"), here.In("number"));
    const bool isTaken = std::any_of(measurements.begin(), measurements.end(),
                                     [&](const Measurement& other) { return other.number == measurement.number; });
    if (measurement.number < 1 || isTaken)
      here.In("number").Fail("a number, from 1, that no other measurement has is needed");
    const Json& places = here.Member(each, "points");
    if (!places.is_array() || (places.size() != 2 && places.size() != 3))
      points.Fail("two or three points are needed");
    for (const Json& point : places)
      measurement.points.push_back(points.Vector<3>(point));
    measurements.push_back(std::move(measurement));
  }
  return measurements;
}

void CheckBackup(Json& root, const JsonPlace& file, BackupStamp& stamp)
{
  Json& backup = root["backup"];
  const JsonPlace place = file.In("backup");
  stamp.number = Count(place.Member(backup, "number"), place.In("number"), LargestBackup);
  if (backup.contains("inPlaceOf"))
    stamp.inPlaceOf = Count(backup["inPlaceOf"], place.In("inPlaceOf"), LargestBackup);
  if (backup.contains("lineage"))
    stamp.lineage = place.In("lineage").Text(backup["lineage"]);
  const Json& time = place.Member(backup, "time");
  if (!time.is_number_integer())
    place.In("time").Fail("a whole number is needed");
  stamp.time = time.get<std::int64_t>();
  stamp.label = place.In("label").Text(place.Member(backup, "label"));
  const std::string checksum = place.In("checksum").Text(place.Member(backup, "checksum"));
  backup.erase("checksum");
  if (TextChecksum(root.dump()) != checksum)
    file.Fail("it is damaged: it is not as it was written");
}

[[noreturn]] void FailToWrite(const std::string& path, int problem)
{
  throw Error(Error::Kind::FileSystem, path + ": it cannot be written (" + std::strerror(problem) + ")");
}

void WriteText(const std::string& path, const std::string& text, const std::string& shown, bool toDisk)
{
  const int file = open(path.c_str(), O_WRONLY | O_TRUNC | O_NOFOLLOW | O_CLOEXEC);
  int problem = file < 0 ? errno : 0;
  for (std::size_t written = 0; problem == 0 && written < text.size();) {
    const ssize_t count = write(file, text.data() + written, text.size() - written);
    if (count > 0)
      written += static_cast<std::size_t>(count);
    else if (count == 0 || errno != EINTR)
      problem = count == 0 ? ENOSPC : errno;
  }
  if (problem == 0 && toDisk && fsync(file) != 0 && errno != EINVAL) // EINVAL: a file system without fsync
    problem = errno;
  if (file >= 0 && close(file) != 0 && problem == 0)
    problem = errno;
  if (problem != 0)
    FailToWrite(shown, problem);
}

void SyncFolder(const fs::path& folder)
{
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file >= 0) {
    fsync(file); // where a folder cannot be synced, the file system orders names itself
    close(file);
  }
}

} // namespace

std::string ResolvedPath(const std::string& path)
{
  if (path.empty())
    return path;
  std::error_code error;
  const fs::path whole = fs::absolute(path, error);
  const fs::path resolved = fs::weakly_canonical(whole, error);
  return (error ? whole.lexically_normal() : resolved).string();
}

bool SameTruths(const std::map<std::string, Pose>& a, const std::map<std::string, Pose>& b)
{
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& left, const auto& right) {
    return left.first == right.first && left.second.matrix() == right.second.matrix();
  });
}

bool SameNotes(const Project& a, const Project& b)
{
  return a.truth == b.truth && a.comment == b.comment && SameTruths(a.truths, b.truths) && a.fixed == b.fixed;
}

bool operator==(const Project& a, const Project& b)
{
  return a.state == b.state && SameNotes(a, b);
}

Project ReadProject(const std::string& path, BackupStamp* stamp)
{
  const JsonPlace file(path);
  Json root = file.Parse(ReadTextFile(path, Limit));
  if (file.Member(root, "schema") != PoseSchema)
    file.Need(root, "schema", Schema);
  file.Need(root, "unit", "mm");
  file.Need(root, "frame", "LPS");
  BackupStamp found;
  if (root.contains("backup"))
    CheckBackup(root, file, found);
  const Json& volumes = file.Member(root, "volumes");
  if (!volumes.is_array())
    file.Fail("\"volumes\" is not a list");

  const fs::path folder = Resolved(path).parent_path(), beside = fs::absolute(path).parent_path();
  Project project;
  std::set<std::string> names, files;
  std::map<std::string, int> copies; // the next number of those that have a name in common
  for (const Json& value : volumes) {
    const int number = static_cast<int>(project.state.volumes.size()) + 1;
    const JsonPlace place = file.In("volume " + std::to_string(number));
    SessionVolume volume = ToVolume(value, place, folder, beside);
    volume.id = number;
    if (!volume.file.empty() && !files.insert(volume.file).second)
      place.Fail(volume.file + " is named twice");
    if (value.contains("name") && names.count(volume.name))
      place.Fail("another volume has the name " + volume.name);
    const std::string wanted = volume.name;
    for (int& copy = copies.try_emplace(wanted, 2).first->second; !names.insert(volume.name).second; ++copy)
      volume.name = wanted + " (" + std::to_string(copy) + ")";
    if (value.contains("TrueVolumeToWorld"))
      project.truths[volume.name] = PoseJson::ToPose(value["TrueVolumeToWorld"], place.In("TrueVolumeToWorld"));
    if (value.contains("fixed") && YesOrNo(value["fixed"], place.In("fixed"))) {
      if (!project.fixed.empty())
        place.In("fixed").Fail(project.fixed + " is the fixed volume already");
      project.fixed = volume.name;
    }
    project.state.volumes.push_back(std::move(volume));
  }
  if (root.contains("centreOfRotation"))
    project.state.centre = file.In("centreOfRotation").Vector<3>(root["centreOfRotation"]);
  if (root.contains("truth")) {
    const std::string truth = file.In("truth").Text(root["truth"]);
    project.truth = truth.empty() ? truth : Resolved(Located(truth, folder, beside)).string();
  }
  if (root.contains("measurements"))
    project.state.measurements = ToMeasurements(root["measurements"], file.In("measurements"));
  if (root.contains("comment"))
    project.comment = file.In("comment").Text(root["comment"]);
  if (root.contains("lastBackup")) {
    const JsonPlace place = file.In("lastBackup");
    project.lastBackup = {place.In("lineage").Text(place.Member(root["lastBackup"], "lineage")),
                          Count(place.Member(root["lastBackup"], "number"), place.In("number"))};
    if (const Json& last = root["lastBackup"]; last.contains("others")) {
      if (!last["others"].is_array())
        place.In("others").Fail("a list is needed");
      for (const Json& other : last["others"])
        project.lastBackup.others.insert(Count(other, place.In("others")));
    }
  }
  if (stamp)
    *stamp = found;
  return project;
}

namespace {

std::string TextOf(const Project& project, const std::string& path, const BackupStamp* stamp)
{
  const fs::path folder = Resolved(path).parent_path();
  Json volumes = Json::array();
  for (const SessionVolume& volume : project.state.volumes) {
    Json strokes = Json::array();
    for (const Stroke& stroke : StrokesOf(volume.strokes))
      strokes.push_back(JsonOf(stroke));
    Json landmarks = Json::array();
    for (const Landmark& landmark : volume.landmarks)
      landmarks.push_back(
          {{"label", landmark.label}, {"position", {landmark.position.x(), landmark.position.y(), landmark.position.z()}}});
    volumes.push_back({{"name", volume.name},
                       {"file", Relative(volume.file, folder)},
                       {"path", volume.file.empty() ? std::string() : Resolved(volume.file).generic_string()},
                       {"geometry", PoseJson::Of(volume.geometry)},
                       {"VolumeToWorld", JsonPlace::RowsOf(volume.volumeToWorld.matrix())},
                       {"colour", volume.colour},
                       {"opacity", volume.opacity},
                       {"visible", volume.visible},
                       {"group", volume.group},
                       {"strokes", std::move(strokes)},
                       {"landmarks", std::move(landmarks)}});
    if (volume.madeOf)
      volumes.back()["madeOf"] = MadeOfJson::Of(*volume.madeOf);
    if (const auto truth = project.truths.find(volume.name); truth != project.truths.end())
      volumes.back()["TrueVolumeToWorld"] = JsonPlace::RowsOf(truth->second.matrix());
    if (volume.name == project.fixed)
      volumes.back()["fixed"] = true;
  }
  Json measurements = Json::array();
  for (const Measurement& each : project.state.measurements) {
    Json points = Json::array();
    for (const Eigen::Vector3d& point : each.points)
      points.push_back(Json::array({point.x(), point.y(), point.z()}));
    measurements.push_back({{"number", each.number}, {"points", std::move(points)}});
  }
  Json root{{"schema", Schema},
            {"unit", "mm"},
            {"frame", "LPS"},
            {"volumes", std::move(volumes)},
            {"measurements", std::move(measurements)},
            {"truth", Relative(project.truth, folder)},
            {"comment", project.comment}};
  if (project.state.centre)
    root["centreOfRotation"] = JsonPlace::ListOf(*project.state.centre);
  if (!stamp && !project.lastBackup.lineage.empty())
    root["lastBackup"] = {
        {"lineage", project.lastBackup.lineage}, {"number", project.lastBackup.number}, {"others", project.lastBackup.others}};
  try {
    if (stamp) {
      root["backup"] = {{"number", stamp->number}, {"time", stamp->time}, {"label", stamp->label}};
      if (stamp->inPlaceOf > 0)
        root["backup"]["inPlaceOf"] = stamp->inPlaceOf;
      if (!stamp->lineage.empty())
        root["backup"]["lineage"] = stamp->lineage;
      root["backup"]["checksum"] = TextChecksum(root.dump());
    }
    return root.dump(stamp ? -1 : 1) + '\n';
  } catch (const nlohmann::json::exception&) {
    throw Error(Error::Kind::InvalidParameter, path + ": a name in it is not UTF-8");
  }
}

} // namespace

void WriteProject(const std::string& path, const Project& project)
{
  const std::string text = TextOf(project, path, nullptr);
  FileReplacement replacement;
  WriteText(replacement.Stage(path), text, path, true);
  replacement.Commit();
  SyncFolder(Resolved(path).parent_path());
}

bool WriteBackup(const std::string& path, const Project& project, const BackupStamp& stamp)
{
  const std::string text = TextOf(project, path, &stamp);
  FileReplacement replacement;
  const std::string staged = replacement.Stage(path);
  WriteText(staged, text, path, false);
  if (link(staged.c_str(), path.c_str()) == 0)
    return true;
  if (errno == EEXIST)
    return false;
  replacement.Commit(); // a file system without links
  return true;
}

void BringToDisk(const std::vector<std::string>& paths)
{
  std::set<fs::path> folders;
  for (const std::string& path : paths) {
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0)
      continue;
    const int problem = fsync(file) != 0 && errno != EINVAL ? errno : 0;
    close(file);
    if (problem != 0)
      FailToWrite(path, problem);
    folders.insert(fs::path(path).parent_path());
  }
  for (const fs::path& folder : folders)
    SyncFolder(folder);
}

std::string FindVolume(const std::string& projectPath, const std::string& file, const std::vector<std::string>& folders)
{
  if (file.empty())
    return file;
  if (IsThere(file))
    return file;
  const fs::path name = fs::path(file).filename();
  const fs::path home = Resolved(projectPath).parent_path();
  std::vector<fs::path> places{home};
  if (home.extension() == ".backups")
    places.push_back(home.parent_path());
  places.insert(places.end(), folders.begin(), folders.end());
  for (const fs::path& place : places)
    if (IsThere(place / name))
      return Resolved(place / name).string();
  return {};
}

} // namespace echorama
