// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QString>
#include <QStringList>

class QCoreApplication;

namespace echorama {

/// The languages, beside English, that texts are there for ("de"): files echorama_LANGUAGE.qm in ../share/echorama/translations
/// beside the folder of the program.
QStringList Languages();

/// Texts in \a language from now on: of Qt itself, and of us. Empty: that of the system, when there is a translation. Before the
/// first widget. \returns the language that it is.
QString InstallTranslation(QCoreApplication& application, const QString& language);

} // namespace echorama
