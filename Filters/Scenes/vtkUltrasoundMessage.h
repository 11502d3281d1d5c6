// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Data as other ranks are told of them: exact, with all arrays. (What vtkCommunicator makes of an image lacks its direction, and
// has its place in decimals.)
#ifndef __VTK_WRAP__
#include "Core/Sharing/Packing.h"
#include "vtkSmartPointer.h"

class vtkDataObject;

class vtkUltrasoundMessage {
public:
  /// Images, vtkPolyData, and vtkMultiBlockDataSets of them. \throws echorama::Error for what else there is
  static void Pack(echorama::Packed& to, vtkDataObject* data);
  static vtkSmartPointer<vtkDataObject> Unpack(echorama::Unpacked& from);
};

#endif // __VTK_WRAP__
