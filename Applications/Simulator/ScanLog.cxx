// SPDX-License-Identifier: BSD-3-Clause
#include "ScanLog.h"
#include "Core/Base/Error.h"
#include "Scan.h"
#include <algorithm>
#include <cmath>
#include <QCryptographicHash>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

const QString SchemaStem = "echorama-scan-";      ///< the version follows
constexpr double MostFrames = 9007199254740992.0; ///< JSON's numbers are exact up to here, 2^53

void AddBytes(QCryptographicHash& hash, const void* bytes, vtkIdType size)
{
  constexpr vtkIdType block = 1 << 24; // Qt counts bytes with an int
  for (vtkIdType at = 0; at < size; at += block)
    hash.addData(static_cast<const char*>(bytes) + at, static_cast<int>(std::min(block, size - at)));
}

void AddValues(QCryptographicHash& hash, vtkDataArray* array)
{
  AddBytes(hash, array->GetVoidPointer(0), array->GetNumberOfValues() * array->GetDataTypeSize());
}

void AddText(QCryptographicHash& hash, const std::string& text)
{
  AddBytes(hash, text.c_str(), static_cast<vtkIdType>(text.size() + 1)); // with its end: "ab", "c" is not "a", "bc"
}

void AddArrays(QCryptographicHash& hash, vtkFieldData* data)
{
  for (int i = 0; i < data->GetNumberOfArrays(); i++) {
    vtkAbstractArray* array = data->GetAbstractArray(i);
    AddText(hash, array->GetName() ? array->GetName() : "");
    if (auto* numbers = vtkDataArray::SafeDownCast(array))
      AddValues(hash, numbers);
    else if (auto* texts = vtkStringArray::SafeDownCast(array))
      for (vtkIdType at = 0; at < texts->GetNumberOfValues(); at++)
        AddText(hash, texts->GetValue(at));
  }
}

// However the cells are kept.
void AddCells(QCryptographicHash& hash, vtkCellArray* cells)
{
  const auto all = vtk::TakeSmartPointer(cells->NewIterator());
  for (all->GoToFirstCell(); !all->IsDoneWithTraversal(); all->GoToNextCell()) {
    vtkIdType count = 0;
    const vtkIdType* corners = nullptr;
    all->GetCurrentCell(count, corners);
    AddBytes(hash, &count, sizeof(count));
    AddBytes(hash, corners, count * static_cast<vtkIdType>(sizeof(*corners)));
  }
}

QString SchemaOf(int version)
{
  return SchemaStem + QString::number(version);
}

QByteArray LineOf(const QJsonObject& object)
{
  return QJsonDocument(object).toJson(QJsonDocument::Compact) + "\n";
}

// The tip and the direction: six numbers.
QJsonArray JsonOf(const Needle& needle)
{
  QJsonArray numbers;
  for (const Eigen::Vector3d& part : {needle.tip, needle.direction})
    for (int a = 0; a < 3; a++)
      numbers.append(part[a]);
  return numbers;
}

Needle NeedleOf(const QJsonValue& value)
{
  const QJsonArray numbers = value.toArray();
  if (numbers.size() != 6)
    throw Error(Error::Kind::BadFile, "Needle needs 6 numbers");
  Needle needle;
  for (int a = 0; a < 3; a++) {
    needle.tip[a] = numbers[a].toDouble(std::nan(""));
    needle.direction[a] = numbers[a + 3].toDouble(std::nan(""));
  }
  needle.Check();
  return needle;
}

[[noreturn]] void FailLine(const QString& path, int line, const QString& reason)
{
  throw Error(Error::Kind::BadFile, QString("%1: line %2: %3").arg(path).arg(line).arg(reason).toStdString());
}

} // namespace

QByteArray SumOf(vtkImageData* image)
{
  QCryptographicHash hash(QCryptographicHash::Md5);
  AddValues(hash, vtkUltrasoundVolume::GetIntensity(image));
  return hash.result().toHex();
}

QByteArray SumOf(const Subject& subject, int version)
{
  QCryptographicHash hash(QCryptographicHash::Md5);
  for (const auto& volume : subject.volumes) {
    const Eigen::Matrix4d toWorld = vtkUltrasoundVolume::GeometryOf(volume).IndexToWorld().matrix();
    AddBytes(hash, toWorld.data(), 16 * sizeof(double));
    if (version == 1)
      AddValues(hash, vtkUltrasoundVolume::GetIntensity(volume));
    else
      AddArrays(hash, volume->GetPointData());
  }
  if (vtkPolyData* tissue = subject.tissue) {
    AddValues(hash, tissue->GetPoints()->GetData());
    if (version > 1) {
      for (vtkCellArray* cells : {tissue->GetVerts(), tissue->GetLines(), tissue->GetPolys(), tissue->GetStrips()})
        AddCells(hash, cells);
      for (vtkFieldData* data : {static_cast<vtkFieldData*>(tissue->GetPointData()),
                                 static_cast<vtkFieldData*>(tissue->GetCellData()), tissue->GetFieldData()})
        AddArrays(hash, data);
    }
  }
  return hash.result().toHex();
}

ScanLogWriter::ScanLogWriter(const QString& path, const Subject& subject) : file_(path)
{
  if (!file_.open(QIODevice::WriteOnly | QIODevice::NewOnly))
    throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(path, file_.errorString()).toStdString());
  Write(LineOf({{"schema", SchemaOf(ScanLog::Version)},
                {"volumes", QJsonArray::fromStringList(subject.files)},
                {"body", QString(subject.sum)}}));
}

void ScanLogWriter::Write(const QByteArray& line)
{
  if (file_.write(line) != line.size() || !file_.flush())
    throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(file_.fileName(), file_.errorString()).toStdString());
}

void ScanLogWriter::Append(const ScanFrame& frame, vtkImageData* image)
{
  QJsonObject object{{"seconds", frame.seconds}, {"number", static_cast<double>(frame.number)}, {"sum", QString(SumOf(image))}};
  QJsonArray pose;
  for (int i = 0; i < 12; i++)
    pose.append(frame.probeToWorld.matrix()(i / 4, i % 4));
  object["ProbeToWorld"] = pose; // row by row, without the last
  if (frame.isInAir)
    object["air"] = true;
  if (frame.isFlipped)
    object["flipped"] = true;
  if (frame.needle)
    object["Needle"] = JsonOf(*frame.needle);
  if (frame.settings != settings_) {
    QJsonObject controls;
    for (const auto& [name, text] : *frame.settings)
      controls[QString::fromStdString(name)] = QString::fromStdString(text);
    object["controls"] = controls;
    settings_ = frame.settings;
  }
  waiting_.push_back(LineOf(object));
}

void ScanLogWriter::Release(int frames)
{
  for (; released_ < frames && !waiting_.empty(); released_++, waiting_.pop_front())
    Write(waiting_.front());
}

ScanLog ScanLog::Read(const QString& path)
{
  QFile file(path);
  if (!file.open(QIODevice::ReadOnly))
    throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(path, file.errorString()).toStdString());
  ScanLog log;
  std::shared_ptr<const ScanSettings> settings;
  for (int line = 1; !file.atEnd(); line++) {
    const QByteArray text = file.readLine();
    QJsonParseError problem;
    const QJsonObject object = QJsonDocument::fromJson(text, &problem).object();
    if (line > 1 && !text.endsWith('\n'))
      break; // cut off
    if (problem.error != QJsonParseError::NoError)
      FailLine(path, line, "it is no JSON: " + problem.errorString());
    if (line == 1) {
      const QString schema = object["schema"].toString();
      while (log.version > 0 && schema != SchemaOf(log.version))
        log.version--;
      if (log.version == 0)
        FailLine(path, line, "it is not a recorded scan that is known (\"schema\": \"" + SchemaOf(ScanLog::Version) + "\")");
      for (const auto& volume : object["volumes"].toArray())
        log.volumes.append(volume.toString());
      log.body = object["body"].toString().toLatin1();
      continue;
    }
    Entry entry;
    const QJsonArray pose = object["ProbeToWorld"].toArray();
    if (pose.size() != 12 || !object["seconds"].isDouble() || !object["number"].isDouble())
      FailLine(path, line, "seconds, number and the 12 numbers of ProbeToWorld are needed");
    for (int i = 0; i < 12; i++)
      entry.frame.probeToWorld.matrix()(i / 4, i % 4) = pose[i].toDouble(std::nan(""));
    if (!entry.frame.probeToWorld.matrix().allFinite() || !IsRotation(entry.frame.probeToWorld.linear()))
      FailLine(path, line, "ProbeToWorld is no rigid pose");
    entry.frame.seconds = object["seconds"].toDouble();
    const double number = object["number"].toDouble();
    if (!(number >= 0.0 && number <= MostFrames && number == std::floor(number)))
      FailLine(path, line, "its number is no whole number from 0 to 2^53");
    entry.frame.number = static_cast<std::int64_t>(number);
    entry.frame.isInAir = object["air"].toBool();
    entry.frame.isFlipped = object["flipped"].toBool();
    if (object.contains("Needle"))
      try {
        entry.frame.needle = NeedleOf(object["Needle"]);
      } catch (const Error& error) {
        FailLine(path, line, QString::fromUtf8(error.what()));
      }
    entry.sum = object["sum"].toString().toLatin1();
    if (object.contains("controls")) {
      ScanSettings controls;
      const QJsonObject all = object["controls"].toObject();
      for (auto i = all.begin(); i != all.end(); ++i)
        controls.emplace_back(i.key().toStdString(), i.value().toString().toStdString());
      settings = std::make_shared<const ScanSettings>(std::move(controls));
    }
    if (!settings)
      FailLine(path, line, "the first frame has no controls");
    entry.frame.settings = settings;
    log.entries.push_back(std::move(entry));
  }
  if (log.entries.empty())
    FailLine(path, 1, "it holds no frame");
  return log;
}

} // namespace echorama
