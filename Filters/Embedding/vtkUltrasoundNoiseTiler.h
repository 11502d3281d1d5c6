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
#include "vtkUltrasoundParameters.h"

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

  // BEGIN parameters
  /**
   * Volumes side by side across the fan; 0: as many as there are for the rows. When there are fewer volumes than places they are
   * used again, turned or mirrored. In [0, 1000]; default 0.
   */
  vtkUltrasoundIntegerMacro(Columns);

  /** Rows of volumes along the sweep. In [1, 1000]; default 1. */
  vtkUltrasoundIntegerMacro(Rows);

  /**
   * By how much neighbouring noise volumes overlap where fan or sweep turn. It sets the angle of the whole. In [0, 360] degrees;
   * default 10.
   */
  vtkUltrasoundNumberMacro(OverlapDegrees);

  /** The same where fan or sweep run straight (turn by less than half a degree in all). In [0, 10000] mm; default 8. */
  vtkUltrasoundNumberMacro(OverlapMm);

  /** Edge of the cubic voxels of the output. 0: the voxel size of the first volume. At least 0 mm; default 0. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /** Of which volumes the fan was fitted, and what that left open: sentences, one per line. */
  std::string GetNotes() const { return this->Notes; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

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
  const std::vector<echorama::NoiseInput>& Prepare(vtkInformationVector* port, const echorama::Progress& progress);
  std::unique_ptr<Volumes> Kept; // the inputs of the last run and their fans
  echorama::NoiseTilingParameters Values;
#endif

  std::string Notes;
};

#endif
