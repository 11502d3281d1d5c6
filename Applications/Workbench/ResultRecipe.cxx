// SPDX-License-Identifier: BSD-3-Clause
#include "ResultRecipe.h"
#include "AlgorithmRun.h"
#include "VolumeReading.h"
#include <algorithm>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkUltrasoundDeformableAligner.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundStitcher.h>

namespace echorama {

namespace {

constexpr const char *StitchPrefix = "Stitch.", *EmbedPrefix = "Embed.";

void WriteOptions(ResultRecipe::Options& options, const std::string& prefix, const ParameterList& parameters)
{
  for (const Parameter& parameter : parameters)
    options[prefix + parameter.name] = parameter.Text();
}

void ReadOptions(const ResultRecipe::Options& options, const std::string& prefix, ParameterList parameters)
{
  for (Parameter& parameter : parameters) {
    const auto option = options.find(prefix + parameter.name);
    try {
      if (option != options.end())
        parameter.Set(option->second);
    } catch (const Error&) { // a value of another version
    }
  }
}

const char* Word(bool on)
{
  return on ? "on" : "off";
}

// An odd number of voxels less is nothing to a preview.
void MakeCoarse(vtkUltrasoundStitcher* stitcher)
{
  stitcher->UpdateInformation();
  double spacing[3];
  stitcher->GetOutputInformation(0)->Get(vtkDataObject::SPACING(), spacing);
  stitcher->SetSpacingMm(2.0 * *std::min_element(spacing, spacing + 3));
}

} // namespace

ResultRecipe::ResultRecipe()
  : stitcher_(vtkSmartPointer<vtkUltrasoundStitcher>::New()), embedder_(vtkSmartPointer<vtkUltrasoundEmbedder>::New())
{
}

ResultRecipe::~ResultRecipe() = default;

ParameterList ResultRecipe::Stitching() const
{
  return stitcher_->Parameters();
}

// What a preview is, is ours to say.
ParameterList ResultRecipe::Embedding() const
{
  return Without(embedder_->Parameters(), {"PreviewFactor"});
}

ResultRecipe::Options ResultRecipe::ToOptions() const
{
  Options options;
  WriteOptions(options, StitchPrefix, Stitching());
  options["Deformable"] = Word(isDeformable);
  options["Preview"] = Word(isPreview);
  options["Embed"] = Word(isEmbedded);
  if (isEmbedded) {
    WriteOptions(options, EmbedPrefix, Embedding());
    options["Form"] = std::to_string(form);
    options["Noise"] = noise.join('\n').toStdString();
  }
  return options;
}

void ResultRecipe::Take(const Options& options)
{
  ReadOptions(options, StitchPrefix, Stitching());
  ReadOptions(options, EmbedPrefix, Embedding());
  const auto text = [&options](const char* name) {
    const auto option = options.find(name);
    return option != options.end() ? QString::fromStdString(option->second) : QString();
  };
  const auto isOn = [&text](const char* name, bool before) {
    const QString word = text(name);
    return word.isEmpty() ? before : word == Word(true);
  };
  isDeformable = isOn("Deformable", isDeformable);
  isPreview = isOn("Preview", isPreview);
  isEmbedded = isOn("Embed", isEmbedded);
  if (const QString number = text("Form"); !number.isEmpty())
    form = std::max(0, number.toInt());
  if (options.count("Noise") != 0)
    noise = text("Noise").split('\n', Qt::SkipEmptyParts);
}

vtkSmartPointer<vtkImageData> ResultRecipe::Make(const Options& options, vtkMultiBlockDataSet* sources, const Progress& progress)
{
  ResultRecipe recipe;
  recipe.Take(options);
  vtkUltrasoundEmbedder* embedder = recipe.embedder_;
  if (recipe.isEmbedded && sources->GetNumberOfBlocks() == 1) { // nothing is to be stitched
    embedder->SetInputDataObject(0, sources->GetBlock(0));
    embedder->SetPreviewFactor(recipe.isPreview ? 2 : 1);
    return recipe.Embed(sources, progress);
  }
  vtkUltrasoundStitcher* stitcher = recipe.stitcher_;
  stitcher->SetInputDataObject(sources);
  const bool isDeformed = recipe.isDeformable && sources->GetNumberOfBlocks() > 1;
  if (isDeformed) {
    const vtkNew<vtkUltrasoundDeformableAligner> deformer;
    deformer->SetInputDataObject(sources);
    Update(deformer, progress.Part(0.0, 0.5));
    stitcher->AddDisplacementData(deformer->GetOutputDataObject(1));
  }
  const Progress rest = progress.Part(isDeformed ? 0.5 : 0.0, 1.0);
  if (recipe.isPreview)
    MakeCoarse(stitcher);
  Update(stitcher, rest.Part(0.0, recipe.isEmbedded ? 0.4 : 1.0));
  if (!recipe.isEmbedded)
    return stitcher->GetOutput();

  embedder->SetInputData(0, stitcher->GetOutput());
  return recipe.Embed(sources, rest.Part(0.4, 1.0));
}

// What the embedder has as its volume.
vtkSmartPointer<vtkImageData> ResultRecipe::Embed(vtkMultiBlockDataSet* sources, const Progress& progress) const
{
  if (!noise.isEmpty()) {
    const vtkNew<vtkMultiBlockDataSet> blocks;
    for (const ReadVolume& volume : ReadVolumes(WithoutCompanions(noise), progress.Part(0.0, 0.2))) {
      if (!volume.image)
        throw Error(Error::Kind::BadFile, volume.error.toStdString());
      const unsigned int block = blocks->GetNumberOfBlocks();
      blocks->SetBlock(block, volume.image);
      blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volume.file.toUtf8().constData());
    }
    embedder_->SetInputDataObject(1, blocks);
  }
  if (form > 0) {
    const auto source = static_cast<unsigned int>(form - 1);
    if (source >= sources->GetNumberOfBlocks())
      throw Error(Error::Kind::InvalidParameter, "the outline is that of source " + std::to_string(form) + ", and there are " +
                                                     std::to_string(sources->GetNumberOfBlocks()));
    embedder_->SetInputDataObject(2, sources->GetBlock(source));
  }
  Update(embedder_, progress.Part(0.2, 1.0));
  return embedder_->GetOutput();
}

} // namespace echorama
