// SPDX-License-Identifier: BSD-3-Clause
#include "ProjectActions.h"
#include "AlgorithmRun.h"
#include "Controls.h"
#include "Core/Base/Error.h"
#include "FocusRing.h"
#include "Widgets/Session/PoseComparison.h"
#include "Widgets/Session/ProjectFolder.h"
#include "Widgets/Session/ProjectVolumes.h"
#include "Workbench.h"
#include <map>
#include <memory>
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QDialog>
#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QHeaderView>
#include <QLabel>
#include <QMenu>
#include <QPushButton>
#include <QTableWidget>
#include <QVBoxLayout>
#include <vtkImageData.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

ProjectActions::ProjectActions(Workbench* bench, QWidget* window) : QObject(window), bench_(bench), window_(window)
{
  copy_ = MakeAction(this, "copyProject", tr("Save project with its &volumes..."), "",
                     tr("A copy of all files in one folder, which opens on another machine"), [this] {
                       auto* dialog = new QFileDialog(window_, tr("Name a new folder for the project and its volumes"));
                       dialog->setObjectName("copyDialog");
                       dialog->setAttribute(Qt::WA_DeleteOnClose);
                       dialog->setAcceptMode(QFileDialog::AcceptSave);
                       dialog->setOption(QFileDialog::DontConfirmOverwrite); // nothing is overwritten
                       dialog->setLabelText(QFileDialog::FileName, tr("New &folder:"));
                       dialog->selectFile("alignment");
                       connect(dialog, &QFileDialog::fileSelected, this, &ProjectActions::CopyTo);
                       dialog->open();
                     });
  compare_ = MakeAction(this, "compareProject", tr("&Compare with a project or poses..."), "",
                        tr("How differently another session places the volumes, mm and degrees"), [this] {
                          auto* dialog =
                              new QFileDialog(window_, tr("Compare with"), {}, tr("Projects and poses (*.json);;All files (*)"));
                          dialog->setObjectName("compareDialog");
                          dialog->setAttribute(Qt::WA_DeleteOnClose);
                          dialog->setFileMode(QFileDialog::ExistingFile);
                          connect(dialog, &QFileDialog::fileSelected, this, &ProjectActions::CompareWith);
                          dialog->open();
                        });
  connect(bench, &Workbench::VolumesChanged, this, &ProjectActions::ShowVolumes);
  connect(bench, &Workbench::ScoredChanged, this, &ProjectActions::ShowVolumes);
  ShowVolumes();
}

void ProjectActions::AddTo(QMenu* menu)
{
  menu->addActions({copy_, compare_});
}

void ProjectActions::ShowVolumes()
{
  const bool any = bench_->Session()->GetNumberOfVolumes() > 0;
  copy_->setEnabled(any);
  compare_->setEnabled(any && !bench_->IsScored()); // the other may be the solution
}

// A result that is in no file is written into the copy, and stays in no file here: this project would miss it when the folder
// is given away.
void ProjectActions::CopyTo(const QString& folder)
{
  auto* session = bench_->Session();
  std::map<int, vtkSmartPointer<vtkImageData>> unfiled;
  for (int id : bench_->Volumes())
    if (session->GetFile(id).empty()) {
      unfiled[id] = vtkSmartPointer<vtkImageData>::New();
      if (!bench_->Try("copyProject", [&] { return session->GetUnpainted(id, unfiled[id]); },
                       {{tr("Try again"), [this, folder] { CopyTo(folder); }}}))
        return;
    }
  const auto write = [unfiled](const SessionVolume& volume, const std::string& file, const Progress& progress) {
    const auto writer = vtkSmartPointer<vtkUltrasoundWriter>::New();
    writer->SetInputDataObject(unfiled.at(volume.id));
    writer->SetFileName(file.c_str());
    Run(writer, progress, [&] { writer->Write(); });
  };
  const auto made = std::make_shared<std::string>();
  const Project project = session->Now();
  const auto copy = [project, write, folder = folder.toStdString(), made](const Progress& progress) {
    *made = CopyProject(project, folder, progress, write);
  };
  const auto tell = [this, made, project] {
    const QString path = QString::fromStdString(*made);
    emit bench_->Said({Message::Note,
                       tr("The project and its volumes are in %1").arg(QFileInfo(path).path()),
                       {{tr("Open the copy"), [this, path, project] { emit OpenAsked(path, project); }}},
                       "copyProject"});
  };
  bench_->Forget("copyProject");
  bench_->Shared().Run(this, tr("Copying project and volumes"), copy, tell,
                       {{tr("Choose another place..."), [this] { copy_->trigger(); }}}, "copyProject");
}

void ProjectActions::CompareWith(const QString& path)
{
  std::map<int, Pose> other;
  bench_->Forget("compareProject");
  try {
    other = ReadPosesOf(bench_->Session()->GetKernel().State(), path.toStdString());
  } catch (const Error& error) {
    return bench_->Warn(QString::fromUtf8(error.what()), {{tr("Compare with another..."), [this] { compare_->trigger(); }}},
                        "compareProject");
  }
  auto* dialog = new QDialog(window_);
  dialog->setObjectName("comparison");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(tr("Compared with %1").arg(QFileInfo(path).fileName()));
  auto* table = TableField(dialog, "differences", tr("How far apart the two place each volume; it follows what you do here"),
                           {tr("Volume"), tr("Middle, mm"), tr("Farthest corner, mm"), tr("Turned, \u00b0")});
  table->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  table->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  auto* beside =
      CheckField(dialog, "besideFirst", tr("&Beside the first volume"), tr("What moved all volumes together is no difference"));
  beside->setChecked(true);
  const auto show = [this, table, beside, other] {
    table->setRowCount(0);
    for (const PoseDifference& each : ComparePoses(bench_->Session()->GetKernel().State(), other, beside->isChecked())) {
      const auto number = [](double value) { return QString::number(value, 'f', 2); };
      InsertRow(table, table->rowCount(),
                each.isKnown
                    ? QStringList{bench_->NameOf(each.id), number(each.middleMm), number(each.mostMm), number(each.degrees)}
                    : QStringList{bench_->NameOf(each.id), tr("not there"), {}, {}});
    }
  };
  show();
  connect(beside, &QCheckBox::toggled, dialog, show);
  for (auto changed : {&Workbench::PosesChanged, &Workbench::VolumesChanged})
    connect(bench_, changed, dialog, show);
  connect(bench_, &Workbench::ScoredChanged, dialog, [this, dialog] {
    if (bench_->IsScored())
      dialog->close();
  });
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, dialog);
  auto* copyTable = buttons->addButton(tr("Copy &table"), QDialogButtonBox::ActionRole);
  connect(copyTable, &QPushButton::clicked, dialog, [table] {
    QString text;
    for (int row = -1; row < table->rowCount(); row++)
      for (int column = 0; column < table->columnCount(); column++)
        text += (row < 0 ? table->horizontalHeaderItem(column) : table->item(row, column))->text() +
                (column + 1 < table->columnCount() ? "\t" : "\n");
    QApplication::clipboard()->setText(text);
  });
  connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::close);
  auto* layout = new QVBoxLayout(dialog);
  layout->addWidget(table);
  layout->addWidget(beside);
  layout->addWidget(buttons);
  new FocusRing(dialog);
  dialog->resize(560, 300);
  dialog->show();
}

} // namespace echorama
