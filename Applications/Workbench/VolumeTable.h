// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QAbstractTableModel>
#include <QStringList>
#include <QVector>

namespace echorama {

class Workbench;

/// The session's volumes as a table to edit, one row each.
class VolumeTable : public QAbstractTableModel {
  Q_OBJECT

public:
  enum Column { Visible, Colour, Name, Opacity, Group, Columns };

  explicit VolumeTable(Workbench* bench, QObject* parent = nullptr);

  int IdOf(int row) const { return ids_.value(row); }
  int RowOf(int id) const { return ids_.indexOf(id); }

  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  bool setData(const QModelIndex& index, const QVariant& value, int role) override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;
  Qt::ItemFlags flags(const QModelIndex& index) const override;

signals:
  void LinksChanged(); ///< whether sources of results are as they were

private:
  void Follow();
  void FollowLinks();

  Workbench* bench_;
  QVector<int> ids_;
  QStringList links_; ///< what has become of the sources of each
};

} // namespace echorama
