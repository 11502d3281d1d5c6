// SPDX-License-Identifier: BSD-3-Clause
#include "Messages.h"
#include "Core/Base/Error.h"
#include "Core/Base/VtkMessage.h"
#include <vector>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>

namespace {

struct Gathered {
  int users = 0;
  std::vector<std::string> errors, warnings;
};
thread_local Gathered gathered;

class ReportWindow : public vtkOutputWindow {
public:
  static ReportWindow* New();
  vtkTypeMacro(ReportWindow, vtkOutputWindow);

  void DisplayText(const char*) override {}
  void DisplayDebugText(const char*) override {}
  void DisplayErrorText(const char* text) override { Report(text, true); }
  void DisplayWarningText(const char* text) override { Report(text, false); }
  void DisplayGenericWarningText(const char* text) override { Report(text, false); }

  std::function<void(const std::string&, bool)> show;

private:
  void Report(const char* text, bool isError)
  {
    const std::string message = echorama::SentenceOfVtkMessage(text ? text : "");
    if (gathered.users > 0) {
      (isError ? gathered.errors : gathered.warnings).push_back(message);
    } else if (show) {
      show(message, isError);
    }
  }
};
vtkStandardNewMacro(ReportWindow);

} // namespace

namespace echorama {

void Messages::Install(std::function<void(const std::string&, bool)> show)
{
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  vtkNew<ReportWindow> window;
  window->show = std::move(show);
  vtkOutputWindow::SetInstance(window);
}

Messages::OfThread::OfThread() : begin_(gathered.errors.size()), beginOfWarnings_(gathered.warnings.size())
{
  ++gathered.users;
}

Messages::OfThread::~OfThread()
{
  --gathered.users;
  gathered.errors.resize(begin_);
  gathered.warnings.resize(beginOfWarnings_);
}

std::vector<std::string> Messages::OfThread::Warnings() const
{
  return {gathered.warnings.begin() + static_cast<std::ptrdiff_t>(beginOfWarnings_), gathered.warnings.end()};
}

std::string Messages::OfThread::Error() const
{
  return ReasonAmong({gathered.errors.begin() + static_cast<std::ptrdiff_t>(begin_), gathered.errors.end()});
}

void Messages::OfThread::ThrowErrors() const
{
  const std::string error = Error();
  if (!error.empty())
    throw echorama::Error(echorama::Error::Kind::BadInput, error);
}

} // namespace echorama
