// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeTable.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <algorithm>
#include <QApplication>
#include <QColor>
#include <QFont>
#include <QStyle>

namespace echorama {

VolumeTable::VolumeTable(Workbench* bench, QObject* parent) : QAbstractTableModel(parent), bench_(bench), ids_(bench->Volumes())
{
  connect(bench, &Workbench::VolumesChanged, this, &VolumeTable::Follow);
  for (auto changed : {&Workbench::PosesChanged, &Workbench::VoxelsChanged, &Workbench::HistoryChanged})
    connect(bench, changed, this, &VolumeTable::FollowLinks);
}

// Rows keep their place where they can, so that a selection or an open editor survives a change of colour.
void VolumeTable::Follow()
{
  const QVector<int> ids = bench_->Volumes();
  if (ids != ids_) {
    beginResetModel();
    ids_ = ids;
    endResetModel();
  } else if (!ids_.isEmpty()) {
    emit dataChanged(index(0, 0), index(ids_.size() - 1, Columns - 1));
  }
  FollowLinks();
}

void VolumeTable::FollowLinks()
{
  QStringList links;
  for (const int id : ids_)
    links.append(QString::fromStdString(bench_->Session()->GetSourcesChanged(id)));
  if (links == links_)
    return;
  links_ = links;
  emit dataChanged(index(0, Name), index(ids_.size() - 1, Name));
  emit LinksChanged();
}

int VolumeTable::rowCount(const QModelIndex& parent) const
{
  return parent.isValid() ? 0 : ids_.size();
}

int VolumeTable::columnCount(const QModelIndex& parent) const
{
  return parent.isValid() ? 0 : Columns;
}

QVariant VolumeTable::data(const QModelIndex& index, int role) const
{
  const auto* session = bench_->Session();
  const int id = IdOf(index.row());
  if (!session->HasVolume(id))
    return {};
  if (role == Qt::ToolTipRole) {
    const QString file = QString::fromStdString(session->GetFile(id));
    if (!session->IsResult(id))
      return file.isEmpty() ? tr("Not from a file") : file;
    QStringList sources;
    for (const MadeOf::Source& source : session->GetKernel().State().Find(id)->madeOf->sources)
      sources.append(QString::fromStdString(source.name));
    const QString link = links_.value(index.row());
    return tr("Made of %1. %2. %3")
        .arg(sources.join(", "), link.isEmpty() ? tr("Its sources are as they were") : tr("Sources changed: %1").arg(link),
             file.isEmpty() ? tr("It is in no file yet") : file);
  }
  switch (index.column()) {
  case Visible:
    if (role == Qt::CheckStateRole)
      return session->GetVisible(id) ? Qt::Checked : Qt::Unchecked;
    break;
  case Colour:
    if (role == Qt::DecorationRole || role == Qt::EditRole) {
      double rgb[3] = {1.0, 1.0, 1.0};
      session->GetColour(id, rgb);
      return QColor::fromRgbF(rgb[0], rgb[1], rgb[2]);
    }
    break;
  case Name:
    if (role == Qt::DisplayRole || role == Qt::EditRole)
      return bench_->NameOf(id);
    if (role == Qt::DecorationRole && !links_.value(index.row()).isEmpty())
      return QApplication::style()->standardIcon(QStyle::SP_MessageBoxWarning);
    if (role == Qt::AccessibleDescriptionRole && !links_.value(index.row()).isEmpty())
      return tr("Sources changed: %1").arg(links_.value(index.row()));
    if (role == Qt::FontRole && session->IsResult(id)) {
      QFont font = QApplication::font();
      font.setItalic(true);
      return font;
    }
    break;
  case Opacity: {
    const int percent = qRound(100.0 * session->GetOpacity(id));
    if (role == Qt::DisplayRole)
      return QString("%1 %").arg(percent);
    if (role == Qt::EditRole)
      return percent;
    break;
  }
  case Group:
    if (role == Qt::DisplayRole && session->GetGroup(id) > 0)
      return session->GetGroup(id);
    break;
  default:
    break;
  }
  if (role == Qt::TextAlignmentRole && index.column() != Name)
    return int(Qt::AlignCenter);
  return {};
}

bool VolumeTable::setData(const QModelIndex& index, const QVariant& value, int role)
{
  auto* session = bench_->Session();
  const int id = IdOf(index.row());
  if (!session->HasVolume(id))
    return false;
  switch (index.column()) {
  case Visible:
    return role == Qt::CheckStateRole && session->SetVisible(id, value.toInt() == Qt::Checked);
  case Colour: {
    const auto colour = value.value<QColor>();
    return colour.isValid() && session->SetColour(id, colour.redF(), colour.greenF(), colour.blueF());
  }
  case Name:
    return role == Qt::EditRole && !value.toString().trimmed().isEmpty() &&
           session->SetName(id, value.toString().trimmed().toUtf8().constData());
  case Opacity:
    return role == Qt::EditRole && session->SetOpacity(id, std::clamp(value.toInt(), 0, 100) / 100.0);
  default:
    return false;
  }
}

QVariant VolumeTable::headerData(int section, Qt::Orientation orientation, int role) const
{
  if (orientation != Qt::Horizontal)
    return {};
  if (role == Qt::DisplayRole) {
    static const char* const titles[Columns] = {QT_TR_NOOP("Show"), "", QT_TR_NOOP("Name"), QT_TR_NOOP("Opacity"),
                                                QT_TR_NOOP("Group")};
    return tr(titles[section]);
  }
  if (role == Qt::ToolTipRole) {
    static const char* const help[Columns] = {
        QT_TR_NOOP("Shown in the views. Only volumes that are shown are stitched and exported; aligning uses all of them"),
        QT_TR_NOOP("Tint of the volume; double click to change it"), QT_TR_NOOP("Double click to rename"),
        QT_TR_NOOP("Weight of the volume where several overlap; double click to change it"),
        QT_TR_NOOP("Volumes of one group are selected and moved together")};
    return tr(help[section]);
  }
  return {};
}

Qt::ItemFlags VolumeTable::flags(const QModelIndex& index) const
{
  Qt::ItemFlags flags = Qt::ItemIsEnabled | Qt::ItemIsSelectable;
  if (index.column() == Visible)
    flags |= Qt::ItemIsUserCheckable;
  if (index.column() == Name || index.column() == Opacity)
    flags |= Qt::ItemIsEditable;
  return flags;
}

} // namespace echorama
