// SPDX-License-Identifier: BSD-3-Clause
// Renaming within one folder is atomic, so one file needs no more than that. A set of files is made consistent by order:
// predecessors leave first (the main file before its companions), the new companions arrive, the main file arrives last.
#include "Core/Base/FileReplacement.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <system_error>
#include <unistd.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

[[noreturn]] void Fail(const std::string& path, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, path + ": " + reason);
}

// Whose processes these numbers are of: others may write to a shared folder at the same time.
std::string Machine()
{
  char name[65] = "";
  gethostname(name, sizeof name - 1);
  for (char& c : name)
    if (c == '/' || c == '@') // the system does not mind
      c = '_';
  return name;
}

// A name beside the target that nobody else uses: .part4711-2@machine@NAME. The extension stays at the end, because writers look
// at it.
std::string NameBeside(const fs::path& target, const char* purpose)
{
  static std::atomic<unsigned> counter{0};
  const std::string name = target.filename().string(), mark = "." + std::string(purpose) + std::to_string(getpid()) + "-" +
                                                              std::to_string(counter++) + "@" + Machine() + "@";
  return (target.parent_path() / (mark + name.substr(name.size() - std::min(name.size(), 255 - mark.size())))).string();
}

// Removes what processes of this machine that were killed left beside the target under such names. A file that was staged may
// have been staged again by what wrote it, so its name may have several marks.
void RemoveAbandoned(const fs::path& target, const std::string& purpose)
{
  const std::string machine = "@" + Machine() + "@", rest = target.filename().string();
  const auto isOfTheDead = [&](const std::string& name, const std::string& kind) {
    return name.rfind("." + kind, 0) == 0 && kill(std::atoi(name.c_str() + 1 + kind.size()), 0) != 0 && errno == ESRCH;
  };
  const auto withoutMark = [&](const std::string& name) {
    const std::size_t at = std::min(name.find('@'), name.size());
    return name.compare(at, machine.size(), machine) == 0 ? name.substr(at + machine.size()) : std::string();
  };
  std::error_code error;
  for (fs::directory_iterator entry(target.parent_path() / ".", error), end; !error && entry != end; entry.increment(error)) {
    std::string name = entry->path().filename().string();
    if (!isOfTheDead(name, purpose))
      continue;
    for (name = withoutMark(name); name != rest && isOfTheDead(name, "part");)
      name = withoutMark(name);
    if (name == rest)
      fs::remove_all(entry->path(), error);
  }
}

// An empty file beside the target that was not there before: whoever put a link in its place is not followed.
std::string NewFileBeside(const fs::path& target)
{
  for (;;) {
    const std::string name = NameBeside(target, "part");
    const int file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file >= 0) {
      close(file);
      return name;
    }
    if (errno != EEXIST)
      Fail(target.string(), std::string("no temporary file can be made beside it (") + std::strerror(errno) + ")");
  }
}

} // namespace

std::string NewFolderBeside(const std::string& path)
{
  RemoveAbandoned(path, "part");
  return NameBeside(path, "part");
}

FileReplacement::~FileReplacement()
{
  std::error_code ignored;
  for (const Item& item : items_)
    if (!item.temporary.empty())
      fs::remove(item.temporary, ignored);
}

std::string FileReplacement::Stage(const std::string& path)
{
  if (path.empty())
    Fail("(no file name)", "a file name is needed");
  std::error_code error;
  fs::path target = path;
  if (fs::is_symlink(target, error))
    target = fs::weakly_canonical(target, error);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    Fail(path, "there is no folder " + folder.string());
  if (fs::exists(target, error) && !fs::is_regular_file(target, error))
    Fail(path, "it is there and is not a plain file");
  RemoveAbandoned(target, "part");
  items_.push_back({NewFileBeside(target), target.string(), {}, false});
  return items_.back().temporary;
}

void FileReplacement::Unstage(const std::string& temporary)
{
  std::error_code ignored;
  fs::remove(temporary, ignored);
  items_.erase(std::remove_if(items_.begin(), items_.end(), [&](const Item& item) { return item.temporary == temporary; }),
               items_.end());
}

void FileReplacement::Remove(const std::string& path)
{
  items_.insert(items_.begin(), {{}, path, {}, false});
}

void FileReplacement::Commit()
{
  std::error_code error;
  for (const Item& item : items_)
    if (!item.temporary.empty() && fs::file_size(item.temporary, error) == 0)
      Fail(item.target, "nothing was written; what was there is left as it was");
  const bool alone = items_.size() == 1 && !items_.front().temporary.empty();
  for (auto item = items_.rbegin(); !alone && item != items_.rend(); ++item)
    if (fs::is_regular_file(item->target, error)) {
      item->aside = NameBeside(item->target, "old");
      fs::rename(item->target, item->aside, error);
      if (error) {
        RollBack();
        Fail(item->target, "it cannot be replaced (" + error.message() + ")");
      }
    }
  for (Item& item : items_) {
    if (item.temporary.empty())
      continue;
    fs::rename(item.temporary, item.target, error);
    if (error) {
      RollBack();
      Fail(item.target, "the finished file cannot be put in place (" + error.message() + ")");
    }
    item.placed = true;
  }
  for (const Item& item : items_) {
    fs::remove(item.aside, error); // if there is one
    RemoveAbandoned(item.target, "old");
  }
  items_.clear();
}

void FileReplacement::RollBack()
{
  std::error_code ignored;
  for (Item& item : items_) {
    if (item.placed)
      fs::remove(item.target, ignored);
    if (!item.aside.empty())
      fs::rename(item.aside, item.target, ignored);
    item.placed = false;
    item.aside.clear();
  }
}

} // namespace echorama
