// SPDX-License-Identifier: BSD-3-Clause
// Both formats come down to a list of edges; what they have in common (names, doubles, cycles) is checked on that list. The
// XML parser neither follows external entities nor expands own ones, and keeps no stack per level, so nesting is harmless.
#include "Core/Geometry/TransformFile.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Core/Base/Words.h"
#include "Core/Geometry/MatrixRows.h"
#include <pugixml.hpp>

namespace echorama {
namespace {

constexpr const char* Schema = "echorama-transforms-1";
using Json = JsonPlace::Json;

// From the first character that is no blank.
std::string_view Begin(std::string_view text)
{
  text = SkipByteOrderMark(text);
  return text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
}

void SetMatrix(NamedTransform& transform, const Eigen::Matrix4d& matrix, const JsonPlace& place)
{
  if (!matrix.allFinite())
    place.Fail("the matrix holds a number that is not finite");
  const Eigen::RowVector4d bottom(0, 0, 0, 1);
  if ((matrix.row(3) - bottom).cwiseAbs().maxCoeff() > 1e-9) // of a matrix that somebody inverted
    place.Fail("the last row of the matrix is not 0 0 0 1");
  transform.matrix.matrix() = matrix;
  transform.matrix.makeAffine();
}

std::string Capitalized(std::string name)
{
  if (!name.empty() && name[0] >= 'a' && name[0] <= 'z')
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
  return name;
}

NamedTransform PlusTransform(const pugi::xml_node& element, const JsonPlace& place)
{
  const auto text = [&](const char* attribute) {
    if (!element.attribute(attribute))
      place.Fail(std::string(attribute) + " is missing");
    return std::string(element.attribute(attribute).value());
  };
  NamedTransform transform;
  transform.from = Capitalized(text("From"));
  transform.to = Capitalized(text("To"));
  const JsonPlace named = place.In(transform.Name());
  const std::string matrixText = text("Matrix");
  const std::vector<std::string_view> words = SplitWords(matrixText);
  if (words.size() != 16)
    named.Fail("Matrix holds " + std::to_string(words.size()) + " values; 16 are needed");
  MatrixRows matrix;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (!ParseNumber(words[i], matrix.data()[i]))
      named.Fail("Matrix holds \"" + std::string(words[i].substr(0, 60)) + "\", which is not a number");
  SetMatrix(transform, matrix, named);
  if (const auto error = element.attribute("Error")) {
    double mm = 0.0;
    if (!ParseNumber(std::string_view(error.value()), mm) || !std::isfinite(mm))
      named.Fail("Error is \"" + std::string(error.value()).substr(0, 60) + "\", which is not a finite number");
    if (mm >= 0.0)
      transform.errorMm = mm;
  }
  if (const auto status = element.attribute("Status"))
    transform.status = TransformStatusOf(status.value());
  transform.date = element.attribute("Date").value();
  return transform;
}

std::vector<NamedTransform> PlusTransforms(std::string_view text, const JsonPlace& file)
{
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
    file.Fail(std::string("it is not XML (") + parsed.description() + " at byte " + std::to_string(parsed.offset) + ")");
  const pugi::xml_node definitions = document.document_element().child("CoordinateDefinitions");
  if (!definitions)
    file.Fail("its XML holds no CoordinateDefinitions; is it a configuration of Plus?");
  std::vector<NamedTransform> transforms;
  int number = 0;
  for (const pugi::xml_node& element : definitions.children("Transform"))
    transforms.push_back(PlusTransform(element, file.In("transform " + std::to_string(++number))));
  return transforms;
}

NamedTransform JsonTransform(const Json& value, const JsonPlace& place)
{
  NamedTransform transform;
  transform.from = place.In("from").Text(place.Member(value, "from"));
  transform.to = place.In("to").Text(place.Member(value, "to"));
  const JsonPlace named = place.In(transform.Name());
  SetMatrix(transform, named.In("matrix").Rows<4>(named.Member(value, "matrix")), named);
  for (const char* key : {"errorMm", "error_mm"}) // as files before it were spelled, and as they are
    if (value.contains(key))
      transform.errorMm = named.In(key).Number(value[key]);
  if (value.contains("status"))
    transform.status = TransformStatusOf(named.In("status").Text(value["status"]));
  if (value.contains("date"))
    transform.date = named.In("date").Text(value["date"]);
  return transform;
}

std::vector<NamedTransform> JsonTransforms(std::string_view text, const JsonPlace& file)
{
  const Json root = file.Parse(text);
  file.Need(root, "schema", Schema);
  file.Need(root, "unit", "mm");
  const Json& list = file.Member(root, "transforms");
  if (!list.is_array())
    file.Fail("\"transforms\" is not a list");
  std::vector<NamedTransform> transforms;
  for (const Json& value : list)
    transforms.push_back(JsonTransform(value, file.In("transform " + std::to_string(transforms.size() + 1))));
  return transforms;
}

} // namespace

bool LooksLikeTransforms(std::string_view bytes)
{
  const std::string_view begin = Begin(bytes);
  if (begin.empty())
    return false;
  return (begin[0] == '<' && bytes.find("<PlusConfiguration") != std::string_view::npos) ||
         (begin[0] == '{' && bytes.find(Schema) != std::string_view::npos);
}

std::vector<NamedTransform> ReadTransforms(const std::string& path, const CycleTolerance& tolerance)
{
  const JsonPlace file(path);
  const std::string text = ReadTextFile(path);
  const std::string_view begin = Begin(text);
  const char first = begin.empty() ? '\0' : begin[0];
  if (first != '<' && first != '{')
    file.Fail("it is neither a configuration of Plus (XML) nor transforms in JSON");
  std::vector<NamedTransform> given = first == '<' ? PlusTransforms(begin, file) : JsonTransforms(begin, file);
  if (given.size() > 1000) // a room has a dozen; the time that CheckCycles takes may grow with their square
    file.Fail("it holds " + std::to_string(given.size()) + " transforms; no more than 1000 are read");

  std::vector<NamedTransform> transforms;
  TransformGraph graph;
  for (NamedTransform& transform : given) {
    if (const std::string complaint = transform.Complaint(); !complaint.empty())
      file.Fail(complaint);
    if (const NamedTransform* earlier = graph.Edge(transform.from, transform.to)) {
      if (earlier->matrix.matrix() != transform.matrix.matrix())
        file.Fail(transform.Name() + " is given twice, with different matrices");
      continue;
    }
    graph.Set(transform);
    transforms.push_back(std::move(transform));
  }
  if (const std::vector<OpenCycle> open = graph.CheckCycles(tolerance); !open.empty())
    file.Fail(open.front().Text());
  return transforms;
}

std::string ReadTransformReport(const std::string& path)
{
  const Json root = JsonPlace(path).Parse(ReadTextFile(path));
  return root.is_object() && root.contains("report") ? root["report"].dump() : "";
}

void WriteTransforms(const std::string& path, const std::vector<NamedTransform>& transforms, const std::string& report)
{
  Json list = Json::array();
  std::set<std::string> names;
  for (const NamedTransform& transform : transforms) {
    const auto check = [&](bool holds, const std::string& reason) {
      if (!holds)
        throw Error(Error::Kind::InvalidParameter, path + ": " + reason);
    };
    const std::string complaint = transform.Complaint();
    check(complaint.empty(), complaint);
    check(transform.matrix.matrix().allFinite(), transform.Name() + ": the matrix holds a number that is not finite");
    check(names.insert(transform.from + ' ' + transform.to).second, transform.Name() + " is given twice");
    list.push_back({{"from", transform.from},
                    {"to", transform.to},
                    {"matrix", JsonPlace::RowsOf(transform.matrix.matrix())},
                    {"status", TransformStatusText(transform.status)}});
    if (transform.errorMm)
      list.back()["error_mm"] = *transform.errorMm;
    if (!transform.date.empty())
      list.back()["date"] = transform.date;
  }
  Json root{{"schema", Schema}, {"unit", "mm"}, {"transforms", list}};
  if (!report.empty()) {
    root["report"] = Json::parse(report, nullptr, false);
    if (!root["report"].is_object())
      throw Error(Error::Kind::InvalidParameter, path + ": the report is no JSON object");
  }

  std::string text;
  try {
    text = root.dump(2) + '\n';
  } catch (const nlohmann::json::exception&) {
    throw Error(Error::Kind::InvalidParameter, path + ": a name or date is not UTF-8");
  }
  WriteTextFile(path, text);
}

} // namespace echorama
