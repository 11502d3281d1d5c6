// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundNoiseTiler
 * @brief volumes of nothing but noise side by side, as one of a machine with a larger fan
 *
 * Input (repeatable): one or more vtkImageData, or vtkDataObjectTree whose leaves are, each with `Intensity` and optionally
 * `ValidRegion`: scans with gel on the probe and nothing but air before it. Where a volume has the field data `ProbeGeometry` and
 * `ProbeToWorld` its fan is that; else it is fitted to its valid region (echorama::FitProbe).
 *
 * Output: one vtkImageData with `Intensity` (float), `ValidRegion`, and the field data `ProbeGeometry` and `ProbeToWorld` of the
 * larger fan: at the place of the first volume's probe, with its radii.
 *
 * Volumes are laid across the fan first (Columns), then along the sweep (Rows), with the overlap that is asked for, and blended
 * like anatomy, by the stitcher. When there are fewer than places they are used again, turned or mirrored.
 *
 * Refuses, with a message: volumes whose fan cannot be found, planes among volumes, fans that turn beside ones that run
 * straight, an overlap as large as a fan, and more than a probe can have.
 *
 * @sa echorama::TileNoise, vtkUltrasoundProbeFit, vtkUltrasoundStitcher
 */
#ifndef vtkUltrasoundNoiseTiler_h
#define vtkUltrasoundNoiseTiler_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

#include <string> // for notes

#ifndef __VTK_WRAP__
#include "Filters/Embedding/NoiseTiling.h"
#include <memory> // for what is kept
#include <vector> // for volumes
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundNoiseTiler : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundNoiseTiler* New();
  vtkTypeMacro(vtkUltrasoundNoiseTiler, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Volumes side by side across the fan, in [0, 100]; 0 (default): as many as there are for the rows. */
  vtkSetClampMacro(Columns, int, 0, 100);
  vtkGetMacro(Columns, int);
  ///@}

  ///@{
  /** Rows of them along the sweep, in [1, 100]. Default 1. */
  vtkSetClampMacro(Rows, int, 1, 100);
  vtkGetMacro(Rows, int);
  ///@}

  ///@{
  /** By how much neighbours overlap where fan or sweep turn, degrees, in [0, 360]. Default 10. */
  vtkSetClampMacro(OverlapDegrees, double, 0.0, 360.0);
  vtkGetMacro(OverlapDegrees, double);
  ///@}

  ///@{
  /** By how much neighbours overlap where fan or sweep run straight, mm, in [0, 1000]. Default 8. */
  vtkSetClampMacro(OverlapMm, double, 0.0, 1000.0);
  vtkGetMacro(OverlapMm, double);
  ///@}

  ///@{
  /** Edge length of the cubic voxels of the output, mm, in [0, 100]; 0 (default): the voxel size of the first volume. */
  vtkSetClampMacro(SpacingMm, double, 0.0, 100.0);
  vtkGetMacro(SpacingMm, double);
  ///@}

  /** Of which volumes the fan was fitted, and what that left open: sentences, one per line. */
  std::string GetNotes() const { return this->Notes; }

protected:
  vtkUltrasoundNoiseTiler();
  ~vtkUltrasoundNoiseTiler() override;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundNoiseTiler(const vtkUltrasoundNoiseTiler&) = delete;
  void operator=(const vtkUltrasoundNoiseTiler&) = delete;

#ifndef __VTK_WRAP__
  struct Volumes;
  echorama::NoiseTilingParameters Parameters() const;
  const std::vector<echorama::NoiseInput>& Prepare(vtkInformationVector* port, const echorama::Progress& progress);
  std::unique_ptr<Volumes> Kept; // the inputs of the last run and their fans
#endif

  int Columns;
  int Rows;
  double OverlapDegrees;
  double OverlapMm;
  double SpacingMm;
  std::string Notes;
};

#endif
