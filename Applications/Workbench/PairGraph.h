// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QColor>
#include <QPointF>
#include <QString>
#include <QVector>
#include <QWidget>

namespace echorama {

/// Volumes and the pairs of them that were aligned, drawn as a graph: nodes in the colours of the volumes, edges in that of the
/// verdict, dashed when the pair has no say in where the volumes are, with the predicted error. A click on an edge chooses it.
class PairGraph : public QWidget {
  Q_OBJECT

public:
  struct Node {
    int id = 0;
    QString name;
    QColor colour;
  };
  struct Edge {
    int a = 0, b = 0;      ///< ids of volumes
    QString verdict, help; ///< "aligned", "ambiguous", "failed"; all that is known, for people
    bool votedDown = false, stands = false;
    double errorMm = 0.0; ///< predicted
  };

  explicit PairGraph(QWidget* parent = nullptr);
  void SetGraph(QVector<Node> nodes, QVector<Edge> edges);
  const QVector<Node>& Nodes() const { return nodes_; }
  const QVector<Edge>& Edges() const { return edges_; }
  void SetChosen(int edge); ///< -1: none
  int Chosen() const { return chosen_; }
  /// Where an edge's label is: a click there means the edge.
  QPointF MiddleOf(int edge) const;
  static QColor ColourOf(const QString& verdict);
  QSize sizeHint() const override { return {200, 190}; }
  QSize minimumSizeHint() const override { return {120, 150}; }

signals:
  void Clicked(int edge);

protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  bool event(QEvent* event) override;

private:
  QPointF PlaceOf(int id) const;
  int EdgeAt(const QPointF& at) const; ///< -1: none

  QVector<Node> nodes_;
  QVector<Edge> edges_;
  int chosen_ = -1;
};

} // namespace echorama
