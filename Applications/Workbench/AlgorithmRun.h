// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"

class vtkAlgorithm;

namespace echorama {

/// Updates an algorithm in a Job: its progress goes to \a progress, a wish to stop becomes its abort flag.
/// \throws Error(Cancelled) when it was stopped, Error(BadInput) with what VTK classes reported on this thread.
void Update(vtkAlgorithm* algorithm, const Progress& progress);

} // namespace echorama
