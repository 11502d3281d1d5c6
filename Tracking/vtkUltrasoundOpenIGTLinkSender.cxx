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

struct vtkUltrasoundOpenIGTLinkSender::Internals {
  std::unique_ptr<echorama::OpenIgtLinkServer> Server;
  echorama::OpenIgtLinkServerParameters Parameters; // of the server that runs

  // A server as the parameters say. Throws what it throws.
  echorama::OpenIgtLinkServer& Listen(const echorama::OpenIgtLinkServerParameters& wanted)
  {
    const bool same = this->Server && wanted.host == this->Parameters.host && wanted.port == this->Parameters.port &&
                      wanted.turnImages == this->Parameters.turnImages;
    if (!same) {
      this->Server.reset(); // its port may be the same
      auto server = std::make_unique<echorama::OpenIgtLinkServer>(wanted);
      server->Start();
      this->Server = std::move(server);
      this->Parameters = wanted;
    }
    return *this->Server;
  }
  echorama::OpenIgtLinkServer& Listen(vtkUltrasoundOpenIGTLinkSender* sender)
  {
    echorama::OpenIgtLinkServerParameters parameters;
    parameters.host = sender->Host ? sender->Host : "";
    parameters.port = sender->Port;
    parameters.turnImages = !sender->KeepCoordinates;
    return this->Listen(parameters);
  }
};

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::vtkUltrasoundOpenIGTLinkSender() : Parts(std::make_unique<Internals>())
{
  const echorama::OpenIgtLinkServerParameters defaults;
  this->SetHost(defaults.host.c_str());
  this->Port = defaults.port;
  this->SetDeviceName("Volume");
}

//----------------------------------------------------------------------------
vtkUltrasoundOpenIGTLinkSender::~vtkUltrasoundOpenIGTLinkSender()
{
  this->SetHost(nullptr);
  this->SetDeviceName(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundOpenIGTLinkSender::Execute(vtkInformationVector** inputs, vtkImageData* output,
                                             const echorama::Progress& progress)
{
  // 1. what came in
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  echorama::StreamedImage message;
  message.name = this->DeviceName ? this->DeviceName : "";
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
  echorama::OpenIgtLinkServer& server = this->Parts->Listen(this);
  const auto wait = [&](double from, const std::function<bool(double)>& done) {
    const double start = echorama::ClockNow();
    double left = this->WaitSeconds;
    while (!done(std::min(left, 0.1)) && (left = start + this->WaitSeconds - echorama::ClockNow()) > 0.0) {
      progress(from + 0.5 * (1.0 - left / this->WaitSeconds));
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
    this->Parts->Listen(this);
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
    pose.pose.matrix()(row, column) = this->KeepCoordinates ? value : signs[row] * signs[column] * value;
  }
  if (!fine) {
    vtkErrorMacro(<< pose.name << ": the matrix is not affine, or not finite");
    return false;
  }
  try {
    this->Parts->Listen(this).Send(pose);
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
  os << indent << "Host: " << (this->Host ? this->Host : "(none)") << "\n";
  os << indent << "Port: " << this->Port << "\n";
  os << indent << "DeviceName: " << (this->DeviceName ? this->DeviceName : "(none)") << "\n";
  os << indent << "KeepCoordinates: " << this->KeepCoordinates << "\n";
  os << indent << "WaitSeconds: " << this->WaitSeconds << "\n";
  os << indent << "ListeningPort: " << this->GetListeningPort() << "\n";
}
