// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <QMainWindow>
#include <QStringList>

class QBoxLayout;
class QLabel;
class QMenu;
class QSplitter;

namespace echorama {

class BodyView;
class CineBar;
class ImageView;
class JobBar;
class MessageBar;
class NeedleTool;
class OutputPanel;
class ParameterPanel;
class Scan;
class TaskPanel;
struct PlanePicture;

/// The window of the simulator: it makes the parts and puts them together. What parts share is the Scan.
class SimulatorWindow : public QMainWindow {
  Q_OBJECT

public:
  explicit SimulatorWindow(QWidget* parent = nullptr);
  ~SimulatorWindow() override;

  Scan* TheScan() const { return scan_; }
  NeedleTool* TheNeedle() const { return needle_; }
  ImageView* Image() const { return image_; }
  BodyView* Body() const { return body_; }

  /// Reads volumes in the background; \a skin: a mesh, or empty for the outline of the first; \a up: from where it is scanned,
  /// zero: as the volume says, else from the front.
  void Open(const QStringList& files, const QString& skin = {}, const Eigen::Vector3d& up = Eigen::Vector3d::Zero());
  /// Image and pose into the folder for pictures; says where. \returns the path of the PNG, empty when it could not be written.
  QString TakePicture();

protected:
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  void closeEvent(QCloseEvent* event) override;

private:
  void MakeMenus();
  void MakeProbeMenu(QMenu* menu);
  void MakeImageMenu(QMenu* menu);
  void AddPanel(QWidget* panel, const QString& title);
  bool AsksBeforeClosing();
  void ShowSolution(const PlanePicture* picture);
  void ShowFrame();
  void ShowState();
  /// What is to the right in the image, on the probe: with left and right exchanged the hand goes the other way.
  double Across(double toTheRight) const;
  void Turn(double notches, Qt::KeyboardModifiers keys);
  void ChangeDepth(double byMm);
  void ChangeGain(double byDb);

  Scan* scan_;
  NeedleTool* needle_;
  MessageBar* messages_;
  JobBar* jobs_;
  BodyView* body_;
  ImageView *image_, *solution_;
  CineBar* cine_;
  QSplitter* views_;
  QBoxLayout* images_;
  OutputPanel* outputs_ = nullptr;
  TaskPanel* tasks_ = nullptr;
  QLabel* readout_;
  QMenu* viewMenu_ = nullptr;
  QWidget* lastPanel_ = nullptr;
};

} // namespace echorama
