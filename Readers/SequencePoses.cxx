// SPDX-License-Identifier: BSD-3-Clause
// One graph serves all frames: which edges there are is the same for the whole sequence (those that some frame has), and only
// their matrices and status change. So the way from the image to the world does not jump from frame to frame, and a frame
// whose tracker saw nothing has no pose instead of one by another way.
#include "Readers/SequencePoses.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>

namespace echorama {
namespace {

constexpr double CosineOfADegree = 0.99985;

// Names of frames begin with a capital, as FramesOf makes them.
std::string FrameName(std::string name)
{
  if (!name.empty())
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  return name;
}

std::string Listed(const std::vector<std::string>& names)
{
  return names.empty() ? "none" : Joined(names);
}

NamedTransform EdgeOf(const std::string& name)
{
  NamedTransform edge;
  std::tie(edge.from, edge.to) = FramesOf(name).value();
  return edge;
}

} // namespace

std::string ChooseWorldFrame(const TransformGraph& graph, const std::string& image, const std::string& requested)
{
  const std::vector<std::string> frames = graph.Frames();
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::vector<std::string> reachable = has(frames, image) ? graph.ReachableFrom(image) : frames;
  if (!requested.empty()) {
    if (!has(reachable, FrameName(requested)))
      throw Error(Error::Kind::NotPossible,
                  "no way leads to the world frame \"" + requested + "\"; the choices are " + Listed(reachable));
    return FrameName(requested);
  }
  if (frames.empty())
    return {};
  for (const char* usual : {"Reference", "World", "Tracker"})
    if (has(reachable, usual))
      return usual;
  std::vector<std::string> ends;
  std::set<std::string> entered, left;
  for (const NamedTransform& edge : graph.Edges()) {
    entered.insert(edge.to);
    left.insert(edge.from);
  }
  for (const std::string& frame : reachable)
    if (entered.count(frame) > 0 && left.count(frame) == 0)
      ends.push_back(frame);
  if (ends.size() != 1)
    throw Error(Error::Kind::NotPossible,
                "it is not clear which frame is the world; name one of " + Listed(ends.empty() ? reachable : ends));
  return ends[0];
}

bool AreAxesOfGrid(const Eigen::Affine3d& imageToWorld, const std::array<int, 3>& dimensions)
{
  const Eigen::Matrix3d axes = imageToWorld.linear();
  return dimensions[2] == 1 || axes.col(0).cross(axes.col(1)).normalized().dot(axes.col(2).normalized()) > CosineOfADegree;
}

ImageGeometry FrameGeometry(const Eigen::Affine3d& imageToWorld, const std::array<int, 3>& dimensions)
{
  ImageGeometry grid;
  grid.dimensions = dimensions;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    grid.spacing[axis] = imageToWorld.linear().col(axis).norm();
  // The sum and the difference of two unit vectors are perpendicular; half-way between them lie the axes that we want.
  const Eigen::Vector3d x = imageToWorld.linear().col(0) / grid.spacing[0], y = imageToWorld.linear().col(1) / grid.spacing[1];
  const Eigen::Vector3d sum = (x + y).normalized(), difference = (x - y).normalized();
  grid.direction.col(0) = (sum + difference).normalized();
  grid.direction.col(1) = (sum - difference).normalized();
  grid.direction.col(2) = grid.direction.col(0).cross(grid.direction.col(1));
  if (!AreAxesOfGrid(imageToWorld, dimensions))
    throw Error(Error::Kind::NotPossible, "frames of " + std::to_string(dimensions[2]) +
                                              " slices cannot be placed by axes that are left-handed or not perpendicular");
  const Eigen::Vector3d middle((dimensions[0] - 1) / 2.0, (dimensions[1] - 1) / 2.0, (dimensions[2] - 1) / 2.0);
  grid.origin = imageToWorld * middle - grid.direction * grid.spacing.cwiseProduct(middle);
  return grid;
}

SequencePoses::SequencePoses(const SequenceContent& content, const std::vector<NamedTransform>& fixed, const std::string& image,
                             const std::string& world)
  : graph_(fixed), names_(content.transforms), image_(FrameName(image))
{
  for (const std::string& name : names_)
    graph_.Set(EdgeOf(name));
  try {
    world_ = ChooseWorldFrame(graph_, image_, world);
  } catch (const Error& error) {
    throw Error(error.GetKind(), content.path + ": " + error.what());
  }
}

bool SequencePoses::Reaches(const std::string& frame) const
{
  const std::vector<std::string> frames = graph_.Frames();
  if (world_.empty() || std::find(frames.begin(), frames.end(), frame) == frames.end())
    return false;
  const std::vector<std::string> reachable = graph_.ReachableFrom(frame);
  return std::find(reachable.begin(), reachable.end(), world_) != reachable.end();
}

std::vector<std::string> SequencePoses::Tools() const
{
  std::vector<std::string> tools;
  for (const std::string& name : names_) {
    const std::string frame = EdgeOf(name).from;
    if (frame != world_ && Reaches(frame) && std::find(tools.begin(), tools.end(), frame) == tools.end())
      tools.push_back(frame);
  }
  return tools;
}

void SequencePoses::MoveTo(const SequenceFrame& frame)
{
  std::map<std::string_view, const SequenceTransform*> given;
  for (const SequenceTransform& transform : frame.transforms)
    given.emplace(transform.name, &transform);
  for (const std::string& name : names_) {
    NamedTransform edge = EdgeOf(name);
    if (const auto transform = given.find(name); transform != given.end()) {
      edge.matrix = transform->second->matrix;
      edge.status = transform->second->status;
    } else
      edge.status = TransformStatus::Missing;
    graph_.Set(edge);
  }
}

} // namespace echorama
