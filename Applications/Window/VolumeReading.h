// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
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
  int stride = 1;                      ///< only one of so many voxels along each axis was read
};

/// Reads one file after the other, for a Job. A file that cannot be read does not keep the others from being read.
/// \param wholeShare a volume that would take more than this part of the free memory is read coarsely, where its format can be:
/// the Stride of vtkUltrasoundReader is 0. \throws Error(Cancelled).
std::vector<ReadVolume> ReadVolumes(const QStringList& files, const Progress& progress, double wholeShare = Unlimited);

/// The volumes among \a files: NAME.ValidRegion.mha and its like belong to NAME.mha when that is there.
QStringList WithoutCompanions(const QStringList& files);

} // namespace echorama
