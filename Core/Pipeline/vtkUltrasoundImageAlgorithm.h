// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundImageAlgorithm
 * @brief base class of the filters that put out one volume: nothing of what a volume carries gets lost
 *
 * The base classes of VTK 9.1 lose the direction matrix in RequestInformation. This one passes the whole geometry of the
 * first input on, asks for the whole extent of every input (our filters need it; under MPI each rank computes the whole
 * and keeps the piece it was asked for), and helps to carry all arrays and field data.
 *
 * A subclass overrides Execute(), and RequestInformation() when its output lies on another grid than its first input.
 */
#ifndef vtkUltrasoundImageAlgorithm_h
#define vtkUltrasoundImageAlgorithm_h

#include "EchoramaCoreModule.h"
#include "vtkImageAlgorithm.h"
#include "vtkUltrasoundVolume.h" // for kernel types

class ECHORAMACORE_EXPORT vtkUltrasoundImageAlgorithm : public vtkImageAlgorithm {
public:
  vtkTypeMacro(vtkUltrasoundImageAlgorithm, vtkImageAlgorithm);

protected:
  vtkUltrasoundImageAlgorithm() = default;
  ~vtkUltrasoundImageAlgorithm() override = default;

  /** Whole extent, spacing, origin and direction of the first input. */
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  /** The whole extent of every image that comes in. */
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  /** Calls Execute() through vtkUltrasoundVolume::Run, then crops the output to the extent that was asked for. */
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

#ifndef __VTK_WRAP__
  /** The work of the filter. Reports failure by throwing echorama::Error. */
  virtual void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) = 0;
#endif

  /**
   * Makes \a output the volume \a input with all its arrays and field data, of which \a intensity is replaced by a new
   * array of the same name and the type \a vtkType, its values not set, which becomes the active scalars.
   */
  static vtkDataArray* CopyWithNewIntensity(vtkImageData* input, vtkDataArray* intensity, vtkImageData* output, int vtkType);

  /**
   * Adds a new one-component point array of \a vtkType, one value per voxel, values not set, to \a output.
   */
  static vtkDataArray* AddArray(vtkImageData* output, const char* name, int vtkType);

private:
  vtkUltrasoundImageAlgorithm(const vtkUltrasoundImageAlgorithm&) = delete;
  void operator=(const vtkUltrasoundImageAlgorithm&) = delete;
};

#endif
