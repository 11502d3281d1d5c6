// SPDX-License-Identifier: BSD-3-Clause
#include "Messages.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <vector>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>

namespace {

struct Gathered {
  int users = 0;
  std::vector<std::string> errors;
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
  // "ERROR: In FILE, line N\nvtkClass (0x1234): message\n\n" becomes "message", on one line.
  static std::string Sentence(std::string text)
  {
    if (text.find(": In ") < text.find('\n') && text.find('\n') != std::string::npos)
      text.erase(0, text.find('\n') + 1);
    const std::size_t address = text.find(" (0x"), end = text.find("): ");
    if (address != std::string::npos && end != std::string::npos && address < end && text.find(' ') == address)
      text.erase(0, end + 3);
    std::replace(text.begin(), text.end(), '\n', ' ');
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }

  void Report(const char* text, bool isError)
  {
    const std::string message = Sentence(text ? text : "");
    if (gathered.users > 0) {
      if (isError)
        gathered.errors.push_back(message);
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

Messages::OfThread::OfThread() : begin_(gathered.errors.size())
{
  ++gathered.users;
}

Messages::OfThread::~OfThread()
{
  --gathered.users;
  gathered.errors.resize(begin_);
}

std::string Messages::OfThread::Error() const
{
  // The executive only tells that an algorithm failed, sometimes before the class that it ran tells why.
  for (std::size_t i = begin_; i < gathered.errors.size(); i++)
    if (gathered.errors[i].find("returned failure for request") == std::string::npos)
      return gathered.errors[i];
  return begin_ < gathered.errors.size() ? gathered.errors[begin_] : std::string();
}

void Messages::OfThread::ThrowErrors() const
{
  const std::string error = Error();
  if (!error.empty())
    throw echorama::Error(echorama::Error::Kind::BadInput, error);
}

} // namespace echorama
