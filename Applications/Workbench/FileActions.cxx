// SPDX-License-Identifier: BSD-3-Clause
#include "FileActions.h"
#include "Controls.h"
#include "Messages.h"
#include "ResultFile.h"
#include "Workbench.h"
#include <memory>
#include <QAction>
#include <QDateTime>
#include <QFile>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QSettings>
#include <vtkCompositeDataSet.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

namespace echorama {

namespace {

constexpr const char* VolumeFilter = "*.mha *.mhd *.nrrd *.nhdr *.nii *.nii.gz *.vdb *.vti *.dcm *.vol *.png *.tif *.tiff *.jpg";

// A volume that would take more of the free memory is shown coarsely: a copy to paint in and what is made of it need room, too.
constexpr double WholeShare = 0.25;

QString LastFolder()
{
  return QSettings().value("files/folder").toString();
}

void RememberFolder(const QString& path)
{
  QSettings().setValue("files/folder", QFileInfo(path).absolutePath());
}

} // namespace

FileActions::FileActions(Workbench* bench, QWidget* window) : QObject(window), bench_(bench), window_(window)
{
  const QString volumes = tr("Volumes (%1);;All files (*)").arg(VolumeFilter), projects = tr("Projects (*.json);;All files (*)");
  open_ = MakeAction(this, "open", tr("&Open volumes..."), "Ctrl+O", tr("Open volumes; files can be dropped on the window, too"),
                     [this, volumes] { AskOpen(tr("Open volumes"), volumes, true); });
  openProject_ =
      MakeAction(this, "openProject", tr("Open &project..."), "Ctrl+Shift+O", tr("Open volumes with their poses and strokes"),
                 [this, projects] { AskOpen(tr("Open a project"), projects, false); });
  save_ = MakeAction(this, "save", tr("&Save project"), "Ctrl+S", tr("Save poses, strokes and how volumes are shown"),
                     [this] { Save(); });
  saveAs_ =
      MakeAction(this, "saveAs", tr("Save project &as..."), "Ctrl+Shift+S", tr("Save the project under another name"), [this] {
        afterSave_ = nullptr;
        AskSave();
      });
  readPoses_ =
      MakeAction(this, "readPoses", tr("&Read poses..."), "", tr("Put the volumes where a pose file says; can be undone"),
                 [this] { AskOpen(tr("Read poses"), tr("Poses (*.json);;All files (*)"), false); });
  for (auto changed : {&Workbench::HistoryChanged, &Workbench::VolumesChanged, &Workbench::SelectionChanged})
    connect(bench, changed, this, &FileActions::ShowHistory);
  connect(bench, &Workbench::HistoryChanged, this, [this] { edits_++; });
  ShowHistory();
}

void FileActions::AddTo(QMenu* menu)
{
  menu->addActions({open_, openProject_});
  menu->addSeparator();
  menu->addActions({save_, saveAs_});
  menu->addSeparator();
  menu->addAction(readPoses_);
}

void FileActions::ShowHistory()
{
  const bool any = bench_->Session()->GetNumberOfVolumes() > 0;
  save_->setEnabled(any && bench_->Session()->GetModifiedSinceSave());
  for (QAction* action : {saveAs_, readPoses_})
    action->setEnabled(any);
}

FileActions::Kind FileActions::KindOf(const QString& path)
{
  if (!path.endsWith(".json", Qt::CaseInsensitive))
    return Kind::Volume;
  QFile file(path);
  const QByteArray beginning = file.open(QIODevice::ReadOnly) ? file.read(4096) : QByteArray();
  return beginning.contains("echorama-poses-") ? Kind::Poses : Kind::Project;
}

void FileActions::Open(const QStringList& paths)
{
  QStringList volumes, projects, poses;
  for (const QString& path : paths) {
    const Kind kind = KindOf(path);
    (kind == Kind::Volume ? volumes : kind == Kind::Project ? projects : poses).append(QFileInfo(path).absoluteFilePath());
  }
  for (const char* topic : {"volumes", "project", "poses", "coarse"})
    bench_->Forget(topic); // what could not be opened before
  if (projects.size() > 1)
    bench_->Note(tr("One project can be open at a time: %1 is opened. Open the others one by one.")
                     .arg(QFileInfo(projects.first()).fileName()));
  // One after the other: a project takes the place of what is there, and poses are for volumes that are there.
  const auto readPoses = [this, poses] {
    if (poses.isEmpty() || !bench_->MayHelp(tr("Read poses")))
      return;
    for (const QString& path : poses)
      bench_->Try("poses", [this, path] { return bench_->Session()->ReadPoses(path.toUtf8().constData()); },
                  {{tr("Read another file..."), [this] { readPoses_->trigger(); }}});
  };
  const auto openVolumes = [this, volumes, readPoses] {
    if (volumes.isEmpty())
      readPoses();
    else
      OpenVolumes(volumes, readPoses);
  };
  if (projects.isEmpty())
    openVolumes();
  else
    OpenProject(projects.first(), openVolumes);
}

void FileActions::OpenVolumes(const QStringList& files, const std::function<void()>& then)
{
  const QStringList volumes = WithoutCompanions(files);
  const QString label = volumes.size() == 1 ? tr("Reading %1").arg(QFileInfo(volumes.first()).fileName())
                                            : tr("Reading %1 volumes").arg(volumes.size());
  const auto read = std::make_shared<std::vector<ReadVolume>>();
  bench_->Forget("volumes");
  const auto add = [this, read, then] {
    auto* session = bench_->Session();
    const bool wasEmpty = session->GetNumberOfVolumes() == 0, wasUntouched = !HasUnsavedWork();
    int last = 0;
    for (ReadVolume& volume : *read)
      if (volume.image) {
        const Messages::OfThread messages;
        if (const int id = session->AddVolume(volume.image, volume.file.toUtf8().constData()); id > 0)
          last = id;
        else
          volume = {volume.file, nullptr, QString::fromUtf8(messages.Error().c_str()), 1};
      }
    WarnOfUnread(*read);
    if (wasUntouched)
      opened_ = session->GetKernel().State();
    // The first volume stays where it is, as a rule: what comes later is to be moved.
    if (last > 0 && !(wasEmpty && read->size() == 1))
      session->Select(last, true, true);
    ShowHistory();
    if (then)
      then();
  };
  bench_->Shared().Run(
      this, label, [volumes, read](const Progress& progress) { *read = ReadVolumes(volumes, progress, WholeShare); },
      [this, add] { bench_->Shared().BetweenEdits(this, add); });
}

// All in one message, so that none pushes another away.
void FileActions::WarnOfUnread(const std::vector<ReadVolume>& volumes)
{
  constexpr int most = 20; // lines: a window has no more room
  QStringList errors;
  for (const ReadVolume& volume : volumes)
    if (!volume.image)
      errors.append(volume.error);
  if (errors.size() > most)
    errors = errors.mid(0, most) + QStringList(tr("and %1 more that cannot be read").arg(errors.size() - most));
  if (!errors.isEmpty())
    bench_->Warn(errors.join('\n'), {{tr("Open other files..."), [this] { open_->trigger(); }}}, "volumes");
  QStringList coarse;
  for (const ReadVolume& volume : volumes)
    if (volume.image && volume.stride > 1)
      coarse.append(tr("%1 is large: one of %2 voxels along each axis was read. Poses that are found here hold for the whole; "
                       "what is stitched here is as coarse, and echorama stitch --memory makes it of all voxels.")
                        .arg(QFileInfo(volume.file).fileName())
                        .arg(volume.stride));
  if (!coarse.isEmpty())
    bench_->Warn(coarse.mid(0, most).join('\n'), {}, "coarse");
}

void FileActions::OpenProject(const QString& path, const std::function<void()>& then)
{
  WhenSaved(QuestionBefore(path), [this, path, then] { ReadProject(path, path, then); });
}

void FileActions::OpenCopy(const QString& path, const Project& project)
{
  if (!(bench_->Session()->Now() == project))
    return OpenProject(path);
  bench_->Forget("project");
  bench_->Session()->ForgetUnsavedWork(); // it is all in the copy
  ReadProject(path, path, {});
}

QString FileActions::QuestionBefore(const QString& path)
{
  return tr("Save what you did before %1 is opened?").arg(QFileInfo(path).fileName());
}

void FileActions::OpenAbandoned(const QString& backup)
{
  WhenSaved(tr("Save what you did before the other session is opened?"), [this, backup] { ReadProject(backup, {}, {}); });
}

// \a saveAs: where Save writes later; empty: it asks.
void FileActions::ReadProject(const QString& path, const QString& saveAs, const std::function<void()>& then)
{
  auto* session = bench_->Session();
  vtkNew<vtkStringArray> files;
  const Message::Answers another{{tr("Open another project..."), [this] { openProject_->trigger(); }}};
  if (!bench_->Try(
          "project", [&] { return session->GetProjectFiles(path.toUtf8().constData(), files); }, another))
    return;
  QStringList there;
  bool isMissing = false;
  for (vtkIdType i = 0; i < files->GetNumberOfValues(); i++) {
    const QString file = QString::fromStdString(files->GetValue(i));
    isMissing |= file.isEmpty();
    if (!file.isEmpty() && !there.contains(file))
      there.append(file);
  }
  if (isMissing) {
    const Messages::OfThread messages;
    session->OpenProject(path.toUtf8().constData()); // names what is missing
    bench_->Ask(tr("%1\nFiles of %2 have moved. Where are they now?")
                    .arg(QString::fromUtf8(messages.Error().c_str()), QFileInfo(path).fileName()),
                {{tr("Look in a folder..."),
                  [this, path, saveAs, then] {
                    auto* dialog = new QFileDialog(window_, tr("Where the volumes are"), QFileInfo(path).absolutePath());
                    dialog->setAttribute(Qt::WA_DeleteOnClose);
                    dialog->setFileMode(QFileDialog::Directory);
                    dialog->setObjectName("folderDialog");
                    connect(dialog, &QFileDialog::fileSelected, this, [this, path, saveAs, then](const QString& folder) {
                      bench_->Session()->AddSearchFolder(folder.toUtf8().constData());
                      ReadProject(path, saveAs, then);
                    });
                    dialog->open();
                  }},
                 {tr("Do not open it"), {}}},
                "project");
    return;
  }
  const QString label = tr("Opening %1").arg(QFileInfo(path).fileName());
  const auto read = std::make_shared<std::vector<ReadVolume>>();
  bench_->Shared().Run(
      this, label, [there, read](const Progress& progress) { *read = ReadVolumes(there, progress, WholeShare); },
      [this, path, saveAs, then, read, before = edits_] {
        WarnOfUnread(*read);
        for (const ReadVolume& volume : *read)
          if (!volume.image)
            return;
        const auto take = [this, path, saveAs, then, read] { TakeProject(path, saveAs, *read, then); };
        if (edits_ == before)
          take();
        else // work went on while files were read
          WhenSaved(QuestionBefore(path), take);
      });
}

void FileActions::TakeProject(const QString& path, const QString& saveAs, const std::vector<ReadVolume>& volumes,
                              const std::function<void()>& then)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  for (const ReadVolume& volume : volumes) {
    const unsigned int block = blocks->GetNumberOfBlocks();
    blocks->SetBlock(block, volume.image);
    blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volume.file.toUtf8().constData());
  }
  auto* session = bench_->Session();
  if (!bench_->Try("project", [&] { return session->OpenProject(path.toUtf8().constData(), blocks); },
                   {{tr("Open another project..."), [this] { openProject_->trigger(); }}}))
    return;
  opened_ = {};
  emit Opened();
  if (!saveAs.isEmpty())
    OfferLaterBackup();
  else if (session->BackUp()) // what was left is now this session's: it is not offered twice
    session->DiscardBackups(QFileInfo(path).absolutePath().toUtf8().constData());
  if (then)
    then();
}

// After a crash the newest backup of the project is later than the project, and says something else.
void FileActions::OfferLaterBackup()
{
  const QString backup = QString::fromStdString(bench_->Session()->GetLaterBackup());
  if (backup.isEmpty())
    return;
  bench_->Ask(tr("This project has unsaved changes, last backed up at %1.")
                  .arg(QFileInfo(backup).lastModified().toString("yyyy-MM-dd hh:mm:ss")),
              {{tr("Restore them"), [this, backup] { bench_->Session()->RestoreBackup(backup.toUtf8().constData()); }},
               {tr("Ignore them"), {}}},
              "project");
}

bool FileActions::Save()
{
  const std::string path = bench_->Session()->GetProjectPath();
  if (!path.empty())
    return SaveTo(QString::fromStdString(path));
  AskSave();
  return false;
}

bool FileActions::SaveTo(const QString& path, bool withoutUnsavedResults)
{
  if (const QVector<int> unsaved = UnsavedResults(bench_->Session()); !unsaved.isEmpty() && !withoutUnsavedResults) {
    AskForResults(path, unsaved);
    return false;
  }
  const auto then = std::exchange(afterSave_, nullptr);
  const auto again = [this, path, withoutUnsavedResults, then] {
    afterSave_ = then;
    SaveTo(path, withoutUnsavedResults);
  };
  const auto elsewhere = [this, then] {
    afterSave_ = then;
    AskSave();
  };
  if (!bench_->Try("save", [&] { return bench_->Session()->SaveProject(path.toUtf8().constData(), withoutUnsavedResults); },
                   {{tr("Save as..."), elsewhere}, {tr("Try again"), again}}))
    return false;
  bench_->Note(tr("Saved %1").arg(path), "save");
  if (then)
    then();
  return true;
}

// A project names files, and a result that was just made is in none.
void FileActions::AskForResults(const QString& path, const QVector<int>& unsaved)
{
  const int id = unsaved.first();
  // What comes after belongs to this question: when it stays without an answer, a later save does not do it.
  const auto save = [this, path, then = std::exchange(afterSave_, nullptr)](bool withoutUnsavedResults) {
    afterSave_ = then;
    SaveTo(path, withoutUnsavedResults);
  };
  const QString file = FreeFileFor(bench_->Session(), id, QFileInfo(path).absolutePath());
  const auto saveThere = [this, id, file, save] { SaveResult(bench_->Shared(), this, id, file, [save] { save(false); }); };
  bench_->Ask(tr("%1 is in no file yet, and a project holds files. Save it beside the project, as %2?")
                  .arg(bench_->NameOf(id), QFileInfo(file).fileName()),
              {{tr("Save it there"), saveThere}, {tr("Leave it out"), [save] { save(true); }}, {tr("Cancel"), {}}}, "save");
}

bool FileActions::HasUnsavedWork() const
{
  const auto* session = bench_->Session();
  if (!session->GetModifiedSinceSave() || session->GetNumberOfVolumes() == 0)
    return false;
  return !session->GetProjectPath().empty() || session->GetKernel().State() != opened_;
}

void FileActions::WhenSaved(const QString& question, const std::function<void()>& then)
{
  if (!HasUnsavedWork()) {
    then();
    return;
  }
  bench_->Ask(question,
              {{tr("Save"),
                [this, then] {
                  afterSave_ = then;
                  Save();
                }},
               {tr("Do not save"),
                [this, then] {
                  bench_->Session()->ForgetUnsavedWork();
                  then();
                }},
               {tr("Cancel"), {}}},
              "unsaved");
}

void FileActions::AskOpen(const QString& title, const QString& filter, bool several)
{
  auto* dialog = new QFileDialog(window_, title, LastFolder(), filter);
  dialog->setObjectName("openDialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setFileMode(several ? QFileDialog::ExistingFiles : QFileDialog::ExistingFile);
  connect(dialog, &QFileDialog::filesSelected, this, [this](const QStringList& files) {
    RememberFolder(files.value(0));
    Open(files);
  });
  dialog->open();
}

void FileActions::AskSave()
{
  auto* dialog = new QFileDialog(window_, tr("Save the project"), LastFolder(), tr("Projects (*.json)"));
  dialog->setObjectName("saveDialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setAcceptMode(QFileDialog::AcceptSave);
  dialog->setDefaultSuffix("json");
  dialog->selectFile("alignment.json");
  connect(dialog, &QFileDialog::fileSelected, this, [this](const QString& file) {
    RememberFolder(file);
    SaveTo(file);
  });
  connect(dialog, &QFileDialog::rejected, this, [this] { afterSave_ = nullptr; });
  dialog->open();
}

} // namespace echorama
