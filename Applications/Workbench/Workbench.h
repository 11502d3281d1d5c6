// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Settings.h"
#include "Workspace.h"
#include <functional>
#include <QObject>
#include <QString>
#include <QVector>

namespace echorama {

/// A sentence for the user, with what can be done about it.
struct Message {
  enum Kind { Note, Warning, Question };
  Kind kind = Note;
  QString text;
  struct Answer {
    QString label;
    std::function<void()> action;
  };
  QVector<Answer> answers; ///< one button each; a message without is closed by its cross, a note by itself
};

/// What the panels, views and actions of one window share: the session, the tool in hand, and how things are shown. It turns the
/// session's VTK events into Qt signals. It knows no widget.
class Workbench : public QObject {
  Q_OBJECT

public:
  /// What is said in \a workspace goes to the message bar, and its error vectors to the 3D view.
  explicit Workbench(Workspace& workspace, QObject* parent = nullptr);
  ~Workbench() override;

  Workspace& Shared() const { return workspace_; }
  vtkUltrasoundAlignmentSession* Session() const { return session_; }

  /// The volume that single numbers and the brush belong to: the first that is selected; 0: none is.
  int ActiveVolume() const;
  QVector<int> Volumes() const;
  QVector<int> SelectedVolumes() const;
  QString NameOf(int id) const;
  /// Of all volumes, mm: one step through slices. 1 when there are none.
  double SmallestSpacing() const;

  Tool CurrentTool() const { return tool_; }
  void SetTool(Tool tool);
  const BrushSettings& Brush() const { return brush_; }
  void SetBrush(const BrushSettings& brush);
  const SliceLook& Slices() const { return slices_; }
  void SetSlices(const SliceLook& look);
  const VolumeLook& Volume() const { return volume_; }
  void SetVolume(const VolumeLook& look);
  const Handling& Hand() const { return hand_; }
  void SetHand(const Handling& hand);

  /// While something is dragged or painted: views draw coarsely where they must to keep up, and those that are only watching
  /// redraw less often.
  bool Interacting() const { return interacting_; }
  void SetInteracting(bool on);

  ///@{ To the message bar of the window.
  void Note(const QString& text);
  void Warn(const QString& text);
  void Ask(const QString& text, const QVector<Message::Answer>& answers);
  ///@}

signals:
  void VolumesChanged();
  void PosesChanged();
  void SelectionChanged();
  void VoxelsChanged();
  void HistoryChanged();

  void ToolChanged();
  void BrushChanged();
  void LookChanged(); ///< of the slices or the 3D view
  void HandChanged();
  void InteractingChanged(bool on);

  void Said(const Message& message);

private:
  void OnSessionEvent(vtkObject* session, unsigned long event, void* data);

  Workspace& workspace_;
  vtkSmartPointer<vtkUltrasoundAlignmentSession> session_ = workspace_.session;
  QVector<unsigned long> observers_;
  Tool tool_ = Tool::Align;
  BrushSettings brush_;
  SliceLook slices_;
  VolumeLook volume_;
  Handling hand_;
  bool interacting_ = false;
};

} // namespace echorama
