// SPDX-License-Identifier: BSD-3-Clause
#include "ResultPanel.h"
#include "Controls.h"
#include "ParameterPanel.h"
#include "ResultFile.h"
#include <algorithm>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>
#include <vtkCompositeDataSet.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>

namespace echorama {

namespace {

constexpr const char* VolumeFilter = "*.mha *.mhd *.nrrd *.nhdr *.nii *.nii.gz *.vti *.vdb";

// By number, as the stitcher tells them.
std::vector<std::string> NamesOf(ParameterList parameters, const char* choice)
{
  return std::get<Choice>(Named(parameters, choice).value).names;
}

QString HelpOf(ParameterList parameters, const char* name)
{
  return QString::fromStdString(Named(parameters, name).help);
}

// What a control of a ParameterPanel sets; what is refused stays as it was.
void SetParameter(ParameterList parameters, const char* name, const std::string& text)
{
  Parameter& parameter = Named(parameters, name);
  const std::string before = parameter.Text();
  try {
    parameter.Set(text);
    parameter.Check();
  } catch (const Error&) {
    parameter.Set(before);
  }
}

// So that a narrow panel is enough: fields go below their names, and lists are as wide as there is room.
QFormLayout* NarrowForm(QWidget* parent = nullptr)
{
  auto* form = parent ? new QFormLayout(parent) : new QFormLayout;
  form->setRowWrapPolicy(QFormLayout::WrapLongRows);
  form->setFieldGrowthPolicy(QFormLayout::AllNonFixedFieldsGrow);
  if (parent)
    form->setContentsMargins(0, 0, 0, 0);
  return form;
}

} // namespace

ResultPanel::ResultPanel(Workspace& workspace, QWidget* parent) : JobPanel(workspace, parent)
{
  setObjectName("resultPanel");
  MakeFields();
  preview_ = Button(this, "stitchPreview", tr("Pre&view"), tr("Quickly, with voxels twice as large"), [this] { Make(true); });
  make_ = Button(this, "stitchMake", tr("&Make"), tr("With full resolution"), [this] { Make(false); });
  compare_ = Button(this, "stitchCompare", tr("&Compare with sources"),
                    tr("Shows the result alone, and then its sources instead, in all views (T)"), [this] { Compare(); });
  save_ = Button(this, "stitchSave", tr("Save result…"), tr("As a file; its extension names the format"), [this] {
    const QString path =
        QFileDialog::getSaveFileName(this, tr("Save result"), NameOf(target_) + ".mha", tr("Volumes (%1)").arg(VolumeFilter));
    if (!path.isEmpty())
      Save(path);
  });
  of_ = TextField(this, "stitchOf", tr("What it will be made of"));
  text_ = TextField(this, "stitchText");
  changed_ = TextField(this, "stitchChanged");
  again_ = Button(this, "stitchAgain", tr("Make &again"),
                  tr("Of its sources as they are now, as it was made before. What was painted on it is painted again"),
                  [this] { MakeAgain(again_->property("of").toInt()); });
  Arrange();
  ShowFields();
  ShowResults();
}

void ResultPanel::MakeFields()
{
  const ParameterList stitching = recipe_.Stitching(), embedding = recipe_.Embedding();
  into_ = new QComboBox(this);
  into_->setObjectName("stitchInto");
  into_->setAccessibleName(tr("Result"));
  into_->setToolTip(tr("Which volume is made: a new one, or one that was made before takes other voxels"));
  connect(into_, qOverload<int>(&QComboBox::activated), this, [this](int i) { SetTarget(into_->itemData(i).toInt()); });
  method_ = ChoiceField(this, "stitchMethod", HelpOf(stitching, "Method"), NamesOf(stitching, "Method"));
  texture_ = ChoiceField(this, "stitchTexture", HelpOf(stitching, "Texture"), NamesOf(stitching, "Texture"));
  spacing_ = NumberField(this, {"stitchSpacing", HelpOf(stitching, "SpacingMm"), 0.0, 20.0, 3, 0.1, tr(" mm")});
  spacing_->setSpecialValueText(tr("as the volumes"));
  gain_ = CheckField(this, "stitchGain", tr("Equalise gain"),
                     tr("First gives the volumes the same brightness and contrast where they overlap"));
  deformable_ = CheckField(this, "stitchDeformable", tr("Deformable"),
                           tr("First finds how tissue was deformed between the volumes, and reads them where it belongs"));
  embed_ = CheckField(this, "embed", tr("Embed in a background"),
                      tr("Puts the result into the fan that holds it, in noise of its own brightness and grain"),
                      [this](bool) { ShowState(); });
  margin_ = NumberField(this, {"embedMargin", HelpOf(embedding, "MarginMm"), -1.0, 200.0, 2, 1.0, tr(" mm")});
  margin_->setSpecialValueText(tr("automatic"));
  for (QComboBox* field : {method_, texture_}) // what matters below depends on them
    connect(field, qOverload<int>(&QComboBox::currentIndexChanged), this, [this] {
      TakeFields();
      stitchMore_->ShowValues();
    });
  more_ = SmallButton(this, "stitchMore", tr("More…"), tr("Further parameters of the stitching and of the background"));
  more_->setCheckable(true);
  more_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  more_->setArrowType(Qt::RightArrow);
  more_->setFocusPolicy(Qt::StrongFocus);
  moreBox_ = MoreFields();
  moreBox_->hide();
  connect(more_, &QToolButton::toggled, this, [this](bool on) {
    moreBox_->setVisible(on);
    more_->setArrowType(on ? Qt::DownArrow : Qt::RightArrow);
  });
}

QWidget* ResultPanel::MoreFields()
{
  auto* box = new QWidget(this);
  auto* layout = new QVBoxLayout(box);
  layout->setContentsMargins(0, 0, 0, 0);
  takesResults_ =
      CheckField(box, "stitchResults", tr("Results are sources, too"),
                 tr("Also takes volumes that were made of others, when they are shown"), [this](bool) { ShowResults(); });
  layout->addWidget(takesResults_);
  using Controls = std::vector<ParameterPanel::Control>;
  stitchMore_ = new ParameterPanel(
      [this] { return recipe_.Stitching(); },
      Controls{{"Sharpness", tr("Sharpness"), 0.0, 19.0},
               {"DetailSharpness", tr("Sharpness of details"), 0.0, 64.0},
               {"DetailScale", tr("Scale of details"), 1.0, 10.0, {}, "", tr("voxels")},
               {"AllowDisjoint", tr("Allow gaps")}},
      [this](const char* name, const std::string& text) { SetParameter(recipe_.Stitching(), name, text); }, box);
  embedMore_ = new ParameterPanel(
      [this] { return recipe_.Embedding(); },
      Controls{{"FeatherMm", tr("Feather"), -1.0, 15.0, tr("automatic")},
               {"Outline", tr("Kind of outline")},
               {"KeepTexture", tr("Keep texture")},
               {"SmoothMm", tr("Smoothing"), 0.5, 20.0},
               {"MatchGrain", tr("Match grain")},
               {"MatchContrast", tr("Match contrast")},
               {"InsideExponent", tr("Spread inside"), 1.0, 16.0},
               {"OutsideExponent", tr("Spread outside"), 1.0, 16.0},
               {"OverlapDegrees", tr("Noise overlaps"), 0.0, 60.0},
               {"Seed", tr("Seed"), 0.0, 200.0}},
      [this](const char* name, const std::string& text) { SetParameter(recipe_.Embedding(), name, text); }, box);
  for (ParameterPanel* panel : {stitchMore_, embedMore_}) {
    auto* form = static_cast<QFormLayout*>(panel->layout());
    form->setContentsMargins(0, 0, 0, 0);
    form->setRowWrapPolicy(QFormLayout::WrapAllRows);
  }
  moreEmbed_ = new QWidget(box);
  auto* form = NarrowForm(moreEmbed_);
  form->setRowWrapPolicy(QFormLayout::WrapAllRows);
  form_ = new QComboBox(moreEmbed_);
  form_->setObjectName("embedForm");
  form_->setAccessibleName(tr("Outline"));
  form_->setToolTip(
      tr("The fan whose form the background has: the smallest that holds the data, or that of a source, which grows "
         "until it holds them"));
  noise_ = new QLineEdit(moreEmbed_);
  noise_->setObjectName("embedNoise");
  noise_->setAccessibleName(tr("Noise volumes"));
  noise_->setPlaceholderText(tr("noise is made"));
  noise_->setToolTip(tr("Files of real noise, which are placed side by side and fill the background; several are parted by ;"));
  auto* browse = SmallButton(moreEmbed_, "embedNoiseBrowse", "…", tr("Chooses the files"));
  connect(browse, &QToolButton::clicked, this, [this] {
    auto* dialog = new QFileDialog(this, tr("Noise volumes"), {}, tr("Volumes (%1);;All files (*)").arg(VolumeFilter));
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setFileMode(QFileDialog::ExistingFiles);
    connect(dialog, &QFileDialog::filesSelected, noise_, [this](const QStringList& files) { noise_->setText(files.join("; ")); });
    dialog->open();
  });
  auto* row = new QHBoxLayout;
  row->addWidget(noise_, 1);
  row->addWidget(browse);
  form->addRow(tr("Outline"), form_);
  form->addRow(tr("Noise volumes"), row);
  layout->addWidget(stitchMore_);
  layout->addWidget(embedMore_);
  layout->addWidget(moreEmbed_);
  return box;
}

void ResultPanel::Arrange()
{
  for (QComboBox* field : findChildren<QComboBox*>()) {
    field->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    field->setMinimumContentsLength(10);
  }
  auto* layout = new QVBoxLayout(this);
  auto* form = NarrowForm();
  form->addRow(tr("Result"), into_);
  form->addRow(tr("Method"), method_);
  form->addRow(tr("Texture"), texture_);
  form->addRow(tr("Voxels"), spacing_);
  form->addRow(gain_);
  form->addRow(deformable_);
  form->addRow(embed_);
  form->addRow(tr("Margin"), margin_);
  layout->addLayout(form);
  layout->addWidget(more_);
  layout->addWidget(moreBox_);
  layout->addWidget(of_);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(preview_);
  buttons->addWidget(make_);
  layout->addLayout(buttons);
  layout->addWidget(text_);
  layout->addWidget(changed_);
  layout->addWidget(again_);
  layout->addWidget(compare_);
  layout->addWidget(save_);
  layout->addStretch(1);
}

QString ResultPanel::NameOf(int id) const
{
  return id > 0 ? QString::fromStdString(workspace_.session->GetName(id)) : tr("result");
}

// What is shown; of a result that is made once more also what it was made of, hidden or not.
std::vector<int> ResultPanel::Sources(int target) const
{
  const vtkUltrasoundAlignmentSession* session = workspace_.session;
  std::vector<int> ids;
  const auto add = [&ids](int id) {
    if (id > 0 && std::find(ids.begin(), ids.end(), id) == ids.end())
      ids.push_back(id);
  };
  for (int i = 0; i < session->GetNumberOfSources(target); ++i)
    add(session->GetSource(target, i));
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i)
    if (const int id = session->GetVolumeId(i);
        id != target && session->GetVisible(id) && (takesResults_->isChecked() || !session->IsResult(id)))
      add(id);
  return ids;
}

void ResultPanel::SetTarget(int id)
{
  target_ = workspace_.session->IsResult(id) ? id : 0;
  if (target_ > 0) {
    recipe_.Take(workspace_.session->GetKernel().State().Find(id)->madeOf->options);
    ShowFields();
    const int form = recipe_.form > 0 ? workspace_.session->GetSource(id, recipe_.form - 1) : 0;
    ShowForms();
    MayBeLong(form_);
    form_->setCurrentIndex(std::max(0, form_->findData(form)));
  }
  ShowResults();
}

void ResultPanel::TakeFields()
{
  ParameterList stitching = recipe_.Stitching(), embedding = recipe_.Embedding();
  Named(stitching, "Method").SetNumber(method_->currentIndex());
  Named(stitching, "Texture").SetNumber(texture_->currentIndex());
  Named(stitching, "SpacingMm").SetNumber(spacing_->value());
  Named(stitching, "EqualizeGain").SetNumber(gain_->isChecked() ? 1.0 : 0.0);
  Named(embedding, "MarginMm").SetNumber(margin_->value());
  recipe_.isDeformable = deformable_->isChecked();
  recipe_.isEmbedded = embed_->isChecked();
  const std::vector<int> sources = Sources(target_);
  const auto form = std::find(sources.begin(), sources.end(), form_->currentData().toInt());
  recipe_.form = form == sources.end() ? 0 : static_cast<int>(form - sources.begin()) + 1;
  recipe_.noise.clear();
  for (const QString& file : noise_->text().split(';'))
    if (!file.trimmed().isEmpty())
      recipe_.noise.append(file.trimmed());
}

void ResultPanel::ShowFields()
{
  ParameterList stitching = recipe_.Stitching(), embedding = recipe_.Embedding();
  const auto number = [](ParameterList& of, const char* name) { return Named(of, name).Number(); };
  for (QComboBox* field : {method_, texture_}) {
    const QSignalBlocker quiet(field);
    field->setCurrentIndex(static_cast<int>(number(stitching, field == method_ ? "Method" : "Texture")));
  }
  spacing_->setValue(number(stitching, "SpacingMm"));
  gain_->setChecked(number(stitching, "EqualizeGain") != 0.0);
  margin_->setValue(number(embedding, "MarginMm"));
  deformable_->setChecked(recipe_.isDeformable);
  embed_->setChecked(recipe_.isEmbedded);
  noise_->setText(recipe_.noise.join("; "));
  stitchMore_->ShowValues();
  embedMore_->ShowValues();
}

void ResultPanel::ShowForms()
{
  const int chosen = form_->currentData().toInt();
  form_->clear();
  form_->addItem(tr("found from the data"), 0);
  for (const int id : Sources(target_))
    form_->addItem(tr("fan of %1").arg(NameOf(id)), id);
  form_->setCurrentIndex(std::max(0, form_->findData(chosen)));
}

void ResultPanel::ShowResults()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  if (!session->IsResult(target_))
    target_ = 0;
  into_->clear();
  into_->addItem(tr("a new volume"), 0);
  int changed = 0;
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (!session->IsResult(id))
      continue;
    into_->addItem(NameOf(id), id);
    if (!session->GetSourcesChanged(id).empty() && (changed == 0 || id == target_))
      changed = id;
  }
  MayBeLong(into_);
  into_->setCurrentIndex(std::max(0, into_->findData(target_)));
  ShowForms();
  QStringList names;
  for (const int id : Sources(target_))
    names.append(Breakable(NameOf(id)));
  of_->setText(names.isEmpty() ? tr("No volume is shown.") : tr("Of %1").arg(names.join(", ")));
  changed_->setVisible(changed > 0);
  again_->setVisible(changed > 0);
  again_->setProperty("of", changed);
  if (changed > 0)
    changed_->setText(
        tr("%1: sources changed: %2.")
            .arg(Breakable(NameOf(changed)), Breakable(QString::fromStdString(session->GetSourcesChanged(changed)))));
  ShowState();
}

void ResultPanel::ShowState()
{
  for (QPushButton* button : {preview_, make_, again_})
    button->setEnabled(!IsRunning());
  save_->setEnabled(!IsRunning() && target_ > 0);
  compare_->setEnabled(Compared() > 0);
  margin_->setEnabled(embed_->isChecked());
  embedMore_->setEnabled(embed_->isChecked());
  moreEmbed_->setEnabled(embed_->isChecked());
}

void ResultPanel::Make(bool preview)
{
  TakeFields();
  recipe_.isPreview = preview;
  Begin(target_, Sources(target_), recipe_);
}

void ResultPanel::MakeAgain(int id)
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  if (!session->IsResult(id))
    return;
  ResultRecipe recipe;
  recipe.Take(session->GetKernel().State().Find(id)->madeOf->options);
  std::vector<int> sources;
  int form = 0;
  for (int i = 0; i < session->GetNumberOfSources(id); ++i)
    if (const int source = session->GetSource(id, i); source > 0) {
      sources.push_back(source);
      if (recipe.form == i + 1)
        form = static_cast<int>(sources.size());
    }
  if (recipe.form > 0 && form == 0)
    workspace_.say(tr("The volume whose fan was the outline of %1 is gone: the fan is found from the data").arg(NameOf(id)),
                   true);
  recipe.form = form;
  Begin(id, sources, recipe);
}

void ResultPanel::Begin(int target, const std::vector<int>& sources, const ResultRecipe& recipe)
{
  if (IsRunning())
    return;
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  if (sources.empty()) {
    workspace_.say(tr("Stitch: %1")
                       .arg(target > 0 ? tr("the sources of %1 are gone").arg(NameOf(target))
                                       : tr("no volume is shown; tick one in the list of volumes")),
                   true);
    return;
  }
  if (sources.size() < 2 && !recipe.isEmbedded) {
    workspace_.say(tr("Stitch: two volumes are needed, and there is %1 alone").arg(NameOf(sources.front())), true);
    return;
  }
  const vtkNew<vtkMultiBlockDataSet> blocks;
  for (const int id : sources) {
    const vtkNew<vtkImageData> image; // it stays as it is, whatever the session does
    session->GetSnapshot(id, image);
    const unsigned int block = blocks->GetNumberOfBlocks();
    blocks->SetBlock(block, image);
    blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), session->GetName(id).c_str());
  }
  const auto options = recipe.ToOptions();
  const std::string record = TextOf(RecordSources(session->GetKernel().State(), sources, options));
  const auto made = std::make_shared<vtkSmartPointer<vtkImageData>>();
  const QString label = recipe.isEmbedded ? tr("Stitch and embed") : tr("Stitch");
  Start(
      recipe.isPreview ? tr("%1 (preview)").arg(label) : label,
      [blocks = vtkSmartPointer<vtkMultiBlockDataSet>(blocks), options, made](const Progress& progress) {
        *made = ResultRecipe::Make(options, blocks, progress);
      },
      [this, target, sources, record, made] {
        workspace_.BetweenEdits(this, [this, target, sources, record, made] { Put(target, sources, record, *made); });
      });
}

void ResultPanel::Put(int target, const std::vector<int>& sources, const std::string& record, vtkImageData* image)
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  // Ids are never given twice: without any of them this is another project.
  if (std::none_of(sources.begin(), sources.end(), [session](int id) { return session->HasVolume(id); })) {
    workspace_.say(tr("Stitch: result discarded, because its sources were closed in the meantime"), true);
    return;
  }
  const bool isNew = !session->IsResult(target);
  int id = target;
  if (isNew) {
    session->BeginEdit(tr("Make a result").toUtf8());
    id = session->AddResult(image, "result", record.c_str());
    for (int i = 0; i < session->GetNumberOfSources(id); ++i) // it would lie among them
      session->SetVisible(session->GetSource(id, i), false);
    session->EndEdit();
  } else if (!session->RemakeResult(id, image, record.c_str())) {
    return;
  }
  if (id == 0)
    return;
  int size[3];
  double spacing[3];
  image->GetDimensions(size);
  image->GetSpacing(spacing);
  text_->setText(tr("%1%2: %3 × %4 × %5 voxels of %6 mm")
                     .arg(session->GetResultOption(id, "Preview") == "on" ? tr("Preview of ") : QString())
                     .arg(NameOf(id))
                     .arg(size[0])
                     .arg(size[1])
                     .arg(size[2])
                     .arg(spacing[0], 0, 'g', 3));
  target_ = id;
  if (isNew) {
    session->Select(id, true, true);
    emit Made(id);
  }
  ShowResults();
}

int ResultPanel::Compared() const
{
  const vtkUltrasoundAlignmentSession* session = workspace_.session;
  int any = target_;
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (session->IsResult(id) && session->IsSelected(id))
      return id;
    any = any == 0 && session->IsResult(id) ? id : any;
  }
  return any;
}

void ResultPanel::Compare()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  const int id = Compared();
  if (id == 0) {
    workspace_.say(tr("Compare with sources: nothing was stitched yet"), true);
    return;
  }
  bool isAnyShown = false;
  for (int i = 0; i < session->GetNumberOfSources(id); ++i)
    isAnyShown |= session->GetVisible(session->GetSource(id, i));
  const bool showsResult = isAnyShown || !session->GetVisible(id);
  session->BeginEdit((showsResult ? tr("Show %1") : tr("Show the sources of %1")).arg(NameOf(id)).toUtf8());
  session->SetVisible(id, showsResult);
  for (int i = 0; i < session->GetNumberOfSources(id); ++i)
    if (const int source = session->GetSource(id, i); source > 0)
      session->SetVisible(source, !showsResult);
  session->EndEdit();
}

void ResultPanel::Save(const QString& path)
{
  if (target_ > 0)
    SaveResult(workspace_, this, target_, path);
}

} // namespace echorama
