// SPDX-License-Identifier: BSD-3-Clause
// stitch_volumes [VOLUME...]: reads overlapping volumes (without any: makes two of a phantom), aligns and stitches them, and
// writes stitched.vti.
#include <cstdlib>
#include <iostream>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkTransform.h>
#include <vtkUltrasoundAligner.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundReader.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundWriter.h>

int main(int argc, char** argv)
{
  vtkNew<vtkUltrasoundAligner> aligner; // the first volume stays, the others come to it
  for (int i = 1; i < argc; ++i) {
    vtkNew<vtkUltrasoundReader> reader;
    reader->SetFileName(argv[i]);
    aligner->AddInputConnection(reader->GetOutputPort());
  }
  for (int i = 0; argc == 1 && i < 2; ++i) {
    vtkNew<vtkUltrasoundPhantomSource> phantom;
    phantom->SetSpacingMm(1.5);
    phantom->SetPosition(25.0 * i, 5.0 * i, 0.0);
    phantom->Update();
    vtkNew<vtkImageData> volume;
    volume->ShallowCopy(phantom->GetOutput());
    vtkNew<vtkTransform> outOfPlace;
    outOfPlace->Translate(4.0 * i, -3.0 * i, 2.0 * i);
    vtkUltrasoundVolume::Move(volume, outOfPlace->GetMatrix()); // the geometry is the pose: no voxel changes
    aligner->AddInputDataObject(volume);
  }
  vtkNew<vtkUltrasoundStitcher> stitcher;
  stitcher->SetInputConnection(aligner->GetOutputPort());
  stitcher->Update();

  vtkImageData* stitched = stitcher->GetOutput();
  if (stitched->GetNumberOfPoints() == 0)
    return EXIT_FAILURE; // the filters have said why
  for (int i = 0; i < aligner->GetNumberOfVolumes(); ++i) {
    vtkNew<vtkMatrix4x4> pose;
    aligner->GetPose(i, pose);
    std::cout << "volume " << i + 1 << " moved by " << pose->GetElement(0, 3) << ", " << pose->GetElement(1, 3) << ", "
              << pose->GetElement(2, 3) << " mm" << std::endl;
  }
  vtkNew<vtkUltrasoundWriter> writer;
  writer->SetFileName("stitched.vti");
  writer->SetInputData(stitched);
  if (!writer->Write())
    return EXIT_FAILURE;
  const int* size = stitched->GetDimensions();
  std::cout << "wrote stitched.vti: " << size[0] << " x " << size[1] << " x " << size[2] << " voxels" << std::endl;
  return EXIT_SUCCESS;
}
