// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QDir>
#include <QStringList>
#include <vector>

namespace echorama {

struct CalliperLine;
struct PlanePicture;
struct ScanFrame;

/// Writes NAME.png, the image as it is made (a pixel for a pixel), and NAME.json with all that it was made from: the volumes, the
/// pose, the controls, what was measured. \returns the path of the PNG.
/// \throws Error(FileSystem) that names the file.
QString WriteSnapshot(const QDir& folder, const QStringList& volumes, const PlanePicture& picture, const ScanFrame& frame,
                      const std::vector<CalliperLine>& callipers);

} // namespace echorama
