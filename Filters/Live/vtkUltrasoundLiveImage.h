// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundLiveImage
 * @brief the 2D image that a probe would make of volumes or of a scene, live
 *
 * Input 0, optional and repeatable: volumes (vtkImageData, or data object trees of them) with `Intensity`, optionally
 * `ValidRegion`, optionally `Embedding` (see vtkUltrasoundVolume). Overlap says what counts where several are real.
 *
 * Input 1, optional: tissue (vtkPolyData, see vtkUltrasoundTissue). Source says what the image is made of: the volumes; or the
 * tissue, as a *scene*, drawn for the eye at the rate of a display (the live view of dissertation 7.7, echorama::SliceTracer), or
 * by the *acoustic* model, slower, and better the higher Refinement is (echorama::ProgressiveSlice; the last level is what
 * vtkUltrasoundSynthesizer makes). What only counts for volumes (Overlap, ShowInvented, Black, White, what was recorded, shadow
 * and enhancement) does nothing then; Attenuation is what the gain makes up for, and only the acoustic model has noise of
 * electronics.
 *
 * Input 2, optional and repeatable: states of tissue that a probe presses: displacement images (of vtkUltrasoundTissuePress)
 * that SetPressState told how deep the probe was pressed in, and where it then was. With them volumes and drawn scenes, which are
 * the tissue at rest, are seen as tissue that is pressed by PressMm: exactly at the states, in between by interpolation.
 *
 * Output 0: a 2D vtkImageData of Width x Height square pixels, the fan centred in it, with `Intensity` (unsigned char),
 * `ValidRegion`, `Embedding` where an input has it, and the field data `ProbeGeometry` and `ProbeToWorld`. Its geometry is the
 * pose: the index axes run along the array (with Flip against it) and into the tissue. Where no volume reaches all arrays are 0.
 * Output 1, when BeamsOutput is on: the beams before scan conversion (samples along x, beams along y, see
 * vtkUltrasoundScanConverter), `Intensity` float from 0 to 255.
 *
 * With Needle a straight needle is a second tool, with its own place: drawn where it crosses the thickness of the plane, and
 * nowhere else. GetNeedleState() tells what the plane has of it, and AdvanceNeedle() moves it along its axis, until bone stops
 * it.
 *
 * The volumes are read along the beams, averaged over the thickness of the plane, developed into greys by the controls, and
 * scan-converted. What only the volumes, the probe or the controls change is kept, so that a new pose costs one image.
 *
 * Without a volume under the probe the image is empty, which is no error: GetState() tells. Fails, with a message that names the
 * parameter or volume, for parameters out of range (a Position that is not finite, for instance) and volumes that are none. A
 * matrix that is no pose is refused when it is set, and the old pose stays.
 *
 * @sa echorama::LiveImage, vtkUltrasoundScanConverter, vtkUltrasoundProbeSource
 */
#ifndef vtkUltrasoundLiveImage_h
#define vtkUltrasoundLiveImage_h

#include "EchoramaFiltersLiveModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"
#include <string> // for the state

#ifndef __VTK_WRAP__
#include "Filters/Live/LiveImage.h"
#include "Filters/Live/LiveScene.h"
#include <memory> // for what is kept
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSLIVE_EXPORT vtkUltrasoundLiveImage : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundLiveImage* New();
  vtkTypeMacro(vtkUltrasoundLiveImage, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Position and Orientation as one rigid matrix. One that is not rigid and finite is refused with an error event, and the old
   * pose stays; setting returns whether it was taken.
   */
  bool SetProbeToWorld(vtkMatrix4x4* probeToWorld);
  void GetProbeToWorld(vtkMatrix4x4* probeToWorld);
  ///@}

  /**
   * NeedleTip and NeedleDirection as those of a tracked tool: the tip is its origin, its z axis the way the needle goes in. One
   * that is not rigid and finite is refused with an error event, and the needle stays; setting returns whether it was taken.
   */
  bool SetNeedleToWorld(vtkMatrix4x4* needleToWorld);

  /**
   * Moves the needle along its axis: NeedleTip becomes another. With NeedleStops it goes in (not out) no further than to bone: of
   * a scene to materials stiffer than 100 MPa, of volumes to what is brighter than NeedleStopLevel over 1.5 mm. The inputs are
   * brought up to date. Returns how far it went, in mm; less than was asked for when it was stopped, and 0 after an error event
   * when it cannot be told. What is thinner than \a stepMm (0.01 to 10 mm) may be missed; time is in inverse proportion to it.
   */
  double AdvanceNeedle(double mm, double stepMm = 0.25);

  /**
   * Takes the field data `ProbeGeometry` of \a data as the custom probe (of a probe that sweeps, its middle plane). Returns
   * false, after an error event, when there is none.
   */
  bool SetProbeFrom(vtkDataObject* data);

  ///@{
  /** States of pressed tissue: see input 2. SetPressState writes what it needs into the field data of a displacement image:
   * `PressMm`, above 0, and `ProbeToWorld`; it returns false for a matrix that is not rigid. */
  void AddPressStateConnection(vtkAlgorithmOutput* state) { this->AddInputConnection(2, state); }
  void AddPressStateData(vtkDataObject* state) { this->AddInputDataObject(2, state); }
  void RemoveAllPressStates() { this->RemoveAllInputConnections(2); }
  static bool SetPressState(vtkDataObject* displacement, double pressMm, vtkMatrix4x4* probeToWorld);
  static const char* PressMmName() { return "PressMm"; }
  ///@}

  // BEGIN parameters
  /** Where the middle of the probe's face lies in the world. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Position);

  /** How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x. In degrees; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Orientation);

  enum Sources { VOLUMES = 0, SCENE = 1, ACOUSTIC = 2 };

  ///@{
  /**
   * What the image is made of. Volumes: input 0. Scene: tissue of input 1, drawn fast. Acoustic: the same by the acoustic model.
   * Default volumes. There are VOLUMES, SCENE, ACOUSTIC.
   */
  vtkUltrasoundChoiceMacro(Source);
  void SetSourceToVolumes() { this->SetSource(VOLUMES); }
  void SetSourceToScene() { this->SetSource(SCENE); }
  void SetSourceToAcoustic() { this->SetSource(ACOUSTIC); }
  ///@}

  /**
   * How much darker everything behind a surface is: shadows by the number of surfaces that were crossed. Used when Source is
   * scene. In [0, 100] dB; default 0.3.
   */
  vtkUltrasoundNumberMacro(DarkeningDb);

  /** Whether tissue attenuates by its material and the frequency. Used when Source is scene. Default on. */
  vtkUltrasoundSwitchMacro(TissueAttenuation);

  /**
   * Whether a surface takes from what is behind it by its step of impedance, too: shadows of bone and air. Used when Source is
   * scene. Default on.
   */
  vtkUltrasoundSwitchMacro(SurfaceLosses);

  /** Whether surfaces are lines, by their step of impedance and the angle. Used when Source is scene. Default on. */
  vtkUltrasoundSwitchMacro(SurfaceLines);

  /**
   * How much of the noise is blended in: 0 shows the bare materials, 1 speckle as strong as it is really. Used when Source is
   * scene. In [0, 2]; default 0.8.
   */
  vtkUltrasoundNumberMacro(Speckle);

  /**
   * How deep the probe is pressed into the body: a drawn scene is warped along the beams; with pressed states volumes and drawn
   * scenes are as those say. Used when Source is scene or volumes. In [0, 100] mm; default 0.
   */
  vtkUltrasoundNumberMacro(PressMm);

  /** Over which depth tissue gives way to 1/e as far as at the face. Used when Source is scene. In [1, 1000] mm; default 25. */
  vtkUltrasoundNumberMacro(PressReachMm);

  /**
   * Gaps of air between face and body up to this are taken as filled with gel. Beams with wider ones have no contact. Used when
   * Source is scene. In [0, 100] mm; default 1.
   */
  vtkUltrasoundNumberMacro(GelMm);

  /**
   * Rays of each element, spread over the thickness of the plane: the time of a frame rises with them. 1: a plane as thin as a
   * razor; else an odd number of at least 5. Used when Source is scene. In [1, 65]; default 5.
   */
  vtkUltrasoundIntegerMacro(SceneRays);

  /**
   * Level of the echo of the face itself where it has no contact, beside the reference tissue; 0: none. Used when Source is
   * scene. In [0, 100] dB; default 25.
   */
  vtkUltrasoundNumberMacro(ReverberationDb);

  /**
   * How good the acoustic image is: 0 a quarter of the beams, 1 half of them, 2 all, 3 reflected sound as well. For a probe that
   * moves, take a low one, and raise it while it rests. Used when Source is acoustic. In [0, 3]; default 3.
   */
  vtkUltrasoundIntegerMacro(Refinement);

  enum Probes { CONVEX = 0, LINEAR = 1, PHASED = 2, ENDOCAVITY = 3, RADIAL = 4, CUSTOM = 5 };

  ///@{
  /**
   * The probe: its array, and how deep it usually looks. Radial: all round, as in vessels and bronchi. Default convex. There are
   * CONVEX, LINEAR, PHASED, ENDOCAVITY, RADIAL, CUSTOM.
   */
  vtkUltrasoundChoiceMacro(Probe);
  void SetProbeToConvex() { this->SetProbe(CONVEX); }
  void SetProbeToLinear() { this->SetProbe(LINEAR); }
  void SetProbeToPhased() { this->SetProbe(PHASED); }
  void SetProbeToEndocavity() { this->SetProbe(ENDOCAVITY); }
  void SetProbeToRadial() { this->SetProbe(RADIAL); }
  void SetProbeToCustom() { this->SetProbe(CUSTOM); }
  ///@}

  /** How deep the image is. 0: as usual for the probe (custom: 100 mm). In [0, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(DepthMm);

  /** Angle between the first and the last beam; 360: all round. Used when Probe is custom. In [0, 360] degrees; default 60. */
  vtkUltrasoundNumberMacro(FanAngle);

  /** Length of the array along its arc. Used when Probe is custom. In [0, 1000] mm; default 50. */
  vtkUltrasoundNumberMacro(FanWidth);

  /** First depth along the beams, from the face. Used when Probe is custom. In [-1000, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(DepthMin);

  /** Gain of everything. In [-100, 100] dB; default 0. */
  vtkUltrasoundNumberMacro(GainDb);

  /** How much the 255 steps of grey span: less gives more contrast. In [10, 200] dB; default 60. */
  vtkUltrasoundNumberMacro(DynamicRangeDb);

  /**
   * Frequency of the probe, from 0.5 on. 0: the usual one of the probe for scenes, that of the recording for volumes, which are
   * then as they were recorded; above it deeper tissue is darker, below it brighter. In [0, 60] MHz; default 0.
   */
  vtkUltrasoundNumberMacro(FrequencyMHz);

  /**
   * Time-gain curve, slider 1 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc1Db);

  /**
   * Time-gain curve, slider 2 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc2Db);

  /**
   * Time-gain curve, slider 3 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc3Db);

  /**
   * Time-gain curve, slider 4 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc4Db);

  /**
   * Time-gain curve, slider 5 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc5Db);

  /**
   * Time-gain curve, slider 6 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc6Db);

  /**
   * Time-gain curve, slider 7 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc7Db);

  /**
   * Time-gain curve, slider 8 of 8: further gain at its depth. The first stands for the first depth, the last for the last. In
   * [-40, 40] dB; default 0.
   */
  vtkUltrasoundNumberMacro(Tgc8Db);

  /** Mean power of the noise of electronics, beside white, before all gain. -200: none. In [-200, 0] dB; default -200. */
  vtkUltrasoundNumberMacro(NoiseDb);

  /** Whether each frame has noise of its own; else it is fixed to the beams. Default off. */
  vtkUltrasoundSwitchMacro(NoiseMoves);

  /** Size of the grain of the noise along the beam. In [0, 10] mm; default 0.6. */
  vtkUltrasoundNumberMacro(NoiseGrainMm);

  /** The same seed makes the same noise. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /** For the eye: how much darker it becomes behind a cm of white. 0: the volume as it is. In [0, 200] dB/cm; default 0. */
  vtkUltrasoundNumberMacro(ShadowDbPerCm);

  /** For the eye: how much brighter it becomes behind a cm of black. 0: the volume as it is. In [0, 20] dB/cm; default 0. */
  vtkUltrasoundNumberMacro(EnhancementDbPerCm);

  /** Shadow is cast by what is brighter: 0 is black, 1 white. In [0, 0.99]; default 0.75. */
  vtkUltrasoundNumberMacro(BrightLevel);

  /** Enhancement follows what is darker: 0 is black, 1 white. In [0.01, 1]; default 0.1. */
  vtkUltrasoundNumberMacro(DarkLevel);

  /** Of tissue, one way: what a change of the frequency goes by. In [0, 10] dB/cm/MHz; default 0.5. */
  vtkUltrasoundNumberMacro(Attenuation);

  /** The frequency at which the volume was recorded. In [0.5, 60] MHz; default 3.5. */
  vtkUltrasoundNumberMacro(RecordedFrequencyMHz);

  /** What the greys of the volume span, from Black to White. In [10, 200] dB; default 60. */
  vtkUltrasoundNumberMacro(RecordedDynamicRangeDb);

  /** The intensity of the volume that is black. Default 0. */
  vtkUltrasoundNumberMacro(Black);

  /** The intensity of the volume that is white; above Black. Default 255. */
  vtkUltrasoundNumberMacro(White);

  enum Overlaps { FIRST = 0, MEAN = 1 };

  ///@{
  /**
   * Where several volumes are real: the first counts, or the mean, each by how far the place is from where it ends and others go
   * on: no seams. Default first. There are FIRST, MEAN.
   */
  vtkUltrasoundChoiceMacro(Overlap);
  void SetOverlapToFirst() { this->SetOverlap(FIRST); }
  void SetOverlapToMean() { this->SetOverlap(MEAN); }
  ///@}

  /** Whether background that embedding invented is shown; else it is as where no volume reaches. Default on. */
  vtkUltrasoundSwitchMacro(ShowInvented);

  /**
   * How thick the plane is that is seen, at the focus: full width at half of its sensitivity. 0: a slice as thin as a razor; -1:
   * that of the probe. In [-1, 100] mm; default -1.
   */
  vtkUltrasoundNumberMacro(ThicknessMm);

  /**
   * Depth of the focus, about which the plane is thinnest; nearer than 1 mm counts as 1 mm. 0: as usual for the probe. In [0,
   * 1000] mm; default 0.
   */
  vtkUltrasoundNumberMacro(FocusMm);

  /**
   * How much thicker the plane becomes with the distance from the focus. -1: as that of the probe. In [-1, 10] mm/mm; default -1.
   */
  vtkUltrasoundNumberMacro(Divergence);

  /** How many planes are averaged for the thickness: the time of a frame is in proportion. In [1, 65]; default 9. */
  vtkUltrasoundIntegerMacro(ThicknessPlanes);

  /** Beams of the plane. In [2, 4096]; default 192. */
  vtkUltrasoundIntegerMacro(Beams);

  /** Samples along a beam. In [2, 16384]; default 512. */
  vtkUltrasoundIntegerMacro(Samples);

  /** Width of the image. In [16, 8192] pixels; default 640. */
  vtkUltrasoundIntegerMacro(Width);

  /** Height of the image. In [16, 8192] pixels; default 480. */
  vtkUltrasoundIntegerMacro(Height);

  /** Whether left and right are exchanged: the first pixel of a row then lies towards +x of the probe. Default off. */
  vtkUltrasoundSwitchMacro(Flip);

  /** Whether there is a needle. It is drawn only where it crosses the plane. Default off. */
  vtkUltrasoundSwitchMacro(Needle);

  /** Where its tip lies in the world. Used when Needle is on. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(NeedleTip);

  /**
   * The way it goes in, in the world; of any length but 0. The shaft lies behind the tip. Used when Needle is on. Default (0, 0,
   * 1).
   */
  vtkUltrasoundVectorMacro(NeedleDirection);

  /** Whether bone stops it when it is advanced (AdvanceNeedle). Used when Needle is on. Default off. */
  vtkUltrasoundSwitchMacro(NeedleStops);

  /**
   * Of volumes: what is brighter than this, averaged over 1.5 mm, is bone. 0 is black, 1 white. Used when NeedleStops is on. In
   * [0, 1]; default 0.85.
   */
  vtkUltrasoundNumberMacro(NeedleStopLevel);

  /** Length of the needle's shaft. Used when Needle is on. In [1, 1000] mm; default 150. */
  vtkUltrasoundNumberMacro(NeedleLengthMm);

  /** Echo of the needle, square to the beam, relative to white. Used when Needle is on. In [-60, 60] dB; default 6. */
  vtkUltrasoundNumberMacro(NeedleEchoDb);

  /**
   * How far from square to the beam the needle may be until its echo has faded to 61%. Used when Needle is on. In [0.1, 90]
   * degrees; default 12.
   */
  vtkUltrasoundNumberMacro(NeedleMirrorDegrees);

  /** Echo of the needle at any angle, relative to white. Used when Needle is on. In [-90, 60] dB; default -28. */
  vtkUltrasoundNumberMacro(NeedleRoughDb);

  /** Width of the needle's echo across the beams. Used when Needle is on. In [0.1, 20] mm; default 1.2. */
  vtkUltrasoundNumberMacro(NeedleWidthMm);

  /** Length of the needle's echo along the beams. Used when Needle is on. In [0.05, 20] mm; default 0.6. */
  vtkUltrasoundNumberMacro(NeedlePulseMm);

  /**
   * Distance between the echoes within the needle that ring below it; 0: it does not ring. Used when Needle is on. In [0, 20] mm;
   * default 1.5.
   */
  vtkUltrasoundNumberMacro(NeedleReverberationMm);

  /** From one echo within the needle to the next. Used when Needle is on. In [-60, -1] dB; default -7. */
  vtkUltrasoundNumberMacro(NeedleReverberationDb);

  /** How much darker it is below the needle. Used when Needle is on. In [0, 60] dB; default 6. */
  vtkUltrasoundNumberMacro(NeedleShadowDb);

  /** Whether the tip echoes at any angle, and is marked. Used when Needle is on. Default off. */
  vtkUltrasoundSwitchMacro(NeedleShowTip);

  /** Echo of the tip, relative to white. Used when NeedleShowTip is on. In [-60, 60] dB; default 0. */
  vtkUltrasoundNumberMacro(NeedleTipDb);

  /** The number of the frame, which chooses its noise. Used when NoiseMoves is on. At least 0; default 0. */
  vtkUltrasoundInteger64Macro(Frame);

  /** Whether the beams are put out, too. Default off. */
  vtkUltrasoundSwitchMacro(BeamsOutput);

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

  enum States { SEES_VOLUME = 0, NO_VOLUME = 1, OUTSIDE = 2, FAILED = 3 };

  ///@{
  /** After an update: whether a volume (or body) is seen, none is connected, all beams run outside of all volumes, or the update
   * failed. */
  int GetState() const
  {
    return this->State;
  }
  std::string GetStateText() const;
  /** How much of the beams lies in volumes, 0 to 1. */
  double GetSeenShare() const
  {
    return this->SeenShare;
  }
  /** Of a scene: how many of the beams are in contact with something that is no gas, 0 to 1. 1 for volumes. */
  double GetContactShare() const
  {
    return this->ContactShare;
  }
  /** Of a scene: the material that the probe stands in, where that is as hard as bone and no probe can be; else empty. */
  std::string GetHardMaterial() const
  {
    return this->HardMaterial;
  }
  ///@}

  enum NeedleStates { NO_NEEDLE = 0, NEEDLE_OUT_OF_PLANE = 1, NEEDLE_IN_PLANE = 2 };

  ///@{
  /** After an update: whether there is a needle in the image, by at least half of the plane's sensitivity, and how much of its
   * shaft, in mm. Nothing of it is drawn where it is out of the plane. */
  int GetNeedleState() const
  {
    return !this->HasNeedle ? NO_NEEDLE : this->Sight.seenMm > 0.0 ? NEEDLE_IN_PLANE : NEEDLE_OUT_OF_PLANE;
  }
  double GetNeedleSeenMm() const
  {
    return this->Sight.seenMm;
  }
  /** Of its tip: whether it is in the image, and how far it is from the middle of the plane, along y of the probe. */
  bool GetNeedleTipInPlane() const
  {
    return this->Sight.tipInPlane;
  }
  double GetNeedleTipOffPlaneMm() const
  {
    return this->Sight.tipOffPlaneMm;
  }
  ///@}

protected:
  vtkUltrasoundLiveImage();
  ~vtkUltrasoundLiveImage() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
#ifndef __VTK_WRAP__
  echorama::Pose OwnPose() const;
  const echorama::BeamVolumes& VolumesOf(vtkInformationVector* port, bool& hasLabels);
  echorama::LiveScene* SceneOf(vtkInformationVector* port);     ///< nullptr without tissue
  const echorama::BeamBend* BendOf(vtkInformationVector* port); ///< nullptr where nothing is pressed

  echorama::LiveImageParameters Values;
  echorama::LiveSceneParameters SceneValues;
  Eigen::Vector3d Place = Eigen::Vector3d::Zero(), Turn = Eigen::Vector3d::Zero(); // mm; axis times angle, degrees
  echorama::Needle NeedleNow() const;                                              ///< \throws Error(InvalidParameter)

  bool HasNeedle = false, NeedleIsStopped = false;
  Eigen::Vector3d NeedlePlace = Eigen::Vector3d::Zero(), NeedleWay = Eigen::Vector3d::UnitZ();
  double NeedleLevel = 0.85; // of bone, from black to white
  echorama::NeedleLook Look;
  echorama::NeedleSight Sight;
  std::int64_t FrameNumber = 0;
  bool PutsOutBeams = false;
  struct KeptVolumes; // that came in last, ready to be read
  std::unique_ptr<KeptVolumes> Kept;
  struct KeptScene; // of the tissue that came in last
  std::unique_ptr<KeptScene> Scene;
  struct KeptPress; // of the displacement images that came in last
  std::unique_ptr<KeptPress> Press;
  echorama::LiveImage Image;
#endif
  int State = NO_VOLUME;
  double SeenShare = 0.0, ContactShare = 1.0;
  std::string HardMaterial;

  vtkUltrasoundLiveImage(const vtkUltrasoundLiveImage&) = delete;
  void operator=(const vtkUltrasoundLiveImage&) = delete;
};

#endif
