// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/Progress.h"
#include "ProgramExport.h"
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

class vtkAlgorithm;

namespace echorama {

/// One run of a subcommand: where its results, messages, times and progress go, and how it learns that it should stop.
///
/// Results are collected and printed once, at the end and only on success: as text, or (json) as one JSON object. Messages
/// go to standard error. What VTK classes report as errors and warnings is gathered and becomes a thrown Error and notes.
/// SIGINT, SIGTERM and SIGHUP ask the running stage to stop; it ends with Error(Cancelled), and destructors clean up.
/// There is one session per process.
class ECHORAMA_PROGRAM_EXPORT Session {
public:
  Session(const std::string& command, bool json);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// The results for --json. Keys "command", "seconds", "stages" and "notes" belong to the session.
  nlohmann::ordered_json result = nlohmann::ordered_json::object();

  /// The exit status when all is printed: 0, or Doubtful for a result that must be checked.
  static constexpr int Doubtful = 3;
  int status = 0;

  /// A line of results for people.
  void Say(const std::string& line);

  /// Something the user should know although all went well.
  void Note(const std::string& text);

  /// The first error that VTK classes have reported since the last stage, or nothing; it is then forgotten.
  static std::string TakeReportedError();

  /// From now on messages say \a shown where they would say \a path.
  void ShowAs(const std::string& path, const std::string& shown) { shownAs_.emplace_back(path, shown); }

  /// Where to write \a path for now, one of \a files; messages go on calling it \a path.
  std::string Stage(FileReplacement& files, const std::string& path)
  {
    const std::string staged = files.Stage(path);
    ShowAs(staged, path);
    return staged;
  }

  /// Updates \a algorithm under a progress bar. \a stage is the verb for the bar and the key of its time in "stages"; \a what
  /// names the file or thing. Throws Error with what the pipeline reported, Error(Cancelled) when the user stopped it.
  void Update(vtkAlgorithm* algorithm, const std::string& stage, const std::string& what = {});

  /// As Update, for work that does not happen in Update(): \a body runs under a progress bar with the algorithm's events.
  void Watch(vtkAlgorithm* algorithm, const std::string& stage, const std::string& what, const std::function<void()>& body);

  /// As Watch, for work without an algorithm.
  void Time(const std::string& stage, const std::function<void()>& body) { Watch(nullptr, stage, {}, body); }

  /// As Time, for a kernel that tells how far it is.
  void Work(const std::string& stage, const std::string& what, const std::function<void(const Progress&)>& body);

  /// Whether the user asked to stop.
  static bool Interrupted();

  /// Prints the results. Returns the exit status.
  int Finish();

  /// Prints one line of error, and with json an object with "error". Returns \a exitStatus.
  int Fail(const std::string& message, int exitStatus);

private:
  std::string Line(std::string message) const;
  void ThrowReported();
  void ShowProgress(const std::string& label, double fraction);
  void ClearProgress();
  double Seconds() const;

  using Clock = std::chrono::steady_clock;

  std::string command_;
  bool json_;
  bool terminal_;
  std::string text_;
  std::vector<std::pair<std::string, std::string>> shownAs_;
  nlohmann::ordered_json stages_ = nlohmann::ordered_json::object();
  nlohmann::ordered_json notes_ = nlohmann::ordered_json::array();
  Clock::time_point start_, stageStart_, lastShown_;
  bool barShown_ = false;
};

/// "1.23", with \a digits after the point.
ECHORAMA_PROGRAM_EXPORT std::string Fixed(double value, int digits);

} // namespace echorama
