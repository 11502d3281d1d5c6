// SPDX-License-Identifier: BSD-3-Clause
#include "Workbench.h"
#include "Flicker.h"
#include "MeasureTool.h"
#include "Messages.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <QPointer>
#include <vtkImageData.h>

namespace echorama {

namespace {

constexpr std::pair<unsigned long, void (Workbench::*)()> Signals[] = {
    {vtkUltrasoundAlignmentSession::VolumesChangedEvent, &Workbench::VolumesChanged},
    {vtkUltrasoundAlignmentSession::PosesChangedEvent, &Workbench::PosesChanged},
    {vtkUltrasoundAlignmentSession::SelectionChangedEvent, &Workbench::SelectionChanged},
    {vtkUltrasoundAlignmentSession::VoxelsChangedEvent, &Workbench::VoxelsChanged},
    {vtkUltrasoundAlignmentSession::HistoryChangedEvent, &Workbench::HistoryChanged},
    {vtkUltrasoundAlignmentSession::MeasurementsChangedEvent, &Workbench::MeasurementsChanged}};

} // namespace

Workbench::Workbench(Workspace& workspace, QObject* parent)
  : QObject(parent), workspace_(workspace), measuring_(new MeasureTool(this)), flicker_(new Flicker(this))
{
  // Errors are not observed here: what VTK classes report comes through Messages.
  for (const auto& [event, changed] : Signals)
    observers_.append(Session()->AddObserver(event, this, &Workbench::OnSessionEvent));
  connect(this, &Workbench::VolumesChanged, this, [this] { // volumes that are looked at alone may go
    const bool areThere = std::all_of(only_.begin(), only_.end(), [this](int id) { return session_->HasVolume(id); });
    if (!areThere)
      SetOnly({});
  });
  // Either may go before the other.
  workspace_.mayHelp = [bench = QPointer<Workbench>(this)](const QString& what) { return !bench || bench->MayHelp(what); };
  workspace_.show = [bench = QPointer<Workbench>(this)](const Message& message) {
    if (bench)
      emit bench->Said(message);
  };
}

Workbench::~Workbench()
{
  for (unsigned long tag : observers_)
    Session()->RemoveObserver(tag);
}

void Workbench::OnSessionEvent(vtkObject*, unsigned long event, void*)
{
  for (const auto& [of, changed] : Signals)
    if (of == event)
      emit(this->*changed)();
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

void Workbench::SetShown(const Settings& settings)
{
  std::apply([this](const auto&... parts) { (Set(parts), ...); }, settings);
}

void Workbench::BeginAttempt(bool isHelpAllowed)
{
  isScored_ = true;
  isHelpAllowed_ = isHelpAllowed;
  helpTaken_ = 0;
  emit ScoredChanged();
}

void Workbench::EndAttempt()
{
  isScored_ = false;
  Forget("trainingPanel"); // what was refused during it
  emit ScoredChanged();
}

bool Workbench::MayHelp(const QString& what)
{
  if (isScored_ && !isHelpAllowed_)
    Warn(tr("%1: not during an attempt; give it up first, or allow it before the next one").arg(what), {}, "trainingPanel");
  else if (isScored_)
    helpTaken_++;
  return !isScored_ || isHelpAllowed_;
}

void Workbench::SetInteracting(bool on)
{
  if (on == interacting_)
    return;
  interacting_ = on;
  emit InteractingChanged(on);
}

void Workbench::SetPointer(const std::optional<Eigen::Vector3d>& place, const QObject* in)
{
  if (place == pointer_ && in == pointerIn_)
    return;
  pointer_ = place;
  pointerIn_ = in;
  emit PointerChanged();
}

void Workbench::SetOnly(const QVector<int>& ids)
{
  flicker_->Stop();
  if (ids == only_)
    return;
  only_ = onlyInSlices_ = ids;
  emit OnlyChanged();
}

void Workbench::SetOnlyInSlices(const QVector<int>& ids)
{
  if (ids == onlyInSlices_)
    return;
  onlyInSlices_ = ids;
  emit OnlyChanged();
}

void Workbench::SetShifts(const ShiftMap& shifts)
{
  if (shifts.map == shifts_.map && shifts.mostMm == shifts_.mostMm && shifts.isStale == shifts_.isStale)
    return;
  shifts_ = shifts;
  emit ShiftsChanged();
}

bool Workbench::BringBack()
{
  const bool was = flicker_->IsOn() || !only_.isEmpty();
  if (flicker_->IsOn())
    flicker_->Stop();
  else
    SetOnly({});
  return was;
}

void Workbench::Note(const QString& text, const QString& topic)
{
  emit Said({Message::Note, text, {}, topic});
}

void Workbench::Warn(const QString& text, const Message::Answers& answers, const QString& topic)
{
  emit Said({Message::Warning, text, answers, topic});
}

void Workbench::Ask(const QString& text, const Message::Answers& answers, const QString& topic)
{
  emit Said({Message::Question, text, answers, topic});
}

bool Workbench::Try(const QString& topic, const std::function<bool()>& act, const Message::Answers& answers)
{
  Forget(topic);
  const Messages::OfThread messages;
  const bool isDone = act();
  for (const std::string& warning : messages.Warnings())
    Note(QString::fromUtf8(warning.c_str()));
  if (const std::string error = messages.Error(); !error.empty())
    Warn(QString::fromUtf8(error.c_str()), answers, topic);
  return isDone;
}

} // namespace echorama
