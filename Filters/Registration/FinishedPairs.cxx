// SPDX-License-Identifier: BSD-3-Clause
#include "FinishedPairs.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/TextFile.h"
#include <algorithm>
#include <cmath>
#include <filesystem>

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* Schema = "echorama-finished-pairs-1"; // of the file; what pairs depend on is in their keys
// A large file is written less often: that takes a twentieth of the time, unless minutes of work could be lost.
constexpr double SecondsBetweenWrites = 5.0, WritingShare = 0.05, MostSecondsBetweenWrites = 300.0;
constexpr std::size_t LargestFile = std::size_t{1} << 30;
constexpr int Verdicts = 3;

template <class Matrix>
Json Numbers(const Matrix& matrix)
{
  return std::vector<double>(matrix.data(), matrix.data() + matrix.size());
}

// The numbers of an alignment in one order, for writing, for reading and to see whether all are finite.
template <class Alignment, class Visit>
void ForEachNumber(Alignment& a, const Visit& visit)
{
  visit("similarity", a.similarity);
  visit("overlap", a.overlap);
  visit("score", a.score);
  visit("peak_ratio", a.peakRatio);
  visit("split_mm", a.splitMm);
  visit("error_mm", a.errorMm);
  visit("voxel_mm", a.voxelMm);
  visit("global_seconds", a.globalSeconds);
  visit("local_seconds", a.localSeconds);
  visit("confidence_seconds", a.confidenceSeconds);
}

template <class Bytes, class Alignment>
void PackOrUnpack(Bytes& bytes, Alignment& a)
{
  bytes(a.verdict, a.reason, a.anywhere, a.volumeToWorld, a.centre, a.information);
  ForEachNumber(a, [&bytes](const char*, auto& value) { bytes(value); });
}

bool IsFinite(const PairAlignment& a)
{
  bool isFinite = a.volumeToWorld.matrix().allFinite() && a.centre.allFinite() && a.information.allFinite();
  ForEachNumber(a, [&isFinite](const char*, double value) { isFinite = isFinite && std::isfinite(value); });
  return isFinite;
}

Json ToJson(const std::string& key, const PairAlignment& a)
{
  Json json{{"key", key}, {"verdict", static_cast<int>(a.verdict)}, {"reason", a.reason}, {"anywhere", a.anywhere}};
  ForEachNumber(a, [&json](const char* name, double value) { json[name] = value; });
  json["VolumeToWorld"] = Numbers(a.volumeToWorld.matrix()); // by columns, as they lie in memory
  json["centre"] = Numbers(a.centre);
  json["information"] = Numbers(a.information);
  return json;
}

PairAlignment FromJson(const Json& json, const JsonPlace& place)
{
  PairAlignment a;
  const double verdict = place.Number(place.Member(json, "verdict"));
  if (!(verdict == std::floor(verdict) && verdict >= 0.0 && verdict < Verdicts))
    place.Fail("there is no such verdict");
  a.verdict = static_cast<Verdict>(static_cast<int>(verdict));
  a.reason = place.Text(place.Member(json, "reason"));
  a.anywhere = place.Member(json, "anywhere") == true;
  ForEachNumber(a, [&](const char* name, double& value) { value = place.Number(place.Member(json, name)); });
  const auto pose = place.Vector<16>(place.Member(json, "VolumeToWorld"));
  a.volumeToWorld.matrix() = Eigen::Map<const Eigen::Matrix4d>(pose.data());
  a.centre = place.Vector<3>(place.Member(json, "centre"));
  const auto information = place.Vector<36>(place.Member(json, "information"));
  a.information = Eigen::Map<const Information>(information.data());
  return a;
}

std::string ChecksumOf(const Json& json)
{
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return Checksum(text.data(), text.size());
}

} // namespace

FinishedPairs::FinishedPairs(std::string path) : path_(std::move(path))
{
  if (path_.empty() || !std::filesystem::exists(path_))
    return;
  const JsonPlace place(path_);
  const Json file = place.Parse(ReadTextFile(path_, LargestFile));
  if (!file.is_object() || file.value("schema", Json()) != Schema)
    place.Fail("it is no file of finished pairs of this version; name another one, or delete it");
  const Json& pairs = place.Member(file, "pairs");
  if (!pairs.is_array() || place.Text(place.Member(file, "checksum")) != ChecksumOf(pairs))
    place.Fail("it is damaged: its checksum is not that of its pairs; delete it to begin anew");
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const JsonPlace pair = place.In("pair " + std::to_string(i + 1));
    pairs_[pair.Text(pair.Member(pairs[i], "key"))] = FromJson(pairs[i], pair);
  }
}

FinishedPairs::~FinishedPairs()
{
  try {
    Write();
  } catch (const std::exception&) {
    // Whoever wants to know calls Write.
  }
}

std::string FinishedPairs::KeyOf(const PlacedVolume& fixed, const std::string& fixedContent, const PlacedVolume& moving,
                                 const std::string& movingContent, const AlignPairParameters& parameters) const
{
  if (path_.empty() || fixedContent.empty() || movingContent.empty())
    return {};
  Json key = Json::array({ECHORAMA_VERSION}); // another version may find something else
  for (const PlacedVolume* volume : {&fixed, &moving}) {
    Json landmarks = Json::array();
    for (const Landmark& landmark : volume->landmarks)
      landmarks.push_back({landmark.label, Numbers(landmark.position)});
    key.push_back({volume == &fixed ? fixedContent : movingContent, Numbers(volume->volumeToWorld.matrix()), landmarks});
  }
  AlignPairParameters described = parameters;
  for (const Parameter& parameter : Describe(described))
    key.push_back({parameter.name, parameter.Text()});
  return ChecksumOf(key);
}

std::optional<PairAlignment> FinishedPairs::Find(const std::string& key) const
{
  const auto found = pairs_.find(key);
  return found != pairs_.end() ? std::optional(found->second) : std::nullopt;
}

void FinishedPairs::Add(const std::string& key, const PairAlignment& found)
{
  if (key.empty() || !IsFinite(found))
    return;
  pairs_[key] = found;
  isChanged_ = true;
  if (SecondsSince(written_) >= std::clamp(secondsToWrite_ / WritingShare, SecondsBetweenWrites, MostSecondsBetweenWrites))
    Write();
}

void FinishedPairs::Write()
{
  if (!isChanged_)
    return;
  const Clock::time_point start = Clock::now();
  Json pairs = Json::array();
  for (const auto& [key, found] : pairs_)
    pairs.push_back(ToJson(key, found));
  // One pair a line, so that the file can be looked at.
  std::string text = "{\"schema\": \"" + std::string(Schema) + "\", \"checksum\": \"" + ChecksumOf(pairs) + "\", \"pairs\": [";
  const char* separator = "\n";
  for (const Json& pair : pairs) {
    text += separator + pair.dump(-1, ' ', false, Json::error_handler_t::replace);
    separator = ",\n";
  }
  WriteTextFile(path_, text + "\n]}\n");
  isChanged_ = false;
  written_ = Clock::now();
  secondsToWrite_ = SecondsSince(start);
}

void Pack(Packed& to, const PairAlignment& pair)
{
  PackOrUnpack(to, pair);
}

void Unpack(Unpacked& from, PairAlignment& pair)
{
  PackOrUnpack(from, pair);
}

} // namespace echorama
