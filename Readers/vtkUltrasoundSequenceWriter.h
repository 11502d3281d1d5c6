// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSequenceWriter
 * @brief writes tracked frames as Plus does: .igs.mha, .seq.mha, .mhd, .seq.nrrd, .igs.nrrd, .nhdr
 *
 * Input 0: vtkImageData, one frame per time step, with `Intensity` (else the active scalars) and the field data that
 * vtkUltrasoundSequenceReader describes. All time steps are asked for and written one after the other, so that a sequence need
 * not fit in memory; an input without time steps is one frame. An image without voxels at the first step makes a recording of
 * poses alone (not in NRRD).
 *
 * Every field AToBTransform of 16 numbers is written with its status. `ImageToWorld` is written as ImageToReferenceTransform
 * (or whatever frame the string `WorldFrame` names), unless the frame has that one already; a frame without it, where others have
 * it, gets one that is INVALID. An image whose `ValidRegion` is 0 everywhere is marked as INVALID. The time is `TimeStamp`; where
 * there is none, the time step, but for frames of a sequence (FrameIndex) that had none. Strings Frame_KEY are fields of
 * the frame, as is ProbeToWorld; other strings, ProbeGeometry, Seed and Scene are written once, as the first frame has them.
 * Pixels, matrices and times come back to the last bit. What cannot be held is listed by GetNotes() and in a warning.
 *
 * All or nothing: after an error, a full disk or an abort, what was there before is there unchanged.
 *
 * Errors, with the file and the reason: an input that fails, frames that differ in size or type, more than one number per pixel,
 * what echorama::SequenceWriter refuses.
 *
 * @sa vtkUltrasoundSequenceReader
 */
#ifndef vtkUltrasoundSequenceWriter_h
#define vtkUltrasoundSequenceWriter_h

#include "EchoramaReadersModule.h"
#include "vtkUltrasoundParameters.h"
#include "vtkWriter.h"

#include <string> // for the notes
#include <vector> // for the notes

#ifndef __VTK_WRAP__
#include "Core/Base/JoinedText.h"
#include "Core/Base/Progress.h"
#endif

class ECHORAMAREADERS_EXPORT vtkUltrasoundSequenceWriter : public vtkWriter {
public:
  static vtkUltrasoundSequenceWriter* New();
  vtkTypeMacro(vtkUltrasoundSequenceWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The file to write; its extension chooses the format. Default: none. */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Updates the input at each of its time steps and writes them. Returns 1 when the file is there, complete; 0 after any
   * error, also of the input.
   */
  int Write() override;

  /** What the last Write() could not keep, one sentence per line. */
  std::string GetNotes() const { return echorama::Joined(this->Notes, "\n"); }

  // BEGIN parameters
  /** Whether pixels are compressed, without loss. Default on. */
  vtkUltrasoundSwitchMacro(UseCompression);

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
  /**
   * Writes what is connected to port 0 of \a sink, one time step after the other. Returns notes on what could not be kept;
   * throws echorama::Error.
   */
  static std::vector<std::string> WriteSteps(vtkWriter* sink, const std::string& path, bool compress,
                                             const echorama::Progress& progress);
#endif

protected:
  vtkUltrasoundSequenceWriter() = default;
  ~vtkUltrasoundSequenceWriter() override
  {
    this->SetFileName(nullptr);
  }

  int FillInputPortInformation(int port, vtkInformation* information) override;
  void WriteData() override {} // all is done by Write(), which asks for one time step after the other

  char* FileName = nullptr;

private:
  vtkUltrasoundSequenceWriter(const vtkUltrasoundSequenceWriter&) = delete;
  void operator=(const vtkUltrasoundSequenceWriter&) = delete;

#ifndef __VTK_WRAP__
  bool UseCompression = true;
  std::vector<std::string> Notes;
#endif
};

#endif
