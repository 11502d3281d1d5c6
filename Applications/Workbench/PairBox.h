// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "PairGraph.h"
#include <QGroupBox>

class QTableWidget;

namespace echorama {

class Workbench;

/// The pairs of the last alignment, as a graph and as a list. Choosing one shows its two volumes alone, with the views on where
/// they overlap; choosing it again, or Escape, brings all back.
class PairBox : public QGroupBox {
  Q_OBJECT

public:
  explicit PairBox(Workbench* bench, QWidget* parent = nullptr);
  void SetPairs(QVector<PairGraph::Edge> pairs);

private:
  void ShowGraph(); ///< with the volumes as they are now called and coloured; those that went are left out
  void ShowPair(int edge);
  void Choose(int edge);
  void Follow();

  Workbench* bench_;
  QVector<PairGraph::Edge> pairs_;
  PairGraph* graph_;
  QTableWidget* table_;
};

} // namespace echorama
