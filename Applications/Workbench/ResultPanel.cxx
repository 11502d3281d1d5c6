// SPDX-License-Identifier: BSD-3-Clause
#include "ResultPanel.h"
#include "AlgorithmRun.h"
#include "Job.h"
#include "JobBar.h"
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkUltrasoundAlignmentSession.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

namespace {

// A combination box of names by number, as the stitcher tells them.
QComboBox* ChoiceOfMethods(const char* (*nameOf)(int), const char* objectName, int chosen, const QString& tip, QWidget* parent)
{
  auto* box = new QComboBox(parent);
  box->setObjectName(objectName);
  box->setToolTip(tip);
  for (int i = 0; nameOf(i); ++i)
    box->addItem(QString::fromLatin1(nameOf(i)));
  box->setCurrentIndex(chosen);
  return box;
}

} // namespace

ResultPanel::ResultPanel(Workspace& workspace, QWidget* parent) : QWidget(parent), workspace_(workspace)
{
  setObjectName("resultPanel");
  const vtkNew<vtkUltrasoundStitcher> defaults;
  method_ = ChoiceOfMethods(&vtkUltrasoundStitcher::GetMethodName, "stitchMethod", defaults->GetMethod(),
                            tr("How one volume goes over into the next"), this);
  texture_ = ChoiceOfMethods(&vtkUltrasoundStitcher::GetTextureName, "stitchTexture", defaults->GetTexture(),
                             tr("What happens to speckle where volumes overlap: mixing blurs it, the others keep it"), this);
  const vtkNew<vtkUltrasoundEmbedder> embedding;
  spacing_ = new QDoubleSpinBox(this);
  spacing_->setObjectName("stitchSpacing");
  spacing_->setRange(0.0, 20.0);
  spacing_->setDecimals(3);
  spacing_->setSingleStep(0.1);
  spacing_->setSuffix(tr(" mm"));
  spacing_->setSpecialValueText(tr("as the volumes"));
  spacing_->setToolTip(tr("Side of the result's voxels"));
  gain_ = new QCheckBox(tr("Equalise gain"), this);
  gain_->setObjectName("stitchGain");
  gain_->setToolTip(tr("First gives the volumes the same brightness and contrast where they overlap"));
  gain_->setChecked(defaults->GetEqualizeGain());
  embed_ = new QCheckBox(tr("Embed in a background"), this);
  embed_->setObjectName("embed");
  embed_->setToolTip(tr("Puts the result into the fan that holds it, in noise of its own brightness and grain"));
  margin_ = new QDoubleSpinBox(this);
  margin_->setObjectName("embedMargin");
  margin_->setRange(0.0, 200.0);
  margin_->setValue(embedding->GetMarginMm());
  margin_->setSuffix(tr(" mm"));
  margin_->setToolTip(tr("How much larger than the data the background is"));
  preview_ = new QPushButton(tr("Pre&view"), this);
  preview_->setObjectName("stitchPreview");
  preview_->setToolTip(tr("Quickly, with voxels twice as large"));
  make_ = new QPushButton(tr("&Make"), this);
  make_->setObjectName("stitchMake");
  make_->setToolTip(tr("With full resolution"));
  save_ = new QPushButton(tr("Save result…"), this);
  save_->setObjectName("stitchSave");
  text_ = new QLabel(tr("Stitches the volumes that are shown."), this);
  text_->setObjectName("stitchText");
  text_->setWordWrap(true);

  auto* layout = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  form->addRow(tr("Method"), method_);
  form->addRow(tr("Texture"), texture_);
  form->addRow(tr("Voxels"), spacing_);
  form->addRow(gain_);
  form->addRow(embed_);
  form->addRow(tr("Margin"), margin_);
  layout->addLayout(form);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(preview_);
  buttons->addWidget(make_);
  layout->addLayout(buttons);
  layout->addWidget(text_);
  layout->addWidget(save_);
  connect(preview_, &QPushButton::clicked, this, [this] { Make(true); });
  connect(make_, &QPushButton::clicked, this, [this] { Make(false); });
  connect(embed_, &QCheckBox::toggled, this, &ResultPanel::ShowState);
  connect(save_, &QPushButton::clicked, this, [this] {
    const QString path = QFileDialog::getSaveFileName(this, tr("Save result"), "stitched.mha",
                                                      tr("Volumes (*.mha *.mhd *.nrrd *.nhdr *.nii *.nii.gz *.vti *.vdb)"));
    if (!path.isEmpty())
      Save(path);
  });
  ShowState();
}

ResultPanel::~ResultPanel()
{
  delete job_; // before the buttons
}

void ResultPanel::SetView(QWidget* view)
{
  view->setMinimumHeight(220);
  static_cast<QVBoxLayout*>(layout())->addWidget(view, 1);
}

void ResultPanel::ShowState()
{
  preview_->setEnabled(!job_);
  make_->setEnabled(!job_);
  save_->setEnabled(!job_ && volume_);
  margin_->setEnabled(embed_->isChecked());
}

void ResultPanel::Make(bool preview)
{
  if (job_)
    return;
  vtkNew<vtkMultiBlockDataSet> shown; // it stays as it is, whatever the session does
  workspace_.session->GetVolumes(shown, true);
  const unsigned int count = shown->GetNumberOfBlocks();
  if (count == 0) {
    workspace_.say(tr("Stitch: no volume is shown"), true);
    return;
  }
  const auto stitcher = vtkSmartPointer<vtkUltrasoundStitcher>::New();
  stitcher->SetInputDataObject(shown);
  stitcher->SetMethod(method_->currentIndex());
  stitcher->SetTexture(texture_->currentIndex());
  stitcher->SetSpacingMm(spacing_->value());
  stitcher->SetEqualizeGain(gain_->isChecked());
  vtkSmartPointer<vtkUltrasoundEmbedder> embedder;
  if (embed_->isChecked()) {
    embedder = vtkSmartPointer<vtkUltrasoundEmbedder>::New();
    embedder->SetMarginMm(margin_->value());
  }
  const auto made = std::make_shared<vtkSmartPointer<vtkImageData>>();
  const QString label = embedder ? tr("Stitch and embed") : tr("Stitch");
  job_ = Job::Start(
      this, preview ? tr("%1 (preview)").arg(label) : label,
      [stitcher, embedder, made, preview](const Progress& progress) {
        if (preview) {
          stitcher->UpdateInformation();
          double spacing[3];
          stitcher->GetOutputInformation(0)->Get(vtkDataObject::SPACING(), spacing);
          stitcher->SetSpacingMm(2.0 * *std::min_element(spacing, spacing + 3));
        }
        Update(stitcher, progress.Part(0.0, embedder ? 0.4 : 1.0));
        *made = stitcher->GetOutput();
        if (embedder) {
          embedder->SetInputData(0, *made);
          Update(embedder, progress.Part(0.4, 1.0));
          *made = embedder->GetOutput();
        }
      },
      [this, made, preview] {
        const int* size = (*made)->GetDimensions();
        double spacing[3];
        (*made)->GetSpacing(spacing);
        Show(*made, tr("%1%2 × %3 × %4 voxels of %5 mm")
                        .arg(preview ? tr("Preview: ") : QString())
                        .arg(size[0])
                        .arg(size[1])
                        .arg(size[2])
                        .arg(spacing[0], 0, 'g', 3));
      },
      [this, label](const QString& error) { workspace_.say(tr("%1: %2").arg(label, error), true); });
  connect(job_, &Job::Ended, this, [this] {
    job_ = nullptr;
    ShowState();
  });
  workspace_.jobs->Watch(job_);
  ShowState();
}

void ResultPanel::Show(vtkImageData* volume, const QString& text)
{
  volume_ = volume;
  vtkUltrasoundAlignmentSession* session = result_.session;
  while (session->GetNumberOfVolumes() > 0)
    session->RemoveVolume(session->GetVolumeId(0));
  session->AddVolume(volume, nullptr, "result");
  session->ForgetHistory(); // else every result would be kept
  text_->setText(text);
  ShowState();
  emit ResultChanged();
}

void ResultPanel::Save(const QString& path)
{
  if (job_ || !volume_)
    return;
  const auto writer = vtkSmartPointer<vtkUltrasoundWriter>::New();
  writer->SetInputDataObject(volume_);
  writer->SetFileName(path.toUtf8());
  job_ = Job::Start(
      this, tr("Save result"), [writer](const Progress& progress) { Run(writer, progress, [&] { writer->Write(); }); },
      [this, path, writer] {
        const QString notes = QString::fromStdString(writer->GetNotes());
        workspace_.say(notes.isEmpty() ? tr("Saved %1").arg(path) : tr("Saved %1. %2").arg(path, notes), false);
      },
      [this, path](const QString& error) { workspace_.say(tr("Saving %1: %2").arg(path, error), true); });
  connect(job_, &Job::Ended, this, [this] {
    job_ = nullptr;
    ShowState();
  });
  workspace_.jobs->Watch(job_);
  ShowState();
}

} // namespace echorama
