// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSceneSource
 * @brief overlapping ultrasound volumes of a scene, and everything that is known of them
 *
 * No input: a scene is a file, or a text, of the schema `echorama-scene-1` (Documentation/scenes.md). What lies in the world,
 * which probe looks at it from where or along which path, whether it presses tissue and has gel on its face, and how volumes are
 * made of it, is all said there. `echorama synthesize` writes what this class puts out.
 *
 * | output | data |
 * | ------ | ---- |
 * | 0 Volumes | vtkMultiBlockDataSet: `volume_1` ..., as vtkUltrasoundSynthesizer makes them; all but the first are out of place
 * by as much as the scene says | | 1 Beams   | vtkMultiBlockDataSet: `beams_1` ..., the same on the beams | | 2 Tissue  |
 * vtkPolyData: all bodies at rest (see vtkUltrasoundTissue) | | 3 Truth   | vtkMultiBlockDataSet: `view_1` ..., blocks of what
 * there is for each: |
 *
 * | block of the truth | data |
 * | ------------------ | ---- |
 * | `tissue`       | vtkPolyData: what sound met, gel with it |
 * | `displacement` | vtkImageData: where tissue has gone, as vtkUltrasoundTissuePress puts it out; what vtkUltrasoundStitcher
 * takes back | | `gel`, `face`  | vtkPolyData: the surface of the gel, and what lies before each beam (see vtkUltrasoundGel) | |
 * `landmarks`    | vtkPolyData: places as the volume has them, with the point array `Label` |
 *
 * The scene is kept, so that one view after another costs no more than all at once; a file that has changed is read again.
 *
 * Each rank of Controller makes its share of the views, whole ones, and gets all of them: the same as one rank makes. What fails
 * on one rank fails on all, with its message.
 *
 * Fails, with a message that gives the way to the key, for what is no scene, for files that it names and that cannot be read,
 * for a view that there is not, and for what a probe cannot do.
 *
 * @sa echorama::SceneRun, vtkUltrasoundSynthesizer, vtkUltrasoundTissuePress, vtkUltrasoundGel
 */
#ifndef vtkUltrasoundSceneSource_h
#define vtkUltrasoundSceneSource_h

#include "EchoramaFiltersScenesModule.h"
#include "vtkMultiBlockDataSetAlgorithm.h"
#include "vtkUltrasoundParameters.h"
#include <string> // for reports

#ifndef __VTK_WRAP__
#include "Core/Sharing/SharedWork.h"
#include "Filters/Scenes/SceneRun.h"
#include <memory>
#include <vector>
#endif

class vtkImageData;
class vtkMatrix4x4;
class vtkMultiProcessController;

class ECHORAMAFILTERSSCENES_EXPORT vtkUltrasoundSceneSource : public vtkMultiBlockDataSetAlgorithm {
public:
  static vtkUltrasoundSceneSource* New();
  vtkTypeMacro(vtkUltrasoundSceneSource, vtkMultiBlockDataSetAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** The scene, JSON; files that it names are looked for in its folder. Default none. */
  vtkUltrasoundTextMacro(FileName);

  /** The scene as a text, instead of a file; files that it names are looked for in the working folder. Default none. */
  vtkUltrasoundTextMacro(Scene);

  /** Folder of the meshes and recordings that the scene names, whatever folder it says. Default none. */
  vtkUltrasoundTextMacro(DataFolder);

  /** The number of the only view that is made; 0: all. In [0, 1000]; default 0. */
  vtkUltrasoundIntegerMacro(View);

  /** Instead of the scene's seed; -1: the scene's. At least -1; default -1. */
  vtkUltrasoundInteger64Macro(Seed);

  /** Edge of the cubic voxels; 0: as the scene says. In [0, 20] mm; default 0. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /** How many places that two views see are told as landmarks, besides the balls of a rig. In [0, 10000]; default 0. */
  vtkUltrasoundIntegerMacro(Landmarks);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /**
   * Whose ranks share the views; all of them have to update. nullptr: this process makes all by itself. Default: the global
   * controller.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController() const { return this->Controller; }
  ///@}

  /** How many views the scene has; 0, after an error event, for what is no scene. */
  int GetNumberOfViews();

  /**
   * The pose that puts a volume of the last update back to where it was made, by the number of its view from 1: the truth of an
   * alignment. Returns false when that view was not made.
   */
  bool GetVolumeToWorld(int view, vtkMatrix4x4* volumeToWorld);

  /** The scene with every number in it, and files by their full names: it makes the same again, to the last bit. */
  std::string GetResolvedScene();

  /** What there is to say about the scene and the last update, a line each; never fatal. */
  std::string GetNotes();

  /**
   * What was made by the last update, as JSON: {"volumes": [{"press", "gel", "cost"}, ...], "ranks", "messages",
   * "message_bytes"}: these two are what this rank has sent to others, each by itself.
   */
  std::string GetReport();

  /** The JSON schema of scenes, the text of Examples/scenes/echorama-scene-1.schema.json. */
  static std::string GetSceneSchema();

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object

  /** A view of the last update; of the scan without what the outputs hold, and of what another rank made what reports tell. */
  struct MadeView {
    int Number = 0; ///< from 1
    echorama::Pose Knock = echorama::Pose::Identity();
    echorama::SceneScan Scan;
  };
  const std::vector<MadeView>& Views() const
  {
    return this->Made;
  }

  /** Puts volume \a number (from 0) of a set out of place by a known amount, but for the first; returns how. */
  static echorama::Pose Knock(vtkImageData* volume, std::size_t number, std::uint64_t seed, double mm, double degrees);
#endif

protected:
  vtkUltrasoundSceneSource();
  ~vtkUltrasoundSceneSource() override;

  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundSceneSource(const vtkUltrasoundSceneSource&) = delete;
  void operator=(const vtkUltrasoundSceneSource&) = delete;

#ifndef __VTK_WRAP__
  struct Settings {
    std::string fileName, scene, dataFolder;
    std::int64_t seed = -1;
    int view = 0, landmarks = 0;
    double spacingMm = 0.0;
  };
  echorama::SynthesisScene Read() const;
  echorama::SceneRun& Prepare(const echorama::Progress& progress);
  void MakeViews(vtkInformationVector* outputs, echorama::SharedWork& shared, const echorama::Progress& progress);
  MadeView Put(echorama::SceneScan& scan, int number, vtkMultiBlockDataSet* blocks, const echorama::Progress& progress);

  Settings Values;
  vtkMultiProcessController* Controller = nullptr;
  std::vector<MadeView> Made;
  std::vector<std::string> Notes;
  int Ranks = 1;
  echorama::Traffic Told; ///< by this rank, in the last update
  std::unique_ptr<echorama::SceneRun> Run;
  std::string RunOf; ///< the scene, and what else the run was made with
#endif
};

#endif
