// SPDX-License-Identifier: BSD-3-Clause
// Sources are known by their names, which are unique in a session and in its project file, so a state is whole in itself: undo,
// a backup and a project bring the link back with the volumes. That a name means another volume by now is found by what is
// compared: file, geometry, pose, strokes, and of a source that is a result itself, what that was made of. No voxels are looked
// at: they follow from these.
#include "Widgets/Session/MadeOf.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Geometry/PoseJson.h"
#include "Widgets/Session/Checksum.h"
#include "Widgets/Session/MadeOfJson.h"
#include "Widgets/Session/PoseComparison.h"
#include "Widgets/Session/SessionState.h"
#include <algorithm>
#include <filesystem>
#include <set>

namespace echorama {
namespace {

using Json = JsonPlace::Json;

constexpr double SamePlaceMm = 1e-4;

std::string StrokesText(const SessionVolume& volume)
{
  return volume.strokes ? Format("%016llx", static_cast<unsigned long long>(volume.strokes->digest)) : std::string();
}

std::string MakingText(const SessionVolume& volume)
{
  return volume.madeOf ? FingerprintOf(*volume.madeOf) : std::string();
}

std::string BareFileOf(const SessionVolume& volume)
{
  return std::filesystem::path(volume.file).filename().string();
}

const SessionVolume* NamedVolume(const SessionState& state, const std::string& name)
{
  const auto found = std::find_if(state.volumes.begin(), state.volumes.end(),
                                  [&name](const SessionVolume& volume) { return volume.name == name; });
  return found == state.volumes.end() ? nullptr : &*found;
}

std::string ChangesOf(const MadeOf::Source& source, const SessionVolume* now, const Pose& result)
{
  if (!now)
    return "is gone";
  if ((!source.file.empty() && !now->file.empty() && source.file != BareFileOf(*now)) ||
      !source.geometry.AgreesWith(now->geometry))
    return "is another volume";
  std::string changes;
  const auto add = [&changes](const char* change) { changes += (changes.empty() ? "" : ", ") + std::string(change); };
  if (source.making != MakingText(*now))
    add("was made again");
  if (!(FarthestCornerMm(now->geometry, source.pose, result.inverse(Eigen::Isometry) * now->volumeToWorld) <= SamePlaceMm))
    add("was moved");
  if (source.strokes != StrokesText(*now))
    add("was painted or carved");
  return changes;
}

std::map<std::string, std::string> ToOptions(const Json& value, const JsonPlace& place)
{
  if (!value.is_object())
    place.Fail("an object of texts is needed");
  std::map<std::string, std::string> options;
  for (const auto& option : value.items())
    options[option.key()] = place.In(option.key()).Text(option.value());
  return options;
}

Json JsonWithoutNames(MadeOf madeOf)
{
  for (MadeOf::Source& source : madeOf.sources) {
    source.name.clear();
    source.file.clear();
  }
  return MadeOfJson::Of(madeOf);
}

} // namespace

Json MadeOfJson::Of(const MadeOf& madeOf)
{
  Json sources = Json::array();
  for (const MadeOf::Source& source : madeOf.sources)
    sources.push_back({{"name", source.name},
                       {"file", source.file},
                       {"geometry", PoseJson::Of(source.geometry)},
                       {"VolumeToResult", JsonPlace::RowsOf(source.pose.matrix())},
                       {"strokes", source.strokes},
                       {"making", source.making}});
  Json options = Json::object();
  for (const auto& [name, value] : madeOf.options)
    options[name] = value;
  return {{"sources", std::move(sources)}, {"options", std::move(options)}};
}

MadeOf MadeOfJson::ToMadeOf(const Json& value, const JsonPlace& place)
{
  MadeOf madeOf;
  const Json& sources = place.Member(value, "sources");
  if (!sources.is_array() || sources.empty())
    place.In("sources").Fail("a list of at least one source is needed");
  std::set<std::string> names;
  for (const Json& each : sources) {
    const JsonPlace here = place.In("source " + std::to_string(madeOf.sources.size() + 1));
    const auto text = [&](const char* key) { return each.contains(key) ? here.In(key).Text(each[key]) : std::string(); };
    MadeOf::Source source;
    source.name = here.In("name").Text(here.Member(each, "name"));
    if (source.name.empty() || !names.insert(source.name).second)
      here.In("name").Fail("a name that no other source has is needed");
    source.file = text("file");
    source.geometry = PoseJson::ToGeometry(here.Member(each, "geometry"), here.In("geometry"));
    source.pose = PoseJson::ToPose(here.Member(each, "VolumeToResult"), here.In("VolumeToResult"));
    source.strokes = text("strokes");
    source.making = text("making");
    madeOf.sources.push_back(std::move(source));
  }
  if (value.contains("options"))
    madeOf.options = ToOptions(value["options"], place.In("options"));
  return madeOf;
}

bool operator==(const MadeOf& a, const MadeOf& b)
{
  const auto same = [](const MadeOf::Source& left, const MadeOf::Source& right) {
    return left.name == right.name && left.file == right.file && SameGeometry(left.geometry, right.geometry) &&
           left.pose.matrix() == right.pose.matrix() && left.strokes == right.strokes && left.making == right.making;
  };
  return a.options == b.options && std::equal(a.sources.begin(), a.sources.end(), b.sources.begin(), b.sources.end(), same);
}

std::string FingerprintOf(const MadeOf& madeOf)
{
  return TextChecksum(JsonPlace::Print(JsonWithoutNames(madeOf)));
}

MadeOf RecordSources(const SessionState& state, const std::vector<int>& ids, std::map<std::string, std::string> options)
{
  const auto refuse = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, reason); };
  if (ids.empty())
    refuse("a result needs at least one source");
  MadeOf madeOf;
  std::set<int> taken;
  for (const int id : ids) {
    const SessionVolume* volume = state.Find(id);
    if (!volume)
      refuse("there is no volume " + std::to_string(id));
    if (!taken.insert(id).second)
      refuse(volume->name + ": a source is taken once");
    madeOf.sources.push_back(
        {volume->name, BareFileOf(*volume), volume->geometry, volume->volumeToWorld, StrokesText(*volume), MakingText(*volume)});
  }
  madeOf.options = std::move(options);
  return madeOf;
}

std::vector<int> SourcesOf(const SessionState& state, const MadeOf& madeOf)
{
  std::vector<int> ids;
  for (const MadeOf::Source& source : madeOf.sources) {
    const SessionVolume* volume = NamedVolume(state, source.name);
    ids.push_back(volume ? volume->id : 0);
  }
  return ids;
}

std::string OptionOf(const MadeOf& madeOf, const std::string& name)
{
  const auto option = madeOf.options.find(name);
  return option != madeOf.options.end() ? option->second : std::string();
}

std::string ChangesSince(const SessionState& state, const SessionVolume& result)
{
  std::string changes;
  for (std::size_t i = 0; result.madeOf && i < result.madeOf->sources.size(); ++i) {
    const MadeOf::Source& source = result.madeOf->sources[i];
    const std::string change = ChangesOf(source, NamedVolume(state, source.name), result.volumeToWorld);
    if (!change.empty())
      changes += (changes.empty() ? "" : "; ") + source.name + " " + change;
  }
  return changes;
}

std::string TextOf(const MadeOf& madeOf)
{
  return JsonPlace::Print(MadeOfJson::Of(madeOf));
}

std::map<std::string, std::string> OptionsOfText(const std::string& text, const std::string& place)
{
  const JsonPlace here(place);
  return ToOptions(here.Parse(text), here);
}

MadeOf MadeOfText(const std::string& text, const std::string& place)
{
  const JsonPlace here(place);
  return MadeOfJson::ToMadeOf(here.Parse(text), here);
}

} // namespace echorama
