// SPDX-License-Identifier: BSD-3-Clause
#include "ResultPanel.h"
#include "AlgorithmRun.h"
#include "Controls.h"
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
#include <vtkUltrasoundDeformableAligner.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

namespace {

// By number, as the stitcher tells them.
std::vector<std::string> NamesOf(ParameterList parameters, const char* choice)
{
  return std::get<Choice>(Named(parameters, choice).value).names;
}

} // namespace

ResultPanel::ResultPanel(Workspace& workspace, QWidget* parent) : JobPanel(workspace, parent)
{
  setObjectName("resultPanel");
  const vtkNew<vtkUltrasoundStitcher> defaults;
  const vtkNew<vtkUltrasoundEmbedder> embedding;
  method_ =
      ChoiceField(this, "stitchMethod", tr("How one volume goes over into the next"), NamesOf(defaults->Parameters(), "Method"));
  method_->setCurrentIndex(defaults->GetMethod());
  texture_ =
      ChoiceField(this, "stitchTexture", tr("What happens to speckle where volumes overlap: mixing blurs it, the others keep it"),
                  NamesOf(defaults->Parameters(), "Texture"));
  texture_->setCurrentIndex(defaults->GetTexture());
  spacing_ = NumberField(this, {"stitchSpacing", tr("Side of the result's voxels"), 0.0, 20.0, 3, 0.1, tr(" mm")});
  spacing_->setSpecialValueText(tr("as the volumes"));
  gain_ = CheckField(this, "stitchGain", tr("Equalise gain"),
                     tr("First gives the volumes the same brightness and contrast where they overlap"));
  gain_->setChecked(defaults->GetEqualizeGain());
  deformable_ = CheckField(this, "stitchDeformable", tr("Deformable"),
                           tr("First finds how tissue was deformed between the volumes, and reads them where it belongs"));
  embed_ = CheckField(this, "embed", tr("Embed in a background"),
                      tr("Puts the result into the fan that holds it, in noise of its own brightness and grain"),
                      [this](bool) { ShowState(); });
  margin_ =
      NumberField(this, {"embedMargin", tr("How much larger than the data the background is"), 0.0, 200.0, 2, 1.0, tr(" mm")});
  margin_->setValue(embedding->GetMarginMm());
  preview_ = Button(this, "stitchPreview", tr("Pre&view"), tr("Quickly, with voxels twice as large"), [this] { Make(true); });
  make_ = Button(this, "stitchMake", tr("&Make"), tr("With full resolution"), [this] { Make(false); });
  save_ = Button(this, "stitchSave", tr("Save result…"), tr("As a file; its extension names the format"), [this] {
    const QString path = QFileDialog::getSaveFileName(this, tr("Save result"), "stitched.mha",
                                                      tr("Volumes (*.mha *.mhd *.nrrd *.nhdr *.nii *.nii.gz *.vti *.vdb)"));
    if (!path.isEmpty())
      Save(path);
  });
  text_ = TextField(this, "stitchText");
  text_->setText(tr("Stitches the volumes that are shown."));

  auto* layout = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  form->addRow(tr("Method"), method_);
  form->addRow(tr("Texture"), texture_);
  form->addRow(tr("Voxels"), spacing_);
  form->addRow(gain_);
  form->addRow(deformable_);
  form->addRow(embed_);
  form->addRow(tr("Margin"), margin_);
  layout->addLayout(form);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(preview_);
  buttons->addWidget(make_);
  layout->addLayout(buttons);
  layout->addWidget(text_);
  layout->addWidget(save_);
  ShowState();
}

void ResultPanel::SetView(QWidget* view)
{
  view->setMinimumHeight(220);
  static_cast<QVBoxLayout*>(layout())->addWidget(view, 1);
}

void ResultPanel::ShowState()
{
  preview_->setEnabled(!IsRunning());
  make_->setEnabled(!IsRunning());
  save_->setEnabled(!IsRunning() && volume_);
  margin_->setEnabled(embed_->isChecked());
}

void ResultPanel::Make(bool preview)
{
  if (IsRunning())
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
  vtkSmartPointer<vtkUltrasoundDeformableAligner> deformer;
  if (deformable_->isChecked() && count > 1) {
    deformer = vtkSmartPointer<vtkUltrasoundDeformableAligner>::New();
    deformer->SetInputDataObject(shown);
  }
  const auto made = std::make_shared<vtkSmartPointer<vtkImageData>>();
  const QString label = embedder ? tr("Stitch and embed") : tr("Stitch");
  Start(
      preview ? tr("%1 (preview)").arg(label) : label,
      [stitcher, deformer, embedder, made, preview](const Progress& progress) {
        if (deformer) {
          Update(deformer, progress.Part(0.0, 0.5));
          stitcher->AddDisplacementData(deformer->GetOutputDataObject(1));
        }
        const Progress rest = progress.Part(deformer ? 0.5 : 0.0, 1.0);
        if (preview) {
          stitcher->UpdateInformation();
          double spacing[3];
          stitcher->GetOutputInformation(0)->Get(vtkDataObject::SPACING(), spacing);
          stitcher->SetSpacingMm(2.0 * *std::min_element(spacing, spacing + 3));
        }
        Update(stitcher, rest.Part(0.0, embedder ? 0.4 : 1.0));
        *made = stitcher->GetOutput();
        if (embedder) {
          embedder->SetInputData(0, *made);
          Update(embedder, rest.Part(0.4, 1.0));
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
      });
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
  if (IsRunning() || !volume_)
    return;
  const auto writer = vtkSmartPointer<vtkUltrasoundWriter>::New();
  writer->SetInputDataObject(volume_);
  writer->SetFileName(path.toUtf8());
  Start(
      tr("Save result"), [writer](const Progress& progress) { Run(writer, progress, [&] { writer->Write(); }); },
      [this, path, writer] {
        const QString notes = QString::fromStdString(writer->GetNotes());
        workspace_.say(notes.isEmpty() ? tr("Saved %1").arg(path) : tr("Saved %1. %2").arg(path, notes), false);
      });
}

} // namespace echorama
