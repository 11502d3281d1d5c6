// SPDX-License-Identifier: BSD-3-Clause
// A state does not name its body. What can be seen of it: the probe that pressed it lies in the body, about as deep below the
// skin as it was pressed in, and what was displaced lies where the body is.
#include "PressedStates.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Readers/VtkXmlFile.h"
#include "Scan.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <QFileInfo>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundDeformGeometry.h>
#include <vtkUltrasoundDisplacement.h>
#include <vtkUltrasoundLiveImage.h>
#include <vtkXMLImageDataReader.h>

namespace echorama {

namespace {

constexpr double FaceOffMm = 10.0;   ///< of the face from where it should be: skins are outlines, and probes are curved
constexpr double SharedVolume = 0.5; ///< of the smaller of two boxes that the other has

Eigen::AlignedBox3d BoxOf(const Subject& body)
{
  Eigen::AlignedBox3d box;
  const auto add = [&box](vtkDataSet* data) {
    double b[6];
    data->GetBounds(b);
    box.extend(Eigen::Vector3d(b[0], b[2], b[4]));
    box.extend(Eigen::Vector3d(b[1], b[3], b[5]));
  };
  if (body.tissue)
    add(body.tissue);
  for (const auto& volume : body.volumes)
    add(volume);
  return box;
}

void CheckState(const std::string& file, vtkImageData* state, const Subject& body)
{
  const auto refuse = [&file](const std::string& reason) { throw Error(Error::Kind::BadInput, file + ": " + reason); };
  vtkDataArray* press = state->GetFieldData()->GetArray(vtkUltrasoundLiveImage::PressMmName());
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(state);
  if (!press || press->GetNumberOfValues() != 1 || !pose)
    refuse("it does not say how deep the probe was pressed in, and where: its field data need PressMm and ProbeToWorld "
           "(vtkUltrasoundLiveImage.SetPressState)");
  const double mm = press->GetTuple1(0);
  if (!(mm > 0.0) || !std::isfinite(mm))
    refuse(Format("the probe was pressed in by %g mm; it must be above 0", mm));
  const LatticeMap map = vtkUltrasoundDeformGeometry::MapOf(state, file);
  const std::string other = "; it is of another body than " + body.files.join(", ").toStdString();
  if (body.mesh) {
    const auto nearest = body.mesh->NearestTo(pose->translation());
    if (nearest && nearest->distanceMm > mm + FaceOffMm)
      refuse(Format("the probe that was pressed in by %g mm lies %.0f mm from the skin", mm, nearest->distanceMm) + other);
  }
  Eigen::AlignedBox3d displaced;
  const ImageGeometry& lattice = map.Lattice();
  for (int corner = 0; corner < 8; corner++)
    displaced.extend(map.IndexToWorld() * Eigen::Vector3d(corner & 1 ? lattice.dimensions[0] - 1 : 0,
                                                          corner & 2 ? lattice.dimensions[1] - 1 : 0,
                                                          corner & 4 ? lattice.dimensions[2] - 1 : 0));
  const Eigen::AlignedBox3d box = BoxOf(body), both = box.intersection(displaced);
  if (both.isEmpty() || both.volume() < SharedVolume * std::min(box.volume(), displaced.volume()))
    refuse("what was displaced lies elsewhere" + other);
}

} // namespace

QStringList PressedStatesAmong(const QStringList& files)
{
  QStringList states;
  for (const QString& file : files) {
    if (!file.endsWith(".vti", Qt::CaseInsensitive) || !QFileInfo(file).isReadable())
      continue;
    try {
      CheckVtkXmlFile(file.toStdString());
    } catch (const Error&) {
      continue; // whoever reads it as a volume will say what is wrong
    }
    vtkNew<vtkXMLImageDataReader> reader;
    reader->SetFileName(file.toUtf8());
    reader->UpdateInformation();
    for (int i = 0; i < reader->GetNumberOfPointArrays(); i++)
      if (std::string(reader->GetPointArrayName(i)) == vtkUltrasoundDisplacement::DisplacementName())
        states.append(file);
  }
  return states;
}

std::vector<vtkSmartPointer<vtkImageData>> ReadPressedStates(const QStringList& files, const Subject& body,
                                                             const Progress& progress)
{
  if (body.IsEmpty())
    throw Error(Error::Kind::BadInput,
                files.join(", ").toStdString() + ": these are states of a body that is pressed: open that first, or with them");
  std::vector<std::pair<vtkSmartPointer<vtkImageData>, std::string>> read;
  for (int i = 0; i < files.size(); i++) {
    const std::string file = files[i].toStdString();
    CheckVtkXmlFile(file);
    vtkNew<vtkXMLImageDataReader> reader;
    reader->SetFileName(file.c_str());
    try {
      Update(reader, progress.Part(static_cast<double>(i) / files.size(), (i + 1.0) / files.size()));
    } catch (const Error& error) {
      if (error.GetKind() == Error::Kind::Cancelled)
        throw;
      throw Error(error.GetKind(), file + ": " + error.what());
    }
    read.emplace_back(reader->GetOutput(), file);
    CheckState(read.back().second, read.back().first, body);
  }
  std::stable_sort(read.begin(), read.end(),
                   [](const auto& a, const auto& b) { return PressMmOf(a.first) < PressMmOf(b.first); });
  std::vector<vtkSmartPointer<vtkImageData>> states;
  for (std::size_t i = 0; i < read.size(); i++) {
    if (i > 0 && PressMmOf(read[i].first) == PressMmOf(read[i - 1].first))
      throw Error(Error::Kind::BadInput, read[i].second + ": it is as deep as " + read[i - 1].second +
                                             Format(": %g mm; one state is wanted for each depth", PressMmOf(read[i].first)));
    states.push_back(read[i].first);
  }
  return states;
}

double PressMmOf(vtkImageData* state)
{
  return state->GetFieldData()->GetArray(vtkUltrasoundLiveImage::PressMmName())->GetTuple1(0);
}

} // namespace echorama
