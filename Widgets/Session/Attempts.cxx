// SPDX-License-Identifier: BSD-3-Clause
// The history of attempts. Lines are added in place, under a lock and by one write: a history is never copied, so it cannot be
// lost by a failed copy, but for one of fewer columns, as older versions wrote it, which a whole copy replaces at once. The
// project is the last column and always quoted: so the end of a line that was cut off cannot be taken for the end of a line.
#include "Core/Base/CsvLine.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "LiveScore.h"
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace echorama {
namespace {

constexpr std::string_view Header =
    "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,help,out_of_plane_s,project";
constexpr std::string_view OldHeader = "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,project";
constexpr std::size_t Columns = 11, OldColumns = 9;
constexpr std::string_view Mark = "\xef\xbb\xbf"; // some programs put it before UTF-8

std::string Quoted(const std::string& text)
{
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"')
      quoted += c;
    quoted += c;
  }
  return quoted + '"';
}

// As it is when nothing in it could be taken for part of the table.
std::string Cell(const std::string& text)
{
  const bool plain =
      text.find_first_of(",\"\r\n") == std::string::npos && (text.empty() || (text.front() != ' ' && text.front() != '\t'));
  return plain ? text : Quoted(text);
}

std::string LineOf(const Attempt& attempt)
{
  const auto cell = [](double number, const std::string& what) {
    if (!std::isfinite(number))
      throw Error(Error::Kind::InvalidParameter, "the attempt's " + what + " is not a finite number");
    return ',' + NumberText(number);
  };
  return Cell(attempt.time) + ',' + Cell(attempt.trainee) + cell(attempt.seconds, "time") + cell(attempt.scoreMm, "score") +
         cell(attempt.worstMm, "worst score") + cell(attempt.degrees, "rotation") + cell(attempt.startMm, "score at the start") +
         ',' + NumberText(attempt.edits) + ',' + NumberText(attempt.help) +
         cell(attempt.outOfPlaneSeconds, "time out of the plane") + ',' + Quoted(attempt.project) + '\n';
}

// One line of the table: its text without its end, and where the next begins.
struct Line {
  std::string_view text;
  std::size_t next = 0;
  bool ended = false; ///< by a line end, and not by the end of the file
};

// Line ends within quotes belong to the cell.
Line LineAt(std::string_view table, std::size_t begin)
{
  bool quoted = false;
  for (std::size_t at = begin; at < table.size(); ++at) {
    if (table[at] == '"')
      quoted = !quoted;
    else if (table[at] == '\n' && !quoted) {
      std::string_view text = table.substr(begin, at - begin);
      if (!text.empty() && text.back() == '\r')
        text.remove_suffix(1);
      return {text, at + 1, true};
    }
  }
  return {table.substr(begin), table.size(), false};
}

bool ParseLine(std::string_view text, std::size_t columns, Attempt& attempt)
{
  std::vector<std::string> cells;
  if (!SplitCsvLine(text, ',', cells) || cells.size() != columns)
    return false;
  attempt.time = cells[0];
  attempt.trainee = cells[1];
  attempt.project = cells.back();
  std::size_t cell = 2;
  for (double* number : {&attempt.seconds, &attempt.scoreMm, &attempt.worstMm, &attempt.degrees, &attempt.startMm})
    if (!ParseNumber(cells[cell++], *number) || !std::isfinite(*number))
      return false;
  return ParseNumber(cells[7], attempt.edits) &&
         (columns == OldColumns || (ParseNumber(cells[8], attempt.help) && ParseNumber(cells[9], attempt.outOfPlaneSeconds) &&
                                    std::isfinite(attempt.outOfPlaneSeconds)));
}

struct History {
  std::vector<Attempt> attempts;
  bool isOld = false;  ///< of fewer columns
  std::size_t end = 0; ///< of what is whole, bytes; half a line may follow
  bool ended = true;   ///< the last line has its line end
};

// \throws Error(BadFile) when the table is not a history of attempts.
History Parse(const std::string& path, std::string_view table)
{
  History history;
  // Half a header is all that a crash at the first attempt can leave.
  for (const std::string_view header : {Header, OldHeader})
    if (table.size() <= header.size() && header.substr(0, table.size()) == table)
      return history;
  const Line header = LineAt(table, table.substr(0, Mark.size()) == Mark ? Mark.size() : 0);
  history.isOld = header.text == OldHeader;
  if ((header.text != Header && !history.isOld) || !header.ended)
    throw Error(Error::Kind::BadFile, path + ": it is not a history of attempts; its first line must be " + std::string(Header));
  history.end = header.next;
  for (int number = 2; history.end < table.size(); ++number) {
    const Line line = LineAt(table, history.end);
    Attempt attempt;
    const bool whole = ParseLine(line.text, history.isOld ? OldColumns : Columns, attempt);
    // Half a line. One that spans lines is none: a stray quotation mark has swallowed what follows it.
    if (!line.ended && !(whole && line.text.back() == '"') && line.text.find('\n') == std::string_view::npos)
      break;
    if (!whole && !line.text.empty())
      throw Error(Error::Kind::BadFile,
                  path + ": line " + std::to_string(number) + " is not an attempt; " +
                      (history.isOld ? "nine values are needed, of which the third to the eighth are numbers"
                                     : "eleven values are needed, of which the third to the tenth are numbers"));
    if (whole)
      history.attempts.push_back(std::move(attempt));
    history.end = line.next;
    history.ended = line.ended;
  }
  return history;
}

[[noreturn]] void Fail(const std::string& path, const std::string& what)
{
  throw Error(Error::Kind::FileSystem, path + ": " + what + " (" + std::strerror(errno) + ")");
}

// An open file, locked against other programs that do the same.
class LockedFile {
public:
  explicit LockedFile(const std::string& path) : path_(path)
  {
    do { // another program may have put another file in its place while this one waited
      if (file_ >= 0)
        close(file_);
      file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (file_ < 0)
        Fail(path_, "the history of attempts cannot be written");
      int result;
      while ((result = flock(file_, LOCK_EX)) != 0 && errno == EINTR) {
      }
      if (result != 0) {
        close(file_);
        Fail(path_, "the history of attempts cannot be locked");
      }
    } while (!IsStillThere());
  }
  ~LockedFile() { close(file_); } // and unlocks
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  // Makes \a text the end of the file, from \a begin on; or leaves the whole lines before \a begin and nothing else.
  void ReplaceEnd(std::size_t begin, std::string_view text)
  {
    const auto whole = static_cast<off_t>(begin);
    if (ftruncate(file_, whole) != 0)
      Fail(path_, "half a line at its end cannot be removed");
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t written = pwrite(file_, text.data() + done, text.size() - done, whole + static_cast<off_t>(done));
      if (written < 0 && errno == EINTR)
        continue;
      if (written <= 0) {
        const int reason = errno;
        if (ftruncate(file_, whole) != 0) // the next attempt removes what is left
          errno = reason;
        errno = reason;
        Fail(path_, "the attempt cannot be written");
      }
      done += static_cast<std::size_t>(written);
    }
    if (fsync(file_) != 0)
      Fail(path_, "the attempt cannot be brought to the disk");
  }

private:
  bool IsStillThere() const
  {
    struct stat ours {
    }, there{};
    return fstat(file_, &ours) == 0 && stat(path_.c_str(), &there) == 0 && ours.st_ino == there.st_ino &&
           ours.st_dev == there.st_dev;
  }

  std::string path_;
  int file_ = -1;
};

constexpr std::size_t Limit = 64 << 20; // some hundred thousand attempts

} // namespace

void AppendAttempt(const std::string& path, const Attempt& attempt)
{
  const std::string line = LineOf(attempt);
  struct stat known {};
  if (stat(path.c_str(), &known) == 0 && !S_ISREG(known.st_mode))
    throw Error(Error::Kind::FileSystem, path + ": it is there and is not a plain file");
  LockedFile file(path);
  const History history = Parse(path, ReadTextFile(path, Limit));
  if (history.isOld) {
    std::string table = std::string(Header) + '\n';
    for (const Attempt& earlier : history.attempts)
      table += LineOf(earlier);
    return WriteTextFile(path, table + line);
  }
  const std::string before = history.end == 0 ? std::string(Header) + '\n' : history.ended ? "" : "\n";
  file.ReplaceEnd(history.end, before + line);
}

std::vector<Attempt> ReadAttempts(const std::string& path)
{
  return Parse(path, ReadTextFile(path, Limit)).attempts;
}

} // namespace echorama
