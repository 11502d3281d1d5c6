// SPDX-License-Identifier: BSD-3-Clause
// The landmarks of an alignment session, which lie in the space of their volume's file and so go where it goes; and what was
// measured, which stays where it is.
#include "Core/Base/Error.h"
#include "Widgets/Session/AlignmentSession.h"
#include <algorithm>

namespace echorama {

void AlignmentSession::SetLandmark(int id, const std::string& label, const Eigen::Vector3d& place)
{
  if (label.empty())
    throw Error(Error::Kind::InvalidParameter, "a landmark needs a label");
  if (!place.allFinite())
    throw Error(Error::Kind::InvalidParameter, "the place of a landmark is not finite");
  EditOne("Mark " + label + " in", id, [&](SessionVolume& volume) {
    const Eigen::Vector3d position = volume.volumeToWorld.inverse(Eigen::Isometry) * place;
    for (Landmark& landmark : volume.landmarks)
      if (landmark.label == label) {
        landmark.position = position;
        return;
      }
    volume.landmarks.push_back({label, position});
  });
}

void AlignmentSession::RemoveLandmark(const std::string& label)
{
  Edit("Remove landmark " + label, [&] {
    for (SessionVolume& volume : state_.volumes)
      volume.landmarks.erase(std::remove_if(volume.landmarks.begin(), volume.landmarks.end(),
                                            [&label](const Landmark& landmark) { return landmark.label == label; }),
                             volume.landmarks.end());
  });
}

void AlignmentSession::ClearLandmarks()
{
  Edit("Remove all landmarks", [this] {
    for (SessionVolume& volume : state_.volumes)
      volume.landmarks.clear();
  });
}

std::optional<Eigen::Vector3d> AlignmentSession::PlaceOfLandmark(int id, const std::string& label) const
{
  if (const SessionVolume* volume = state_.Find(id))
    for (const Landmark& landmark : volume->landmarks)
      if (landmark.label == label)
        return volume->volumeToWorld * landmark.position;
  return std::nullopt;
}

std::string AlignmentSession::NextLandmarkLabel(int id) const
{
  std::set<std::string> own, all;
  for (const SessionVolume& volume : state_.volumes)
    for (const Landmark& landmark : volume.landmarks) {
      all.insert(landmark.label);
      if (volume.id == id)
        own.insert(landmark.label);
    }
  for (const SessionVolume& volume : state_.volumes)
    for (const Landmark& landmark : volume.landmarks)
      if (own.count(landmark.label) == 0)
        return landmark.label;
  int number = 1;
  while (all.count(std::to_string(number)) > 0)
    ++number;
  return std::to_string(number);
}

void AlignmentSession::SetMeasurement(const Measurement& measurement)
{
  const auto& points = measurement.points;
  if (measurement.number < 1 || measurement.number > LargestNumber)
    throw Error(Error::Kind::InvalidParameter, "measurements count from 1 to " + std::to_string(LargestNumber));
  if (points.size() != 2 && points.size() != 3)
    throw Error(Error::Kind::InvalidParameter, "a measurement needs two points, or three for an angle");
  if (!std::all_of(points.begin(), points.end(), [](const Eigen::Vector3d& point) { return point.allFinite(); }))
    throw Error(Error::Kind::InvalidParameter, "a point of a measurement is not finite");
  Edit("Measurement " + std::to_string(measurement.number), [&] {
    for (Measurement& each : state_.measurements)
      if (each.number == measurement.number) {
        each = measurement;
        return;
      }
    state_.measurements.push_back(measurement);
  });
}

void AlignmentSession::RemoveMeasurement(int number)
{
  auto& all = state_.measurements;
  const auto isIt = [number](const Measurement& each) { return each.number == number; };
  if (std::none_of(all.begin(), all.end(), isIt))
    throw Error(Error::Kind::InvalidParameter, "there is no measurement " + std::to_string(number));
  Edit("Remove measurement " + std::to_string(number),
       [&] { all.erase(std::remove_if(all.begin(), all.end(), isIt), all.end()); });
}

void AlignmentSession::ClearMeasurements()
{
  Edit("Remove all measurements", [this] { state_.measurements.clear(); });
}

int AlignmentSession::NextMeasurementNumber() const
{
  std::set<int> taken;
  for (const Measurement& each : state_.measurements)
    taken.insert(each.number);
  return NextNumber(taken);
}

} // namespace echorama
