// SPDX-License-Identifier: BSD-3-Clause
#include "ScanLog.h"
#include "Core/Base/Error.h"
#include "Scan.h"
#include <QCryptographicHash>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

const QString Schema = "echorama-scan-1";

void AddVoxels(QCryptographicHash& hash, vtkImageData* image)
{
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
  constexpr vtkIdType block = 1 << 24; // Qt counts bytes with an int
  const auto* bytes = static_cast<const char*>(intensity->GetVoidPointer(0));
  const vtkIdType size = intensity->GetNumberOfValues() * intensity->GetDataTypeSize();
  for (vtkIdType at = 0; at < size; at += block)
    hash.addData(bytes + at, static_cast<int>(std::min(block, size - at)));
}

QByteArray LineOf(const QJsonObject& object)
{
  return QJsonDocument(object).toJson(QJsonDocument::Compact) + "\n";
}

[[noreturn]] void FailLine(const QString& path, int line, const QString& reason)
{
  throw Error(Error::Kind::BadFile, QString("%1: line %2: %3").arg(path).arg(line).arg(reason).toStdString());
}

} // namespace

QByteArray SumOf(vtkImageData* image)
{
  QCryptographicHash hash(QCryptographicHash::Md5);
  AddVoxels(hash, image);
  return hash.result().toHex();
}

QByteArray SumOf(const Subject& subject)
{
  QCryptographicHash hash(QCryptographicHash::Md5);
  for (const auto& volume : subject.volumes) {
    const Eigen::Matrix4d toWorld = vtkUltrasoundVolume::GeometryOf(volume).IndexToWorld().matrix();
    hash.addData(reinterpret_cast<const char*>(toWorld.data()), 16 * sizeof(double));
    AddVoxels(hash, volume);
  }
  if (subject.tissue) {
    vtkDataArray* points = subject.tissue->GetPoints()->GetData();
    hash.addData(static_cast<const char*>(points->GetVoidPointer(0)),
                 static_cast<int>(points->GetNumberOfValues() * points->GetDataTypeSize()));
  }
  return hash.result().toHex();
}

ScanLogWriter::ScanLogWriter(const QString& path, const Subject& subject) : file_(path)
{
  if (!file_.open(QIODevice::WriteOnly | QIODevice::NewOnly))
    throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(path, file_.errorString()).toStdString());
  Write(LineOf({{"schema", Schema}, {"volumes", QJsonArray::fromStringList(subject.files)}, {"body", QString(SumOf(subject))}}));
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
  if (frame.settings != settings_) {
    QJsonObject controls;
    for (const auto& [name, text] : *frame.settings)
      controls[QString::fromStdString(name)] = QString::fromStdString(text);
    object["controls"] = controls;
    settings_ = frame.settings;
  }
  Write(LineOf(object));
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
      if (object["schema"].toString() != Schema)
        FailLine(path, line, "it is not a recorded scan (\"schema\": \"" + Schema + "\")");
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
    entry.frame.number = static_cast<std::int64_t>(object["number"].toDouble());
    entry.frame.isInAir = object["air"].toBool();
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
