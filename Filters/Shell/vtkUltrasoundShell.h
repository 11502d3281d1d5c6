// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundShell
 * @brief a body's surface as a printed skin for the optical surface tracker, the base that holds its camera, and where it is
 * calibrated
 *
 * Input 0: vtkPolyData, the closed surface of one body, in mm. Input 1, optional: points where the skin is calibrated, in their
 * order; they are moved onto the surface, and those too near to the opening are left out.
 *
 * Output 0: the skin, output 1: the base, both closed surfaces of triangles, outward, in the frame of the body: what vtkSTLWriter
 * takes. The skin carries the field data `CameraPosition` and `CameraDirection`, 3 doubles each: where the base holds the
 * camera's optical centre.
 *
 * Output 2: the calibration points, a vertex each, with the point arrays `Mark` (the number, from 1) and `Normals`. Without input
 * 1 they are where Places says, in an order in which a person finds the next one.
 *
 * Output 3: the proxy: the body above the opening, simplified by quadric error (Garland and Heckbert 1997; dissertation 7.3) to
 * about Points points, with the point array `Mark`. Empty when input 1 is connected, Places is Dome or Points is 0.
 *
 * Output 4: what is to be printed, all in one, told apart by the cell array `Print`, from 0: skin and base, or the parts that
 * they are cut into where the printer is too small (CutToFit).
 *
 * With Rig, output 0 is the large dome and output 1 the small one, both to be put on the base that was made without Rig. Output 2
 * are the marks of both: vertices with the point arrays `Mark` (from 1; the same number on both domes is the same direction from
 * the camera), `Dome` (0: large, 1: small), `InCamera` (3 doubles: the place in the camera's frame, whose origin is the optical
 * centre and whose z is Up) and `Normals`. Output 3 is empty.
 *
 * With Marker the skin has the field data `MarkerId`: the number that its raised cells show (Tracking/Optical/ShellMarker.h).
 *
 * Fails, with the reason: for a surface with holes (their number, places and lengths), self-intersections or other faults; for a
 * body that is too thin for the wall; when what is to be printed does not fit the printer (and FitPrinter is on); for parameters
 * out of their range.
 *
 * @sa echorama::MakeShell, vtkUltrasoundTissueMeshes
 */
#ifndef vtkUltrasoundShell_h
#define vtkUltrasoundShell_h

#include "EchoramaFiltersShellModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include <memory> // for what is set
#include <string>
#endif

class ECHORAMAFILTERSSHELL_EXPORT vtkUltrasoundShell : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundShell* New();
  vtkTypeMacro(vtkUltrasoundShell, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** Thickness of the skin. In [0.4, 20] mm; default 2. */
  vtkUltrasoundNumberMacro(ThicknessMm);

  enum Measureds { SURFACE = 0, CAMERA = 1 };

  ///@{
  /**
   * How thickness is measured: to the nearest place of the surface, or along the ray to the camera. Default surface. There are
   * SURFACE, CAMERA.
   */
  vtkUltrasoundChoiceMacro(Measured);
  void SetMeasuredToSurface() { this->SetMeasured(SURFACE); }
  void SetMeasuredToCamera() { this->SetMeasured(CAMERA); }
  ///@}

  /**
   * Edge of the cells of the level set, at most half of ThicknessMm. Sharp edges are broken by up to half of it. In [0.1, 5] mm;
   * default 0.5.
   */
  vtkUltrasoundNumberMacro(ResolutionMm);

  /** The direction from the opening to the skin. In [-1000000, 1000000]; default (0, 0, 1). */
  vtkUltrasoundVectorMacro(Up);

  /**
   * Height of the plane of the opening above the body's lowest point. What lies below is not printed. In (0, 10000] mm; default
   * 10.
   */
  vtkUltrasoundNumberMacro(OpeningMm);

  /** How far the flange and the base reach beyond the skin. 0: no flange. In [0, 100] mm; default 12. */
  vtkUltrasoundNumberMacro(FlangeMm);

  /** Thickness of the flange. In [0.5, 30] mm; default 3. */
  vtkUltrasoundNumberMacro(FlangeThicknessMm);

  /** Number of screw holes in flange and base. In [0, 64]; default 8. */
  vtkUltrasoundIntegerMacro(Screws);

  /** Diameter of the screw holes. In [1, 20] mm; default 3.4. */
  vtkUltrasoundNumberMacro(ScrewMm);

  /** Thickness of the base. In [1, 50] mm; default 5. */
  vtkUltrasoundNumberMacro(BaseMm);

  /** Height of the base's lip along the skin's inside, which keeps light out. 0: none. In [0, 100] mm; default 8. */
  vtkUltrasoundNumberMacro(BaffleMm);

  /** Between parts that fit into each other. In [0, 3] mm; default 0.3. */
  vtkUltrasoundNumberMacro(ClearanceMm);

  /** Diameter of the camera's hole, in the middle of the base. In [1, 100] mm; default 15. */
  vtkUltrasoundNumberMacro(LensHoleMm);

  /**
   * The camera's board: its edges, with the lens in its middle, and the depth of its pocket in the base. In [1, 100] mm; default
   * (25, 24, 3).
   */
  vtkUltrasoundVectorMacro(BoardMm);

  /** How far the lens's optical centre lies above the board. In [0, 100] mm; default 8. */
  vtkUltrasoundNumberMacro(LensMm);

  enum Marks { NONE = 0, HOLES = 1, BUMPS = 2 };

  ///@{
  /**
   * What is made of calibration points: holes that an LED fits in, or bumps that are removed later. Default none. There are NONE,
   * HOLES, BUMPS.
   */
  vtkUltrasoundChoiceMacro(Marks);
  void SetMarksToNone() { this->SetMarks(NONE); }
  void SetMarksToHoles() { this->SetMarks(HOLES); }
  void SetMarksToBumps() { this->SetMarks(BUMPS); }
  ///@}

  /** Diameter of holes or bumps. In [0.5, 20] mm; default 5.2. */
  vtkUltrasoundNumberMacro(MarkMm);

  /** Whether raised cells inside the skin's foot tell the camera which shell it is in. Default off. */
  vtkUltrasoundSwitchMacro(Marker);

  /** What the printer can make: its width, depth and height. In [1, 10000] mm; default (300, 300, 300). */
  vtkUltrasoundVectorMacro(PrinterMm);

  /** Whether what does not fit the printer is cut into parts that do. Default on. */
  vtkUltrasoundSwitchMacro(CutToFit);

  /** How far parts that were cut reach behind, or into, the next one. In [2, 50] mm; default 6. */
  vtkUltrasoundNumberMacro(SeamMm);

  /** Whether parts that do not fit the printer are refused. Default on. */
  vtkUltrasoundSwitchMacro(FitPrinter);

  enum Places { PROXY = 0, DOME = 1 };

  ///@{
  /**
   * Where calibration points lie when none are given: at the points of the simplified body, or in directions from the middle of
   * the opening that are three times denser at the horizon than at the top. Default proxy. There are PROXY, DOME.
   */
  vtkUltrasoundChoiceMacro(Places);
  void SetPlacesToProxy() { this->SetPlaces(PROXY); }
  void SetPlacesToDome() { this->SetPlaces(DOME); }
  ///@}

  /** About how many calibration points there are when none are given. 0: none. In [0, 10000]; default 350. */
  vtkUltrasoundIntegerMacro(Points);

  /**
   * Whether two domes with marks are made instead, which stand on the same base: with them a lens is calibrated once, for all
   * shells of that base. Default off.
   */
  vtkUltrasoundSwitchMacro(Rig);

  /** Radius of the rig's large dome. 0: the largest that the base has room for. In [0, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(LargeDomeMm);

  /** Radius of the rig's small dome. 0: 0.6 of the large one. In [0, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(SmallDomeMm);

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

  /** What the last update made and found, line by line. */
  const char* GetReport() const
  {
    return this->Report.c_str();
  }

  ///@{
  /** The wall of the last update, where it is plain, as Measured says, at some 10,000 places; NaN before. */
  double GetLeastThickness() const
  {
    return this->LeastThickness;
  }
  double GetMostThickness() const
  {
    return this->MostThickness;
  }
  ///@}

  /** A page (HTML) to print, which shows where the calibration points of the last update are. */
  const char* GetGuide() const
  {
    return this->Guide.c_str();
  }

  ///@{
  /**
   * What the last update has to be printed: how many closed surfaces, their names ("skin", "base 2"), and each in the frame of
   * the body. GetPrint returns false, after an error event, when there is none of that number.
   */
  int GetNumberOfPrints() const;
  const char* GetPrintName(int print) const;
  bool GetPrint(int print, vtkPolyData* data);
  ///@}

  /**
   * Writes all prints of the last update as one 3MF file (compressed; most slicers read it), an object each, in mm, as it stands
   * on the printer. Returns false, after an error event, when there are none or the file cannot be written.
   */
  bool Write3mf(const char* path);

protected:
  vtkUltrasoundShell();
  ~vtkUltrasoundShell() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundShell(const vtkUltrasoundShell&) = delete;
  void operator=(const vtkUltrasoundShell&) = delete;

  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;
  std::string Report, Guide;
  double LeastThickness, MostThickness;
#endif
};

#endif
