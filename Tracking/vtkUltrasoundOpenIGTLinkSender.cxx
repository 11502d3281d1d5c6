// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundOpenIGTLinkSender.h"

#include "Readers/vtkUltrasoundVoxelTypes.h"
#include "Tracking/Devices/OpenIgtLinkServer.h"
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

struct vtkUltrasoundOpenIGTLinkSender::Internals {
  echorama::OpenIgtLinkServerParameters Wanted, Running; // Running: of the server
  std::string DeviceName = "Volume";
  bool KeepCoordinates = false;
  double WaitSeconds = 0.0;
  std::unique_ptr<echorama::OpenIgtLinkServer> Server;

  // A server as is wanted. Throws what it throws.
  echorama::OpenIgtLinkServer& Listen()
  {
    this->Wanted.turnImages = !this->KeepCoordinates;
    if (!this->Server || this->Wanted.host != this->Running.host || this->Wanted.port != this->Running.port ||
        this->Wanted.turnImages != this->Running.turnImages) {
      this->Server.reset(); // its port may be the same
      auto server = std::make_unique<echorama::OpenIgtLinkServer>(this->Wanted);
      server->Start();
      this->Server = std::move(server);
      this->Running = this->Wanted;
    }
    return *this->Server;
  }
};

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::vtkUltrasoundOpenIGTLinkSender() : Parts(std::make_unique<Internals>()) {}

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::~vtkUltrasoundOpenIGTLinkSender() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundOpenIGTLinkSender::Parameters()
{
  using echorama::Parameter;
  Internals& v = *this->Parts;
  return echorama::Join(
      {echorama::Without(Describe(v.Wanted), {"Clients", "QueuedBytes", "RememberedImages"}),
       {Parameter("DeviceName", v.DeviceName, "What the volume is called there: 1 to 20 bytes."),
        Parameter(
            "KeepCoordinates", v.KeepCoordinates,
            "Whether volume and transforms are sent with their own numbers, so that they lie where the poses of a tracker lie "
            "that 3D Slicer is given as they are. Off: both are turned from L, P, S to R, A, S, so that patients lie in 3D "
            "Slicer as they should.")
            .Advanced(),
        Parameter(
            "WaitSeconds", v.WaitSeconds, {0, 3600}, "s",
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
  message.name = this->Parts->DeviceName;
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
  echorama::OpenIgtLinkServer& server = this->Parts->Listen();
  const auto wait = [&progress, longest = this->Parts->WaitSeconds](double from, const std::function<bool(double)>& done) {
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
  try {
    this->Parts->Listen();
  } catch (const Error& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundOpenIGTLinkSender::Stop()
{
  this->Parts->Server.reset();
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
    pose.pose.matrix()(row, column) = this->Parts->KeepCoordinates ? value : signs[row] * signs[column] * value;
  }
  if (!fine) {
    vtkErrorMacro(<< pose.name << ": the matrix is not affine, or not finite");
    return false;
  }
  try {
    this->Parts->Listen().Send(pose);
  } catch (const Error& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundOpenIGTLinkSender::Flush(double seconds)
{
  return !this->Parts->Server || this->Parts->Server->Flush(seconds);
}

//----------------------------------------------------------------------------
int vtkUltrasoundOpenIGTLinkSender::GetListeningPort()
{
  return this->Parts->Server ? this->Parts->Server->Port() : 0;
}

//----------------------------------------------------------------------------
int vtkUltrasoundOpenIGTLinkSender::GetNumberOfClients()
{
  return this->Parts->Server ? static_cast<int>(this->Parts->Server->Statistics().clients) : 0;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundOpenIGTLinkSender::GetNumberOfSentMessages()
{
  return this->Parts->Server ? static_cast<vtkIdType>(this->Parts->Server->Statistics().sent) : 0;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundOpenIGTLinkSender::GetNumberOfDroppedMessages()
{
  return this->Parts->Server ? static_cast<vtkIdType>(this->Parts->Server->Statistics().dropped) : 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundOpenIGTLinkSender::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "ListeningPort: " << this->GetListeningPort() << "\n";
}
