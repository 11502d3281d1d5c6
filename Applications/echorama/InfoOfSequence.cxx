// SPDX-License-Identifier: BSD-3-Clause
// echorama info of a tracked sequence: its header alone is read.
#include "Core/Base/Angles.h"
#include "Info.h"
#include "Readers/FileKind.h"
#include "Readers/SequenceFile.h"
#include "Volumes.h"
#include <algorithm>
#include <cmath>
#include <map>

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;

// One transform over all frames.
struct TransformTrack {
  std::vector<std::pair<std::string, int>> statuses; // how often each, in order of appearance
  int valid = 0;
  Eigen::AlignedBox3d places; // of the first frame's origin in the second
  Eigen::Matrix3d first = Eigen::Matrix3d::Identity();
  double radians = 0.0; // the largest turn against the first valid one

  void Add(const SequenceTransform& transform)
  {
    auto status = statuses.begin();
    while (status != statuses.end() && status->first != transform.statusText)
      ++status;
    if (status == statuses.end())
      status = statuses.insert(status, {transform.statusText, 0});
    ++status->second;
    if (transform.status != TransformStatus::Valid)
      return;
    const Eigen::Matrix3d rotation = transform.matrix.rotation(); // the nearest, where pixels are scaled
    if (valid++ == 0)
      first = rotation;
    radians = std::max(radians, std::abs(Eigen::AngleAxisd(Eigen::Matrix3d(first.transpose() * rotation)).angle()));
    places.extend(transform.matrix.translation());
  }
};

void DescribeTime(Session& session, const std::vector<double>& times, Json& json)
{
  int backwards = 0;
  for (std::size_t i = 1; i < times.size(); ++i)
    backwards += times[i] <= times[i - 1];
  if (times.empty()) {
    json["time"] = Json();
    session.Say(Entry("time", "no frame has a time stamp"));
    return;
  }
  const double seconds = times.back() - times.front();
  const double rate = seconds > 0.0 ? static_cast<double>(times.size() - 1) / seconds : 0.0;
  json["time"] = {{"first", times.front()}, {"last", times.back()}, {"frames_per_second", rate}, {"not_increasing", backwards}};
  session.Say(Entry("time", Fixed(times.front(), 3) + " to " + Fixed(times.back(), 3) + " s" +
                                (rate > 0.0 ? ", " + Fixed(rate, 2) + " frames a second" : "") +
                                (backwards ? ", not increasing at " + std::to_string(backwards) + " frames" : "")));
}

} // namespace

Json DescribeSequence(Session& session, const std::string& file)
{
  const SequenceFile sequence(file);
  const SequenceContent& content = sequence.Content();
  for (const std::string& note : content.notes)
    session.Note(file + ": " + note);
  std::map<std::string, TransformTrack> tracks;
  std::vector<double> times;
  int validImages = 0;
  session.Time("measure", [&] {
    for (int i = 0; i < content.frames; ++i) {
      const SequenceFrame frame = sequence.Frame(i);
      validImages += frame.imageValid && content.HasImages();
      if (std::isfinite(frame.time))
        times.push_back(frame.time);
      for (const SequenceTransform& transform : frame.transforms)
        tracks[transform.name].Add(transform);
    }
  });

  Json json{{"file", file},
            {"format", FormatText(content.format)},
            {"kind", "sequence"},
            {"frames", content.frames},
            {"dimensions", content.dimensions}};
  session.Say(Entry("format", std::string(FormatText(content.format)) + ", a tracked sequence"));
  if (content.HasImages()) {
    json["type"] = TypeText(content.type);
    json["components"] = content.components;
    session.Say(Entry("frames", std::to_string(content.frames) + " of " + std::to_string(content.dimensions[0]) + " x " +
                                    std::to_string(content.dimensions[1]) +
                                    (content.dimensions[2] > 1 ? " x " + std::to_string(content.dimensions[2]) : "") +
                                    (content.components > 1 ? " x " + std::to_string(content.components) + " numbers" : "") +
                                    ", " + TypeText(content.type)));
  } else {
    session.Say(Entry("frames", std::to_string(content.frames) + " without images (trackers alone)"));
  }
  json["orientation"] = content.orientation;
  json["image_type"] = content.imageType;
  if (content.HasImages()) {
    session.Say(Entry("orientation", (content.orientation.empty() ? "not known" : content.orientation) +
                                         (content.imageType.empty() ? "" : ", image type " + content.imageType)));
    session.Say(
        Entry("images", std::to_string(validImages) + " valid, " + std::to_string(content.frames - validImages) + " invalid"));
  }
  json["valid_images"] = validImages;
  json["invalid_images"] = content.frames - validImages;
  DescribeTime(session, times, json);

  json["transforms"] = Json::object();
  for (const std::string& name : content.transforms) {
    const TransformTrack& track = tracks[name];
    Json one{{"statuses", Json::object()}};
    std::string line;
    for (const auto& [status, count] : track.statuses) {
      one["statuses"][status] = count;
      line += (line.empty() ? "" : ", ") + std::to_string(count) + " " + status;
    }
    if (track.valid > 0) {
      const double mm = track.places.diagonal().norm();
      const double degrees = track.radians * DegreesPerRadian;
      one["moves_mm"] = mm;
      one["turns_degrees"] = degrees;
      line += "; moves within " + Fixed(mm, 1) + " mm, turns by up to " + Fixed(degrees, 1) + " degrees";
    }
    json["transforms"][name] = one;
    session.Say(Entry(name == content.transforms.front() ? "transforms" : "", name + ": " + line));
  }
  json["fields"] = DescribeFields(session, content.fields);
  return json;
}

} // namespace echorama
