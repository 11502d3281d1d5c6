// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundNoiseSource
 * @brief noise as an ultrasound machine makes it, in the fan of a probe
 *
 * Input 0, optional: a volume whose fan the noise fills (its field data `ProbeGeometry` and `ProbeToWorld`, else what
 * vtkUltrasoundProbeFit finds), and with OnInputGrid also its grid. Input 1, optional: a volume whose grain and intensities
 * the noise shall have. Without input 0 its fan is taken; without any input, the fan of the properties.
 *
 * Output: a vtkImageData with `Intensity` (unsigned char, or float), `ValidRegion` (1 inside the fan, elsewhere both are 0), and
 * the field data `ProbeGeometry`, `ProbeToWorld` and `Seed`. Its grid is the tightest of cubic voxels around the fan, aligned
 * with the probe.
 *
 * Noise along beams (the default) is speckle made in beam space and scan-converted: its grain is curved about the probe and
 * widens with depth. White and Perlin noise do not look like ultrasound; they are there to compare with.
 *
 * Fails, with a message that names the number, for a probe geometry that is none, lengths out of range, a volume too large, or
 * a volume to match that has too little texture.
 *
 * Source: dissertation 6.2.
 * @sa echorama::MakeBeamNoise, echorama::MatchNoise, vtkUltrasoundProbeFit
 */
#ifndef vtkUltrasoundNoiseSource_h
#define vtkUltrasoundNoiseSource_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/ProbeGeometry.h"
#include <memory>   // for what is set
#include <optional> // for inputs
#endif

class vtkAlgorithmOutput;

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundNoiseSource : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundNoiseSource* New();
  vtkTypeMacro(vtkUltrasoundNoiseSource, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volume to match. */
  void SetMatchConnection(vtkAlgorithmOutput* port) { this->SetInputConnection(1, port); }
  void SetMatchData(vtkDataObject* volume) { this->SetInputDataObject(1, volume); }
  ///@}

  // BEGIN parameters
  enum Kinds { BEAMS = 0, WHITE = 1, PERLIN = 2 };

  ///@{
  /**
   * Noise along beams looks like ultrasound; white and Perlin noise are there to compare with. Default beams. There are BEAMS,
   * WHITE, PERLIN.
   */
  vtkUltrasoundChoiceMacro(Kind);
  void SetKindToBeams() { this->SetKind(BEAMS); }
  void SetKindToWhite() { this->SetKind(WHITE); }
  void SetKindToPerlin() { this->SetKind(PERLIN); }
  ///@}

  enum IntensityModels { RAYLEIGH = 0, LOG_COMPRESSED = 1 };

  ///@{
  /**
   * How intensities are distributed: as the envelope of speckle, or as the greys of a machine. A volume to match brings its own
   * distribution. Default log-compressed. There are RAYLEIGH, LOG_COMPRESSED.
   */
  vtkUltrasoundChoiceMacro(IntensityModel);
  void SetIntensityModelToRayleigh() { this->SetIntensityModel(RAYLEIGH); }
  void SetIntensityModelToLogCompressed() { this->SetIntensityModel(LOG_COMPRESSED); }
  ///@}

  /** Mean of the intensities; below 255 when they are log-compressed. Above 0; default 40. */
  vtkUltrasoundNumberMacro(Mean);

  /**
   * How much 255 greys span. With 60 dB the deviation is 24 greys where nothing is cut. Used when IntensityModel is
   * log-compressed. In [10, 200] dB; default 60.
   */
  vtkUltrasoundNumberMacro(DynamicRangeDb);

  /** The same seed makes the same noise. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * Size of the grain along the depth, at most a quarter of the depth range: the lag at which the autocorrelation of the
   * speckle's power is one half. 0: neighbouring samples are independent. A volume to match brings its own. In [0, 10000] mm;
   * default 0.6.
   */
  vtkUltrasoundNumberMacro(DepthCorrelationMm);

  /** The same across the fan. In [0, 0.25] whole fans; default 0.0125. */
  vtkUltrasoundNumberMacro(FanCorrelation);

  /** The same along the sweep. In [0, 0.25] whole sweeps; default 0.025. */
  vtkUltrasoundNumberMacro(SweepCorrelation);

  /**
   * Samples along a beam. 0: three to each length of the grain, or 400 samples, 240 elements and 120 steps where that is 0. In
   * [0, 100000]; default 0.
   */
  vtkUltrasoundIntegerMacro(Samples);

  /**
   * Beams across the fan. 0: three to each length of the grain, or 400 samples, 240 elements and 120 steps where that is 0. In
   * [0, 100000]; default 0.
   */
  vtkUltrasoundIntegerMacro(Elements);

  /**
   * Planes of the sweep. 0: three to each length of the grain, or 400 samples, 240 elements and 120 steps where that is 0. In [0,
   * 100000]; default 0.
   */
  vtkUltrasoundIntegerMacro(Steps);

  /**
   * Of the volume to match, what is smooth over so much along the depth, and twice as much across, is the scene and no grain.
   * Above 0 mm; default 1.5.
   */
  vtkUltrasoundNumberMacro(WindowMm);

  /**
   * Standard deviation of the intensities of white and Perlin noise. Used when Kind is white or perlin. At least 0; default 20.
   */
  vtkUltrasoundNumberMacro(Deviation);

  /** Distance of the gradients of Perlin noise, at least that of the voxels. Used when Kind is perlin. Above 0 mm; default 4. */
  vtkUltrasoundNumberMacro(CellMm);

  /**
   * Octaves of Perlin noise, each with half the cell and half the amplitude of the one before. Used when Kind is perlin. In [1,
   * 10]; default 3.
   */
  vtkUltrasoundIntegerMacro(Octaves);

  /** Edge of the cubic voxels. Used when OnInputGrid is off. In (0, 1000] mm; default 0.5. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /** Whether the output lies on the grid of the volume that gives the fan. Default off. */
  vtkUltrasoundSwitchMacro(OnInputGrid);

  /** Whether intensities are float, neither rounded nor cut; else unsigned char. Default off. */
  vtkUltrasoundSwitchMacro(FloatOutput);

  /** The output is refused when it would have more voxels. At least 1; default 1073741824. */
  vtkUltrasoundInteger64Macro(MaximumVoxels);

  /** Angle between the first and the last beam of a fan. In [0, 359.999] degrees; default 65. */
  vtkUltrasoundNumberMacro(FanAngle);

  /** Length of the array along its arc. In [0, 10000] mm; default 45. */
  vtkUltrasoundNumberMacro(FanWidth);

  /**
   * Angle that the array sweeps. With an angle and a width of 0 the sweep is a single plane. In [0, 359.999] degrees; default 55.
   */
  vtkUltrasoundNumberMacro(SweepAngle);

  /** Length of the arc that the middle of the array travels. In [0, 10000] mm; default 29. */
  vtkUltrasoundNumberMacro(SweepWidth);

  /** First depth along the beams, from the face. In [-10000, 10000] mm; default 0. */
  vtkUltrasoundNumberMacro(DepthMin);

  /** Last depth along the beams, from the face. In [-10000, 10000] mm; default 100. */
  vtkUltrasoundNumberMacro(DepthMax);

  /** Where the middle of the probe's face lies in the world. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Position);

  /** How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x. In degrees; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Orientation);

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

  ///@{
  /** After an update: samples, elements and steps that were made, and their lengths (mm, whole fans, whole sweeps). */
  vtkGetVector3Macro(MadeCounts, int);
  vtkGetVector3Macro(MadeCorrelation, double);
  ///@}

  ///@{
  /**
   * After an update with a volume to match: whether its lengths along depth, fan and sweep (1 or 0 each) are longer than what its
   * voxels add to them; if not they are bounds.
   */
  vtkGetVector3Macro(MatchResolved, int);
  ///@}

protected:
  vtkUltrasoundNoiseSource();
  ~vtkUltrasoundNoiseSource() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  struct Settings;
#ifndef __VTK_WRAP__
  std::optional<vtkUltrasoundVolume::Input> InputAt(vtkInformationVector** inputs, int port);
  echorama::PlacedProbe FanFor(vtkInformationVector** inputs);
  echorama::ImageGeometry GridFor(vtkInformationVector** inputs, const echorama::PlacedProbe& fan);
  std::unique_ptr<Settings> Values;
#endif

  int MadeCounts[3] = {0, 0, 0};
  double MadeCorrelation[3] = {0.0, 0.0, 0.0};
  int MatchResolved[3] = {0, 0, 0};

  vtkUltrasoundNoiseSource(const vtkUltrasoundNoiseSource&) = delete;
  void operator=(const vtkUltrasoundNoiseSource&) = delete;
};

#endif
