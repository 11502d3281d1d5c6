// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include <map>
#include <QStringList>
#include <string>
#include <vtkSmartPointer.h>

class vtkImageData;
class vtkMultiBlockDataSet;
class vtkUltrasoundEmbedder;
class vtkUltrasoundStitcher;

namespace echorama {

/// How one volume is made of several: what the stitcher and the embedder describe, and what is done beside that. As texts it is
/// the options of a result's MadeOf, so that a result can be made again as it was.
class ResultRecipe {
public:
  using Options = std::map<std::string, std::string>;

  ResultRecipe();
  ~ResultRecipe();

  ///@{ They hold parameters, and are never run.
  ParameterList Stitching() const;
  ParameterList Embedding() const;
  ///@}
  bool isDeformable = false; ///< volumes are read through what a deformable alignment finds
  bool isEmbedded = false;
  bool isPreview = false; ///< of voxels twice as large
  int form = 0;           ///< the source, from 1, whose fan is the outline; 0: one that is found from the data
  QStringList noise;      ///< files; none: noise is made

  Options ToOptions() const;
  /// What is not named stays; what is not known (of another version) is left out.
  void Take(const Options& options);

  /// In a Job. \throws Error, with what a filter or a reader said.
  static vtkSmartPointer<vtkImageData> Make(const Options& options, vtkMultiBlockDataSet* sources, const Progress& progress);

private:
  vtkSmartPointer<vtkImageData> Embed(vtkMultiBlockDataSet* sources, const Progress& progress) const;

  vtkSmartPointer<vtkUltrasoundStitcher> stitcher_;
  vtkSmartPointer<vtkUltrasoundEmbedder> embedder_;
};

} // namespace echorama
