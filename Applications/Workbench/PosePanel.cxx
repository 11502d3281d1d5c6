// SPDX-License-Identifier: BSD-3-Clause
// Numbers are of the first selected volume. When several are selected the others make the same motion: they stay as they lie
// to each other, as with the mouse.
#include "PosePanel.h"
#include "Controls.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "Workbench.h"
#include <QDoubleSpinBox>
#include <QEvent>
#include <QGridLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

namespace echorama {

namespace {

constexpr const char* Axes[3] = {"X", "Y", "Z"};
constexpr double Far = 1e5;

// Places a volume, and gives all others that are selected the same motion of the world. One entry of undo.
void PlaceSelection(Workbench* bench, int id, const double middle[3], const double degrees[3])
{
  auto* session = bench->Session();
  const QVector<int> selected = bench->SelectedVolumes();
  session->BeginEdit(QObject::tr("Place %1").arg(bench->NameOf(id)).toUtf8().constData());
  const auto& volumes = session->GetKernel().State();
  const Pose before = volumes.Find(id)->volumeToWorld;
  if (!session->SetPlacement(id, middle[0], middle[1], middle[2], degrees[0], degrees[1], degrees[2])) {
    session->CancelEdit();
    return;
  }
  const Pose motion = volumes.Find(id)->volumeToWorld * before.inverse(Eigen::Isometry);
  for (int other : selected)
    if (other != id)
      session->SetVolumeToWorld(other, motion * volumes.Find(other)->volumeToWorld);
  session->EndEdit();
}

} // namespace

PosePanel::PosePanel(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench), of_(TextField(this, "poseOf"))
{
  setObjectName("posePanel");
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->setSpacing(4);
  auto* grid = new QGridLayout;
  grid->setHorizontalSpacing(2);
  grid->setVerticalSpacing(3);
  layout->addWidget(of_);
  layout->addLayout(grid);
  layout->addStretch(1);

  for (int axis = 0; axis < 3; axis++)
    grid->setColumnStretch(axis + 1, 1);
  for (int axis = 0; axis < 3; axis++)
    grid->addWidget(new QLabel(QString("<b>%1</b>").arg(Axes[axis]), this), 0, axis + 1, Qt::AlignHCenter);
  const auto addRow = [&](int row, const QString& title, const char* name, const QString& help, int digits, const QString& unit,
                          std::array<QDoubleSpinBox*, 3>& fields, const std::function<void(double)>& edited) {
    grid->addWidget(new QLabel(title, this), row, 0);
    for (int axis = 0; axis < 3; axis++) {
      fields[axis] = NumberField(this, {"", help, -Far, Far, digits, 1.0, unit}, edited);
      fields[axis]->setObjectName(QString(name) + Axes[axis]);
      fields[axis]->setAccessibleName(title + ' ' + Axes[axis]);
      fields[axis]->setButtonSymbols(QAbstractSpinBox::NoButtons);
      grid->addWidget(fields[axis], row, axis + 1);
    }
  };
  const auto takePose = [this](double) { TakePose(); };
  addRow(1, tr("Middle, mm"), "middle", tr("Where the middle of the volume is: x to the left, y to the back, z to the head"), 2,
         {}, middle_, takePose);
  addRow(2, tr("Turned, \u00b0"), "degrees", tr("Rotation about the world's z, then y, then x"), 2, {}, degrees_, takePose);
  for (int axis = 0; axis < 3; axis++)
    degrees_[axis]->setRange(-360.0, 360.0);

  // Steps: - and + per axis, with the sizes that keys use, too.
  const auto addSteps = [&](int row, const QString& title, const char* name, const QString& help,
                            const std::function<void(int, double)>& step) {
    grid->addWidget(new QLabel(title, this), row, 0);
    for (int axis = 0; axis < 3; axis++) {
      auto* pair = new QWidget(this);
      auto* both = new QHBoxLayout(pair);
      both->setContentsMargins(0, 0, 0, 0);
      both->setSpacing(1);
      for (int sign : {-1, 1}) {
        auto* button = Button(pair, "", sign < 0 ? QString(QChar(0x2212)) : "+",
                              help.arg(sign < 0 ? tr("back") : tr("on"), Axes[axis]), [step, axis, sign] { step(axis, sign); });
        button->setObjectName(QString("%1%2%3").arg(name, sign < 0 ? "Less" : "More", Axes[axis]));
        button->setAutoRepeat(true);
        button->setMinimumWidth(24);
        both->addWidget(button);
      }
      grid->addWidget(pair, row, axis + 1);
    }
  };
  addSteps(3, tr("Move by"), "move", tr("One step %1 along %2"), [this](int axis, double steps) { Move(axis, steps); });
  addSteps(4, tr("Turn by"), "turn", tr("One step %1 about %2, about the centre of rotation"),
           [this](int axis, double steps) { Turn(axis, steps); });

  grid->addWidget(new QLabel(tr("Step, mm, \u00b0"), this), 5, 0);
  mmStep_ =
      NumberField(this, {"translationStep", tr("One step of the keys and of the buttons above, mm"), 0.01, 100.0, 2, 0.5, ""},
                  bench->Setter(&Handling::translationStepMm));
  degreeStep_ =
      NumberField(this, {"rotationStep", tr("One turn of the keys and of the buttons above"), 0.01, 90.0, 2, 0.5, "\u00b0"},
                  bench->Setter(&Handling::rotationStepDegrees));
  grid->addWidget(mmStep_, 5, 1);
  grid->addWidget(degreeStep_, 5, 2);
  grid->addWidget(new QLabel(tr("Mouse\nspeed"), this), 6, 0, 2, 1, Qt::AlignTop); // beside the two rows that tell of what
  mmSensitivity_ = NumberField(
      this, {"translationSensitivity", tr("How far volumes move: 1 with the mouse, 0.1 for fine work"), 0.01, 10.0, 2, 0.1, {}},
      bench->Setter(&Handling::translationSensitivity));
  degreeSensitivity_ = NumberField(
      this, {"rotationSensitivity", tr("How far volumes turn: 1 with the mouse, 0.1 for fine work"), 0.01, 10.0, 2, 0.1, {}},
      bench->Setter(&Handling::rotationSensitivity));
  grid->addWidget(mmSensitivity_, 6, 1);
  grid->addWidget(degreeSensitivity_, 6, 2);
  grid->addWidget(new QLabel(tr("<small>moving</small>"), this), 7, 1, Qt::AlignHCenter | Qt::AlignTop);
  grid->addWidget(new QLabel(tr("<small>turning</small>"), this), 7, 2, Qt::AlignHCenter | Qt::AlignTop);

  addRow(8, tr("Turns about"), "centre", tr("The centre of rotation, mm"), 1, {}, centre_, [this](double) {
    bench_->Session()->SetCentreOfRotation(centre_[0]->value(), centre_[1]->value(), centre_[2]->value());
  });
  grid->addWidget(Button(this, "centreReset", tr("Middle"), tr("Turn about the middle of what is selected"),
                         [this] { bench_->Session()->ResetCentreOfRotation(); }),
                  9, 3);

  for (auto changed : {&Workbench::PosesChanged, &Workbench::SelectionChanged, &Workbench::VolumesChanged}) {
    connect(bench, changed, this, &PosePanel::ShowPose);
    connect(bench, changed, this, &PosePanel::ShowCentre);
  }
  connect(bench, &Workbench::ScoredChanged, this, &PosePanel::ShowPose);
  connect(bench, &Workbench::ScoredChanged, this, &PosePanel::ShowCentre);
  connect(bench, &Workbench::HandChanged, this, &PosePanel::ShowHand);
  FitNumbers();
  ShowPose();
  ShowCentre();
  ShowHand();
}

void PosePanel::changeEvent(QEvent* event)
{
  QWidget::changeEvent(event);
  if (event->type() == QEvent::FontChange)
    FitNumbers();
}

// Three columns share the panel: none may be so narrow that a number of three digits is cut off.
void PosePanel::FitNumbers()
{
  constexpr int Frame = 7, Arrows = 18;
  for (QDoubleSpinBox* field : findChildren<QDoubleSpinBox*>()) {
    const bool hasArrows = field->buttonSymbols() != QAbstractSpinBox::NoButtons;
    const QString longest = hasArrows ? QStringLiteral("00.00\u00b0") : QStringLiteral("-000.00");
    field->setMinimumWidth(field->fontMetrics().horizontalAdvance(longest) + Frame + (hasArrows ? Arrows : 0));
  }
}

void PosePanel::ShowPose()
{
  const int id = bench_->ActiveVolume(), count = bench_->SelectedVolumes().size();
  double middle[3] = {0, 0, 0}, degrees[3] = {0, 0, 0};
  if (id)
    bench_->Session()->GetPlacement(id, middle, degrees);
  for (int axis = 0; axis < 3; axis++)
    for (const auto& [field, value] : {std::pair{middle_[axis], middle[axis]}, {degrees_[axis], degrees[axis]}}) {
      Show(field, value);
      field->setEnabled(id != 0 && !bench_->IsScored());
      if (bench_->IsScored())
        field->clear(); // who knows the numbers of the solution needs no eyes
    }
  const QString name = Breakable(bench_->NameOf(id));
  of_->setText(id == 0      ? tr("Select a volume to move it.")
               : count == 1 ? name
                            : tr("%1 and %2 more, which move with it").arg(name).arg(count - 1));
}

void PosePanel::ShowCentre()
{
  double centre[3];
  bench_->Session()->GetCentreOfRotation(centre);
  for (int axis = 0; axis < 3; axis++) {
    Show(centre_[axis], centre[axis]);
    centre_[axis]->setEnabled(!bench_->IsScored());
    if (bench_->IsScored())
      centre_[axis]->clear(); // it is the middle of the volume
  }
}

void PosePanel::ShowHand()
{
  const Handling& hand = bench_->Hand();
  Show(mmStep_, hand.translationStepMm);
  Show(degreeStep_, hand.rotationStepDegrees);
  Show(mmSensitivity_, hand.translationSensitivity);
  Show(degreeSensitivity_, hand.rotationSensitivity);
}

// What a field shows is rounded. The numbers that were not typed stay as exact as they are.
void PosePanel::TakePose()
{
  const int id = bench_->ActiveVolume();
  double middle[3], degrees[3];
  if (!id || !bench_->Session()->GetPlacement(id, middle, degrees))
    return;
  const auto take = [](const QDoubleSpinBox* field, double& value) {
    if (field->textFromValue(field->value()) != field->textFromValue(value))
      value = field->value();
  };
  for (int axis = 0; axis < 3; axis++) {
    take(middle_[axis], middle[axis]);
    take(degrees_[axis], degrees[axis]);
  }
  PlaceSelection(bench_, id, middle, degrees);
}

void PosePanel::Move(int axis, double steps)
{
  double by[3] = {0, 0, 0};
  by[axis] = steps * bench_->Hand().translationStepMm;
  if (bench_->ActiveVolume())
    bench_->Session()->TranslateSelection(by[0], by[1], by[2]);
}

void PosePanel::Turn(int axis, double steps)
{
  double by[3] = {0, 0, 0};
  by[axis] = steps * bench_->Hand().rotationStepDegrees;
  if (bench_->ActiveVolume())
    bench_->Session()->RotateSelection(by[0], by[1], by[2]);
}

} // namespace echorama
