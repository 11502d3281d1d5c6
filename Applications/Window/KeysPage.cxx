// SPDX-License-Identifier: BSD-3-Clause
#include "KeysPage.h"
#include <QAction>
#include <QDialog>
#include <QTextBrowser>
#include <QVBoxLayout>

namespace echorama {

namespace {

QString Table(const QString& title, const QVector<KeysOf::Row>& rows)
{
  QString html = QString("<h3>%1</h3><table cellpadding=2>").arg(title.toHtmlEscaped());
  for (const auto& row : rows)
    html += QString("<tr><td><b>%1</b></td><td>%2</td></tr>").arg(row.keys.toHtmlEscaped(), row.what.toHtmlEscaped());
  return html + "</table>";
}

} // namespace

// The keys of menus come from the menus themselves, so that this page cannot be wrong about them.
void ShowKeysPage(QWidget* parent, const QVector<KeysOf>& sections)
{
  QString html;
  for (const KeysOf& section : sections)
    html += Table(section.title, section.rows);
  QVector<KeysOf::Row> menus;
  for (const QAction* action : parent->findChildren<QAction*>())
    if (!action->shortcut().isEmpty())
      menus.append({action->shortcut().toString(QKeySequence::NativeText), action->statusTip()});
  html += Table(QObject::tr("Keys"), menus);
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
