// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a project; what is accepted is opened, changed and undone.
#include "Testing/Fuzzing.h"
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/ProjectFile.h"
#include <cstdlib>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const Project project = ReadProject(file.Path());
    AlignmentSession session;
    for (SessionVolume volume : project.state.volumes) {
      FindVolume(file.Path(), volume.file);
      volume.geometry.dimensions = {1, 1, 1}; // a pose file may leave the geometry to the file
      session.Add(volume);
    }
    session.SetCentreOfRotation(project.state.centre);
    const SessionState before = session.State();
    const int entries = session.UndoCount();
    for (const SessionVolume& volume : before.volumes)
      ChangesSince(before, volume);
    session.SelectAll();
    session.MoveSelection(Pose(Eigen::Translation3d(1.0, 2.0, 3.0)));
    while (session.UndoCount() > entries)
      session.Undo();
    if (session.State() != before)
      std::abort();
  });
}
