// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundMultiBlockAlgorithm
 * @brief base class of the filters that take several volumes and put out several, one block each
 *
 * Every input port takes any number of images, or of data object trees of such, and all of them whole. Under MPI each rank
 * computes and holds the whole result. A subclass overrides Execute().
 */
#ifndef vtkUltrasoundMultiBlockAlgorithm_h
#define vtkUltrasoundMultiBlockAlgorithm_h

#include "EchoramaCoreModule.h"
#include "vtkMultiBlockDataSetAlgorithm.h"
#include "vtkUltrasoundVolume.h" // for kernel types

class ECHORAMACORE_EXPORT vtkUltrasoundMultiBlockAlgorithm : public vtkMultiBlockDataSetAlgorithm {
public:
  vtkTypeMacro(vtkUltrasoundMultiBlockAlgorithm, vtkMultiBlockDataSetAlgorithm);

protected:
  vtkUltrasoundMultiBlockAlgorithm() = default;
  ~vtkUltrasoundMultiBlockAlgorithm() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  /** Calls Execute() through vtkUltrasoundVolume::Run. */
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

#ifndef __VTK_WRAP__
  /** The work of the filter. Reports failure by throwing echorama::Error. */
  virtual void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) = 0;

  /** Puts a volume out as block number \a block of a port, by its name. */
  static void PutBlock(vtkInformationVector* outputs, int port, std::size_t block, vtkImageData* volume, const std::string& name);
#endif

private:
  vtkUltrasoundMultiBlockAlgorithm(const vtkUltrasoundMultiBlockAlgorithm&) = delete;
  void operator=(const vtkUltrasoundMultiBlockAlgorithm&) = delete;
};

#endif
