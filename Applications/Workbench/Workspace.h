// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Message.h"
#include <functional>
#include <QString>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAlignmentSession.h>

class QObject;
class vtkMatrix4x4;

namespace echorama {

class Job;
class JobBar;

/// What the panels of a window share. The window owns it and outlives them.
struct Workspace {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> session = vtkSmartPointer<vtkUltrasoundAlignmentSession>::New();
  JobBar* jobs = nullptr;
  /// A job that the job bar shows; what keeps it from being done is said, with \a answers, of \a topic or the owner's name. See
  /// Job::Start.
  Job* Run(QObject* owner, const QString& label, std::function<void(const Progress&)> work, std::function<void()> done,
           const Message::Answers& answers = {}, const QString& topic = {});
  /// For what a job found: now, or as soon as nothing is dragged or painted, which it would become a part of.
  void BetweenEdits(QObject* owner, const std::function<void()>& edit) const;
  std::function<void(const Message& message)> show = [](const Message&) {}; ///< in the window's message bar
  void say(const QString& text, bool isError) const { show({isError ? Message::Warning : Message::Note, text, {}}); }
  std::function<bool(const QString& what)> mayHelp = [](const QString&) { return true; }; ///< else it has said why not
  std::function<void(vtkMatrix4x4* toolToWorld, bool grasping)> moveByTool = [](vtkMatrix4x4*, bool) {}; ///< alignment widget
};

} // namespace echorama
