// SPDX-License-Identifier: BSD-3-Clause
#include "AlgorithmRun.h"
#include "Messages.h"
#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkNew.h>

namespace echorama {

void Run(vtkAlgorithm* algorithm, const Progress& progress, const std::function<void()>& body)
{
  bool isStopped = false;
  const auto onProgress = [&] {
    try {
      progress(algorithm->GetProgress());
    } catch (const Error&) { // must not fly through VTK
      isStopped = true;
      algorithm->SetAbortExecute(1);
    }
  };
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(const_cast<void*>(static_cast<const void*>(&onProgress)));
  command->SetCallback(
      [](vtkObject*, unsigned long, void* function, void*) { (*static_cast<decltype(onProgress)*>(function))(); });
  const Messages::OfThread messages;
  const unsigned long tag = algorithm->AddObserver(vtkCommand::ProgressEvent, command);
  body();
  algorithm->RemoveObserver(tag);
  if (isStopped)
    throw Error(Error::Kind::Cancelled, "stopped on request");
  messages.ThrowErrors();
}

void Update(vtkAlgorithm* algorithm, const Progress& progress)
{
  Run(algorithm, progress, [algorithm] { algorithm->Update(); });
}

} // namespace echorama
