// SPDX-License-Identifier: BSD-3-Clause
#include "PairBox.h"
#include "Controls.h"
#include "GreyLevels.h"
#include "Workbench.h"
#include <algorithm>
#include <QHeaderView>
#include <QShortcut>
#include <QSignalBlocker>
#include <QTableWidget>
#include <QVBoxLayout>

namespace echorama {

PairBox::PairBox(Workbench* bench, QWidget* parent) : QGroupBox(tr("Pairs"), parent), bench_(bench)
{
  setObjectName("pairs");
  graph_ = new PairGraph(this);
  table_ = TableField(this, "pairTable",
                      tr("The pairs that were aligned, and the error that each predicts. Choosing one shows its volumes alone, "
                         "where they overlap; a second click, or Escape, brings all back."),
                      {tr("Pair"), tr("Answer"), tr("Error")});
  table_->setSelectionBehavior(QAbstractItemView::SelectRows);
  table_->setSelectionMode(QAbstractItemView::SingleSelection);
  table_->setMinimumHeight(130);
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  table_->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->addWidget(graph_);
  layout->addWidget(table_);
  const auto toggle = [this](int edge) { Choose(edge == graph_->Chosen() ? -1 : edge); };
  connect(graph_, &PairGraph::Clicked, this, toggle);
  // A press selects the row; a press on the row that was selected already lets go of it.
  connect(table_, &QTableWidget::itemSelectionChanged, this, [this] {
    if (table_->currentRow() >= 0 && table_->item(table_->currentRow(), 0)->isSelected())
      ShowPair(table_->currentRow());
  });
  connect(table_, &QTableWidget::itemPressed, this, [this, wasChosen = -1](const QTableWidgetItem* item) mutable {
    if (wasChosen == item->row() && graph_->Chosen() == item->row())
      Choose(-1);
    wasChosen = graph_->Chosen();
  });
  connect(new QShortcut(Qt::Key_Escape, table_, nullptr, nullptr, Qt::WidgetShortcut), &QShortcut::activated, this,
          [this] { bench_->BringBack(); });
  connect(bench, &Workbench::VolumesChanged, this, &PairBox::ShowGraph);
  connect(bench, &Workbench::OnlyChanged, this, &PairBox::Follow);
}

void PairBox::SetPairs(QVector<PairGraph::Edge> pairs)
{
  bench_->SetOnly({});
  pairs_ = std::move(pairs);
  ShowGraph();
}

void PairBox::ShowGraph()
{
  const auto* session = bench_->Session();
  QVector<PairGraph::Node> nodes;
  QVector<PairGraph::Edge> edges;
  for (const PairGraph::Edge& pair : pairs_)
    if (session->HasVolume(pair.a) && session->HasVolume(pair.b))
      edges.append(pair);
  for (int id : bench_->Volumes())
    if (std::any_of(edges.begin(), edges.end(), [id](const PairGraph::Edge& edge) { return edge.a == id || edge.b == id; }))
      nodes.append({id, bench_->NameOf(id), echorama::ColourOf(*bench_, id)});
  const QSignalBlocker quiet(table_);
  table_->setRowCount(0);
  for (const PairGraph::Edge& edge : edges) {
    const int row = table_->rowCount();
    InsertRow(table_, row,
              {tr("%1 \u2013 %2").arg(bench_->NameOf(edge.a), bench_->NameOf(edge.b)),
               edge.votedDown ? tr("%1, voted down").arg(edge.verdict) : edge.verdict,
               edge.verdict == "failed" ? QString() : tr("%1 mm").arg(edge.errorMm, 0, 'f', 2)},
              edge.help);
    table_->item(row, 1)->setForeground(PairGraph::ColourOf(edge.verdict));
  }
  graph_->SetGraph(std::move(nodes), std::move(edges));
  Follow();
}

void PairBox::ShowPair(int edge)
{
  const PairGraph::Edge& pair = graph_->Edges()[edge];
  bench_->SetOnly({pair.a, pair.b});
  emit bench_->PairAsked(pair.a, pair.b);
  bench_->Shared().show({Message::Note,
                         tr("%1 and %2 alone; Escape brings all back").arg(bench_->NameOf(pair.a), bench_->NameOf(pair.b)),
                         {},
                         objectName()});
}

void PairBox::Choose(int edge)
{
  if (edge < 0)
    bench_->SetOnly({});
  else
    ShowPair(edge);
}

// What is shown alone may be changed by others: Escape in a view.
void PairBox::Follow()
{
  const QVector<int>& only = bench_->Only();
  int chosen = -1;
  for (int i = 0; i < graph_->Edges().size(); ++i)
    if (only == QVector<int>{graph_->Edges()[i].a, graph_->Edges()[i].b})
      chosen = i;
  graph_->SetChosen(chosen);
  const QSignalBlocker quiet(table_);
  if (chosen < 0)
    table_->clearSelection();
  else
    table_->setCurrentCell(chosen, 0, QItemSelectionModel::ClearAndSelect | QItemSelectionModel::Rows);
}

} // namespace echorama
