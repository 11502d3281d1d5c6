// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundOpenIGTLinkSender.h"

#include "Readers/vtkUltrasoundVoxelTypes.h"
#include "Tracking/Stream/Clock.h"

#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundAcquisition.h"

#include <algorithm>
#include <cmath>
#include <functional>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundOpenIGTLinkSender);

vtkUltrasoundParametersMacro(vtkUltrasoundOpenIGTLinkSender);

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::vtkUltrasoundOpenIGTLinkSender() = default;

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::~vtkUltrasoundOpenIGTLinkSender() = default;

//----------------------------------------------------------------------------
echorama::OpenIgtLinkServer& vtkUltrasoundOpenIGTLinkSender::Listen()
{
  this->Wanted.turnImages = !this->KeepCoordinates;
  if (!this->Server || this->Wanted.host != this->Served.host || this->Wanted.port != this->Served.port ||
      this->Wanted.turnImages != this->Served.turnImages) {
    this->Server.reset(); // its port may be the same
    auto server = std::make_unique<echorama::OpenIgtLinkServer>(this->Wanted);
    server->Start();
    this->Server = std::move(server);
    this->Served = this->Wanted;
  }
  return *this->Server;
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundOpenIGTLinkSender::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {echorama::Without(Describe(this->Wanted), {"Clients", "QueuedBytes", "RememberedImages"}),
       {Parameter("DeviceName", this->DeviceName, "What the volume is called there: 1 to 20 bytes."),
        Parameter(
            "KeepCoordinates", this->KeepCoordinates,
            "Whether volume and transforms are sent with their own numbers, so that they lie where the poses of a tracker lie "
            "that 3D Slicer is given as they are. Off: both are turned from L, P, S to R, A, S, so that patients lie in 3D "
            "Slicer as they should.")
            .Advanced(),
        Parameter(
            "WaitSeconds", this->WaitSeconds, {0, 3600}, "s",
            "How long an update waits for a first client when there is none, and then again until the volume has been handed "
            "over. For scripts that end after their update.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
void vtkUltrasoundOpenIGTLinkSender::Execute(vtkInformationVector** inputs, vtkImageData* output,
                                             const echorama::Progress& progress)
{
  // 1. what came in
  echorama::CheckRanges(this->Parameters());
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  echorama::StreamedImage message;
  message.name = this->DeviceName;
  if (message.name.empty()) {
    throw Error(Error::Kind::InvalidParameter, "the device name is empty");
  }
  message.time = vtkUltrasoundAcquisition::TimeStampOf(image).value_or(echorama::ClockNow());
  message.geometry = vtkUltrasoundVolume::GeometryOf(image);
  message.type = echorama::VoxelTypeOf(input.Intensity);
  const auto* voxels = static_cast<const unsigned char*>(input.Intensity->GetVoidPointer(0));
  message.voxels = std::make_shared<const std::vector<unsigned char>>(voxels, voxels + message.geometry.VoxelCount() *
                                                                                           echorama::SizeOf(message.type));

  // 2. to whom it may concern
  echorama::OpenIgtLinkServer& server = this->Listen();
  const auto wait = [&progress, longest = this->WaitSeconds](double from, const std::function<bool(double)>& done) {
    const double start = echorama::ClockNow();
    double left = longest;
    while (!done(std::min(left, 0.1)) && (left = start + longest - echorama::ClockNow()) > 0.0) {
      progress(from + 0.5 * (1.0 - left / longest));
    }
  };
  progress(0.0);
  wait(0.0, [&server](double seconds) { return server.WaitForClient(seconds); });
  server.SendImage(message);
  wait(0.5, [&server](double seconds) { return server.Flush(seconds); });
  progress(1.0);

  // 3. what goes out
  output->ShallowCopy(image);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundOpenIGTLinkSender::Start()
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress&) { this->Listen(); }) != 0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundOpenIGTLinkSender::SendTransform(const char* name, vtkMatrix4x4* matrix)
{
  echorama::ToolPose pose;
  pose.name = name ? name : "";
  pose.time = echorama::ClockNow();
  const int signs[] = {-1, -1, 1, 1}; // L, P, S to R, A, S
  bool fine = matrix != nullptr;
  for (int i = 0; fine && i < 16; ++i) {
    const int row = i / 4, column = i % 4;
    const double value = matrix->GetElement(row, column);
    fine = std::isfinite(value) && (row < 3 || value == (column == 3 ? 1.0 : 0.0));
    pose.pose.matrix()(row, column) = this->KeepCoordinates ? value : signs[row] * signs[column] * value;
  }
  return vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
           if (!fine) {
             throw Error(Error::Kind::InvalidParameter, pose.name + ": the matrix is not affine, or not finite");
           }
           this->Listen().Send(pose);
         }) != 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundOpenIGTLinkSender::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "ListeningPort: " << this->GetListeningPort() << "\n";
}
