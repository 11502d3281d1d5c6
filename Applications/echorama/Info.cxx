// SPDX-License-Identifier: BSD-3-Clause
// echorama info: what a file holds.
#include "Info.h"
#include "Commands.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/PoseFile.h"
#include "Core/Geometry/TransformFile.h"
#include "Readers/FileKind.h"
#include "Volumes.h"
#include <memory>

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;

Json Describe(Session& session, const std::string& file)
{
  session.Say(file);
  switch (KindOf(file)) {
  case FileKind::Poses:
    return DescribePoses(session, file);
  case FileKind::Transforms:
    return DescribeTransforms(session, file);
  case FileKind::Sequence:
    return DescribeSequence(session, file);
  case FileKind::Volume:
    break;
  }
  return DescribeVolume(session, file);
}

} // namespace

std::string Entry(const std::string& what, const std::string& text)
{
  return "  " + what + std::string(what.size() < 12 ? 12 - what.size() : 1, ' ') + text;
}

Json DescribeFields(Session& session, const std::vector<std::pair<std::string, std::string>>& fields)
{
  constexpr std::size_t most = 12, longest = 80;
  Json json = Json::object();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& [name, value] = fields[i];
    json[name] = value;
    if (i < most)
      session.Say(
          Entry(i == 0 ? "header" : "", name + " = " + (value.size() <= longest ? value : value.substr(0, longest) + " ...")));
  }
  if (fields.size() > most)
    session.Say(Entry("", "... and " + std::to_string(fields.size() - most) + " more (all of them with --json)"));
  return json;
}

Json DescribePoses(Session& session, const std::string& file)
{
  Json json{{"file", file}, {"poses", Json::array()}};
  for (const VolumePose& pose : ReadPoses(file)) {
    const double degrees = RotationAngle(pose.volumeToWorld) * DegreesPerRadian;
    json["poses"].push_back({{"file", pose.file}, {"rotation_degrees", degrees}, {"VolumeToWorld", JsonOf(pose.volumeToWorld)}});
    session.Say("  " + pose.file + ": turned by " + Fixed(degrees, 3) + " degrees, translation " +
                Triple(pose.volumeToWorld.translation(), ", ", 3) + " mm");
  }
  return json;
}

Json DescribeTransforms(Session& session, const std::string& file)
{
  // A cycle that stays open is what info is asked for; reading for use refuses it.
  const CycleTolerance any{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 0.0};
  const std::vector<NamedTransform> transforms = ReadTransforms(file, any);
  const TransformGraph graph(transforms);
  Json json{{"file", file}, {"frames", graph.Frames()}, {"transforms", Json::array()}, {"open_cycles", Json::array()}};
  for (const NamedTransform& transform : transforms) {
    Json one{{"from", transform.from}, {"to", transform.to}, {"matrix", JsonOf(transform.matrix)}};
    one["status"] = TransformStatusText(transform.status);
    std::string line = "  " + transform.Name() + ": " + TransformStatusText(transform.status);
    if (transform.errorMm) {
      one["error_mm"] = *transform.errorMm;
      line += ", error " + Fixed(*transform.errorMm, 3) + " mm";
    }
    const Eigen::Vector3d scale = transform.matrix.linear().colwise().norm();
    if ((scale.array() - 1.0).abs().maxCoeff() > 1e-3)
      line += ", scale " + Triple(scale, " x ", 5);
    if (!transform.date.empty()) {
      one["date"] = transform.date;
      line += ", of " + transform.date;
    }
    json["transforms"].push_back(one);
    session.Say(line);
  }
  if (transforms.empty())
    session.Say("  no transforms");
  for (const OpenCycle& cycle : graph.CheckCycles()) {
    json["open_cycles"].push_back({{"edges", cycle.edges}, {"frame", cycle.frame}, {"mm", cycle.mm}, {"degrees", cycle.degrees}});
    session.Note(file + ": " + cycle.Text());
  }
  return json;
}

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto files = std::make_shared<std::vector<std::string>>();
  options
      ->add_option("file", *files,
                   "Volumes of any format, tracked sequences, pose files (.json), transforms (.json, .xml of Plus)")
      ->type_name("FILE")
      ->required();
  action = [files](Session& session) {
    session.result["files"] = Json::array();
    for (const std::string& file : *files)
      session.result["files"].push_back(Describe(session, file));
  };
}

} // namespace echorama
