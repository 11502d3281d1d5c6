// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSynthesizer
 * @brief a synthetic 3D ultrasound volume, or one slice, of tissue whose geometry is known
 *
 * Input 0: tissue (vtkPolyData, see vtkUltrasoundTissue), from a source or from anything that deforms or adds to it. Input 1,
 * optional: a probe (data with the field data `ProbeGeometry` and `ProbeToWorld`, as vtkUltrasoundProbeSource puts it out);
 * without it the geometry and pose of this filter's own properties are used. Input 2, optional: a displacement image
 * (in the form of vtkUltrasoundDisplacement) that says where the tissue has gone: a scatterer at m in the material is now at
 * m + u(m), the other way round than displacements of an aligner. The surfaces of input 0 are those that the tissue has now.
 *
 * Output 0: the scan-converted volume, a vtkImageData with `Intensity` (unsigned char, log-compressed B-mode), `ValidRegion` (1
 * inside the fan) and the field data `ProbeGeometry`, `ProbeToWorld`, `Seed` and `Scene` (all parameters as JSON). Its geometry
 * is the pose. A probe that does not sweep, or SliceOnly, makes a 2D image. Output 1: the same on the beams: samples along x,
 * beams of the fan along y, steps of the sweep along z (see vtkUltrasoundScanConverter).
 *
 * The rays' acceleration structure is kept as long as the tissue does not change, so moving the probe is cheap.
 *
 * Fails, with a message that names the number or array, for tissue that is none, parameters out of range, a probe geometry
 * that is none, and a volume or a number of scatterers that does not fit.
 *
 * @sa echorama::SynthesisParameters (the model), vtkUltrasoundTissueSource, vtkUltrasoundAnatomySource, vtkUltrasoundProbeSource
 */
#ifndef vtkUltrasoundSynthesizer_h
#define vtkUltrasoundSynthesizer_h

#include "EchoramaFiltersAcousticsModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include <string> // for the notes

#ifndef __VTK_WRAP__
#include "Filters/Acoustics/Synthesize.h"
#include <memory>
#endif

class vtkAlgorithmOutput;
class vtkMatrix4x4;

class ECHORAMAFILTERSACOUSTICS_EXPORT vtkUltrasoundSynthesizer : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundSynthesizer* New();
  vtkTypeMacro(vtkUltrasoundSynthesizer, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The optional inputs: a probe, and the displacement of the tissue. nullptr takes one away. */
  void SetProbeConnection(vtkAlgorithmOutput* probe);
  void SetDisplacementConnection(vtkAlgorithmOutput* displacement);
  ///@}

  enum { Coherent = 0, Counting = 1 };

  ///@{
  /**
   * How echoes are made: Coherent (0, the default) sums the echoes of scatterers coherently along the ways of sound; Counting
   * (1) counts random scatter events of rays, the algorithm of dissertation 3.4.
   */
  void SetMode(int);
  int GetMode() const;
  ///@}

  ///@{
  /**
   * Seed of the tissue's scatterers, and of all else that is random but the noise. Volumes of one seed see the same. At least 0.
   * Default 1.
   */
  void SetSeed(vtkTypeInt64);
  vtkTypeInt64 GetSeed() const;
  ///@}

  ///@{
  /**
   * Pose of the probe when there is no probe input: where the middle of its face lies (mm), and how it is turned (axis times
   * angle, degrees). Default: at the origin, looking along +z with its fan along x.
   */
  vtkSetVector3Macro(Position, double);
  vtkGetVector3Macro(Position, double);
  vtkSetVector3Macro(Orientation, double);
  vtkGetVector3Macro(Orientation, double);
  ///@}

  ///@{
  /** The same as one rigid matrix. Another is refused with an error message. */
  void SetProbeToWorld(vtkMatrix4x4* probeToWorld);
  void GetProbeToWorld(vtkMatrix4x4* probeToWorld);
  ///@}

  ///@{
  /**
   * A curved array swept about an axis, when there is no probe input: angles in degrees, radii and depths in mm. Default: 65
   * degrees of fan at a radius of 40 mm, 55 degrees of sweep at 30 mm, 5 to 120 mm deep.
   */
  vtkSetMacro(FanAngle, double);
  vtkGetMacro(FanAngle, double);
  vtkSetMacro(FanRadius, double);
  vtkGetMacro(FanRadius, double);
  vtkSetMacro(SweepAngle, double);
  vtkGetMacro(SweepAngle, double);
  vtkSetMacro(SweepRadius, double);
  vtkGetMacro(SweepRadius, double);
  vtkSetMacro(DepthMin, double);
  vtkGetMacro(DepthMin, double);
  vtkSetMacro(DepthMax, double);
  vtkGetMacro(DepthMax, double);
  ///@}

  ///@{
  /** Beams of a plane and planes of the sweep, in [2, 4096], and samples on a beam, in [2, 16384]. Default 128, 96, 512. */
  void SetElements(int);
  int GetElements() const;
  void SetSteps(int);
  int GetSteps() const;
  void SetSamples(int);
  int GetSamples() const;
  ///@}

  ///@{
  /**
   * Whether only one plane of the sweep is made, a 2D image, for interaction. Default off. SlicePosition says which: -0.5 (first)
   * to 0.5 (last), default 0.
   */
  vtkSetMacro(SliceOnly, bool);
  vtkGetMacro(SliceOnly, bool);
  vtkBooleanMacro(SliceOnly, bool);
  vtkSetClampMacro(SlicePosition, double, -0.5, 0.5);
  vtkGetMacro(SlicePosition, double);
  ///@}

  ///@{
  /** Edge of the voxels in mm, in [0, 1000]; 0, the default, makes about as many voxels as samples. */
  vtkSetClampMacro(SpacingMm, double, 0.0, 1000.0);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /** Centre frequency in MHz, in [0.5, 50], and the -6 dB width of the two-way spectrum over it, in [0.05, 1.5]. Default 3.5,
   * 0.6. */
  void SetFrequencyMHz(double);
  double GetFrequencyMHz() const;
  void SetBandwidth(double);
  double GetBandwidth() const;
  ///@}

  ///@{
  /**
   * Width of the active aperture, in [0.1, 100] mm, and way to the focus, in [1, 1000] mm, along the fan and along the sweep.
   * Default 14 and 70, 10 and 70.
   */
  void SetLateralApertureMm(double);
  double GetLateralApertureMm() const;
  void SetLateralFocusMm(double);
  double GetLateralFocusMm() const;
  void SetElevationApertureMm(double);
  double GetElevationApertureMm() const;
  void SetElevationFocusMm(double);
  double GetElevationFocusMm() const;
  ///@}

  ///@{
  /** Reflections that are followed, in [0, 100]. Default 4. */
  void SetMaxBounces(int);
  int GetMaxBounces() const;
  ///@}

  ///@{
  /** Share of the pressure that the probe's own face turns back, in [0, 1]; 0: no reverberation between face and tissue. */
  void SetFaceReflection(double);
  double GetFaceReflection() const;
  ///@}

  ///@{
  /** Level of the echo of a perfect mirror beside the speckle of the reference tissue, dB, in [0, 120]. Default 45. */
  void SetMirrorDb(double);
  double GetMirrorDb() const;
  ///@}

  ///@{
  /** Rays per element, over its aperture, in [1, 4096]; 1 follows the axis of the beam alone, which is fast. Default 8. */
  void SetSubRays(int);
  int GetSubRays() const;
  ///@}

  ///@{
  /**
   * The most scatterers that are made of any material, per mm^3, in [0, 1000]; 0, the default: 10 in every resolution cell at the
   * transmit focus. Fewer are faster; volumes share their speckle when they have the same number.
   */
  void SetScatterersPerMm3(double);
  double GetScatterersPerMm3() const;
  ///@}

  ///@{
  /** Of the mode Counting: rays per element, in [1, 1e7], and the clarity c of dissertation eq. 3.4, in [0, 200]. Default
   * 256, 20. */
  void SetRaysPerElement(int);
  int GetRaysPerElement() const;
  void SetClarity(double);
  double GetClarity() const;
  ///@}

  ///@{
  /**
   * Receiver: gain, in [-200, 200] dB; time-gain compensation, in [-20, 100] dB per cm of depth; dynamic range, in [10, 200] dB;
   * mean grey of the reference tissue, in [0, 255]; noise of the electronics beside the reference tissue, in [-200, 100] dB
   * (-200: none). Default 0, 3.5, 60, 110, -65.
   */
  void SetGainDb(double);
  double GetGainDb() const;
  void SetTgcDbPerCm(double);
  double GetTgcDbPerCm() const;
  void SetDynamicRangeDb(double);
  double GetDynamicRangeDb() const;
  void SetReferenceGrey(double);
  double GetReferenceGrey() const;
  void SetNoiseDb(double);
  double GetNoiseDb() const;
  ///@}

  ///@{
  /** Seed of the noise of the electronics, at least 0. Default 1. Volumes of one scan have different ones. */
  void SetNoiseSeed(vtkTypeInt64);
  vtkTypeInt64 GetNoiseSeed() const;
  ///@}

  /** What the last run noticed about the tissue (open or inverted surfaces) and what it cost, a line each; never fatal. */
  std::string GetNotes() const { return this->Notes; }

#ifndef __VTK_WRAP__
  /** Sets what the setters above set, but for probe geometry and pose, and all that has no setter of its own. */
  void SetParameters(const echorama::SynthesisParameters& parameters);
  /** What the last run cost. */
  const echorama::SynthesisCost& Cost() const
  {
    return this->LastCost;
  }
#endif

protected:
  vtkUltrasoundSynthesizer();
  ~vtkUltrasoundSynthesizer() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
#ifndef __VTK_WRAP__
  struct Job;
  Job Prepare(vtkInformationVector** inputs);
  echorama::Pose OwnPose() const;

  echorama::SynthesisParameters Values; ///< probe, pose and displacement are those of the Job
  echorama::SynthesisCost LastCost;
  struct SceneOfInput; ///< rays' structure of the tissue that came in last
  std::unique_ptr<SceneOfInput> Kept;
#endif
  double Position[3], Orientation[3];
  double FanAngle, FanRadius, SweepAngle, SweepRadius, DepthMin, DepthMax;
  bool SliceOnly = false;
  double SlicePosition = 0.0, SpacingMm = 0.0;
  std::string Notes;

  vtkUltrasoundSynthesizer(const vtkUltrasoundSynthesizer&) = delete;
  void operator=(const vtkUltrasoundSynthesizer&) = delete;
};

#endif
