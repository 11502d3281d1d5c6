// SPDX-License-Identifier: BSD-3-Clause
#include "EmptyPage.h"
#include "Controls.h"
#include <QAction>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

namespace echorama {

EmptyPage::EmptyPage(QWidget* views, QAction* open, QAction* openProject, const std::function<void(const Sample&)>& openSample)
  : QWidget(views)
{
  setObjectName("emptyPage");
  setAutoFillBackground(true); // the views below have nothing to show
  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(12);
  layout->addStretch(2);
  const auto addText = [this, layout](const QString& text, const char* name) {
    QLabel* label = TextField(this, name);
    label->setText(text);
    label->setAlignment(Qt::AlignHCenter);
    layout->addWidget(label);
    return label;
  };
  const auto addRow = [this, layout] {
    auto* row = new QHBoxLayout;
    row->addStretch(1);
    layout->addLayout(row);
    return row;
  };
  const auto addButton = [](QHBoxLayout* row, QPushButton* button) {
    button->setAutoDefault(true); // Return presses it
    row->addWidget(button);
  };
  QLabel* title = addText(tr("Begin with two or more volumes that overlap"), "emptyTitle");
  QFont large = title->font();
  large.setPointSizeF(1.5 * large.pointSizeF());
  title->setFont(large);
  auto* files = addRow();
  addButton(files, Button(this, "emptyOpen", tr("&Open volumes..."), open->statusTip(), [open] { open->trigger(); }));
  addButton(files, Button(this, "emptyOpenProject", tr("Open a &project..."), openProject->statusTip(),
                          [openProject] { openProject->trigger(); }));
  files->addStretch(1);
  addText(tr("or drop files anywhere on this window"), "emptyDrop");
  layout->addSpacing(24);
  addText(tr("No volumes at hand? Samples are made here, in seconds:"), "emptySamples");
  constexpr int most = 3; // in a row, also where texts are large
  const QVector<Sample> samples = Samples();
  for (int i = 0; i < samples.size(); i += most) {
    auto* row = addRow();
    for (const Sample& sample : samples.mid(i, most))
      addButton(row, Button(this, sample.name, sample.label, sample.help, [sample, openSample] { openSample(sample); }));
    row->addStretch(1);
  }
  layout->addStretch(3);
  views->installEventFilter(this);
  setGeometry(views->rect());
}

bool EmptyPage::eventFilter(QObject* object, QEvent* event)
{
  if (event->type() == QEvent::Resize)
    setGeometry(parentWidget()->rect());
  return QWidget::eventFilter(object, event);
}

} // namespace echorama
