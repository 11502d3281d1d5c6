// SPDX-License-Identifier: BSD-3-Clause
// The workbench in German, as a locale asks for it; and whether texts can be, and are, translated.
#include "EmptyPage.h"
#include "GuideBar.h"
#include "Preferences.h"
#include "Translation.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QDialog>
#include <QLabel>
#include <QMenu>
#include <QMenuBar>
#include <QProcess>
#include <QPushButton>
#include <QRegularExpression>
#include <QSettings>
#include <QStandardPaths>
#include <QtTest>
#include <QXmlStreamReader>

using namespace echorama;

namespace {

const QDir Sources(ECHORAMA_SOURCE_DIR "/Applications");

struct Texts {
  QSet<QString> all, unfinished; ///< "context: text"
};

Texts TextsIn(const QString& path)
{
  QFile file(path);
  if (!file.open(QIODevice::ReadOnly))
    qFatal("%s cannot be read", qPrintable(path));
  Texts texts;
  QString context, source;
  for (QXmlStreamReader xml(&file); !xml.atEnd(); xml.readNext()) {
    if (!xml.isStartElement())
      continue;
    if (xml.name() == QLatin1String("name"))
      context = xml.readElementText();
    else if (xml.name() == QLatin1String("source"))
      source = context + ": " + xml.readElementText();
    else if (xml.name() == QLatin1String("translation")) {
      texts.all.insert(source);
      const bool isUnfinished = xml.attributes().value("type") == QLatin1String("unfinished");
      if (isUnfinished || xml.readElementText().trimmed().isEmpty())
        texts.unfinished.insert(source);
    }
  }
  return texts;
}

QStringList SourceFiles()
{
  QStringList files;
  for (const char* folder : {"Workbench", "Window"})
    for (const QString& name : QDir(Sources.filePath(folder)).entryList({"*.cxx", "*.h"}, QDir::Files))
      files.append(Sources.filePath(QString(folder) + "/" + name));
  return files;
}

} // namespace

class TestTranslation : public WindowTest {
  Q_OBJECT

private slots:
  void theLocaleChooses();
  void theWindowIsGerman();
  void everyEntryHasAKeyInGermanToo();
  void theLanguageIsChosen();
  void everythingThatIsThereIsTranslated();
  void fewTextsAreNotThere();
  void noTextIsLeftOut();
};

void TestTranslation::theLocaleChooses()
{
  QVERIFY(Languages().contains("de"));
  QCOMPARE(InstallTranslation(*qApp, {}), QString("de")); // LANGUAGE, set in main()
}

void TestTranslation::theWindowIsGerman()
{
  QSettings().remove("window/guide");
  WindowUnderTest window;
  QStringList menus;
  for (const QAction* menu : window.Window().menuBar()->actions())
    menus.append(QString(menu->text()).remove('&'));
  QCOMPARE(menus, QStringList({"Datei", "Bearbeiten", "Ansicht", "Werkzeuge", "Ausrichten", "Zusammenf\u00fcgen", "Hilfe"}));
  QCOMPARE(window.Part<QPushButton>("emptyOpen")->text(), QString("Volumen &\u00f6ffnen..."));
  window.Screenshot("german-empty");
  QVERIFY(window.Open({A(), B()}));
  window.Key(Qt::Key_R);
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("Verfeinern: fertig, 1 bewegt"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Part<QAction>("undoAction")->text().contains("ckg\u00e4ngig: Verfeinern"));
  // Found by its letter.
  QTest::keyClick(&window.Window(), Qt::Key_H, Qt::AltModifier);
  QTRY_VERIFY(QApplication::activePopupWidget());
  QTest::keyClick(QApplication::activePopupWidget(), Qt::Key_W);
  window.Settle();
  QVERIFY(!window.Part<GuideBar>("guideBar")->isVisible());
  window.Screenshot("german");
}

void TestTranslation::everyEntryHasAKeyInGermanToo()
{
  WindowUnderTest window;
  const std::function<void(const QList<QAction*>&)> check = [&](const QList<QAction*>& actions) {
    QSet<QChar> letters;
    for (const QAction* action : actions) {
      if (action->isSeparator())
        continue;
      const int at = action->text().indexOf('&');
      QVERIFY2(at >= 0, qPrintable(action->text()));
      const QChar letter = action->text()[at + 1].toLower();
      QVERIFY2(!letters.contains(letter), qPrintable(action->text()));
      letters.insert(letter);
      if (action->menu())
        check(action->menu()->actions());
    }
  };
  check(window.Window().menuBar()->actions());
}

void TestTranslation::theLanguageIsChosen()
{
  WindowUnderTest window;
  ShowPreferences(&window.Window(), window.Window().Bench());
  auto* choice = window.Part<QDialog>("preferences")->findChild<QComboBox*>("preferredLanguage");
  QVERIFY(choice->findText("Deutsch") > 0 && choice->findText("English") > 0);
  choice->setFocus();
  choice->setCurrentIndex(choice->findText("English"));
  emit choice->activated(choice->currentIndex());
  QCOMPARE(Preferences::Kept().language, QString("en"));
  QVERIFY(window.HasMessage("neu gestartet"));
  QCOMPARE(InstallTranslation(*qApp, Preferences::Kept().language), QString("en"));
}

void TestTranslation::everythingThatIsThereIsTranslated()
{
  const Texts texts = TextsIn(Sources.filePath("Window/Translations/echorama_de.ts"));
  qInfo("%d texts, %d without a translation", texts.all.size(), texts.unfinished.size());
  QVERIFY(texts.all.size() > 500);
  QVERIFY2(texts.unfinished.isEmpty(), qPrintable(QStringList(texts.unfinished.values()).join('\n')));
}

// Those that came to the sources since: they are English in all languages.
void TestTranslation::fewTextsAreNotThere()
{
  const QString lupdate =
      QFile::exists("/usr/lib/qt5/bin/lupdate") ? "/usr/lib/qt5/bin/lupdate" : QStandardPaths::findExecutable("lupdate");
  if (lupdate.isEmpty())
    QSKIP("there is no lupdate");
  const QString found = Folder().filePath("found.ts");
  QVERIFY(QProcess::execute(lupdate, QStringList{"-silent", "-no-recursive", "-locations", "none"} + SourceFiles() +
                                         QStringList{"-ts", found}) == 0);
  const QSet<QString> now = TextsIn(found).all, known = TextsIn(Sources.filePath("Window/Translations/echorama_de.ts")).all;
  const QStringList missing = QSet<QString>(now).subtract(known).values();
  qInfo("%d of %d texts are not translated\n%s", missing.size(), now.size(), qPrintable(missing.join('\n')));
  QVERIFY(now.size() > 500);
  QVERIFY(missing.size() < now.size() / 10);
}

// What a person reads goes through tr().
void TestTranslation::noTextIsLeftOut()
{
  const QRegularExpression literal("(setText|setToolTip|setStatusTip|setWindowTitle|setTitle|setPlaceholderText|addMenu|"
                                   "addToolBar|addRow|addTab|QLabel|QGroupBox|"
                                   "Note|Warn|Ask|say)\\(\\s*\"([^\"]*[A-Za-z]{3}[^\"]*)\"");
  QStringList left;
  for (const QString& path : SourceFiles()) {
    QFile file(path);
    QVERIFY(file.open(QIODevice::ReadOnly));
    const QString text = QString::fromUtf8(file.readAll());
    for (auto matches = literal.globalMatch(text); matches.hasNext();)
      left.append(QFileInfo(path).fileName() + ": " + matches.next().captured(0));
  }
  QVERIFY2(left.isEmpty(), qPrintable(left.join('\n')));
}

int main(int argc, char** argv)
{
  qputenv("LC_ALL", "de_DE.UTF-8");
  qputenv("LANGUAGE", "de");
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestTranslation test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestTranslation.moc"
