// SPDX-License-Identifier: BSD-3-Clause
#include "KeysPage.h"
#include <QAction>
#include <QDialog>
#include <QTextBrowser>
#include <QVBoxLayout>

namespace echorama {

namespace {

constexpr const char* Mouse[][2] = {
    {"Left", "the tool in hand: move volumes, paint, carve, restore, mark, or point"},
    {"Shift + left (Align)", "turn volumes"},
    {"Wheel", "through the slices (Shift: ten at a time)"},
    {"Ctrl + wheel", "zoom"},
    {"Middle", "move the picture"},
    {"Shift + middle", "turn the plane of the slice"},
    {"Right", "contrast (sideways) and brightness (up and down)"},
    {"Double click", "make a view large, and back"},
};
constexpr const char* Aligning[][2] = {
    {"x, y, z", "restrict motion to this axis; press again for the plane perpendicular to it, and again for free motion"},
    {"Arrows", "move by one step in the view"},
    {"Page up, Page down", "move by one step towards you, and away"},
    {"Ctrl + arrows, Ctrl + Page up, Page down", "turn by one step"},
    {"+, -", "double or halve the step size"},
    {"c", "put the centre of rotation where the mouse is"},
    {"Shift + c", "put it back in the middle of what is selected"},
    {"Escape", "take a drag back"},
};

template <std::size_t N>
QString Table(const QString& title, const char* const (&rows)[N][2])
{
  QString html = QString("<h3>%1</h3><table cellpadding=2>").arg(title);
  for (const auto& row : rows)
    html += QString("<tr><td><b>%1</b></td><td>%2</td></tr>")
                .arg(QObject::tr(row[0]).toHtmlEscaped(), QObject::tr(row[1]).toHtmlEscaped());
  return html + "</table>";
}

} // namespace

// The keys of menus come from the menus themselves, so that this page cannot be wrong about them.
void ShowKeysPage(QWidget* parent)
{
  QString html = Table(QObject::tr("Mouse"), Mouse) + Table(QObject::tr("Moving volumes (tool Align)"), Aligning);
  html += QString("<h3>%1</h3><table cellpadding=2>").arg(QObject::tr("Keys"));
  for (const QAction* action : parent->findChildren<QAction*>())
    if (!action->shortcut().isEmpty())
      html +=
          QString("<tr><td><b>%1</b></td><td>%2</td></tr>")
              .arg(action->shortcut().toString(QKeySequence::NativeText).toHtmlEscaped(), action->statusTip().toHtmlEscaped());
  html += "</table>";
  auto* dialog = parent->findChild<QDialog*>("keysPage");
  if (!dialog) {
    dialog = new QDialog(parent);
    dialog->setObjectName("keysPage");
    dialog->setWindowTitle(QObject::tr("Keys and mouse"));
    auto* text = new QTextBrowser(dialog);
    auto* layout = new QVBoxLayout(dialog);
    layout->setContentsMargins(0, 0, 0, 0);
    layout->addWidget(text);
    dialog->resize(560, 640);
  }
  dialog->findChild<QTextBrowser*>()->setHtml(html);
  dialog->show();
  dialog->raise();
}

} // namespace echorama
