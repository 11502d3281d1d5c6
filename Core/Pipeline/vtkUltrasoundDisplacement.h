// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundDisplacement
 * @brief smooth displacements as images: a coarse lattice of vectors stands for a field that is defined everywhere
 *
 * A displacement image is a vtkImageData with the point array `Displacement`: three doubles or floats per point, mm, along the
 * axes of the world. It leads from rest to now, whoever made it: what lies, or belongs, at x is at x + u(x) now, and a volume,
 * placed by its geometry, shows it there. So the result of a simulation moves tissue, and the same image lets a stitcher read the
 * scan of that tissue where it was at rest. Between the points u is the cubic spline through them (echorama::DisplacementField),
 * twice continuously differentiable; beyond the image it fades to zero within two spacings. So a lattice of 30 mm, as
 * vtkUltrasoundDeformableAligner makes it, says all.
 *
 * (vtkUltrasoundDeformGeometry reads the same image as a map that is linear between the points.)
 *
 * @sa vtkUltrasoundDeformableAligner, vtkUltrasoundStitcher, vtkUltrasoundSynthesizer
 */
#ifndef vtkUltrasoundDisplacement_h
#define vtkUltrasoundDisplacement_h

#include "EchoramaCoreModule.h"
#include "vtkObject.h"

#ifndef __VTK_WRAP__
#include "Core/Imaging/DisplacementField.h"
#include <string>
#include <vector>
#endif

class vtkImageData;
class vtkInformationVector;

class ECHORAMACORE_EXPORT vtkUltrasoundDisplacement : public vtkObject {
public:
  static vtkUltrasoundDisplacement* New();
  vtkTypeMacro(vtkUltrasoundDisplacement, vtkObject);

  /** Name of the point array. */
  static const char* DisplacementName() { return "Displacement"; }

  ///@{
  /**
   * The displacement of what lies at a point at rest, and where what is at a point now belongs (the inverse), mm. Return false,
   * with an error message, for an image that is no displacement, or where the inverse does not exist.
   */
  static bool Evaluate(vtkImageData* displacement, const double point[3], double result[3]);
  static bool Invert(vtkImageData* displacement, const double read[3], double belongs[3]);
  ///@}

#ifndef __VTK_WRAP__
  /** Throws echorama::Error(BadInput) that begins with \a name for an image that is no displacement. */
  static echorama::DisplacementField FieldOf(vtkImageData* displacement, const std::string& name);

  /**
   * The fields of a repeatable input: images, or blocks of them, one for each of the volumes of these names, in their order; or
   * none at all. Throws echorama::Error(BadInput) for another number, and for a block
   * with the name of another than its volume, unless that is "".
   */
  static std::vector<echorama::DisplacementField> FieldsOf(vtkInformationVector* port, const std::vector<std::string>& volumes);

  /** Makes \a image the lattice of a field, with the values that it takes there. */
  static void ImageOf(const echorama::DisplacementField& field, vtkImageData* image);
#endif

protected:
  vtkUltrasoundDisplacement() = default;
  ~vtkUltrasoundDisplacement() override = default;

private:
  vtkUltrasoundDisplacement(const vtkUltrasoundDisplacement&) = delete;
  void operator=(const vtkUltrasoundDisplacement&) = delete;
};

#endif
