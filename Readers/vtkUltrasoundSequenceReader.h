// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSequenceReader
 * @brief reads tracked sequences of frames: .igs.mha, .seq.mha, .mhd, .seq.nrrd, .igs.nrrd, .nhdr
 *
 * Output 0, one frame per time step: a vtkImageData with the point arrays `Intensity` and `ValidRegion` (1; 0 everywhere
 * where the file marks the image as not valid), and as field data
 *
 * | field                         | values                                                                             |
 * | ----------------------------- | ---------------------------------------------------------------------------------- |
 * | ImageToWorld                  | 16 doubles: pixel indices to world mm, exact; absent when the frame has no valid pose |
 * | WorldFrame                    | a string: the frame of coordinates that is the world; absent when none can be reached |
 * | TimeStamp                     | 1 double, seconds; absent when the file has none                                   |
 * | FrameIndex                    | 1 int, from 0                                                                      |
 * | AToBTransform                 | 16 doubles, for every transform of the file, also those that are not valid         |
 * | AToBTransformStatus           | a string: OK, INVALID, MISSING, OUT_OF_VIEW ..., as in the file                    |
 * | Frame_KEY, KEY                | strings: the other fields of this frame, and of the file                           |
 *
 * The image's own geometry is the nearest to ImageToWorld that is a rigid pose with a spacing; without a pose it is that of
 * the header (usually pixels of 1 mm at the origin). Frames come in MF orientation (x towards the marked side, y away from
 * the probe), whatever the file's. Times are the file's time stamps where all frames have one and they increase, else indices
 * of frames. A time between two frames gives the nearer one. Recordings of trackers alone give an empty image.
 *
 * Output 1: the track, a vtkPolyData. Each tool (see ToolFrame) is a point per frame in which its pose is valid: the origin of
 * its frame of coordinates in the world, with the point arrays FrameIndex, TimeStamp (NaN: none), Tool (an index into the field
 * data ToolNames), ToolToWorld (16 numbers, row by row), and for every transform of the file AToBTransform (16) and
 * AToBTransformStatus (0 valid, 1 missing, 2 out of range). Consecutive frames are joined by lines, so that a line ends where
 * the tracker lost the tool. Each output is made only when it is asked for.
 *
 * A frame is never placed with a transform whose status is not OK. Files are streamed: memory is needed for the header, one
 * frame and about 10 MB. GetNotes() says what was assumed, turned or is not usable.
 *
 * Refused, with a message that names file and reason: what echorama::SequenceFile refuses; a WorldFrame or ToolFrame that
 * cannot be reached; no WorldFrame where several are possible; a bad TransformFile.
 *
 * @sa vtkUltrasoundSequenceWriter, vtkUltrasoundReader
 */
#ifndef vtkUltrasoundSequenceReader_h
#define vtkUltrasoundSequenceReader_h

#include "EchoramaReadersModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <memory> // for what is open
#include <string> // for the notes

class vtkPolyData;

class ECHORAMAREADERS_EXPORT vtkUltrasoundSequenceReader : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundSequenceReader* New();
  vtkTypeMacro(vtkUltrasoundSequenceReader, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The file to read. Default: none. */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  ///@{
  /**
   * Fixed transforms that the sequence lacks, such as ImageToProbe: a configuration of the Plus toolkit (XML) or our JSON.
   * A transform that the sequence has too is that of the sequence. Default: none.
   */
  vtkSetFilePathMacro(TransformFile);
  vtkGetFilePathMacro(TransformFile);
  ///@}

  // BEGIN parameters
  /**
   * The frame of coordinates that is the world. Empty takes the first of Reference, World and Tracker that transforms lead to
   * from the image (from anything, when none begins at the image), else the only frame that transforms lead to and none leads
   * from; where that leaves a choice, it has to be made here. Default none.
   */
  vtkUltrasoundTextMacro(WorldFrame);

  /** The frame of coordinates that counts pixels. Default Image. */
  vtkUltrasoundTextMacro(ImageFrame);

  /**
   * Whose track output 1 is: a frame of coordinates. Empty takes the image where it can be placed, else every frame that a
   * transform of the file begins at and that can be placed. Default none.
   */
  vtkUltrasoundTextMacro(ToolFrame);

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

  /**
   * 1 when \a fileName is there and its header is that of a sequence of frames, else 0.
   */
  static int CanReadFile(const char* fileName);

  ///@{
  /** What is known once information has been updated: frames, 0 before; all frames of coordinates, with commas; the world. */
  int GetNumberOfFrames() const;
  std::string GetCoordinateFrames() const;
  std::string GetWorldFrameInUse() const;
  ///@}

  /**
   * What was assumed, turned or is not usable, one sentence per line. Empty when all is well.
   */
  std::string GetNotes() const;

protected:
  vtkUltrasoundSequenceReader();
  ~vtkUltrasoundSequenceReader() override;

  int FillOutputPortInformation(int port, vtkInformation* information) override;
  int ProcessRequest(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

  char* FileName = nullptr;
  char* TransformFile = nullptr;

private:
  vtkUltrasoundSequenceReader(const vtkUltrasoundSequenceReader&) = delete;
  void operator=(const vtkUltrasoundSequenceReader&) = delete;

#ifndef __VTK_WRAP__
  struct Sequence;
  Sequence& Open();
  void ReadFrame(int index, vtkImageData* output, const echorama::Progress& progress);
  void MakeTrack(vtkPolyData* output, const echorama::Progress& progress);

  std::string ImageFrame = "Image", WorldFrame, ToolFrame;
  std::unique_ptr<Sequence> Opened;
  double RequestedTime = 0.0;
#endif
};

#endif
