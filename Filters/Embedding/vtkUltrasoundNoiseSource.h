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

#ifndef __VTK_WRAP__
#include "BeamNoise.h"
#include <optional>
#endif

class vtkAlgorithmOutput;

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundNoiseSource : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundNoiseSource* New();
  vtkTypeMacro(vtkUltrasoundNoiseSource, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** What kinds of noise there are. */
  enum KindType { BEAMS = 0, WHITE = 1, PERLIN = 2 };

  /** How intensities of noise along beams are distributed. */
  enum IntensityModelType { RAYLEIGH = 0, LOG_COMPRESSED = 1 };

  ///@{
  /** The volume to match. */
  void SetMatchConnection(vtkAlgorithmOutput* port) { this->SetInputConnection(1, port); }
  void SetMatchData(vtkDataObject* volume) { this->SetInputDataObject(1, volume); }
  ///@}

  ///@{
  /** BEAMS (default), WHITE or PERLIN. */
  vtkSetClampMacro(Kind, int, BEAMS, PERLIN);
  vtkGetMacro(Kind, int);
  void SetKindToBeams() { this->SetKind(BEAMS); }
  void SetKindToWhite() { this->SetKind(WHITE); }
  void SetKindToPerlin() { this->SetKind(PERLIN); }
  ///@}

  ///@{
  /**
   * RAYLEIGH (the envelope of speckle) or LOG_COMPRESSED (default: the greys of a machine). A volume to match brings its own
   * distribution. WHITE and PERLIN are normally distributed, or nearly.
   */
  vtkSetClampMacro(IntensityModel, int, RAYLEIGH, LOG_COMPRESSED);
  vtkGetMacro(IntensityModel, int);
  ///@}

  ///@{
  /** Mean of the intensities, above 0, and below 255 when log-compressed. Default 40. */
  vtkSetMacro(Mean, double);
  vtkGetMacro(Mean, double);
  ///@}

  ///@{
  /** How many dB 255 greys span (log-compressed), in [10, 200]. Default 60: a deviation of 24 greys where nothing is cut. */
  vtkSetClampMacro(DynamicRangeDb, double, 10.0, 200.0);
  vtkGetMacro(DynamicRangeDb, double);
  ///@}

  ///@{
  /** Seed, at least 0. Default 1. */
  vtkSetClampMacro(Seed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(Seed, vtkTypeInt64);
  ///@}

  ///@{
  /**
   * How many samples along a beam, beams (elements) across the fan and planes (steps) of the sweep. 0 (default): three to each
   * length below. With a length of 0 they set the grain (dissertation 6.2); 0 is then 400, 240 and 120.
   */
  vtkSetClampMacro(Samples, int, 0, 100000);
  vtkGetMacro(Samples, int);
  vtkSetClampMacro(Elements, int, 0, 100000);
  vtkGetMacro(Elements, int);
  vtkSetClampMacro(Steps, int, 0, 100000);
  vtkGetMacro(Steps, int);
  ///@}

  ///@{
  /**
   * Size of the grain: the lag at which the autocorrelation of the speckle's power is one half. Along the depth in mm (0 to a
   * quarter of the depth range; default 0.6), across the fan in whole fans (0 to 0.25; default 0.0125), along the sweep in whole
   * sweeps (0 to 0.25; default 0.025). 0: neighbouring samples are independent. A volume to match brings its own.
   */
  vtkSetMacro(DepthCorrelationMm, double);
  vtkGetMacro(DepthCorrelationMm, double);
  vtkSetClampMacro(FanCorrelation, double, 0.0, 0.25);
  vtkGetMacro(FanCorrelation, double);
  vtkSetClampMacro(SweepCorrelation, double, 0.0, 0.25);
  vtkGetMacro(SweepCorrelation, double);
  ///@}

  ///@{
  /**
   * Of the volume to match, what is smooth over so many mm along the depth, and twice as many across, is the scene and no grain;
   * > 0. Default 1.5.
   */
  vtkSetMacro(WindowMm, double);
  vtkGetMacro(WindowMm, double);
  ///@}

  ///@{
  /** Standard deviation of the intensities of WHITE and PERLIN, at least 0. Default 20. */
  vtkSetClampMacro(Deviation, double, 0.0, 1e9);
  vtkGetMacro(Deviation, double);
  ///@}

  ///@{
  /** Distance of the gradients of PERLIN, mm, at least SpacingMm. Default 4. */
  vtkSetMacro(CellMm, double);
  vtkGetMacro(CellMm, double);
  ///@}

  ///@{
  /** Octaves of PERLIN, in [1, 10]. Default 3. */
  vtkSetClampMacro(Octaves, int, 1, 10);
  vtkGetMacro(Octaves, int);
  ///@}

  ///@{
  /** Edge of the cubic voxels in mm, > 0. Default 0.5. Not used with OnInputGrid. */
  vtkSetMacro(SpacingMm, double);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /** Whether the output lies on the grid of input 0. Default off. */
  vtkSetMacro(OnInputGrid, bool);
  vtkGetMacro(OnInputGrid, bool);
  vtkBooleanMacro(OnInputGrid, bool);
  ///@}

  ///@{
  /** Whether intensities are float, neither rounded nor cut. Default off: unsigned char. */
  vtkSetMacro(FloatOutput, bool);
  vtkGetMacro(FloatOutput, bool);
  vtkBooleanMacro(FloatOutput, bool);
  ///@}

  ///@{
  /** The output is refused when it would have more voxels, at least 1. Default 2^30. */
  vtkSetClampMacro(MaximumVoxels, vtkIdType, 1, VTK_ID_MAX);
  vtkGetMacro(MaximumVoxels, vtkIdType);
  ///@}

  ///@{
  /**
   * The fan where no volume gives one: angles (degrees, [0, 360)) and lengths of arcs (mm, >= 0) of the fan and of the sweep.
   * Default 65 degrees, 45 mm; 55 degrees, 29 mm. A sweep of 0 degrees and 0 mm is a single plane.
   */
  vtkSetMacro(FanAngle, double);
  vtkGetMacro(FanAngle, double);
  vtkSetMacro(FanWidth, double);
  vtkGetMacro(FanWidth, double);
  vtkSetMacro(SweepAngle, double);
  vtkGetMacro(SweepAngle, double);
  vtkSetMacro(SweepWidth, double);
  vtkGetMacro(SweepWidth, double);
  ///@}

  ///@{
  /** Its first and last depth along the beams, mm from the face. Default 0 and 100. */
  vtkSetMacro(DepthMin, double);
  vtkGetMacro(DepthMin, double);
  vtkSetMacro(DepthMax, double);
  vtkGetMacro(DepthMax, double);
  ///@}

  ///@{
  /** Where the middle of its face lies in the world, mm. Default (0, 0, 0). */
  vtkSetVector3Macro(Position, double);
  vtkGetVector3Macro(Position, double);
  ///@}

  ///@{
  /** How it is turned: axis times angle, in degrees. Default (0, 0, 0): it looks along +z, the fan along x. */
  vtkSetVector3Macro(Orientation, double);
  vtkGetVector3Macro(Orientation, double);
  ///@}

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
  ~vtkUltrasoundNoiseSource() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
#ifndef __VTK_WRAP__
  std::optional<vtkUltrasoundVolume::Input> InputAt(vtkInformationVector** inputs, int port);
  echorama::PlacedProbe FanFor(vtkInformationVector** inputs);
  echorama::ImageGeometry GridFor(vtkInformationVector** inputs, const echorama::PlacedProbe& fan);
  echorama::BeamNoiseParameters BeamParameters(const echorama::ProbeGeometry& geometry) const;
#endif

  int Kind = BEAMS;
  int IntensityModel = LOG_COMPRESSED;
  double Mean;
  double DynamicRangeDb;
  vtkTypeInt64 Seed;
  int Samples = 0;
  int Elements = 0;
  int Steps = 0;
  double DepthCorrelationMm;
  double FanCorrelation;
  double SweepCorrelation;
  double WindowMm;
  double Deviation;
  double CellMm;
  int Octaves;
  double SpacingMm = 0.5;
  bool OnInputGrid = false;
  bool FloatOutput = false;
  vtkIdType MaximumVoxels = vtkIdType(1) << 30;
  double FanAngle = 65.0;
  double FanWidth = 45.0;
  double SweepAngle = 55.0;
  double SweepWidth = 29.0;
  double DepthMin = 0.0;
  double DepthMax = 100.0;
  double Position[3] = {0.0, 0.0, 0.0};
  double Orientation[3] = {0.0, 0.0, 0.0};
  int MadeCounts[3] = {0, 0, 0};
  double MadeCorrelation[3] = {0.0, 0.0, 0.0};
  int MatchResolved[3] = {0, 0, 0};

  vtkUltrasoundNoiseSource(const vtkUltrasoundNoiseSource&) = delete;
  void operator=(const vtkUltrasoundNoiseSource&) = delete;
};

#endif
