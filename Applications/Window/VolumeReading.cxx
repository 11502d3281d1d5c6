// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeReading.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Readers/OutputFiles.h"
#include <new>
#include <QFileInfo>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkUltrasoundReader.h>

namespace echorama {

std::vector<ReadVolume> ReadVolumes(const QStringList& files, const Progress& progress)
{
  std::vector<ReadVolume> volumes;
  for (int i = 0; i < files.size(); i++) {
    const double count = files.size();
    ReadVolume volume{files[i], nullptr, {}};
    try {
      vtkNew<vtkUltrasoundReader> reader;
      reader->SetFileName(files[i].toUtf8().constData());
      Update(reader, progress.Part(i / count, (i + 1) / count));
      if (reader->GetOutput()->GetNumberOfPoints() == 0)
        throw Error(Error::Kind::BadFile, files[i].toStdString() + ": it cannot be read as a volume");
      volume.image = reader->GetOutput();
    } catch (const std::bad_alloc&) {
      volume.error = files[i] + ": there is not enough memory";
    } catch (const Error& error) {
      if (error.GetKind() == Error::Kind::Cancelled)
        throw;
      volume.error = QString::fromUtf8(error.what());
      if (!volume.error.contains(QFileInfo(files[i]).fileName()))
        volume.error.prepend(files[i] + ": ");
    }
    volumes.push_back(std::move(volume));
  }
  return volumes;
}

QStringList WithoutCompanions(const QStringList& files)
{
  std::vector<std::string> paths;
  for (const QString& file : files)
    paths.push_back(file.toStdString());
  QStringList volumes;
  for (const QString& file : files)
    if (!IsCompanion(file.toStdString(), paths))
      volumes.append(file);
  return volumes;
}

} // namespace echorama
