// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSynthesizer
 * @brief a synthetic 3D ultrasound volume, or one slice, of tissue whose geometry is known
 *
 * Input 0: tissue (vtkPolyData, see vtkUltrasoundTissue), from a source or from anything that deforms or adds to it. Input 1,
 * optional: a probe (data with the field data `ProbeGeometry` and `ProbeToWorld`, as vtkUltrasoundProbeSource puts it out);
 * without it the geometry and pose of this filter's own properties are used. Input 2, optional: a displacement image
 * (vtkUltrasoundDisplacement) that says where the tissue has gone: a scatterer at m in the material is now at m + u(m). An
 * aligner that compares the volume with one of tissue at rest finds the same displacement. The surfaces of input 0 are those that
 * the tissue has now.
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
#include "vtkUltrasoundParameters.h"
#include <string> // for the notes

#ifndef __VTK_WRAP__
#include "Filters/Acoustics/Synthesize.h"
#include <memory>
#endif

class vtkAlgorithmOutput;
class vtkMatrix4x4;
class vtkPoints;
class vtkPolyData;

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

  ///@{
  /** Position and Orientation as one rigid matrix. Another is refused with an error message. */
  void SetProbeToWorld(vtkMatrix4x4* probeToWorld);
  void GetProbeToWorld(vtkMatrix4x4* probeToWorld);
  ///@}

  // BEGIN parameters
  /** Where the middle of the probe's face lies in the world. Not used with a probe input. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Position);

  /**
   * How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x. Not used with a probe input. In
   * degrees; default (0, 0, 0).
   */
  vtkUltrasoundVectorMacro(Orientation);

  /** Angle between the first and the last beam of a fan. Not used with a probe input. In [0, 359.999] degrees; default 65. */
  vtkUltrasoundNumberMacro(FanAngle);

  /** Radius of the array. Not used with a probe input. In [0, 10000] mm; default 40. */
  vtkUltrasoundNumberMacro(FanRadius);

  /** Angle that the array sweeps. 0: a single plane. Not used with a probe input. In [0, 359.999] degrees; default 55. */
  vtkUltrasoundNumberMacro(SweepAngle);

  /** How far the face is from the axis of the sweep. Not used with a probe input. In [0, 10000] mm; default 30. */
  vtkUltrasoundNumberMacro(SweepRadius);

  /** First depth along the beams, from the face. Not used with a probe input. In [-10000, 10000] mm; default 5. */
  vtkUltrasoundNumberMacro(DepthMin);

  /** Last depth along the beams, from the face. Not used with a probe input. In [-10000, 10000] mm; default 120. */
  vtkUltrasoundNumberMacro(DepthMax);

  /** Whether only one plane of the sweep is made, a 2D image: for interaction. Default off. */
  vtkUltrasoundSwitchMacro(SliceOnly);

  /**
   * Which plane of the sweep: -0.5 is the first, 0.5 the last. Used when SliceOnly is on. In [-0.5, 0.5] whole sweeps; default 0.
   */
  vtkUltrasoundNumberMacro(SlicePosition);

  /** Edge of the cubic voxels. 0: about as many voxels as samples. In [0, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /**
   * Seed of the scatterers of the tissue, and of all else that is random but the noise. Volumes of one seed see the same. At
   * least 0; default 1.
   */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * How far the speckle has changed: complex echoes of volumes of one Seed and different ChangeSeeds that are seen alike
   * correlate by 1 less this. Bodies stay where and as loud as they are. Used when Mode is coherent. In [0, 1]; default 0.
   */
  vtkUltrasoundNumberMacro(Decorrelation);

  /** Seed of the change: volumes with the same one have changed alike. Used when Mode is coherent. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(ChangeSeed);

  /** Beams of a plane. In [2, 4096]; default 128. */
  vtkUltrasoundIntegerMacro(Elements);

  /** Planes of the sweep, at least 2 of a probe that sweeps. In [1, 4096]; default 96. */
  vtkUltrasoundIntegerMacro(Steps);

  /** Samples along a beam. In [2, 16384]; default 512. */
  vtkUltrasoundIntegerMacro(Samples);

  /** Centre frequency of the pulse. Used when Mode is coherent. In [0.5, 60] MHz; default 3.5. */
  vtkUltrasoundNumberMacro(FrequencyMHz);

  /**
   * Width of the two-way spectrum at -6 dB, as a share of the centre frequency. Used when Mode is coherent. In [0.05, 1.5];
   * default 0.6.
   */
  vtkUltrasoundNumberMacro(Bandwidth);

  /** Width of the active aperture along the fan. Used when Mode is coherent. In [0.1, 100] mm; default 14. */
  vtkUltrasoundNumberMacro(LateralApertureMm);

  /** Way from the face to the transmit focus along the fan. Used when Mode is coherent. In [1, 1000] mm; default 70. */
  vtkUltrasoundNumberMacro(LateralFocusMm);

  /**
   * Whether receiving is focused at every depth along the fan; else at the transmit focus. Used when Mode is coherent. Default
   * on.
   */
  vtkUltrasoundSwitchMacro(DynamicReceive);

  /**
   * Dynamic receiving uses no more of the aperture than the depth divided by this. Used when DynamicReceive is on. In [0.5, 10];
   * default 1.
   */
  vtkUltrasoundNumberMacro(SmallestFNumber);

  /** Width of the lens along the sweep. Used when Mode is coherent. In [0.1, 100] mm; default 10. */
  vtkUltrasoundNumberMacro(ElevationApertureMm);

  /**
   * Way from the face to the focus of the lens, for sending and receiving. Used when Mode is coherent. In [1, 1000] mm; default
   * 70.
   */
  vtkUltrasoundNumberMacro(ElevationFocusMm);

  /** How the scanner turns time into depth. In [500, 5000] m/s; default 1540. */
  vtkUltrasoundNumberMacro(AssumedSoundSpeed);

  /** Gain of everything. In [-200, 200] dB; default 0. */
  vtkUltrasoundNumberMacro(GainDb);

  /** Time-gain compensation: further gain by the depth. In [-20, 100] dB/cm; default 3.5. */
  vtkUltrasoundNumberMacro(TgcDbPerCm);

  /** How much the 255 steps of grey span. In [10, 200] dB; default 60. */
  vtkUltrasoundNumberMacro(DynamicRangeDb);

  /** Mean grey of the reference tissue, liver, at a gain of 0 dB. In [0, 255]; default 110. */
  vtkUltrasoundNumberMacro(ReferenceGrey);

  /**
   * Mean power of the noise of the electronics beside the reference tissue, before all gain; -200: none. In [-200, 100] dB;
   * default -65.
   */
  vtkUltrasoundNumberMacro(NoiseDb);

  /** Seed of the noise. Volumes of one scan have different ones. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(NoiseSeed);

  enum Modes { COHERENT = 0, COUNTING = 1 };

  ///@{
  /**
   * Coherent: the echoes of scatterers are summed with their phases. Counting: random scatter events of rays are counted
   * (dissertation 3.4). Default coherent. There are COHERENT, COUNTING.
   */
  vtkUltrasoundChoiceMacro(Mode);
  void SetModeToCoherent() { this->SetMode(COHERENT); }
  void SetModeToCounting() { this->SetMode(COUNTING); }
  ///@}

  /** Reflections that are followed. Used when Mode is coherent. In [0, 100]; default 4. */
  vtkUltrasoundIntegerMacro(MaxBounces);

  /** Whether rays bend where the speed of sound changes. Used when Mode is coherent. Default on. */
  vtkUltrasoundSwitchMacro(Refraction);

  /**
   * Share of the pressure that the face of the probe turns back; 0: no reverberation between probe and tissue. Used when Mode is
   * coherent. In [0, 1]; default 0.2.
   */
  vtkUltrasoundNumberMacro(FaceReflection);

  /** The face turns sound back up to this far from its middle. Used when Mode is coherent. In [0, 1000] mm; default 20. */
  vtkUltrasoundNumberMacro(FaceRadiusMm);

  /**
   * How far from the normal of a surface its mirror echo is still received: standard deviation of a Gaussian, about the angle of
   * half the aperture as seen from the focus. Used when Mode is coherent. In [0.1, 90] degrees; default 5.
   */
  vtkUltrasoundNumberMacro(AcceptanceDegrees);

  /**
   * The most straight pieces of one ray's way: a stop for scenes of many mirrors. Used when Mode is coherent. In [1, 100000000];
   * default 10000.
   */
  vtkUltrasoundIntegerMacro(MaxSegments);

  /**
   * Side lobes on either side of each beam along the fan; each costs about as much as the beam itself. 0: none. Used when Mode is
   * coherent. In [0, 20]; default 0.
   */
  vtkUltrasoundIntegerMacro(SideLobes);

  enum Apodisations { RECTANGULAR = 0, HANN = 1, GAUSSIAN = 2 };

  ///@{
  /**
   * What side and grating lobes are those of: rectangular has loud side lobes, hann and gaussian (a fifth of the aperture) faint
   * ones. Used when Mode is coherent. Default hann. There are RECTANGULAR, HANN, GAUSSIAN.
   */
  vtkUltrasoundChoiceMacro(Apodisation);
  void SetApodisationToRectangular() { this->SetApodisation(RECTANGULAR); }
  void SetApodisationToHann() { this->SetApodisation(HANN); }
  void SetApodisationToGaussian() { this->SetApodisation(GAUSSIAN); }
  ///@}

  /**
   * From element to element of the array. Grating lobes lie where its sine of the angle is a multiple of wavelength / pitch. 0:
   * no grating lobes. Used when Mode is coherent. In [0, 10] mm; default 0.
   */
  vtkUltrasoundNumberMacro(PitchMm);

  /**
   * How wide an element is; narrow ones hear more of grating lobes. Used when Mode is coherent. In [0.01, 1] pitches; default
   * 0.9.
   */
  vtkUltrasoundNumberMacro(ElementWidth);

  /**
   * Rays of an element, spread over its aperture. 1: the axis alone, fast and hard-edged. Used when Mode is coherent. In [1,
   * 4096]; default 8.
   */
  vtkUltrasoundIntegerMacro(SubRays);

  enum Samplings { RANDOM = 0, STRATIFIED = 1, SOBOL = 2 };

  ///@{
  /**
   * How the rays of an element are spread. Used when Mode is coherent. Default stratified. There are RANDOM, STRATIFIED, SOBOL.
   */
  vtkUltrasoundChoiceMacro(Sampling);
  void SetSamplingToRandom() { this->SetSampling(RANDOM); }
  void SetSamplingToStratified() { this->SetSampling(STRATIFIED); }
  void SetSamplingToSobol() { this->SetSampling(SOBOL); }
  ///@}

  /**
   * Whether a beam is bent and shaded as a whole, by the mean of its rays and of those of its neighbours within its width; off:
   * bent along its axis alone. Used when Mode is coherent. Default off.
   */
  vtkUltrasoundSwitchMacro(WideBeams);

  /**
   * Level of the echo of a perfect mirror, square to the beam, beside the mean speckle of the reference tissue. Used when Mode is
   * coherent. In [0, 120] dB; default 45.
   */
  vtkUltrasoundNumberMacro(MirrorDb);

  /**
   * The most scatterers that are made of any material; fewer are faster. 0: 10 in every resolution cell at the transmit focus.
   * Volumes share their speckle when they have the same number. Used when Mode is coherent. In [0, 1000] per mm^3; default 0.
   */
  vtkUltrasoundNumberMacro(ScatterersPerMm3);

  /**
   * Ways of sound whose speckle would stay this far below black, after all gain, are not summed. Used when Mode is coherent. In
   * [0, 300] dB; default 12.
   */
  vtkUltrasoundNumberMacro(InvisibleDb);

  /** Rays that each element sends. Used when Mode is counting. In [1, 10000000]; default 256. */
  vtkUltrasoundIntegerMacro(RaysPerElement);

  /**
   * Exponent of the angle at which an echo comes in (dissertation, eq. 3.4): the larger, the clearer. Used when Mode is counting.
   * In [0, 200]; default 20.
   */
  vtkUltrasoundNumberMacro(Clarity);

  /**
   * A ray that was scattered goes on within this half angle of its old direction. Used when Mode is counting. In [0, 180]
   * degrees; default 30.
   */
  vtkUltrasoundNumberMacro(ConeDegrees);

  /** The most scatter events of one ray. Used when Mode is counting. In [1, 1000000]; default 1000. */
  vtkUltrasoundIntegerMacro(MaxEvents);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /**
   * Where the image (output 0) shows the tissue at each point of the world, mm: sound bends, and its speed is not the one that
   * the scanner assumes. The tissue is where input 0 has it now. (NaN, NaN, NaN) where it is not seen: outside of the fan or its
   * depths (of a single plane: off the surface that it images), where no direct sound gets to, as behind total reflection, and
   * where neighbouring beams are bent apart by more than they are wide. The points that come out replace those in \a to; their
   * precision is double. The inputs are brought up to date, the outputs need not be. Each call follows the axes of all beams, so
   * ask for all points at once. For coherent echoes alone: with the mode counting, and where the inputs cannot be used, an error
   * event, and no point is seen.
   */
  void TissueToSeen(vtkPoints* from, vtkPoints* to);

  /** What the last run noticed about the tissue (open or inverted surfaces) and what it cost, a line each; never fatal. */
  std::string GetNotes() const { return this->Notes; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
  /** Sets all of them but for probe geometry and pose, and what has no setter of its own. */
  void SetParameters(const echorama::SynthesisParameters& parameters);
  /**
   * Makes \a output the scan conversion of \a made, on \a grid (the pose of the volume), and \a beams (may be nullptr) the
   * samples on the beams, both with what is known of the acquisition.
   */
  static void SetOutputs(const echorama::SynthesisParameters& parameters, echorama::VolumeView<const unsigned char> made,
                         const echorama::ImageGeometry& grid, vtkImageData* output, vtkImageData* beams,
                         const echorama::Progress& progress = {});
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
  void UpdateInput(int port);
  const echorama::AcousticScene& SceneOf(vtkPolyData* tissue, const echorama::Progress& progress);
  echorama::Pose OwnPose() const;

  echorama::SynthesisParameters Values; ///< probe, pose and displacement are those of the Job
  /// The probe without a probe input (degrees, mm), and the form of the output.
  struct {
    double fanAngle = 65.0, fanRadius = 40.0, sweepAngle = 55.0, sweepRadius = 30.0, depthMin = 5.0, depthMax = 120.0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), orientation = Eigen::Vector3d::Zero();
    bool sliceOnly = false;
    double slicePosition = 0.0, spacingMm = 0.0;
  } Own;
  echorama::SynthesisCost LastCost;
  struct SceneOfInput; ///< rays' structure of the tissue that came in last
  std::unique_ptr<SceneOfInput> Kept;
#endif
  std::string Notes;

  vtkUltrasoundSynthesizer(const vtkUltrasoundSynthesizer&) = delete;
  void operator=(const vtkUltrasoundSynthesizer&) = delete;
};

#endif
