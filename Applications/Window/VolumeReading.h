// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <QString>
#include <QStringList>
#include <string>
#include <vector>
#include <vtkSmartPointer.h>

class vtkImageData;

namespace echorama {

/// A volume that was read, or why it was not.
struct ReadVolume {
  QString file;
  vtkSmartPointer<vtkImageData> image; ///< nullptr: not read
  QString error;                       ///< names the file and the reason
};

/// Reads one file after the other, for a Job. A file that cannot be read does not keep the others from being read.
/// \throws Error(Cancelled).
std::vector<ReadVolume> ReadVolumes(const QStringList& files, const Progress& progress);

/// The volumes among \a files: NAME.ValidRegion.mha and its like belong to NAME.mha when that is there.
QStringList WithoutCompanions(const QStringList& files);

} // namespace echorama
