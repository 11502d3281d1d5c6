// SPDX-License-Identifier: BSD-3-Clause
// All three formats come down to rows of a label and three numbers in one of two frames. The two tables share a parser: an .fcsv
// is a CSV whose columns and frame stand in comments.
#include "Core/Geometry/LandmarkFile.h"
#include "Core/Base/CsvLine.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Core/Base/Words.h"
#include <algorithm>
#include <array>

namespace echorama {
namespace {

constexpr std::size_t maxLandmarks = 1000000;
constexpr double maxMm = 1e7;

enum class Frame { Lps, Ras };

Landmark MakeLandmark(std::string_view label, Eigen::Vector3d position, Frame frame, const JsonPlace& place)
{
  if (!position.allFinite() || position.cwiseAbs().maxCoeff() > maxMm)
    place.Fail("a coordinate is not a number within 1e7 mm");
  if (frame == Frame::Ras)
    position.head<2>() = -position.head<2>();
  return {std::string(TrimBlanks(label)), position};
}

void Add(Landmark landmark, std::vector<Landmark>& landmarks, const JsonPlace& file)
{
  if (landmarks.size() == maxLandmarks)
    file.Fail("it holds more than a million landmarks");
  landmarks.push_back(std::move(landmark));
}

std::vector<Landmark> JsonLandmarks(std::string_view text, const JsonPlace& file)
{
  const JsonPlace::Json root = file.Parse(text);
  const JsonPlace::Json& markups = file.Member(root, "markups");
  if (!markups.is_array())
    file.Fail("\"markups\" is not a list");
  std::vector<Landmark> landmarks;
  int number = 0;
  for (const JsonPlace::Json& markup : markups) {
    const JsonPlace place = file.In("markup " + std::to_string(++number));
    if (!markup.is_object())
      place.Fail("it is not a JSON object");
    Frame frame = Frame::Lps;
    if (markup.contains("coordinateSystem")) {
      const std::string name = place.In("coordinateSystem").Text(markup["coordinateSystem"]);
      if (name != "LPS" && name != "RAS")
        place.Fail("the coordinate system is \"" + name.substr(0, 60) + "\"; LPS or RAS is needed");
      frame = name == "RAS" ? Frame::Ras : Frame::Lps;
    }
    if (markup.contains("coordinateUnits")) {
      // A text, or a coded entry: code, scheme, meaning.
      const JsonPlace::Json& units = markup["coordinateUnits"];
      const std::string code = place.In("coordinateUnits").Text(units.is_array() && !units.empty() ? units.front() : units);
      if (code != "mm")
        place.Fail("the unit is \"" + code.substr(0, 60) + "\"; mm is needed");
    }
    if (!markup.contains("controlPoints"))
      continue;
    if (!markup["controlPoints"].is_array())
      place.Fail("\"controlPoints\" is not a list");
    int point = 0;
    for (const JsonPlace::Json& value : markup["controlPoints"]) {
      const JsonPlace here = place.In("control point " + std::to_string(++point));
      if (!value.is_object())
        here.Fail("it is not a JSON object");
      if (value.contains("positionStatus") && here.In("positionStatus").Text(value["positionStatus"]) != "defined")
        continue;
      const Eigen::Vector3d position = here.In("position").Vector<3>(here.Member(value, "position"));
      Add(MakeLandmark(value.contains("label") ? here.In("label").Text(value["label"]) : std::string(), position, frame, here),
          landmarks, file);
    }
  }
  return landmarks;
}

std::vector<std::string> Cells(std::string_view line, const JsonPlace& place)
{
  std::vector<std::string> cells;
  if (!SplitCsvLine(line, ',', cells))
    place.Fail("a quotation mark is not closed");
  return cells;
}

std::string Lower(std::string_view text)
{
  std::string lower(TrimBlanks(text));
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return lower;
}

struct LandmarkColumns {
  int label = -1, defined = -1;
  std::array<int, 3> axes{-1, -1, -1};
  Frame frame = Frame::Lps;
  std::size_t count = 0; // of all of them

  bool IsWhole() const { return label >= 0 && *std::min_element(axes.begin(), axes.end()) >= 0; }
};

LandmarkColumns ColumnsOf(const std::vector<std::string>& names)
{
  const auto find = [&names](const char* name) {
    for (std::size_t i = 0; i < names.size(); ++i)
      if (Lower(names[i]) == name)
        return static_cast<int>(i);
    return -1;
  };
  LandmarkColumns columns;
  columns.label = std::max(find("label"), find("name"));
  columns.defined = find("defined");
  columns.count = names.size();
  columns.axes = {find("x"), find("y"), find("z")};
  if (!columns.IsWhole())
    columns.axes = {find("l"), find("p"), find("s")};
  if (!columns.IsWhole()) {
    columns.axes = {find("r"), find("a"), find("s")};
    columns.frame = Frame::Ras;
  }
  return columns;
}

// What follows "# key =" in a comment.
bool CommentValue(std::string_view line, const char* key, std::string& value)
{
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos || Lower(line.substr(1, equals - 1)) != key)
    return false;
  value = TrimBlanks(line.substr(equals + 1));
  return true;
}

std::vector<Landmark> TableLandmarks(std::string_view text, const JsonPlace& file)
{
  LandmarkColumns columns{0, -1, {1, 2, 3}, Frame::Lps, 4};
  bool isFcsv = false, mayBeNames = true;
  std::vector<Landmark> landmarks;
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string_view line = TrimBlanks(text.substr(0, end));
    const bool isWindows = text.substr(end, 2) == "\r\n";
    text.remove_prefix(std::min(text.size(), end + (isWindows ? 2 : 1)));
    const JsonPlace place = file.In("line " + std::to_string(++number));
    if (std::any_of(line.begin(), line.end(), [](char c) { return (c >= 0 && c < 32 && c != '\t') || c == 127; }))
      place.Fail("it holds binary data; landmarks are text");
    if (line.empty())
      continue;
    if (line[0] == '#') {
      std::string value;
      if (landmarks.empty() && !isFcsv &&
          (Lower(line.substr(1)).rfind("markups fiducial file", 0) == 0 || CommentValue(line, "coordinatesystem", value))) {
        columns = {11, -1, {1, 2, 3}, Frame::Ras, 14};
        isFcsv = true;
        mayBeNames = false;
      }
      if (CommentValue(line, "coordinatesystem", value)) {
        if (value != "0" && value != "1" && value != "RAS" && value != "LPS")
          place.Fail("the coordinate system is \"" + value.substr(0, 60) + "\"; 0 (RAS) or 1 (LPS) is needed" +
                     (value == "2" || value == "IJK" ? ", not voxel indices" : ""));
        columns.frame = value == "0" || value == "RAS" ? Frame::Ras : Frame::Lps;
      } else if (isFcsv && CommentValue(line, "columns", value)) {
        const Frame frame = columns.frame;
        columns = ColumnsOf(Cells(value, place));
        columns.frame = frame;
        if (!columns.IsWhole())
          place.Fail("columns label, x, y and z are needed");
      }
      continue;
    }
    std::vector<std::string> cells = Cells(line, place);
    if (isFcsv && cells.size() == columns.count + 2) { // 3D Slicer 5 adds two that it does not name: the status and "automatic"
      const std::string status = cells[columns.count], automatic = cells[columns.count + 1];
      const bool isStatus = status.size() == 1 && status[0] >= '0' && status[0] <= '3' && (automatic == "0" || automatic == "1");
      if (isStatus && status != "2") // undefined, previewed or missing
        continue;
      cells.resize(columns.count + (isStatus ? 0 : 2));
    }
    if (mayBeNames) {
      mayBeNames = false;
      double x = 0.0;
      if (cells.size() > 1 && !ParseNumber(TrimBlanks(cells[1]), x)) {
        columns = ColumnsOf(cells);
        if (!columns.IsWhole())
          place.Fail("a landmark (label,x,y,z) or names of columns (label,x,y,z or label,l,p,s or label,r,a,s) are needed");
        continue;
      }
    }
    if (cells.size() > columns.count) // a decimal comma would move all that follows
      place.Fail("it has " + std::to_string(cells.size()) + " cells, and there are " + std::to_string(columns.count) +
                 " columns; a decimal point is needed, not a comma");
    const auto cell = [&](int column, const char* name) -> std::string_view {
      if (column >= static_cast<int>(cells.size()))
        place.Fail(std::string(name) + " is missing; it has only " + std::to_string(cells.size()) + " cells");
      return TrimBlanks(cells[static_cast<std::size_t>(column)]);
    };
    if (columns.defined >= 0 && cell(columns.defined, "defined") == "0")
      continue;
    Eigen::Vector3d position;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = cell(columns.axes[static_cast<std::size_t>(axis)], "a coordinate");
      if (!ParseNumber(word, position[axis]))
        place.Fail("\"" + std::string(word.substr(0, 60)) + "\" is not a number");
    }
    Add(MakeLandmark(cell(columns.label, "the label"), position, columns.frame, place), landmarks, file);
  }
  return landmarks;
}

} // namespace

std::vector<Landmark> ReadLandmarks(const std::string& path)
{
  const JsonPlace file(path);
  const std::string whole = ReadTextFile(path, std::size_t{256} << 20);
  const std::string_view text = SkipByteOrderMark(whole);
  const std::string_view first = text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size()), 1);
  std::vector<Landmark> landmarks = first == "{" ? JsonLandmarks(text, file) : TableLandmarks(text, file);
  if (landmarks.empty())
    file.Fail("it holds no landmarks");
  return landmarks;
}

} // namespace echorama
