// SPDX-License-Identifier: BSD-3-Clause
#include "Translation.h"
#include <QCoreApplication>
#include <QDir>
#include <QLibraryInfo>
#include <QLocale>
#include <QTranslator>

namespace echorama {

namespace {

QDir Folder()
{
  return QDir(QCoreApplication::applicationDirPath() + "/../share/echorama/translations");
}

} // namespace

QStringList Languages()
{
  QStringList languages;
  for (const QString& file : Folder().entryList({"echorama_*.qm"}, QDir::Files, QDir::Name))
    languages.append(file.mid(9, file.size() - 12));
  return languages;
}

QString InstallTranslation(QCoreApplication& application, const QString& language)
{
  const QStringList wanted = language.isEmpty() ? QLocale::system().uiLanguages() : QStringList(language);
  for (const QString& each : wanted) {
    const QString name = each.left(2);
    if (name == "en")
      return name;
    if (!Languages().contains(name))
      continue;
    for (const auto& [file, folder] :
         {std::pair<QString, QString>{"qtbase_" + name, QLibraryInfo::location(QLibraryInfo::TranslationsPath)},
          {"echorama_" + name, Folder().path()}}) {
      auto* translator = new QTranslator(&application);
      if (translator->load(file, folder))
        QCoreApplication::installTranslator(translator);
    }
    return name;
  }
  return "en";
}

} // namespace echorama
