// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <QString>
#include <QStringList>
#include <QVector>

namespace echorama {

/// A set of volumes for a person without files: made here, of an invented body, out of place by a known amount.
struct Sample {
  const char* name; ///< of its folder, and of what makes it (for tests)
  int volumes;
  QString label, help;
};
QVector<Sample> Samples();

/// Where it lies, or will lie, for this user.
QString FolderOf(const Sample& sample);
QStringList VolumesOf(const Sample& sample);
/// The poses that put the volumes where they belong.
QString TruthOf(const Sample& sample);
/// Whether all of it is there: it is made once.
bool IsThere(const Sample& sample);

/// Makes the files: all, or none. \throws Error(FileSystem), Error(Cancelled).
void Make(const Sample& sample, const Progress& progress);

} // namespace echorama
