// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Message.h"
#include "Settings.h"
#include "Workspace.h"
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <QObject>
#include <QString>
#include <QVector>
#include <vtkSmartPointer.h>

class vtkImageData;

namespace echorama {

class Flicker;
class MeasureTool;

/// What the panels, views and actions of one window share: the session, the tool in hand, and how things are shown. It turns the
/// session's VTK events into Qt signals. It knows no widget.
class Workbench : public QObject {
  Q_OBJECT

public:
  /// What is said in \a workspace goes to the message bar.
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
  ///@{ How things are shown and handled; whoever changes a part tells the others.
  const Settings& Shown() const { return settings_; }
  void SetShown(const Settings& settings);
  const BrushSettings& Brush() const { return std::get<BrushSettings>(settings_); }
  const SliceLook& Slices() const { return std::get<SliceLook>(settings_); }
  const VolumeLook& Volume() const { return std::get<VolumeLook>(settings_); }
  const Handling& Hand() const { return std::get<Handling>(settings_); }
  template <class Part>
  void Set(const Part& part)
  {
    std::get<Part>(settings_) = part;
    Tell(part);
  }
  /// One field of one of them.
  template <class Part, class Value, class Given>
  void Set(Value Part::*field, const Given& value)
  {
    std::get<Part>(settings_).*field = static_cast<Value>(value);
    Tell(std::get<Part>(settings_));
  }
  /// What a control calls with the new value of a field.
  template <class Part, class Value>
  auto Setter(Value Part::*field)
  {
    return [this, field](const auto& value) { Set(field, value); };
  }
  ///@}

  /// While something is dragged or painted: views draw coarsely where they must to keep up, and those that are only watching
  /// redraw less often.
  bool Interacting() const { return interacting_; }
  void SetInteracting(bool on);

  ///@{ What the mouse points at, world: shown in all views but the one that it is in.
  void SetPointer(const std::optional<Eigen::Vector3d>& place, const QObject* in);
  const std::optional<Eigen::Vector3d>& Pointer() const { return pointer_; }
  const QObject* PointerIn() const { return pointerIn_; }
  ///@}

  ///@{ To look at some volumes alone, without an edit; none: all. Slices may show others for a moment, while they flicker.
  void SetOnly(const QVector<int>& ids);
  void SetOnlyInSlices(const QVector<int>& ids);
  const QVector<int>& Only() const { return only_; }
  const QVector<int>& OnlyInSlices() const { return onlyInSlices_; }
  /// What Escape does when nothing is dragged: ends flickering, then brings all volumes back. False: there was neither.
  bool BringBack();
  ///@}
  /// A map of shifts that slices lay over their pictures; see vtkUltrasoundSliceView::SetShifts.
  struct ShiftMap {
    vtkSmartPointer<vtkImageData> map; ///< nullptr: none
    double mostMm = 1.0;
    bool isStale = false;
  };
  void SetShifts(const ShiftMap& shifts);
  const ShiftMap& Shifts() const { return shifts_; }
  MeasureTool* Measuring() const { return measuring_; }
  Flicker* Flickering() const { return flicker_; }

  ///@{ An attempt that is scored: nothing that leads to the solution is shown, and help is refused, or counted.
  void BeginAttempt(bool isHelpAllowed);
  void EndAttempt();
  /// Whether \a what, which places volumes or tells where they belong, may be done: no attempt is scored, or it may and is
  /// counted. Else it has said why not.
  bool MayHelp(const QString& what);
  bool IsScored() const { return isScored_; }
  int HelpTaken() const { return helpTaken_; } ///< in this attempt or the last one
  ///@}

  ///@{ To the message bar of the window. What is said takes the place of what was said before of the same topic.
  void Note(const QString& text, const QString& topic = {});
  /// A text without answers says itself what to do.
  void Warn(const QString& text, const Message::Answers& answers = {}, const QString& topic = {});
  void Ask(const QString& text, const Message::Answers& answers, const QString& topic = {});
  /// What was said of it is of the past.
  void Forget(const QString& topic) { emit Said({Message::Note, {}, {}, topic}); }
  /// Does something with the session; when that fails, warns with the reason and \a answers. What was said of the topic goes.
  bool Try(const QString& topic, const std::function<bool()>& act, const Message::Answers& answers);
  ///@}

signals:
  void VolumesChanged();
  void PosesChanged();
  void SelectionChanged();
  void VoxelsChanged();
  void HistoryChanged();
  void MeasurementsChanged();

  void ToolChanged();
  void BrushChanged();
  void LookChanged(); ///< of the slices or the 3D view
  void HandChanged();
  void InteractingChanged(bool on);
  void ScoredChanged();
  void PointerChanged();
  void ShiftsChanged();
  void OnlyChanged();           ///< in slices, and perhaps in 3D
  void PairAsked(int a, int b); ///< somebody wants to see where these overlap

  void Said(const Message& message);

private:
  void Tell(const BrushSettings&) { emit BrushChanged(); }
  void Tell(const SliceLook&) { emit LookChanged(); }
  void Tell(const VolumeLook&) { emit LookChanged(); }
  void Tell(const Handling&) { emit HandChanged(); }
  void OnSessionEvent(vtkObject* session, unsigned long event, void* data);

  Workspace& workspace_;
  vtkSmartPointer<vtkUltrasoundAlignmentSession> session_ = workspace_.session;
  QVector<unsigned long> observers_;
  Tool tool_ = Tool::Align;
  Settings settings_;
  bool interacting_ = false, isScored_ = false, isHelpAllowed_ = false;
  int helpTaken_ = 0;
  std::optional<Eigen::Vector3d> pointer_;
  const QObject* pointerIn_ = nullptr;
  QVector<int> only_, onlyInSlices_;
  ShiftMap shifts_;
  MeasureTool* measuring_;
  Flicker* flicker_;
};

} // namespace echorama
