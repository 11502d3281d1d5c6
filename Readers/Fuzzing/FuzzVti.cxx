// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a VTK image file: what passes our check must not end VTK's reader, which is not ours and believes its files.
#include "Readers/VtkXmlFile.h"
#include "Testing/Fuzzing.h"
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkXMLImageDataReader.h>

using namespace echorama;

// VTK leaks the array that it is reading when its data turn out to be damaged.
extern "C" const char* __asan_default_options()
{
  return "detect_leaks=0";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); // its texts are made all the same: they can end it, too
  const MemoryFile file(data, size);
  return Survives([&] {
    CheckVtkXmlFile(file.Path());
    const vtkNew<vtkXMLImageDataReader> reader;
    reader->SetFileName(file.Path().c_str());
    reader->Update();
  });
}
