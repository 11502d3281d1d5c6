// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundReader
 * @brief reads a volume with its pose: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .vdb, .vti, stacks of images
 *
 * Output 0: one vtkImageData whose origin, spacing and direction are those of the file (mm, LPS), with the point arrays
 * `Intensity` (whatever the file called it; the active scalars) and `ValidRegion` (unsigned char, 1 or 0), and with what the
 * file says of the acquisition as field data (vtkUltrasoundAcquisition). Other lines of a header come as field data too, one
 * string each, under their own names. VTK's readers of MetaImage and NRRD lose the direction; this one does not.
 *
 * Output 1: where the file holds samples along beams (GE Kretz), these, as vtkUltrasoundScanConverter takes them: depth along
 * x, the beams of the fan along y, the steps of the sweep along z, with the same field data; else an empty image. Output 0
 * is then their scan conversion. Each is made only when it is asked for.
 *
 * DICOM: enhanced ultrasound volumes, series of slices (by their folder or any one of them), frames over space; the volume of a
 * time series is chosen by the pipeline's time. GE Kretz: see output 1. Documentation/filters/Reader.md tells of each format.
 *
 * The content decides what a file is, not its extension. `ValidRegion` is, in this order: the array of that name (.vti);
 * the file `NAME.ValidRegion.mha` beside `NAME.mha` (any extension, the same for both), whose geometry must agree; everything
 * but the zeros connected to the border of the grid and voxels that are not numbers. `NAME.Provenance.mha` is carried as the
 * point array `Provenance`, likewise `Coverage`, `Spread` and `Embedding`. GetNotes() says what was assumed or lost.
 *
 * Active voxels of an OpenVDB grid are its valid region. A stack of PNG, JPEG or TIFF images is named by its folder or by one of
 * its files, and has no pose.
 *
 * A 2D image is a volume of one slice. Where the axes of a file are left-handed the slices are taken in reverse, so that the
 * geometry is a rigid pose. The header alone is read until voxels are asked for. Where only some slices are asked for
 * (UPDATE_EXTENT), only these are read of MetaImage, NRRD and NIfTI with a file of their valid region, however large these are; a
 * part of any other file is cut out of the whole.
 *
 * Refused, with a message that names file and reason: files that are truncated, empty, damaged or of another type; sizes that
 * do not fit the data or the memory; a spacing that is not positive; a direction that is singular or sheared; numbers that are
 * not finite; several numbers per voxel; tracked sequences of 2D frames.
 *
 * @sa vtkUltrasoundWriter
 */
#ifndef vtkUltrasoundReader_h
#define vtkUltrasoundReader_h

#include "EchoramaReadersModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <memory> // for open files
#include <string> // for the notes
#include <vector> // for the notes

#ifndef __VTK_WRAP__
#include "Core/Base/JoinedText.h"
#include "Readers/VolumeSource.h"
#endif

class vtkXMLImageDataReader;

class ECHORAMAREADERS_EXPORT vtkUltrasoundReader : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundReader* New();
  vtkTypeMacro(vtkUltrasoundReader, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The file to read, or a folder of DICOM slices. Default: none. */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * 1 when \a fileName is there and begins like a file that this class reads, else 0 (also for tracked sequences). The voxels
   * are not looked at.
   */
  static int CanReadFile(const char* fileName);

  /**
   * What the last update had to assume, or could not keep, one sentence per line. Empty when the file said everything.
   */
  std::string GetNotes() const { return echorama::Joined(this->Notes, "\n"); }

  // BEGIN parameters
  /**
   * Edge of the voxels that a file of beams (GE Kretz) is scan-converted to. 0 takes about as many voxels inside the fan as there
   * are samples. In [0, 1000] mm; default 0.
   */
  vtkUltrasoundNumberMacro(SpacingMm);

  /**
   * Spacing of a stack of pictures: along x, along y and from picture to picture. Where it is 0, that of the files is taken, else
   * 1 mm, with a note. Other formats know theirs. At least 0 mm; default (0, 0, 0).
   */
  vtkUltrasoundVectorMacro(StackSpacingMm);

  /**
   * Only one of so many voxels along each axis is read, for a first look at a large volume; those between are skipped. For
   * MetaImage, NRRD and NIfTI. 0 takes the smallest that leaves at most 128 million voxels, and 1 for other formats. In [0, 1000]
   * voxels; default 1.
   */
  vtkUltrasoundIntegerMacro(Stride);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundReader();
  ~vtkUltrasoundReader() override;

  int ProcessRequest(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

  char* FileName = nullptr;

private:
  vtkUltrasoundReader(const vtkUltrasoundReader&) = delete;
  void operator=(const vtkUltrasoundReader&) = delete;

#ifndef __VTK_WRAP__
  void ReadSource(vtkImageData* output, const echorama::Progress& progress);
  bool ReadSlices(vtkImageData* output, const echorama::Progress& progress);
  void ReadBeams(vtkImageData* output, const echorama::Progress& progress);
  void SetFields(const echorama::VolumeContent& content, vtkImageData* output);
  void ReadXml(vtkImageData* output);
  void FindValidRegion(vtkImageData* output, const echorama::Progress& progress);
  void FindCompanions(vtkImageData* output, const echorama::Progress& progress);

  echorama::VolumeReadParameters Values;
  std::vector<std::string> Notes;
  struct OpenFiles;
  std::unique_ptr<OpenFiles> Opened; // while some slices after others are asked for
#endif
};

#endif
