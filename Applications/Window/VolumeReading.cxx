// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeReading.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Core/Base/Memory.h"
#include "Readers/OutputFiles.h"
#include <cmath>
#include <new>
#include <QFileInfo>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUltrasoundReader.h>

namespace echorama {

namespace {

// What all voxels of a file take with their valid region, and how far apart they are.
struct Whole {
  double bytes, spacing;
};

Whole WholeOf(vtkUltrasoundReader* reader)
{
  Run(reader, {}, [reader] { reader->UpdateInformation(); });
  vtkInformation* out = reader->GetOutputInformation(0);
  const int* extent = out->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT());
  vtkInformation* scalars =
      vtkDataObject::GetActiveFieldInformation(out, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
  double bytes = 1.0 + (scalars ? vtkDataArray::GetDataTypeSize(scalars->Get(vtkDataObject::FIELD_ARRAY_TYPE())) : 1);
  for (int axis = 0; axis < 3; ++axis)
    bytes *= extent[2 * axis + 1] - extent[2 * axis] + 1.0;
  return {bytes, out->Get(vtkDataObject::SPACING())[0]};
}

} // namespace

std::vector<ReadVolume> ReadVolumes(const QStringList& files, const Progress& progress, double wholeShare)
{
  std::vector<ReadVolume> volumes;
  for (int i = 0; i < files.size(); i++) {
    const double count = files.size();
    ReadVolume volume{files[i], nullptr, {}, 1};
    try {
      vtkNew<vtkUltrasoundReader> reader;
      reader->SetFileName(files[i].toUtf8().constData());
      const Whole whole = WholeOf(reader);
      if (whole.bytes > wholeShare * FreeMemory())
        reader->SetStride(0);
      Update(reader, progress.Part(i / count, (i + 1) / count));
      if (reader->GetOutput()->GetNumberOfPoints() == 0)
        throw Error(Error::Kind::BadFile, files[i].toStdString() + ": it cannot be read as a volume");
      volume.image = reader->GetOutput();
      volume.stride = static_cast<int>(std::lround(volume.image->GetSpacing()[0] / whole.spacing));
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
  const std::vector<bool> areCompanions = AreCompanions(paths);
  QStringList volumes;
  for (int i = 0; i < files.size(); i++)
    if (!areCompanions[static_cast<std::size_t>(i)])
      volumes.append(files[i]);
  return volumes;
}

} // namespace echorama
