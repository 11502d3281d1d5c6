// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QTimer>
#include <QWidget>
#include <string>
#include <vector>

class QListWidget;
class QPushButton;

namespace echorama {

class Workbench;

/// Undo and redo, and the backups: one after every edit, also of earlier days; a click brings one back (which can be undone).
class HistoryPanel : public QWidget {
  Q_OBJECT

public:
  explicit HistoryPanel(Workbench* bench, QWidget* parent = nullptr);

protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

private:
  struct Line {
    std::string path, label;
    double time;
    bool operator==(const Line& other) const { return path == other.path && label == other.label && time == other.time; }
  };
  void ShowHistory();
  void ShowButtons();
  void ListBackups();
  void ShowBackups(const std::vector<Line>& lines);
  void Restore(int row);

  Workbench* bench_;
  QPushButton *undo_, *redo_;
  QListWidget* backups_;
  QTimer list_;
  bool isListing_ = false;
  bool isOld_ = true; ///< the list, because nobody saw it
  std::vector<Line> shown_;
};

} // namespace echorama
