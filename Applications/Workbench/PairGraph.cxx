// SPDX-License-Identifier: BSD-3-Clause
#include "PairGraph.h"
#include <cmath>
#include <QHelpEvent>
#include <QLineF>
#include <QMouseEvent>
#include <QPainter>
#include <QToolTip>

namespace echorama {

PairGraph::PairGraph(QWidget* parent) : QWidget(parent)
{
  setObjectName("pairGraph");
  setAccessibleName(tr("Graph of the pairs that were aligned; the list below it says the same"));
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

QColor PairGraph::ColourOf(const QString& verdict)
{
  return verdict == "aligned" ? QColor(120, 205, 110) : verdict == "ambiguous" ? QColor(240, 205, 90) : QColor(235, 110, 95);
}

void PairGraph::SetGraph(QVector<Node> nodes, QVector<Edge> edges)
{
  nodes_ = std::move(nodes);
  edges_ = std::move(edges);
  chosen_ = -1;
  update();
}

void PairGraph::SetChosen(int edge)
{
  chosen_ = edge;
  update();
}

// On an ellipse, the first one at the left.
QPointF PairGraph::PlaceOf(int id) const
{
  for (int i = 0; i < nodes_.size(); ++i)
    if (nodes_[i].id == id) {
      const double angle = 2.0 * M_PI * i / nodes_.size();
      return {0.5 * width() - (0.5 * width() - 34.0) * std::cos(angle),
              0.5 * height() - (0.5 * height() - 26.0) * std::sin(angle)};
    }
  return {0.5 * width(), 0.5 * height()};
}

// Not the very middle, where edges across the graph meet.
QPointF PairGraph::MiddleOf(int edge) const
{
  return QLineF(PlaceOf(edges_[edge].a), PlaceOf(edges_[edge].b)).pointAt(nodes_.size() > 3 ? 0.38 : 0.5);
}

int PairGraph::EdgeAt(const QPointF& at) const
{
  constexpr double reach = 9.0; // pixels
  int found = -1;
  double nearest = reach;
  for (int i = 0; i < edges_.size(); ++i) {
    const QPointF a = PlaceOf(edges_[i].a), way = PlaceOf(edges_[i].b) - a;
    const double length = QPointF::dotProduct(way, way);
    const double share = length > 0.0 ? std::fmin(std::fmax(QPointF::dotProduct(at - a, way) / length, 0.0), 1.0) : 0.0;
    // A label is easier to hit than a line.
    const double distance = std::fmin(QLineF(at, a + share * way).length(), 0.5 * QLineF(at, MiddleOf(i)).length());
    if (distance < nearest) {
      nearest = distance;
      found = i;
    }
  }
  return found;
}

void PairGraph::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  if (nodes_.isEmpty()) {
    painter.setPen(QColor(150, 150, 150));
    painter.drawText(rect().adjusted(8, 0, -8, 0), Qt::AlignCenter | Qt::TextWordWrap,
                     tr("After an alignment: which pairs of volumes were compared, and what each is worth."));
    return;
  }
  QFont small = painter.font();
  small.setPointSizeF(0.85 * small.pointSizeF());
  painter.setFont(small);
  for (int i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    QPen pen(ColourOf(edge.verdict), i == chosen_ ? 4.0 : 2.0, edge.votedDown || !edge.stands ? Qt::DashLine : Qt::SolidLine);
    painter.setPen(pen);
    painter.drawLine(PlaceOf(edge.a), PlaceOf(edge.b));
  }
  for (int i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    const QString label =
        edge.verdict == "failed" ? tr("failed") : tr("%1 mm").arg(edge.errorMm, 0, 'f', edge.errorMm < 10 ? 1 : 0);
    QRectF box = painter.fontMetrics().boundingRect(label);
    box.moveCenter(MiddleOf(i));
    painter.setPen(Qt::NoPen);
    painter.setBrush(QColor(40, 40, 40, 220));
    painter.drawRoundedRect(box.adjusted(-3, -1, 3, 1), 3, 3);
    painter.setPen(ColourOf(edge.verdict));
    painter.drawText(box, Qt::AlignCenter, label);
  }
  for (const Node& node : nodes_) {
    const QPointF at = PlaceOf(node.id);
    painter.setPen(QPen(QColor(20, 20, 20), 1.5));
    painter.setBrush(node.colour);
    painter.drawEllipse(at, 7.0, 7.0);
    painter.setPen(QColor(220, 220, 220));
    const QString name = painter.fontMetrics().elidedText(node.name, Qt::ElideMiddle, 90);
    QRectF box = painter.fontMetrics().boundingRect(name);
    box.moveCenter(at + QPointF(0.0, at.y() < 0.5 * height() - 1.0 ? -15.0 : 16.0));
    box.moveLeft(std::fmin(std::fmax(box.left(), 2.0), width() - box.width() - 2.0));
    painter.drawText(box, Qt::AlignCenter | Qt::TextDontClip, name);
  }
}

void PairGraph::mousePressEvent(QMouseEvent* event)
{
  const int edge = EdgeAt(event->localPos());
  if (event->button() == Qt::LeftButton && edge >= 0)
    emit Clicked(edge);
}

bool PairGraph::event(QEvent* event)
{
  if (event->type() == QEvent::ToolTip) {
    auto* help = static_cast<QHelpEvent*>(event);
    const int edge = EdgeAt(help->pos());
    if (edge >= 0)
      QToolTip::showText(help->globalPos(), edges_[edge].help, this);
    else
      QToolTip::hideText();
    return true;
  }
  return QWidget::event(event);
}

} // namespace echorama
