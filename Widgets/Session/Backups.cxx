// SPDX-License-Identifier: BSD-3-Clause
// The name of a backup says its number and its time, so that thinning out need not open any. Listing opens all: only so is it
// known which can be read.
#include "Widgets/Session/Backups.h"
#include "Core/Base/Error.h"
#include "Widgets/Session/Checksum.h"
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <filesystem>
#include <limits>
#include <set>
#include <sys/file.h>
#include <sys/stat.h>
#include <tuple>
#include <unistd.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr const char* LockName = "lock";

[[noreturn]] void FailBackup(const std::string& path, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, path + ": " + reason);
}

bool ParseName(const std::string& name, Backup& backup)
{
  std::tm time{};
  int end = 0;
  if (std::sscanf(name.c_str(), "backup-%9d-%4d%2d%2dT%2d%2d%2dZ.json%n", &backup.number, &time.tm_year, &time.tm_mon,
                  &time.tm_mday, &time.tm_hour, &time.tm_min, &time.tm_sec, &end) != 7 ||
      end != static_cast<int>(name.size()) || backup.number < 1)
    return false;
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  backup.time = timegm(&time);
  return true;
}

// By their names alone, the newest first.
std::vector<Backup> Named(const std::string& folder)
{
  std::vector<Backup> backups;
  std::error_code error;
  for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    Backup backup;
    backup.path = each->path().string();
    if (ParseName(each->path().filename().string(), backup))
      backups.push_back(backup);
  }
  std::sort(backups.begin(), backups.end(),
            [](const Backup& a, const Backup& b) { return a.number != b.number ? a.number > b.number : a.path > b.path; });
  return backups;
}

void ThinOut(const std::string& folder, int keep)
{
  const std::vector<Backup> backups = Named(folder);
  std::int64_t lastSpan = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = static_cast<std::size_t>(keep); i < backups.size(); ++i) {
    const bool recent = backups.front().time - backups[i].time < 86400;
    const std::int64_t length = recent ? 3600 : 86400;
    const std::int64_t span = backups[i].time / length * length; // the hour or day in which it was made
    std::error_code ignored;
    if (span == lastSpan)
      fs::remove(backups[i].path, ignored);
    lastSpan = span;
  }
}

int OpenLock(const std::string& folder)
{
  return open((fs::path(folder) / LockName).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
}

bool InUse(const std::string& folder)
{
  const int lock = open((fs::path(folder) / LockName).c_str(), O_RDWR | O_CLOEXEC);
  if (lock < 0)
    return false;
  const bool held = flock(lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(lock);
  return held;
}

void RemoveHalfWritten(const std::string& folder)
{
  std::vector<fs::path> parts;
  std::error_code error;
  for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error))
    if (each->path().filename().string().rfind(".part", 0) == 0)
      parts.push_back(each->path());
  for (const fs::path& part : parts)
    fs::remove(part, error);
}

fs::path DataRoot()
{
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data && fs::path(data).is_absolute())
    return fs::path(data) / "echorama";
  const char* home = std::getenv("HOME");
  if (!home || !fs::path(home).is_absolute())
    FailBackup("backups", "neither XDG_DATA_HOME nor HOME tells where to keep them; save the project first");
  return fs::path(home) / ".local" / "share" / "echorama";
}

fs::path UnsavedRoot()
{
  return DataRoot() / "unsaved";
}

fs::path Beside(const std::string& project)
{
  return fs::absolute(project).replace_extension(".backups");
}

// For a project beside which nothing can be written. The number tells projects of one name in different folders apart.
fs::path Away(const std::string& project)
{
  const fs::path whole = fs::absolute(project).lexically_normal();
  return DataRoot() / "projects" / (whole.stem().string() + "-" + TextChecksum(whole.string()));
}

bool CanHold(const fs::path& folder)
{
  std::error_code error;
  if (fs::is_directory(folder, error))
    return access(folder.c_str(), W_OK | X_OK) == 0;
  const fs::path parent = folder.parent_path();
  // A parent that is missing is told of by who makes the folder.
  return !fs::exists(folder, error) && (!fs::exists(parent, error) || access(parent.c_str(), W_OK | X_OK) == 0);
}

std::vector<Backup> NamedFor(const std::string& project)
{
  std::vector<Backup> backups = Named(Beside(project).string());
  try {
    const std::vector<Backup> away = Named(Away(project).string());
    backups.insert(backups.end(), away.begin(), away.end());
  } catch (const Error&) { // no folder of the user
  }
  std::stable_sort(backups.begin(), backups.end(), [](const Backup& a, const Backup& b) { return a.number > b.number; });
  return backups;
}

bool IsBefore(const timespec& one, const timespec& other)
{
  return std::tie(one.tv_sec, one.tv_nsec) < std::tie(other.tv_sec, other.tv_nsec);
}

void Read(Backup& backup)
{
  try {
    BackupStamp stamp;
    ReadProject(backup.path, &stamp);
    backup.label = stamp.label;
    backup.inPlaceOf = stamp.number == backup.number ? stamp.inPlaceOf : 0; // else it was renamed: numbers were others then
    backup.lineage = stamp.lineage;
    backup.readable = stamp.number > 0; // a project without a stamp was not written here
  } catch (const Error&) {
    backup.readable = false;
  }
}

std::vector<Backup> Opened(std::vector<Backup> backups)
{
  std::set<fs::path> replaced;
  for (Backup& backup : backups) {
    Read(backup);
    if (backup.inPlaceOf > 0)
      for (const Backup& other : backups)
        if (other.number == backup.inPlaceOf && fs::path(other.path).parent_path() == fs::path(backup.path).parent_path())
          replaced.insert(other.path);
  }
  backups.erase(std::remove_if(backups.begin(), backups.end(), [&](const Backup& each) { return replaced.count(each.path) > 0; }),
                backups.end());
  return backups;
}

std::string Time(std::int64_t time, const char* format)
{
  const auto seconds = static_cast<std::time_t>(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[40];
  return std::string(text, std::strftime(text, sizeof text, format, &parts));
}

} // namespace

Backups::Backups(const std::string& folder, LastBackup after, int keep)
  : folder_(folder), after_(std::move(after)), keep_(std::max(keep, 1))
{
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder))
    FailBackup(folder, "the folder of backups cannot be made (" + error.message() + ")");
  lock_ = OpenLock(folder);
  if (lock_ < 0)
    FailBackup(folder, std::string("the folder of backups cannot be written (") + std::strerror(errno) + ")");
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0)
    RemoveHalfWritten(folder); // nobody else is writing here
  flock(lock_, LOCK_SH);
}

Backups::~Backups()
{
  close(lock_);
}

bool Backups::Write(const Project& project, const std::string& label, bool inPlaceOfLast)
{
  if (last_ && *last_ == project)
    return false;
  const std::vector<Backup> earlier = Named(folder_);
  BackupStamp stamp;
  stamp.number = 1 + std::max(after_.number, earlier.empty() ? 0 : earlier.front().number);
  stamp.lineage = after_.lineage;
  stamp.time = std::time(nullptr);
  stamp.label = label;
  const bool replaces = inPlaceOfLast && !lastPath_.empty();
  bool goesAtOnce = false;
  if (replaces) {
    const std::lock_guard<std::mutex> lock(mutex_);
    goesAtOnce = !unsynced_.empty() && unsynced_.back() == lastPath_; // on a slow disk they do not pile up
    if (goesAtOnce)
      unsynced_.pop_back();
    stamp.inPlaceOf = goesAtOnce ? lastStamp_.inPlaceOf : lastStamp_.number;
  }
  std::string path;
  try {
    do
      path = (fs::path(folder_) / FileName(stamp.number, stamp.time)).string();
    while (!WriteBackup(path, project, stamp) && ++stamp.number); // another session took the number
  } catch (const Error& error) {                                  // the same reason has the same words
    std::string reason = error.what();
    for (std::size_t at = 0; (at = reason.find(path)) != std::string::npos;)
      reason.replace(at, path.size(), folder_);
    if (goesAtOnce) {
      const std::lock_guard<std::mutex> lock(mutex_);
      unsynced_.push_back(lastPath_);
    }
    throw Error(error.GetKind(), reason);
  }
  if (goesAtOnce) {
    std::error_code ignored;
    fs::remove(lastPath_, ignored);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (replaces && !goesAtOnce)
      replaced_.push_back(lastPath_);
    unsynced_.push_back(path);
  }
  lastStamp_ = stamp;
  numbers_.insert(stamp.number);
  after_.number = stamp.number;
  last_ = project;
  lastPath_ = path;
  unsaved_.push_back(path);
  ThinOut(folder_, keep_);
  return true;
}

void Backups::Sync()
{
  std::vector<std::string> paths, replaced;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    paths.swap(unsynced_);
    replaced.swap(replaced_);
  }
  try {
    BringToDisk(paths);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    unsynced_.insert(unsynced_.begin(), paths.begin(), paths.end());
    replaced_.insert(replaced_.begin(), replaced.begin(), replaced.end());
    throw;
  }
  std::error_code ignored;
  for (const std::string& path : replaced)
    fs::remove(path, ignored);
}

std::vector<Backup> Backups::List(const std::string& folder)
{
  return Opened(Named(folder));
}

std::vector<Backup> Backups::ListFor(const std::string& path)
{
  return Opened(NamedFor(path));
}

std::set<int> Backups::NumbersFor(const std::string& path)
{
  std::set<int> numbers;
  for (const Backup& backup : NamedFor(path))
    numbers.insert(backup.number);
  return numbers;
}

std::optional<Backup> Backups::NewestFor(const std::string& path, const timespec& saved, const LastBackup& last)
{
  std::vector<Backup> backups = NamedFor(path);
  const bool isNumbered = !last.lineage.empty();
  if (!isNumbered)
    std::stable_sort(backups.begin(), backups.end(), [](const Backup& a, const Backup& b) { return a.time > b.time; });
  for (Backup& backup : backups) {
    struct stat file {};
    if (isNumbered ? backup.number <= last.number && last.others.count(backup.number) == 0
                   : backup.time < saved.tv_sec ||
                         (backup.time == saved.tv_sec && stat(backup.path.c_str(), &file) == 0 && IsBefore(file.st_mtim, saved)))
      continue;
    echorama::Read(backup);
    // Of a project that had no lineage yet, each window has begun one of its own.
    if (backup.readable && (!isNumbered || backup.lineage == last.lineage || last.others.count(backup.number) > 0))
      return backup;
  }
  return std::nullopt;
}

void Backups::DiscardUnsaved()
{
  std::error_code ignored;
  for (const std::string& path : unsaved_)
    fs::remove(path, ignored);
  unsaved_.clear();
}

std::string Backups::FileName(int number, std::int64_t time)
{
  char digits[16];
  std::snprintf(digits, sizeof digits, "%06d", number);
  return std::string("backup-") + digits + Time(time, "-%Y%m%dT%H%M%SZ.json");
}

std::string Backups::FolderFor(const std::string& path)
{
  if (!path.empty()) {
    const fs::path folder = Beside(path);
    return (CanHold(folder) ? folder : Away(path)).string();
  }
  const fs::path root = UnsavedRoot();
  const std::string name = Time(std::time(nullptr), "%Y%m%d-%H%M%S-") + std::to_string(getpid());
  fs::path folder = root / name;
  std::error_code error;
  for (int copy = 2; fs::exists(folder, error); ++copy)
    folder = root / (name + "-" + std::to_string(copy));
  return folder.string();
}

std::vector<std::string> Backups::Abandoned()
{
  std::vector<std::pair<std::int64_t, std::string>> found;
  std::error_code error;
  for (fs::directory_iterator each(UnsavedRoot(), error), end; !error && each != end; each.increment(error)) {
    const std::string folder = each->path().string();
    const std::vector<Backup> backups = Named(folder);
    if (!backups.empty() && !InUse(folder))
      found.emplace_back(backups.front().time, folder);
  }
  std::sort(found.rbegin(), found.rend());
  std::vector<std::string> folders;
  for (const auto& [time, folder] : found)
    folders.push_back(folder);
  return folders;
}

void Backups::Move(const std::string& from, const std::string& to)
{
  const Backups target(to);
  const std::vector<Backup> there = Named(to);
  int number = there.empty() ? 1 : there.front().number + 1;
  std::vector<Backup> moving = Named(from);
  std::reverse(moving.begin(), moving.end());
  const bool neighbours = fs::path(from).parent_path() == fs::path(to).parent_path();
  for (const Backup& backup : moving) {
    const fs::path path = fs::path(to) / FileName(number++, backup.time);
    try {
      BackupStamp stamp;
      const Project project = ReadProject(backup.path, &stamp);
      if (!neighbours || stamp.inPlaceOf > 0) { // what is relative to the folder becomes another: names of files, numbers
        stamp.number = number - 1;
        stamp.inPlaceOf = 0;
        std::error_code ignored;
        if (WriteBackup(path.string(), project, stamp)) {
          BringToDisk({path.string()});
          fs::remove(backup.path, ignored);
        }
        continue;
      }
    } catch (const Error& reason) {
      if (reason.GetKind() == Error::Kind::FileSystem)
        continue; // it stays
    }             // a damaged one comes along as it is
    std::error_code error;
    fs::rename(backup.path, path, error);
    if (error) { // another disk
      error.clear();
      fs::copy_file(backup.path, path, error);
      if (!error)
        fs::remove(backup.path, error);
    }
  }
  if (Named(from).empty() && !InUse(from))
    Discard(from);
}

void Backups::Discard(const std::string& folder)
{
  if (InUse(folder))
    throw Error(Error::Kind::NotPossible, folder + ": a session that still runs writes its backups there");
  std::error_code ignored;
  for (const Backup& backup : Named(folder))
    fs::remove(backup.path, ignored);
  RemoveHalfWritten(folder);
  fs::remove(fs::path(folder) / LockName, ignored);
  fs::remove(folder, ignored); // only when it is empty
}

} // namespace echorama
