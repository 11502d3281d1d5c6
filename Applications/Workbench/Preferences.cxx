// SPDX-License-Identifier: BSD-3-Clause
#include "Preferences.h"
#include "Controls.h"
#include "FocusRing.h"
#include "Theme.h"
#include "Translation.h"
#include "Widgets/Session/Tints.h"
#include "Workbench.h"
#include <QApplication>
#include <QComboBox>
#include <QDialog>
#include <QDialogButtonBox>
#include <QFormLayout>
#include <QLabel>
#include <QSettings>

namespace echorama {

namespace {

QString TextOf(const char* text)
{
  return QCoreApplication::translate("Preferences", text);
}

QVector<WordChoice> ColourChoices()
{
  return {{"many", TextOf(QT_TRANSLATE_NOOP("Preferences", "Seven tints"))},
          {"grey-amber", TextOf(QT_TRANSLATE_NOOP("Preferences", "Grey and amber"))},
          {"blue-orange", TextOf(QT_TRANSLATE_NOOP("Preferences", "Blue and orange"))}};
}

QVector<WordChoice> ThemeChoices()
{
  return {{"dark", TextOf(QT_TRANSLATE_NOOP("Preferences", "Dark"))},
          {"light", TextOf(QT_TRANSLATE_NOOP("Preferences", "Light"))},
          {"system", TextOf(QT_TRANSLATE_NOOP("Preferences", "As the system"))}};
}

// Names of languages are in themselves, for those who can read no other.
QVector<WordChoice> LanguageChoices()
{
  QVector<WordChoice> choices{{"", TextOf(QT_TRANSLATE_NOOP("Preferences", "As the system"))}, {"en", "English"}};
  for (const QString& language : Languages())
    choices.append({language, QLocale(language).nativeLanguageName()});
  return choices;
}

QString OneOf(const QVector<WordChoice>& choices, const char* key, const QString& otherwise)
{
  const QString kept = QSettings().value(key, otherwise).toString();
  for (const WordChoice& choice : choices)
    if (choice.word == kept)
      return kept;
  return otherwise;
}

} // namespace

Preferences Preferences::Kept()
{
  const Preferences usual;
  return {OneOf(ColourChoices(), "preferences/colours", usual.colours), OneOf(ThemeChoices(), "preferences/theme", usual.theme),
          OneOf(LanguageChoices(), "preferences/language", usual.language)};
}

void Preferences::Keep() const
{
  QSettings settings;
  settings.setValue("preferences/colours", colours);
  settings.setValue("preferences/theme", theme);
  settings.setValue("preferences/language", language);
}

void Apply(const Preferences& preferences, Workbench* bench)
{
  bench->Session()->SetTints(preferences.colours.toUtf8().constData());
}

void ShowPreferences(QWidget* window, Workbench* bench)
{
  if (auto* there = window->findChild<QDialog*>("preferences")) {
    there->raise();
    there->activateWindow();
    return;
  }
  auto* dialog = new QDialog(window);
  dialog->setObjectName("preferences");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(TextOf(QT_TRANSLATE_NOOP("Preferences", "Preferences")));
  auto* form = new QFormLayout(dialog);
  const Preferences kept = Preferences::Kept();
  const auto add = [&](const char* name, const char* label, const char* help, const QVector<WordChoice>& choices,
                       QString Preferences::*field, const std::function<void(const Preferences&)>& apply) {
    auto* choice = ChoiceField(dialog, name, TextOf(help), choices, [field, apply](const QString& word) {
      Preferences now = Preferences::Kept();
      now.*field = word;
      now.Keep();
      apply(now);
    });
    Show(choice, kept.*field);
    form->addRow(TextOf(label), choice);
  };
  add("preferredColours", QT_TRANSLATE_NOOP("Preferences", "&Colours of volumes"),
      QT_TRANSLATE_NOOP("Preferences", "The last two can also be told apart by people who see no red or no green"),
      ColourChoices(), &Preferences::colours, [bench](const Preferences& now) { Apply(now, bench); });
  add("preferredTheme", QT_TRANSLATE_NOOP("Preferences", "&Window"),
      QT_TRANSLATE_NOOP("Preferences", "Dark grey changes least how grey levels look; pictures stay on black in any"),
      ThemeChoices(), &Preferences::theme, [](const Preferences& now) { ApplyTheme(*qApp, now.theme); });
  add("preferredLanguage", QT_TRANSLATE_NOOP("Preferences", "&Language"),
      QT_TRANSLATE_NOOP("Preferences", "Texts are in this language from the next start"), LanguageChoices(),
      &Preferences::language, [bench](const Preferences&) {
        bench->Note(TextOf(QT_TRANSLATE_NOOP("Preferences", "The language changes when the workbench is started again.")),
                    "language");
      });
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, dialog);
  QObject::connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::close);
  form->addRow(buttons);
  new FocusRing(dialog);
  dialog->show();
}

} // namespace echorama
