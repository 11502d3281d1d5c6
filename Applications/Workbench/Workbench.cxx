// SPDX-License-Identifier: BSD-3-Clause
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <QPointer>
#include <vtkImageData.h>

namespace echorama {

Workbench::Workbench(Workspace& workspace, QObject* parent) : QObject(parent), workspace_(workspace)
{
  // Errors are not observed here: what VTK classes report comes through Messages.
  for (unsigned long event :
       {vtkUltrasoundAlignmentSession::VolumesChangedEvent, vtkUltrasoundAlignmentSession::PosesChangedEvent,
        vtkUltrasoundAlignmentSession::SelectionChangedEvent, vtkUltrasoundAlignmentSession::VoxelsChangedEvent,
        vtkUltrasoundAlignmentSession::HistoryChangedEvent})
    observers_.append(Session()->AddObserver(event, this, &Workbench::OnSessionEvent));
  // Either may go before the other.
  workspace_.say = [bench = QPointer<Workbench>(this)](const QString& text, bool isError) {
    if (bench)
      isError ? bench->Warn(text) : bench->Note(text);
  };
  workspace_.showErrorVectors = [bench = QPointer<Workbench>(this)](bool shown) {
    if (!bench)
      return;
    VolumeLook look = bench->Volume();
    look.errorVectors = shown;
    bench->SetVolume(look);
  };
}

Workbench::~Workbench()
{
  for (unsigned long tag : observers_)
    Session()->RemoveObserver(tag);
}

void Workbench::OnSessionEvent(vtkObject*, unsigned long event, void*)
{
  switch (event) {
  case vtkUltrasoundAlignmentSession::VolumesChangedEvent:
    emit VolumesChanged();
    break;
  case vtkUltrasoundAlignmentSession::PosesChangedEvent:
    emit PosesChanged();
    break;
  case vtkUltrasoundAlignmentSession::SelectionChangedEvent:
    emit SelectionChanged();
    break;
  case vtkUltrasoundAlignmentSession::VoxelsChangedEvent:
    emit VoxelsChanged();
    break;
  case vtkUltrasoundAlignmentSession::HistoryChangedEvent:
    emit HistoryChanged();
    break;
  default:
    break;
  }
}

QVector<int> Workbench::Volumes() const
{
  QVector<int> ids;
  for (int i = 0; i < Session()->GetNumberOfVolumes(); i++)
    ids.append(Session()->GetVolumeId(i));
  return ids;
}

QVector<int> Workbench::SelectedVolumes() const
{
  QVector<int> ids;
  for (int id : Volumes())
    if (Session()->IsSelected(id))
      ids.append(id);
  return ids;
}

int Workbench::ActiveVolume() const
{
  const QVector<int> selected = SelectedVolumes();
  return selected.isEmpty() ? 0 : selected.first();
}

QString Workbench::NameOf(int id) const
{
  return QString::fromStdString(Session()->GetName(id));
}

double Workbench::SmallestSpacing() const
{
  double smallest = std::numeric_limits<double>::infinity();
  for (int id : Volumes()) {
    const double* spacing = Session()->GetImage(id)->GetSpacing();
    smallest = std::min(smallest, *std::min_element(spacing, spacing + 3));
  }
  return std::isfinite(smallest) ? smallest : 1.0;
}

void Workbench::SetTool(Tool tool)
{
  if (tool == tool_)
    return;
  tool_ = tool;
  emit ToolChanged();
}

void Workbench::SetBrush(const BrushSettings& brush)
{
  brush_ = brush;
  emit BrushChanged();
}

void Workbench::SetSlices(const SliceLook& look)
{
  slices_ = look;
  emit LookChanged();
}

void Workbench::SetVolume(const VolumeLook& look)
{
  volume_ = look;
  emit LookChanged();
}

void Workbench::SetHand(const Handling& hand)
{
  hand_ = hand;
  emit HandChanged();
}

void Workbench::SetInteracting(bool on)
{
  if (on == interacting_)
    return;
  interacting_ = on;
  emit InteractingChanged(on);
}

void Workbench::Note(const QString& text)
{
  emit Said({Message::Note, text, {}});
}

void Workbench::Warn(const QString& text)
{
  emit Said({Message::Warning, text, {}});
}

void Workbench::Ask(const QString& text, const QVector<Message::Answer>& answers)
{
  emit Said({Message::Question, text, answers});
}

} // namespace echorama
