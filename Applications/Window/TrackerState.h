// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <QComboBox>
#include <QString>
#include <string>
#include <vtkUltrasoundTrackerSource.h>

namespace echorama {

/// Lists the tools of a tracker when their number has changed; \returns the one that is chosen, or nothing. \param none stands
/// above them, and is no tool; "": there is no such entry
inline std::string ChosenTool(QComboBox* tools, vtkUltrasoundTrackerSource* tracker, const QString& none = {})
{
  const int above = none.isEmpty() ? 0 : 1;
  if (tools->count() != above + tracker->GetNumberOfTools()) {
    const QString chosen = tools->currentText();
    tools->clear();
    if (above > 0)
      tools->addItem(none);
    for (int i = 0; i < tracker->GetNumberOfTools(); ++i)
      tools->addItem(QString::fromStdString(tracker->GetToolName(i)));
    tools->setCurrentIndex(std::max(0, tools->findText(chosen)));
  }
  return tools->currentIndex() < above ? std::string() : tools->currentText().toStdString();
}

/// Its state, with the reason where it has one.
inline QString StateOf(vtkUltrasoundTrackerSource* tracker)
{
  const QString state = QString::fromStdString(tracker->GetState()), message = QString::fromStdString(tracker->GetMessage());
  return message.isEmpty() ? state : state + ": " + message;
}

} // namespace echorama
