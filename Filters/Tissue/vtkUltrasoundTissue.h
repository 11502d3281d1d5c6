// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTissue
 * @brief bodies of tissue as a vtkPolyData: triangles, whose body each is, and what the bodies are made of
 *
 * | array            | where      | values                                                                              |
 * | ---------------- | ---------- | ----------------------------------------------------------------------------------- |
 * | Body             | cell data  | int: index of the triangle's body                                                   |
 * | Material         | cell data  | int: index of the body's material, for colours                                      |
 * | BodyMaterial     | field data | int per body: index of its material                                                 |
 * | BodyName         | field data | text per body, may be empty; left out when all are                                  |
 * | MaterialName     | field data | text per material; the first is the background                                      |
 * | MaterialProperty | field data | doubles per material, with named components: see echorama::Material                 |
 *
 * Where several bodies hold a point the one with the greatest index counts. Nobody else spells these names. It has no state.
 */
#ifndef vtkUltrasoundTissue_h
#define vtkUltrasoundTissue_h

#include "EchoramaFiltersTissueModule.h"
#include "vtkObject.h"

#ifndef __VTK_WRAP__
#include "Filters/Tissue/TissueSurface.h"
#endif

class vtkPolyData;

class ECHORAMAFILTERSTISSUE_EXPORT vtkUltrasoundTissue : public vtkObject {
public:
  static vtkUltrasoundTissue* New();
  vtkTypeMacro(vtkUltrasoundTissue, vtkObject);

  ///@{
  /** Names of the arrays. */
  static const char* BodyName() { return "Body"; }
  static const char* MaterialName() { return "Material"; }
  static const char* BodyMaterialName() { return "BodyMaterial"; }
  static const char* BodyNameName() { return "BodyName"; }
  static const char* MaterialNameName() { return "MaterialName"; }
  static const char* MaterialPropertyName() { return "MaterialProperty"; }
  ///@}

  /** Whether the data carries materials, and so is tissue. */
  static bool IsTissue(vtkPolyData* data);

#ifndef __VTK_WRAP__
  /** Fills \a data (points, triangles, cell and field data) with the surface. */
  static void Set(vtkPolyData* data, const echorama::TissueSurface& surface);

  /**
   * The surface that \a data holds. Polygons and strips are cut into triangles; vertices and lines are left out. Throws
   * echorama::Error(BadInput) that names the array which is missing or does not fit.
   */
  static echorama::TissueSurface Of(vtkPolyData* data);
#endif

protected:
  vtkUltrasoundTissue() = default;
  ~vtkUltrasoundTissue() override = default;

private:
  vtkUltrasoundTissue(const vtkUltrasoundTissue&) = delete;
  void operator=(const vtkUltrasoundTissue&) = delete;
};

#endif
