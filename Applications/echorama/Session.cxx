// SPDX-License-Identifier: BSD-3-Clause
// VTK classes report through vtkOutputWindow, as text that begins with the source file and line. One window that gathers
// takes its place, so that a user sees one sentence: the first error with a reason that was reported while a stage ran. Errors
// after it are complaints about it.
#include "Session.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/Utf8.h"
#include "Core/Base/VtkMessage.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <unistd.h>
#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>

namespace {

class GatheringWindow : public vtkOutputWindow {
public:
  static GatheringWindow* New();
  vtkTypeMacro(GatheringWindow, vtkOutputWindow);

  void DisplayText(const char*) override {}
  void DisplayDebugText(const char*) override {}
  void DisplayErrorText(const char* text) override { Gather(errors_, text); }
  void DisplayWarningText(const char* text) override { Gather(warnings_, text); }
  void DisplayGenericWarningText(const char* text) override { Gather(warnings_, text); }

  std::vector<std::string> TakeErrors() { return Take(errors_); }
  std::vector<std::string> TakeWarnings() { return Take(warnings_); }

private:
  // VTK classes may report from any thread.
  void Gather(std::vector<std::string>& list, const char* text)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    list.push_back(echorama::SentenceOfVtkMessage(text ? text : ""));
  }
  std::vector<std::string> Take(std::vector<std::string>& list)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(list, {});
  }

  std::mutex mutex_;
  std::vector<std::string> errors_, warnings_;
};
vtkStandardNewMacro(GatheringWindow);

GatheringWindow* Window()
{
  return static_cast<GatheringWindow*>(vtkOutputWindow::GetInstance());
}

volatile std::sig_atomic_t interrupted = 0;

extern "C" void Interrupt(int)
{
  interrupted = 1;
}

void InstallSignalHandlers()
{
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler == SIG_IGN) // nohup, or a background job
      continue;
    action.sa_handler = Interrupt;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  // A full quota and a closed pipe shall be failed writes, not sudden deaths that leave temporary files.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

// Whole numbers as such: a number of bytes that was computed is 10167620, not 10167620.0.
void MakeWhole(nlohmann::ordered_json& value)
{
  if (value.is_structured())
    for (nlohmann::ordered_json& each : value)
      MakeWhole(each);
  else if (value.is_number_float() && std::fabs(value.get<double>()) < 9e15 &&
           value.get<double>() == std::floor(value.get<double>()))
    value = static_cast<std::int64_t>(value.get<double>());
}

// Bytes of files that are not UTF-8 are replaced. Control characters are escaped, also those that JSON would allow.
std::string TextOf(nlohmann::ordered_json object)
{
  MakeWhole(object);
  const std::string text = echorama::JsonPlace::Print(object);
  std::string safe;
  safe.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\xc2' && static_cast<unsigned char>(text[i + 1]) < 0xa0) // U+0080 to U+009F, of two bytes
      ++i;
    else if (text[i] != '\x7f') {
      safe += text[i];
      continue;
    }
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(text[i])));
    safe += escaped;
  }
  return safe;
}

} // namespace

namespace echorama {

Session::Session(const std::string& command, bool json)
  : command_(command), json_(json), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now())
{
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  vtkNew<GatheringWindow> window;
  vtkOutputWindow::SetInstance(window);
  InstallSignalHandlers();
}

Session::~Session()
{
  ClearProgress();
  vtkOutputWindow::SetInstance(nullptr);
}

bool Session::Interrupted()
{
  return interrupted != 0;
}

double Session::Seconds() const
{
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Session::Say(const std::string& line)
{
  text_ += Printable(line) + "\n";
}

void Session::Note(const std::string& text)
{
  ClearProgress();
  notes_.push_back(Line(text));
  std::cerr << "echorama: note: " << Line(text) << std::endl;
}

std::string Session::Line(std::string message) const
{
  for (const auto& [path, shown] : shownAs_)
    for (std::size_t at = message.find(path); at != std::string::npos; at = message.find(path, at + shown.size()))
      message.replace(at, path.size(), shown);
  std::replace(message.begin(), message.end(), '\n', ' ');
  return Printable(message);
}

void Session::Update(vtkAlgorithm* algorithm, const std::string& stage, const std::string& what)
{
  Watch(algorithm, stage, what, [algorithm] { algorithm->Update(); });
}

void Session::Watch(vtkAlgorithm* algorithm, const std::string& stage, const std::string& what, const std::function<void()>& body)
{
  const std::string label = what.empty() ? stage : stage + " " + what;
  stageStart_ = Clock::now();
  lastShown_ = {};
  const auto onProgress = [this, algorithm, &label] {
    if (Interrupted())
      algorithm->SetAbortExecute(1);
    ShowProgress(label, algorithm->GetProgress());
  };
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(const_cast<void*>(static_cast<const void*>(&onProgress)));
  command->SetCallback(
      [](vtkObject*, unsigned long, void* function, void*) { (*static_cast<decltype(onProgress)*>(function))(); });
  const unsigned long tag = algorithm ? algorithm->AddObserver(vtkCommand::ProgressEvent, command) : 0;
  const auto end = [&] {
    if (algorithm)
      algorithm->RemoveObserver(tag);
    ClearProgress();
    const double before = stages_.value(stage, 0.0);
    stages_[stage] = before + std::chrono::duration<double>(Clock::now() - stageStart_).count();
  };
  try {
    if (!Interrupted())
      body();
  } catch (...) {
    end();
    throw;
  }
  end();
  if (Interrupted())
    throw Error(Error::Kind::Cancelled, "stopped on request; nothing was written");
  ThrowReported();
}

void Session::Work(const std::string& stage, const std::string& what, const std::function<void(const Progress&)>& body)
{
  const std::string label = what.empty() ? stage : stage + " " + what;
  const Progress progress([this, &label](double fraction) {
    ShowProgress(label, fraction);
    return !Interrupted();
  });
  Watch(nullptr, stage, what, [&] {
    try {
      body(progress);
    } catch (const Error& error) {
      if (error.GetKind() != Error::Kind::Cancelled)
        throw; // a stop is reported by Watch
    }
  });
}

std::string Session::TakeReportedError()
{
  return ReasonAmong(Window()->TakeErrors());
}

void Session::ThrowReported()
{
  for (const std::string& warning : Window()->TakeWarnings())
    Note(warning);
  const std::string error = TakeReportedError();
  if (!error.empty())
    throw Error(Error::Kind::BadInput, error);
}

void Session::ShowProgress(const std::string& label, double fraction)
{
  const auto now = Clock::now();
  if (!terminal_ || now - lastShown_ < std::chrono::milliseconds(100))
    return;
  lastShown_ = now;
  barShown_ = true;
  fraction = std::clamp(fraction, 0.0, 1.0);
  constexpr int width = 30;
  const int filled = static_cast<int>(std::lround(fraction * width));
  std::string line = "\r" + label + " [" + std::string(filled, '#') + std::string(width - filled, '.') + "] " +
                     std::to_string(static_cast<int>(fraction * 100.0)) + "%";
  const double seconds = std::chrono::duration<double>(now - stageStart_).count();
  if (fraction > 0.02 && seconds > 1.0)
    line += ", " + Fixed(seconds * (1.0 - fraction) / fraction, 0) + " s left";
  std::cerr << line << "\033[K" << std::flush;
}

void Session::ClearProgress()
{
  if (barShown_)
    std::cerr << "\r\033[K" << std::flush;
  barShown_ = false;
}

int Session::Finish()
{
  if (json_) {
    nlohmann::ordered_json object{{"command", command_}};
    object.update(result);
    object["seconds"] = Seconds();
    object["stages"] = stages_;
    object["notes"] = notes_;
    std::cout << TextOf(object) << std::endl;
  } else {
    std::cout << text_ << std::flush;
  }
  return std::cout ? status : Fail("standard output: cannot be written", 1);
}

int Session::Fail(const std::string& message, int exitStatus)
{
  ClearProgress();
  const std::string line = Line(message);
  std::cerr << "echorama: " << line << std::endl;
  if (json_ && std::cout) {
    const nlohmann::ordered_json object{{"command", command_}, {"error", line}, {"seconds", Seconds()}, {"notes", notes_}};
    std::cout << TextOf(object) << std::endl;
  }
  return exitStatus;
}

std::string Fixed(double value, int digits)
{
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

} // namespace echorama
