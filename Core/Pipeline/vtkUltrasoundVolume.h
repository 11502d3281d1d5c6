// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundVolume
 * @brief what makes a vtkImageData one of our volumes, and how kernels see it
 *
 * A volume is a vtkImageData whose Origin, Spacing and DirectionMatrix place it in the world (mm, LPS), with two point
 * arrays: `Intensity`, and `ValidRegion` (unsigned char, 1 or 0: which voxels are real). This class spells those names,
 * converts geometry, and is the one door between VTK data and kernels. It has no state.
 */
#ifndef vtkUltrasoundVolume_h
#define vtkUltrasoundVolume_h

#include "EchoramaCoreModule.h"
#include "vtkObject.h"

#ifndef __VTK_WRAP__
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "Core/Imaging/VoxelTypes.h"
#include "vtkDataArray.h"
#include "vtkSmartPointer.h"
#include "vtkTypeTraits.h"
#include <functional>
#include <optional>
#include <string>
#include <vector>
#endif

class vtkAlgorithm;
class vtkDataArray;
class vtkDataObject;
class vtkImageData;
class vtkInformation;
class vtkInformationVector;
class vtkMatrix4x4;

class ECHORAMACORE_EXPORT vtkUltrasoundVolume : public vtkObject {
public:
  static vtkUltrasoundVolume* New();
  vtkTypeMacro(vtkUltrasoundVolume, vtkObject);

  ///@{
  /**
   * Names of the two point arrays, of one that says which volume each voxel of a stitched one came from, of one that says
   * how far each voxel can be trusted (float, 0 to 1; see vtkUltrasoundReliabilityMap), and of one that says what each voxel of
   * an embedded volume is (unsigned char: 0 nothing, 1 data, 2 data mixed with background, 3 invented background).
   */
  static const char* IntensityName() { return "Intensity"; }
  static const char* ValidRegionName() { return "ValidRegion"; }
  static const char* ProvenanceName() { return "Provenance"; }
  static const char* ReliabilityName() { return "Reliability"; }
  static const char* EmbeddingName() { return "Embedding"; }
  ///@}

  /**
   * The intensities of a volume: the array named `Intensity`, else the active scalars. nullptr when there is neither.
   */
  static vtkDataArray* GetIntensity(vtkImageData* volume);

  /**
   * The valid region of a volume, or nullptr when every voxel is real.
   */
  static vtkDataArray* GetValidRegion(vtkImageData* volume);

  /**
   * Moves a volume by a rigid transform: its geometry, its `ProbeToWorld` and its `ImageToWorld` change, its voxels do not.
   * Returns false, with an error message, when the matrix is not rigid.
   */
  static bool Move(vtkImageData* volume, vtkMatrix4x4* pose);

#ifndef __VTK_WRAP__
  /** An array for the voxels of a large volume, not filled: on huge pages where the system has them. */
  static vtkSmartPointer<vtkDataArray> NewArray(int vtkType, vtkIdType tuples, const char* name);

  /** The geometry of the voxels; a first extent that is not zero is folded into the origin. */
  static echorama::ImageGeometry GeometryOf(vtkImageData* volume);

  /** Sets extent (from zero), origin, spacing and direction. */
  static void SetGeometry(vtkImageData* volume, const echorama::ImageGeometry& geometry);

  /** Sets whole extent (from zero), origin, spacing and direction of an output in RequestInformation. */
  static void SetGeometry(vtkInformation* outputInformation, const echorama::ImageGeometry& geometry);

  /** Moves geometry, `ProbeToWorld` and `ImageToWorld`. */
  static void Move(vtkImageData* volume, const echorama::Pose& pose);

  /** A matrix as a pose; none when it is not a rigid transform. */
  static std::optional<echorama::Pose> RigidPoseOf(vtkMatrix4x4* matrix);
  static void SetMatrix(vtkMatrix4x4* matrix, const echorama::Pose& pose);

  /** A volume that came into a filter. */
  struct Input {
    vtkImageData* Image = nullptr;
    vtkDataArray* Intensity = nullptr;
    vtkDataArray* ValidRegion = nullptr; ///< nullptr: every voxel is real
    std::string Name;                    ///< NAME() of its block, or "volume N" with N from 1
  };

  /**
   * The volumes on a repeatable port: image data, and the image leaves of data object trees, in order. The intensities are
   * those that SetInputArrayToProcess(0, ...) of the filter names, by default as GetIntensity.
   * Throws echorama::Error(BadInput) that names the volume when it has no intensities, more than one component, a type
   * that is not in VoxelTypes.h, a valid region that is not unsigned char, or a geometry that is not one (ImageGeometry::Check).
   */
  static std::vector<Input> CollectInputs(vtkAlgorithm* filter, vtkInformationVector* port);

  /**
   * GetValidRegion(); throws echorama::Error(BadInput) that begins with \a name when it is not one unsigned char per voxel.
   */
  static vtkDataArray* CheckValidRegion(vtkImageData* volume, const std::string& name);

  /** One volume, checked as above. Without a filter (nullptr) its intensities are those of GetIntensity. */
  static Input CheckInput(vtkAlgorithm* filter, vtkImageData* image, const std::string& name);

  /** The view of a data array with the dimensions of its image. T must be its type. */
  template <class T>
  static echorama::VolumeView<T> ViewOf(vtkDataArray* array, vtkImageData* image)
  {
    return array ? echorama::VolumeView<T>(static_cast<std::remove_const_t<T>*>(array->GetVoidPointer(0)), DimensionsOf(image))
                 : echorama::VolumeView<T>();
  }

  /** What kernels take. T must be the type of the intensities. */
  template <class T>
  static echorama::PosedVolume<T> PosedVolumeOf(const Input& input)
  {
    return {ViewOf<const T>(input.Intensity, input.Image), ViewOf<const unsigned char>(input.ValidRegion, input.Image),
            GeometryOf(input.Image)};
  }

  /**
   * Calls functor(T(0)) with the voxel type of \a intensity: the functor is generic and reads the type of its argument.
   * Throws echorama::Error(BadInput) for a type that is not in VoxelTypes.h.
   */
  template <class Functor>
  static void Dispatch(vtkDataArray* intensity, Functor&& functor)
  {
    switch (intensity->GetDataType()) {
#define EchoramaDispatchCase(T)                                                                                                  \
  case vtkTypeTraits<T>::VTK_TYPE_ID:                                                                                            \
    functor(static_cast<T>(0));                                                                                                  \
    return;
      ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaDispatchCase)
#undef EchoramaDispatchCase
    default:
      RefuseType(intensity);
    }
  }

  /** For FillInputPortInformation: the port takes any number of images, or of data object trees of such. */
  static void AcceptVolumes(vtkInformation* port);

  /**
   * For RequestInformation, where only the data tells what comes out: makes what comes in on a port, whole, on all connections or
   * one. It is not made again later, as nothing has changed then. Returns whether it could be made.
   */
  static bool MakeInput(vtkAlgorithm* filter, int port, int connection = -1);

  ///@{
  /** Adds an array of one tuple, or one text, to the field data. */
  static void AddField(vtkDataObject* data, const char* name, const double* values, int components);
  static void AddField(vtkDataObject* data, const char* name, const std::string& text);
  ///@}

  /**
   * For RequestUpdateExtent: asks for the whole of every connection of an input port, whether it is cut into extents or
   * into pieces.
   */
  static void RequestWhole(vtkInformationVector* port);

  /**
   * Runs the body of a RequestData. Gives it a Progress that updates the filter's progress and honours its abort flag.
   * Turns errors into vtkErrorMacro of the filter and, on errors and abort alike, empties the outputs, so that nothing
   * half-made leaves the filter. Returns what RequestData should.
   */
  static int Run(vtkAlgorithm* filter, vtkInformationVector* outputs, const std::function<void(const echorama::Progress&)>& body);
#endif

protected:
  vtkUltrasoundVolume() = default;
  ~vtkUltrasoundVolume() override = default;

private:
#ifndef __VTK_WRAP__
  static std::array<int, 3> DimensionsOf(vtkImageData* image);
  [[noreturn]] static void RefuseType(vtkDataArray* intensity);
#endif
  vtkUltrasoundVolume(const vtkUltrasoundVolume&) = delete;
  void operator=(const vtkUltrasoundVolume&) = delete;
};

#endif
