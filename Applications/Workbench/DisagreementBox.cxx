// SPDX-License-Identifier: BSD-3-Clause
#include "DisagreementBox.h"
#include "Controls.h"
#include "Core/Base/Percentile.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>
#include <vtkImageData.h>
#include <vtkUltrasoundDisagreement.h>

namespace echorama {

struct DisagreementBox::Found {
  std::vector<Compared> compared;
  std::vector<vtkSmartPointer<vtkImageData>> images;
  std::vector<std::string> names;
  DisagreementParameters parameters;
  DisagreementMap map;

  void Run(const Progress& progress)
  {
    std::vector<vtkUltrasoundVolume::Input> volumes;
    for (std::size_t i = 0; i < images.size(); ++i)
      volumes.push_back(vtkUltrasoundVolume::CheckInput(nullptr, images[i], names[i]));
    map = vtkUltrasoundDisagreement::Compare(volumes, parameters, progress);
    images.clear();
  }
};

DisagreementBox::DisagreementBox(Workbench* bench, QWidget* parent) : JobPanel(bench->Shared(), parent), bench_(bench)
{
  setObjectName("disagreement");
  DisagreementParameters defaults;
  ParameterList parameters = Describe(defaults);
  const auto number = [this, &parameters](const char* name, const char* of, const QString& help) {
    const Parameter& parameter = Named(parameters, of);
    auto* field = NumberField(this, {name, help, parameter.range.low, parameter.range.high, 1, 1.0, tr(" mm")});
    field->setValue(parameter.Number());
    return field;
  };
  find_ =
      Button(this, "findDisagreement", tr("&Find disagreement"),
             tr("How far the volumes that are shown are from agreeing, block by block, in the background"), [this] { Find(); });
  shown_ = CheckField(this, "showDisagreement", tr("Show in slices"),
                      tr("Colours where something is known; where there is no colour, nothing is"), [this](bool) { ShowMap(); });
  shown_->setChecked(true);
  scale_ = NumberField(this, {"disagreementScale", tr("The shift that has the brightest colour"), 0.1, 100.0, 1, 0.5, tr(" mm")},
                       [this](double) { ShowMap(); });
  Show(scale_, 3.0);
  search_ =
      number("disagreementSearch", "SearchMm", tr("Shifts are looked for so far; what is farther apart stays without colour"));
  block_ = number("disagreementBlock", "BlockMm",
                  tr("Side of the blocks that are compared: larger ones know more, and tell less of where"));
  text_ = TextField(this, "disagreementText");
  here_ = TextField(this, "disagreementHere", tr("Where the mouse points"));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->addWidget(find_);
  layout->addWidget(text_); // what is told is seen without scrolling, also in a small window
  layout->addWidget(here_);
  auto* form = new QFormLayout;
  form->addRow(tr("Search"), search_);
  form->addRow(tr("Blocks"), block_);
  form->addRow(shown_);
  form->addRow(tr("Scale to"), scale_);
  layout->addLayout(form);
  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::VoxelsChanged})
    connect(bench, changed, this, &DisagreementBox::ShowMap);
  connect(bench, &Workbench::PointerChanged, this, &DisagreementBox::ShowHere);
}

DisagreementBox::~DisagreementBox() = default;

std::vector<DisagreementBox::Compared> DisagreementBox::Now() const
{
  std::vector<Compared> now;
  for (const SessionVolume& volume : bench_->Session()->GetKernel().State().volumes)
    if (volume.visible) {
      now.push_back({volume.id, {}, volume.strokes.get()});
      std::copy_n(volume.volumeToWorld.matrix().data(), 16, now.back().pose.begin());
    }
  return now;
}

void DisagreementBox::Find()
{
  const QString label = tr("Disagreement");
  const auto found = std::make_shared<Found>();
  found->compared = Now();
  if (IsRunning())
    return;
  if (found->compared.size() < 2)
    return workspace_.show({Message::Warning, tr("%1: two volumes that are shown are needed").arg(label), {}, objectName()});
  if (!workspace_.mayHelp(label))
    return;
  for (const Compared& each : found->compared) {
    found->images.push_back(vtkSmartPointer<vtkImageData>::New());
    bench_->Session()->GetSnapshot(each.id, found->images.back());
    found->names.push_back(bench_->Session()->GetName(each.id));
  }
  found->parameters.searchMm = search_->value();
  found->parameters.blockMm = block_->value();
  Start(
      label, [found](const Progress& progress) { found->Run(progress); }, [this, found] { Take(found); });
}

void DisagreementBox::Take(const std::shared_ptr<Found>& found)
{
  found_ = found;
  picture_ = vtkSmartPointer<vtkImageData>::New();
  vtkUltrasoundDisagreement::PutOut(found->map, found->map.geometry, picture_);
  ShowMap();
}

void DisagreementBox::ShowMap()
{
  if (!found_)
    return;
  const DisagreementMap& map = found_->map;
  const bool isStale = !(found_->compared == Now());
  bench_->SetShifts({shown_->isChecked() && map.known > 0 ? picture_.Get() : nullptr, scale_->value(), isStale});
  std::vector<double> lengths;
  for (const LocalShift& shift : map.shifts)
    if (shift.knownDirections > 0)
      lengths.push_back(shift.mm);
  QString text = tr("%1 of %2 blocks tell something.").arg(map.known).arg(map.compared);
  if (!lengths.empty())
    text +=
        " " +
        tr("Median %1 mm, 95% below %2 mm.").arg(Percentile(lengths, 0.5), 0, 'f', 2).arg(Percentile(lengths, 0.95), 0, 'f', 2);
  if (map.compared == 0)
    text = tr("The volumes do not overlap.");
  if (isStale)
    text = tr("Stale: volumes have changed since.") + " " + text;
  text_->setText(text);
  ShowHere();
}

void DisagreementBox::ShowHere()
{
  if (!found_ || !bench_->Pointer() || bench_->Interacting() || !isVisible())
    return;
  const DisagreementMap& map = found_->map;
  const Eigen::Vector3d index = map.geometry.WorldToIndex() * *bench_->Pointer();
  const Eigen::Array3d cell = (index.array() + 0.5).floor();
  const auto& n = map.geometry.dimensions;
  const bool isInside = (cell >= 0.0).all() && cell.x() < n[0] && cell.y() < n[1] && cell.z() < n[2];
  const auto at = isInside ? static_cast<std::size_t>((cell.z() * n[1] + cell.y()) * n[0] + cell.x()) : 0;
  if (!isInside || map.fixed[at] < 0)
    return here_->setText(tr("Under the mouse: not known"));
  const LocalShift& shift = map.shifts[at];
  const auto name = [this](std::int16_t volume) {
    return QString::fromStdString(found_->names[static_cast<std::size_t>(volume)]);
  };
  const QString ways = shift.knownDirections == 3   ? QString()
                       : shift.knownDirections == 2 ? tr(", in two directions; the third is not known")
                                                    : tr(", across an edge; along it is not known");
  here_->setText(tr("Under the mouse: %1 \u00b1 %2 mm, %3 and %4%5")
                     .arg(shift.mm, 0, 'f', 2)
                     .arg(shift.errorMm, 0, 'f', 2)
                     .arg(name(map.fixed[at]), name(map.moving[at]), ways));
}

void DisagreementBox::ShowState()
{
  find_->setEnabled(!IsRunning());
}

} // namespace echorama
