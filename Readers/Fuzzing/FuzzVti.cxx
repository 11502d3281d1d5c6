// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a VTK image file, or as one of polygons when they name these: what passes our check must not end VTK's readers,
// which are not ours and believe their files.
#include "Readers/VtkXmlFile.h"
#include "Testing/Fuzzing.h"
#include <string_view>
#include <vtkDataArraySelection.h>
#include <vtkNew.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPolyDataReader.h>

using namespace echorama;

// VTK leaks the array that it is reading when its data turn out to be damaged.
extern "C" const char* __asan_default_options()
{
  return "detect_leaks=0";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  vtkObject::GlobalWarningDisplayOff();
  const MemoryFile file(data, size);
  return Survives([&] {
    if (std::string_view(reinterpret_cast<const char*>(data), size).find("<PolyData") != std::string_view::npos) {
      CheckVtkXmlFile(file.Path(), "PolyData");
      const vtkNew<vtkXMLPolyDataReader> reader; // as ReadMesh does: points and polygons alone
      reader->SetFileName(file.Path().c_str());
      reader->UpdateInformation();
      reader->GetPointDataArraySelection()->DisableAllArrays();
      reader->GetCellDataArraySelection()->DisableAllArrays();
      reader->Update();
      return;
    }
    CheckVtkXmlFile(file.Path());
    const vtkNew<vtkXMLImageDataReader> reader;
    reader->SetFileName(file.Path().c_str());
    reader->Update();
  });
}
