// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/SequenceText.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Readers/ByteOrder.h"
#include <cmath>
#include <set>

namespace echorama {
namespace {

[[noreturn]] void Fail(const std::string& path, Error::Kind kind, const std::string& reason)
{
  throw Error(kind, path + ": " + reason);
}

void CheckField(const std::string& path, const HeaderField& field)
{
  if (!CanHold(field))
    Fail(path, Error::Kind::BadInput, "the header cannot hold the field \"" + field.first + "\"");
}

// 16 numbers, row by row.
std::string MatrixText(const Eigen::Affine3d& matrix)
{
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = matrix.matrix().topRows<3>();
  return JoinedNumbers(rows.data(), 12) + " 0 0 0 1";
}

} // namespace

void CheckSequence(const std::string& path, SequenceContent& content)
{
  if (content.dimensions[0] < 0 || content.dimensions[1] < 0 || content.dimensions[2] < 1 || content.components < 1)
    Fail(path, Error::Kind::BadInput, "frames of these dimensions cannot be written");
  const bool images = content.HasImages();
  if (!images)
    content.dimensions = {0, 0, 1};
  for (const HeaderField& field : content.fields) {
    CheckField(path, field);
    if (IsFrameField(field.first) || field.first == "UltrasoundImageOrientation" || field.first == "UltrasoundImageType")
      Fail(path, Error::Kind::BadInput, "the field \"" + field.first + "\" is one that the writer makes itself");
  }
  CheckField(path, {"type", content.imageType});
  content.geometry.dimensions = images ? content.dimensions : std::array<int, 3>{1, 1, 1};
  content.geometry.Check(path);
}

std::vector<HeaderField> MetaImageSequenceFields(const SequenceContent& content, bool compressed)
{
  const ImageGeometry& g = content.geometry;
  const bool images = content.HasImages(), volumes = content.dimensions[2] > 1;
  const std::string one = volumes ? " 1" : "", zero = volumes ? " 0" : "";
  std::string sizes, matrix;
  for (std::size_t axis = 0; axis < (volumes ? 3 : 2); ++axis)
    sizes += std::to_string(content.dimensions[axis]) + " ";
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    matrix += (axis > 0 ? " " : "") + JoinedNumbers(g.direction.col(axis).data(), 3) + zero;
  return {{"ObjectType", "Image"},
          {"NDims", volumes ? "4" : "3"},
          {"BinaryData", "True"},
          {"BinaryDataByteOrderMSB", HostIsBigEndian ? "True" : "False"},
          {"CompressedData", compressed ? "True" : "False"},
          {"DimSize", sizes},
          {"Kinds", volumes ? "domain domain domain list" : "domain domain list"},
          {"ElementNumberOfChannels", NumberText(content.components)},
          {"ElementSpacing", JoinedNumbers(g.spacing.data(), 3) + one},
          {"ElementType", images ? MetaImageTypeName(content.type) : "MET_OTHER"},
          {"Offset", JoinedNumbers(g.origin.data(), 3) + zero},
          {"TransformMatrix", matrix + (volumes ? " 0 0 0 1" : "")},
          {"UltrasoundImageOrientation", images ? "MF" : "XX"},
          {"UltrasoundImageType", content.imageType.empty() ? images ? "BRIGHTNESS" : "XX" : content.imageType}};
}

bool CanNameTransform(const std::string& name)
{
  const std::string key = name + "Transform"; // of "AToBTransform", it would be none
  return FramesOf(name) && FramesOf(key) && CanHold({key, ""});
}

std::vector<HeaderField> SequenceFrameFields(const std::string& path, const SequenceFrame& frame, int number,
                                             const std::string& statusKey, bool hasPixels)
{
  const std::string frameText = "frame " + std::to_string(number);
  if (std::isinf(frame.time))
    Fail(path, Error::Kind::BadInput, "the time of " + frameText + " is not finite");
  std::vector<HeaderField> fields;
  std::set<std::string> given{"Timestamp", "ImageStatus", "Status"};
  const auto add = [&](const std::string& key, const std::string& value) {
    CheckField(path, {key, value});
    if (!given.insert(key).second)
      Fail(path, Error::Kind::BadInput, "the field \"" + key + "\" of " + frameText + " is given twice");
    fields.emplace_back(key, value);
  };
  for (const SequenceTransform& transform : frame.transforms) {
    if (!FramesOf(transform.name))
      Fail(path, Error::Kind::BadInput, "\"" + transform.name + "\" is not the name of a transform, FrameAToFrameB");
    const bool finite = transform.matrix.matrix().allFinite();
    if (!finite && transform.status == TransformStatus::Valid)
      Fail(path, Error::Kind::BadInput, transform.name + "Transform of " + frameText + " is not finite");
    const bool told = TransformStatusOf(transform.statusText) == transform.status;
    add(transform.name + "Transform", MatrixText(finite ? transform.matrix : Eigen::Affine3d::Identity()));
    add(transform.name + "TransformStatus", told ? transform.statusText : TransformStatusText(transform.status));
  }
  for (const auto& [key, value] : frame.fields)
    add(key, value);
  if (!std::isnan(frame.time))
    fields.emplace_back("Timestamp", NumberText(frame.time));
  fields.emplace_back(statusKey, frame.imageValid && hasPixels ? "OK" : "INVALID");
  return fields;
}

std::string SequenceFramePrefix(int number)
{
  const std::string digits = std::to_string(number);
  return "Seq_Frame" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + "_";
}

} // namespace echorama
