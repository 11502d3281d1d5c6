// SPDX-License-Identifier: BSD-3-Clause
// VTK's polygons (.vtp) from files that may be damaged. Not a class of the module: for ReadMesh, and for its fuzzer.
#ifndef vtkUltrasoundVtpFile_h
#define vtkUltrasoundVtpFile_h

#include "Core/Base/Error.h"
#include "Core/Base/VtkMessage.h"
#include "Readers/VtkXmlFile.h"
#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkDataArraySelection.h"
#include "vtkExecutive.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkXMLDataElement.h"
#include "vtkXMLPolyDataReader.h"

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace echorama {

/// VTK's reader takes the last offset of cells for the number of their corners, and asks for the memory of so many: no more than
/// a file of this size can hold, however it is compressed.
class VtpReader : public vtkXMLPolyDataReader {
public:
  static VtpReader* New() { VTK_STANDARD_NEW_BODY(VtpReader); }
  vtkTypeMacro(VtpReader, vtkXMLPolyDataReader);

  double MostCorners = 0.0;
  bool HasTooMany = false;

protected:
  int ReadArrayValues(vtkXMLDataElement* element, vtkIdType index, vtkAbstractArray* array, vtkIdType start, vtkIdType count,
                      FieldType type) override
  {
    if (!this->Superclass::ReadArrayValues(element, index, array, start, count, type)) {
      return 0;
    }
    const char* name = element->GetAttribute("Name");
    auto* numbers = vtkDataArray::SafeDownCast(array);
    if (name && std::strcmp(name, "offsets") == 0 && numbers && numbers->GetNumberOfTuples() > 0) {
      this->HasTooMany |= numbers->GetComponent(numbers->GetNumberOfTuples() - 1, 0) > this->MostCorners;
    }
    return this->HasTooMany ? 0 : 1;
  }
};

/// The points and polygons of a file. \throws Error(BadFile) with what is wrong with it.
inline vtkSmartPointer<vtkPolyData> ReadVtp(const std::string& path)
{
  constexpr double cornersOfByte = 1000.0; // 8 bytes each, and a thousand times fewer when they are compressed; with some room
  CheckVtkXmlFile(path, "PolyData");
  std::vector<std::string> complaints;
  vtkNew<vtkCallbackCommand> listener;
  listener->SetClientData(&complaints);
  listener->SetCallback([](vtkObject*, unsigned long, void* list, void* text) {
    static_cast<std::vector<std::string>*>(list)->push_back(SentenceOfVtkMessage(text ? static_cast<const char*>(text) : ""));
  });
  vtkNew<VtpReader> reader;
  reader->MostCorners = cornersOfByte * static_cast<double>(std::filesystem::file_size(path));
  reader->AddObserver(vtkCommand::ErrorEvent, listener);
  reader->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, listener);
  reader->SetParserErrorObserver(listener); // an object of its own
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  reader->GetPointDataArraySelection()->DisableAllArrays(); // nobody needs them, and they may be damaged
  reader->GetCellDataArraySelection()->DisableAllArrays();
  reader->Update();
  if (reader->HasTooMany) {
    FailFile(path, "its polygons are damaged: their offsets say more corners than the file can hold");
  }
  if (const std::string problem = ReasonAmong(complaints); !problem.empty()) {
    FailFile(path, problem);
  }
  vtkSmartPointer<vtkPolyData> data = reader->GetOutput();
  for (vtkCellArray* cells : {data->GetPolys(), data->GetStrips()}) { // what VTK's filters believe of them
    bool good = cells->IsValid();
    for (vtkIdType i = 0; good && i < cells->GetNumberOfCells(); ++i) {
      good = cells->GetCellSize(i) > 2;
    }
    if (good && cells->GetNumberOfConnectivityIds() > 0) {
      double range[2];
      cells->GetConnectivityArray()->GetRange(range);
      good = range[0] >= 0.0 && range[1] < static_cast<double>(data->GetNumberOfPoints());
    }
    if (!good) {
      FailFile(path, "its polygons are damaged: they have fewer than three corners, or name points that are not there");
    }
  }
  return data;
}

} // namespace echorama

#endif
