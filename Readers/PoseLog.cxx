// SPDX-License-Identifier: BSD-3-Clause
// A table is read line by line. Its columns are found once, by their names; a sensor is whatever has the seven columns of a
// position and a quaternion with a common ending. What is wrong with single rows is gathered as one note per kind, whatever
// the number of rows. Time and memory grow with the length of the file alone.
#include "Readers/PoseLog.h"
#include "Core/Base/CsvLine.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/Words.h"
#include "Core/Geometry/MatrixRows.h"
#include "Readers/HeaderLines.h"
#include "Readers/SequenceFile.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace echorama {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double LargestMm = 1e7, QuaternionTolerance = 0.01;
constexpr std::size_t PairCells = 33; // a time and two matrices
constexpr int LongestPreamble = 100;  // lines before the names of the columns
constexpr double HalfADay = 43200.0;  // seconds
constexpr double PairUnitMm = 1000.0; // metres
constexpr double SmallestFieldMm = 10.0;

// Sentences on what single rows or frames suffer from: one for each reason, with the first place and the number of others.
class Faults {
public:
  explicit Faults(std::string place) : place_(std::move(place)) {}
  void Add(const std::string& reason, std::int64_t at)
  {
    const auto [fault, fresh] = faults_.try_emplace(reason, Fault{at, 0, order_});
    order_ += fresh;
    ++fault->second.count;
  }
  void Note(std::vector<std::string>& notes) const
  {
    std::map<int, std::string> sentences;
    for (const auto& [reason, fault] : faults_)
      sentences[fault.order] = place_ + " " + std::to_string(fault.first) +
                               (fault.count > 1 ? " and " + std::to_string(fault.count - 1) + " more" : "") + ": " + reason;
    for (const auto& [order, sentence] : sentences)
      notes.push_back(sentence);
  }

private:
  struct Fault {
    std::int64_t first = 0, count = 0;
    int order = 0;
  };
  std::string place_;
  std::map<std::string, Fault> faults_;
  int order_ = 0;
};

struct Sensor {
  std::string name;
  std::array<int, 7> columns{}; // x y z, then w x y z of the quaternion
};

int FirstColumn(const Sensor& sensor)
{
  return *std::min_element(sensor.columns.begin(), sensor.columns.end());
}

// Where the numbers of a table stand; -1: nowhere.
struct Columns {
  char separator = ',';
  bool pairs = false; // rows are those of pairs of poses
  int time = -1, tool = -1, status = -1;
  std::array<int, 4> clock{-1, -1, -1, -1}; // hour, minutes, seconds, ms
  std::string repeated;                     // a column that is there several times, so that it belongs to nobody knows which tool
  std::vector<Sensor> sensors;              // in the order of their first columns
  int last = -1;                            // of all sensors

  bool HasClock() const { return clock[0] >= 0 && clock[1] >= 0 && clock[2] >= 0; }
};

std::vector<std::string> Cells(const std::string& line, char separator, bool& closed)
{
  std::vector<std::string> cells;
  closed = true;
  if (separator == ' ') {
    for (const std::string_view word : SplitWords(line))
      cells.emplace_back(word);
    return cells;
  }
  closed = SplitCsvLine(line, separator, cells);
  for (std::string& cell : cells)
    cell = std::string(TrimBlanks(cell));
  while (!cells.empty() && cells.back().empty()) // rows may end in a separator
    cells.pop_back();
  return cells;
}

char SeparatorOf(const std::string& line)
{
  for (const char separator : {',', ';', '\t'})
    if (line.find(separator) != std::string::npos)
      return separator;
  return ' ';
}

// "q_W" as "qw", "Sample:" as "sample".
std::string PlainName(const std::string& cell)
{
  std::string name;
  for (const char c : cell)
    if (c >= 'A' && c <= 'Z')
      name += static_cast<char>(c + 32);
    else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))
      name += c;
  return name;
}

std::string SensorName(std::string ending)
{
  if (ending.empty())
    return ToolTransformName("");
  if (ending[0] >= 'a' && ending[0] <= 'z')
    ending[0] = static_cast<char>(ending[0] - 32);
  return "Sensor" + ending + "ToTracker";
}

// The columns that a line names, if it is one that does.
std::optional<Columns> NamedColumns(const std::string& line)
{
  const std::size_t first = line.find_first_not_of("# \t");
  if (first == std::string::npos)
    return std::nullopt;
  Columns columns;
  const std::string text = line.substr(first);
  columns.separator = SeparatorOf(text);
  bool closed = true;
  const auto isFirstOfQuaternion = [](const std::string& name) {
    const std::string begin = name.substr(0, 2);
    return begin == "qw" || begin == "qo" || begin == "q0";
  };
  std::map<std::string, int> at; // the first column of each name
  std::vector<std::string> names;
  for (const std::string& cell : Cells(text, columns.separator, closed)) {
    names.push_back(PlainName(cell));
    if (!at.emplace(names.back(), static_cast<int>(names.size()) - 1).second && isFirstOfQuaternion(names.back()))
      columns.repeated = names.back();
  }
  const auto find = [&at](std::initializer_list<std::string> choices) {
    for (const std::string& name : choices)
      if (const auto found = at.find(name); found != at.end())
        return found->second;
    return -1;
  };
  std::set<std::string> known;
  for (const std::string& name : names) {
    if (!isFirstOfQuaternion(name))
      continue;
    const std::string end = name.substr(2);
    if (!known.insert(end).second)
      continue;
    const Sensor sensor{SensorName(end),
                        {find({"tx" + end, "x" + end}), find({"ty" + end, "y" + end}), find({"tz" + end, "z" + end}),
                         find({name}), find({"qx" + end, "q1" + end}), find({"qy" + end, "q2" + end}),
                         find({"qz" + end, "q3" + end})}};
    if (FirstColumn(sensor) < 0)
      continue;
    columns.sensors.push_back(sensor);
    columns.last = std::max(columns.last, *std::max_element(sensor.columns.begin(), sensor.columns.end()));
  }
  std::stable_sort(columns.sensors.begin(), columns.sensors.end(),
                   [](const Sensor& a, const Sensor& b) { return FirstColumn(a) < FirstColumn(b); });
  if (columns.sensors.empty() || !closed)
    return std::nullopt;
  columns.time = find({"time", "timestamp", "t"});
  columns.tool = find({"tool", "name"});
  columns.status = find({"status"});
  columns.clock = {find({"hour", "hours"}), find({"minutes", "minute"}), find({"seconds", "second"}),
                   find({"ms", "milliseconds", "millisecond"})};
  return columns;
}

// A line of numbers alone, as many as a pair of poses has.
std::optional<Columns> PairColumns(const std::string& line)
{
  Columns columns;
  columns.pairs = true;
  columns.separator = SeparatorOf(line);
  bool closed = true;
  const std::vector<std::string> cells = Cells(line, columns.separator, closed);
  double number = 0.0;
  if (cells.size() != PairCells ||
      !std::all_of(cells.begin(), cells.end(), [&number](const std::string& cell) { return ParseNumber(cell, number); }))
    return std::nullopt;
  return columns;
}

class TableReader {
public:
  TableReader(const std::string& path, const PoseLogOptions& options) : lines_(path), options_(options) { log_.path = path; }

  PoseLog Read()
  {
    FindColumns();
    while (Next())
      TakeRow();
    if (log_.poses.empty())
      lines_.Fail("it holds no poses");
    if (columns_.pairs && options_.unitMm == 0.0)
      log_.notes.push_back("the file states no unit of length; metres are assumed, as is usual for pairs of poses");
    if (!columns_.pairs && options_.unitMm == 0.0)
      NoteSmallness();
    faults_.Note(log_.notes);
    return std::move(log_);
  }

private:
  // The next line that is not empty and no comment.
  bool Next(bool comments = false)
  {
    while (lines_.Next(line_)) {
      if (++number_ == 1)
        line_ = SkipByteOrderMark(line_);
      const std::string_view text = TrimBlanks(line_);
      if (!text.empty() && (comments || text[0] != '#'))
        return true;
    }
    return false;
  }

  void FindColumns()
  {
    std::string before;
    while (Next(true) && number_ <= LongestPreamble) {
      NoteDate(before);
      if (const auto columns = NamedColumns(line_)) {
        columns_ = *columns;
        if (!columns_.repeated.empty())
          lines_.FailHere("the column \"" + columns_.repeated + "\" is there several times: number the columns of each tool (" +
                          columns_.repeated + "1, " + columns_.repeated + "2, and so on), or export one tool at a time");
        if (columns_.time < 0 && !columns_.HasClock() && options_.rowsPerSecond == 0.0)
          lines_.FailHere("no column holds the time (time, timestamp, t; or hour, minutes, seconds and ms)");
        if (columns_.tool < 0)
          for (const Sensor& sensor : columns_.sensors)
            AddTool(sensor.name);
        return;
      }
      if (const auto columns = PairColumns(line_)) {
        columns_ = *columns;
        AddTool("HandToBase");
        AddTool("TargetToCamera");
        TakeRow();
        return;
      }
      before = line_;
    }
    lines_.Fail("not a log of poses: no line names columns x, y, z, qw, qx, qy and qz, and none holds the 33 numbers of a "
                "time and two matrices");
  }

  // NDI's tools write the date under the names day, month, year ...
  void NoteDate(const std::string& names)
  {
    bool closed = true;
    const std::vector<std::string> keys = Cells(names, ',', closed), cells = Cells(line_, ',', closed);
    if (keys.size() >= 3 && cells.size() >= 3 && PlainName(keys[0]) == "day" && PlainName(keys[1]) == "month" &&
        PlainName(keys[2]) == "year")
      log_.notes.push_back("it was recorded on day " + cells[0] + ", month " + cells[1] + ", year " + cells[2] +
                           "; times are seconds from the midnight before");
  }

  // Trackers see further than a centimetre, and no further than ten metres.
  void NoteSmallness()
  {
    double largest = 0.0;
    bool moves = false;
    const ToolPose* first = nullptr;
    for (const ToolPose& pose : log_.poses) {
      if (pose.status == TransformStatus::Missing)
        continue;
      first = first ? first : &pose;
      moves = moves || pose.pose.translation() != first->pose.translation();
      largest = std::max(largest, pose.pose.translation().norm());
    }
    if (moves && largest < SmallestFieldMm)
      log_.notes.push_back("all positions lie within " + NumberText(std::ceil(largest * 1000.0) / 1000.0) +
                           " mm; if they are metres, give the unit 1000");
  }

  void AddTool(const std::string& name)
  {
    if (tools_.insert(name).second)
      log_.tools.push_back(name);
  }

  // A cell as a number: NaN when it is empty or says that nothing was measured. Nothing when the row ends before it.
  std::optional<double> Number(int column) const
  {
    if (column >= static_cast<int>(cells_.size()))
      return std::nullopt;
    const std::string& cell = cells_[static_cast<std::size_t>(column)];
    double number = NaN;
    if (!cell.empty() && !ParseNumber(cell, number) && PlainName(cell) != "missing")
      lines_.FailHere("\"" + cell.substr(0, 60) + "\" is not a number");
    return number;
  }

  // Of the row, in seconds; NaN when it has none.
  double Time()
  {
    if (options_.rowsPerSecond > 0.0)
      return static_cast<double>(rows_ - 1) / options_.rowsPerSecond;
    if (columns_.pairs || columns_.time >= 0)
      return Number(columns_.pairs ? 0 : columns_.time).value_or(NaN);
    double time = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      constexpr std::array<double, 4> seconds{3600.0, 60.0, 1.0, 0.001};
      if (columns_.clock[i] >= 0)
        time += seconds[i] * Number(columns_.clock[i]).value_or(NaN);
    }
    // Clocks of 12 and of 24 hours begin again.
    time += turnsOfTheClock_ * HalfADay;
    if (time < lastClock_ - HalfADay / 2.0) {
      const double turns = std::ceil((lastClock_ - time) / HalfADay);
      turnsOfTheClock_ += turns;
      time += turns * HalfADay;
    }
    if (std::isfinite(time))
      lastClock_ = time;
    return time;
  }

  void TakeRow()
  {
    bool closed = true;
    cells_ = Cells(line_, columns_.separator, closed);
    if (!closed)
      lines_.FailHere("a quotation mark is not closed");
    if (cells_.empty())
      return;
    ++rows_;
    ToolPose pose;
    pose.time = Time();
    if (!std::isfinite(pose.time)) {
      faults_.Add("the row has no time and was skipped", number_);
      return;
    }
    if (columns_.pairs)
      TakePair(pose);
    else
      TakeSensors(pose);
  }

  void TakePair(ToolPose pose)
  {
    for (int side = 0; side < 2; ++side) {
      MatrixRows matrix;
      for (int i = 0; i < 16; ++i) {
        const auto number = Number(1 + 16 * side + i);
        if (!number) {
          faults_.Add("the row ends early", number_);
          return;
        }
        matrix.data()[i] = *number;
      }
      matrix.topRightCorner<3, 1>() *= options_.unitMm > 0.0 ? options_.unitMm : PairUnitMm;
      pose.name = log_.tools[static_cast<std::size_t>(side)];
      pose.status = TransformStatus::Valid;
      if (!NearestPose(matrix, pose.pose))
        Miss(pose, "the matrix is not a rigid transform; the pose is treated as missing");
      else if (pose.pose.translation().cwiseAbs().maxCoeff() > LargestMm)
        Miss(pose, "the position is beyond 1e7 mm; the pose is treated as missing");
      log_.poses.push_back(pose);
    }
  }

  void TakeSensors(const ToolPose& moment)
  {
    const int cells = static_cast<int>(cells_.size());
    if (cells <= columns_.last)
      faults_.Add("the row ends early; its complete values were read", number_);
    for (const Sensor& sensor : columns_.sensors) {
      if (FirstColumn(sensor) >= cells)
        break; // so do all that follow
      ToolPose pose = moment;
      std::array<double, 7> numbers{};
      bool whole = true;
      for (std::size_t i = 0; i < 7 && whole; ++i) {
        const auto number = Number(sensor.columns[i]);
        whole = number.has_value();
        numbers[i] = number.value_or(NaN);
      }
      if (!whole || columns_.tool >= cells)
        continue;
      if (columns_.tool >= 0)
        pose.name = ToolTransformName(cells_[static_cast<std::size_t>(columns_.tool)]);
      else
        pose.name = sensor.name;
      SetPose(pose, numbers);
      if (columns_.status >= 0 && columns_.status < cells && pose.status == TransformStatus::Valid)
        pose.status = TransformStatusOf(cells_[static_cast<std::size_t>(columns_.status)]);
      if (pose.status == TransformStatus::Missing)
        pose.pose = Pose::Identity();
      AddTool(pose.name);
      log_.poses.push_back(pose);
    }
  }

  void SetPose(ToolPose& pose, const std::array<double, 7>& numbers)
  {
    const auto isNan = [](double number) { return std::isnan(number); };
    if (std::all_of(numbers.begin(), numbers.end(), [](double number) { return number == 0.0; }) ||
        std::all_of(numbers.begin(), numbers.end(), isNan)) {
      pose.status = TransformStatus::Missing;
      return;
    }
    const double unit = options_.unitMm > 0.0 ? options_.unitMm : 1.0;
    const Eigen::Vector3d place = unit * Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
    const Eigen::Quaterniond turn(numbers[3], numbers[4], numbers[5], numbers[6]);
    if (!place.allFinite() || !turn.coeffs().allFinite())
      Miss(pose, "a number is not finite; the pose is treated as missing");
    else if (place.cwiseAbs().maxCoeff() > LargestMm)
      Miss(pose, "the position is beyond 1e7 mm; the pose is treated as missing");
    else if (!(std::fabs(turn.norm() - 1.0) <= QuaternionTolerance))
      Miss(pose, "the length of the quaternion is not 1; the pose is treated as missing");
    else {
      pose.pose.linear() = turn.normalized().toRotationMatrix();
      pose.pose.translation() = place;
    }
  }

  void Miss(ToolPose& pose, const std::string& reason)
  {
    pose.pose = Pose::Identity();
    pose.status = TransformStatus::Missing;
    faults_.Add(reason, number_);
  }

  HeaderLines lines_;
  PoseLogOptions options_;
  PoseLog log_;
  Columns columns_;
  Faults faults_{"line"};
  std::set<std::string> tools_;
  std::string line_;
  std::int64_t number_ = 0, rows_ = 0;
  std::vector<std::string> cells_;
  double turnsOfTheClock_ = 0.0, lastClock_ = -HalfADay;
};

PoseLog ReadSequencePoses(const std::string& path, const PoseLogOptions& options)
{
  const SequenceFile file(path);
  const SequenceContent& content = file.Content();
  PoseLog log;
  log.path = path;
  log.notes = content.notes;
  const double unit = options.unitMm > 0.0 ? options.unitMm : 1.0;
  bool timed = options.rowsPerSecond > 0.0;
  for (int index = 0; index < content.frames && !timed; ++index)
    timed = std::isfinite(file.Time(index));
  Faults faults("frame");
  std::set<std::string> rigid, seen; // names that are a pose at least once, and that are something at all
  for (int index = 0; index < content.frames; ++index) {
    const SequenceFrame frame = file.Frame(index);
    const double time = options.rowsPerSecond > 0.0 ? index / options.rowsPerSecond : frame.time;
    if (timed && !std::isfinite(time)) {
      faults.Add("the frame has no time; its poses were skipped", index);
      continue;
    }
    const std::map<std::string, std::string> fields(frame.fields.begin(), frame.fields.end());
    for (const SequenceTransform& transform : frame.transforms) {
      ToolPose pose;
      pose.name = transform.name;
      pose.time = time;
      pose.status = transform.status;
      if (const auto arrival = fields.find(transform.name + ArrivalField); arrival != fields.end())
        ParseNumber(arrival->second, pose.arrival);
      if (pose.status != TransformStatus::Missing) {
        seen.insert(pose.name);
        Eigen::Matrix4d matrix = transform.matrix.matrix();
        matrix.topRightCorner<3, 1>() *= unit;
        if (NearestPose(matrix, pose.pose) && pose.pose.translation().cwiseAbs().maxCoeff() <= LargestMm) {
          rigid.insert(pose.name);
        } else {
          pose.pose = Pose::Identity();
          pose.status = TransformStatus::Missing;
          faults.Add(pose.name + " is not a rigid transform; it is treated as missing", index);
        }
      }
      log.poses.push_back(pose);
    }
  }
  // A calibration from pixels to mm is a transform, and never a pose.
  std::set<std::string> left;
  for (const std::string& name : content.transforms)
    if (seen.count(name) > 0 && rigid.count(name) == 0)
      left.insert(name);
    else
      log.tools.push_back(name);
  log.poses.erase(std::remove_if(log.poses.begin(), log.poses.end(), [&](const ToolPose& p) { return left.count(p.name) > 0; }),
                  log.poses.end());
  faults.Note(log.notes);
  if (!timed)
    log.notes.push_back("its frames have no times");
  if (log.poses.empty())
    throw Error(Error::Kind::BadFile, path + ": it holds no poses");
  return log;
}

// Sorts by time, and says where times of a tool do not rise.
void SortByTime(PoseLog& log)
{
  std::map<std::string, double> last;
  std::int64_t wrong = 0;
  double first = 0.0;
  for (const ToolPose& pose : log.poses) {
    const auto [before, fresh] = last.emplace(pose.name, pose.time);
    if (!fresh && pose.time <= before->second && ++wrong == 1)
      first = pose.time;
    before->second = pose.time;
  }
  if (wrong > 0)
    log.notes.push_back("the times do not increase at " + std::to_string(wrong) + " rows, first at " + NumberText(first) + " s" +
                        (2 * wrong > static_cast<std::int64_t>(log.poses.size())
                             ? ": they have too few digits; give the number of rows per second"
                             : ""));
  std::stable_sort(log.poses.begin(), log.poses.end(), [](const ToolPose& a, const ToolPose& b) { return a.time < b.time; });
}

} // namespace

ParameterList Describe(PoseLogOptions& p)
{
  return {
      Parameter("UnitMm", p.unitMm, {0, 1e6}, "mm", "Unit of the recording's lengths; 1000: metres. 0: as the file says."),
      Parameter("RowsPerSecond", p.rowsPerSecond, {0, 1e6}, "",
                "When above 0, the times of the file are not taken: its rows (or frames) are this many a second, from 0 on. For "
                "files whose times have too few digits.")};
}

std::vector<ToolPose> PoseLog::Of(const std::string& tool) const
{
  std::string name = tool;
  if (std::find(tools.begin(), tools.end(), name) == tools.end())
    name = ToolTransformName(tool);
  if (std::find(tools.begin(), tools.end(), name) == tools.end())
    throw Error(Error::Kind::BadInput, path + ": there is no tool " + tool + "; there are: " + Joined(tools));
  std::vector<ToolPose> own;
  std::copy_if(poses.begin(), poses.end(), std::back_inserter(own), [&name](const ToolPose& pose) { return pose.name == name; });
  return own;
}

PoseLog ReadPoseLog(const std::string& path, const PoseLogOptions& options)
{
  CheckRanges(options);
  const FileFormat format = FormatOfContent(path);
  if (format != FileFormat::MetaImage && format != FileFormat::Nrrd && format != FileFormat::Unknown)
    throw Error(Error::Kind::BadFile, path + ": it holds images, not a log of poses");
  PoseLog log = format == FileFormat::Unknown ? TableReader(path, options).Read() : ReadSequencePoses(path, options);
  SortByTime(log);
  return log;
}

} // namespace echorama
