// SPDX-License-Identifier: BSD-3-Clause
#include "Snapshot.h"
#include "Core/Base/Error.h"
#include "ImageView.h"
#include "ScanFrame.h"
#include <QDateTime>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QPainter>
#include <QSaveFile>

namespace echorama {

namespace {

QJsonArray Rows(const Pose& pose)
{
  QJsonArray rows;
  for (int i = 0; i < 4; i++)
    rows.append(QJsonArray{pose.matrix()(i, 0), pose.matrix()(i, 1), pose.matrix()(i, 2), pose.matrix()(i, 3)});
  return rows;
}

QJsonArray Triple(const Eigen::Vector3d& at)
{
  return {at[0], at[1], at[2]};
}

[[noreturn]] void Fail(const QString& path, const QString& reason)
{
  throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(path, reason).toStdString());
}

} // namespace

QString WriteSnapshot(const QDir& folder, const QStringList& volumes, const PlanePicture& picture, const ScanFrame& frame,
                      const std::vector<CalliperLine>& callipers)
{
  if (!folder.mkpath("."))
    Fail(folder.path(), "the folder cannot be made");
  const QString name = "echorama-" + QDateTime::currentDateTime().toString("yyyyMMdd-HHmmss-zzz");
  QJsonObject controls;
  for (const auto& [key, text] : *frame.settings)
    controls[QString::fromStdString(key)] = QString::fromStdString(text);
  QJsonArray lines;
  for (const CalliperLine& calliper : callipers) {
    const QLineF& line = calliper.line;
    lines.append(QJsonObject{{"from", QJsonArray{line.x1(), line.y1()}},
                             {"to", QJsonArray{line.x2(), line.y2()}},
                             {"fromInWorld", Triple(calliper.From())},
                             {"toInWorld", Triple(calliper.To())},
                             {"lengthMm", line.length()}});
  }
  QJsonObject all{{"schema", "echorama-snapshot-1"},
                  {"unit", "mm"},
                  {"volumes", QJsonArray::fromStringList(volumes)},
                  {"ProbeToWorld", Rows(frame.probeToWorld)},
                  {"frame", static_cast<double>(frame.number)},
                  {"controls", controls},
                  {"flipped", picture.isFlipped},
                  {"topLeft", QJsonArray{picture.topLeft.x(), picture.topLeft.y()}},
                  {"pixel", QJsonArray{picture.pixel.width(), picture.pixel.height()}},
                  {"callipers", lines}};
  if (frame.needle) {
    const Eigen::Vector3d &tip = frame.needle->tip, &way = frame.needle->direction;
    all["needle"] = QJsonObject{{"tip", Triple(tip)}, {"direction", Triple(way)}};
  }
  const QString image = folder.filePath(name + ".png"), text = folder.filePath(name + ".json");
  QImage opaque(picture.image.size(), QImage::Format_RGB32);
  opaque.fill(Qt::black);
  QPainter(&opaque).drawImage(0, 0, picture.image);
  QSaveFile png(image), json(text);
  if (!png.open(QIODevice::WriteOnly) || !opaque.save(&png, "PNG") || !png.commit())
    Fail(image, png.errorString());
  const QByteArray bytes = QJsonDocument(all).toJson();
  if (!json.open(QIODevice::WriteOnly) || json.write(bytes) != bytes.size() || !json.commit())
    Fail(text, json.errorString());
  return image;
}

} // namespace echorama
