// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundWriter
 * @brief writes a volume so that vtkUltrasoundReader gives it back: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .vdb, .vti
 *
 * Input 0: vtkImageData with intensities (the array `Intensity`, else the active scalars; any type of number).
 * The extension chooses the format. Pose and acquisition (vtkUltrasoundAcquisition) are kept by all of them; numbers come
 * back to the last bit, but for .nrrd and .vdb, which store spacing and direction as a product. .vti holds all arrays and
 * field data in one file, and .vdb (OpenVDB) intensities and valid region, sparsely: its active voxels. The others hold the
 * intensities; `ValidRegion`, `Provenance`, `Coverage`, `Spread` and `Embedding` go to files beside them
 * (`NAME.ValidRegion.mha`), and field data that are single strings go to the header. NIfTI has 32-bit floats for the geometry: an
 * extension of its header, which other programs skip, holds it exactly, and GetNotes() says how far off they see it. What cannot
 * be held is listed by GetNotes() and in a warning. The file of the valid region is left out where every voxel is real and the
 * reader would see that without it; one that stood there before is removed.
 *
 * A name with a double extension (.igs.mha, .seq.mha, .seq.nrrd ...) asks for a sequence of all time steps: it is written as
 * vtkUltrasoundSequenceWriter does. (ParaView's Save Data looks at the last extension alone, so it comes here.)
 *
 * Everything is written under temporary names in the same folder and renamed at the end, all together: after an error, a
 * full disk or an abort, what was there before is there unchanged.
 *
 * Errors, with the file and the reason: an extension that is not one of these, a folder that is missing or not writable,
 * a full disk, more than one number per voxel, a geometry that is not a pose, point arrays that do not fit the voxels, a
 * `ValidRegion` that is not unsigned char, slabs of a format that is written whole, an input whose pose or type of numbers
 * changes from slab to slab.
 *
 * @sa vtkUltrasoundReader, vtkUltrasoundSequenceWriter
 */
#ifndef vtkUltrasoundWriter_h
#define vtkUltrasoundWriter_h

#include "EchoramaReadersModule.h"
#include "vtkUltrasoundParameters.h"
#include "vtkWriter.h"

#include <string> // for the notes
#include <vector> // for the notes

#ifndef __VTK_WRAP__
#include "Core/Base/JoinedText.h"
#include "Core/Base/Progress.h"
#include <array>      // for extents
#include <functional> // for the source of slabs
#endif

class vtkImageData;

class ECHORAMAREADERS_EXPORT vtkUltrasoundWriter : public vtkWriter {
public:
  static vtkUltrasoundWriter* New();
  vtkTypeMacro(vtkUltrasoundWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The file to write. Default: none. */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Updates the input and writes it. Returns 1 when the file is there, complete; 0 after any error, also of the input.
   */
  int Write() override;

  /** What the last Write() could not keep, one sentence per line. */
  std::string GetNotes() const { return echorama::Joined(this->Notes, "\n"); }

  // BEGIN parameters
  /** Whether voxels are compressed, without loss. NIfTI goes by its extension: .nii is not, .nii.gz is. Default on. */
  vtkUltrasoundSwitchMacro(UseCompression);

  /**
   * In how many slabs along z the input is asked for its voxels, one after the other; at most so many as there are slices. With
   * more than 1 the volume is never in memory as a whole, when the input makes no more than it is asked for; the files are the
   * same to the last byte. For .mha, .mhd, .nrrd, .nhdr, .nii and .nii.gz. At least 1; default 1.
   */
  vtkUltrasoundIntegerMacro(NumberOfSlabs);

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
  vtkUltrasoundWriter() = default;
  ~vtkUltrasoundWriter() override
  {
    this->SetFileName(nullptr);
  }

  int FillInputPortInformation(int port, vtkInformation* information) override;
  void WriteData() override;

  char* FileName = nullptr;

private:
  vtkUltrasoundWriter(const vtkUltrasoundWriter&) = delete;
  void operator=(const vtkUltrasoundWriter&) = delete;

#ifndef __VTK_WRAP__
  using SlabSource = std::function<vtkImageData*(const std::array<int, 6>& extent, const echorama::Progress& progress)>;
  void WriteBySlabs(const std::string& path, const echorama::Progress& progress);
  void WriteSlabs(const std::string& path, const std::array<int, 6>& whole, int slabs, const SlabSource& slabOf,
                  const echorama::Progress& progress);
  void WriteXml(vtkImageData* input, bool validIsSeen, const echorama::Progress& progress);
  void NoteLost(const std::vector<std::string>& lost);
  void Finish(int written);

  bool UseCompression = true;
  int NumberOfSlabs = 1;
  std::vector<std::string> Notes;
  double RoundingMm = 0.0; // of the last file, as other programs see it
  bool Written = false;
#endif
};

#endif
