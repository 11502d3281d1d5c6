// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <functional>

class vtkAlgorithm;

namespace echorama {

/// Runs \a body, which makes an algorithm work, in a Job: the algorithm's progress goes to \a progress, a wish to stop becomes
/// its abort flag. \throws Error(Cancelled) when it was stopped, Error(BadInput) with what VTK classes reported on this thread.
void Run(vtkAlgorithm* algorithm, const Progress& progress, const std::function<void()>& body);

/// The same for algorithm->Update().
void Update(vtkAlgorithm* algorithm, const Progress& progress);

} // namespace echorama
