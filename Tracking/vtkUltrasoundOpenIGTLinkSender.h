// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundOpenIGTLinkSender
 * @brief gives a volume to 3D Slicer and every other OpenIGTLink client that is connected
 *
 * Input 0: vtkImageData with `Intensity` (else the active scalars). Output: the same, untouched. Each update sends the volume as
 * an IMAGE to all clients; those that connect later get the newest one at once. The time is `TimeStamp`, else now. Voxels that
 * are not valid are sent as they are.
 *
 * It is the server: peers connect to its port, which is open to this machine alone unless Host says otherwise. It listens
 * from the first update, SendTransform() or Start() until Stop() or its end.
 *
 * Our coordinates are L, P, S; OpenIGTLink's images are R, A, S, and so the volume is turned on its way, see KeepCoordinates.
 *
 * Errors, as error events with an empty output: a port that is taken, a host that is not this machine's, a name of more than 20
 * bytes, a volume of 2 GiB or more or with more than 65535 voxels along an axis.
 *
 * @sa vtkUltrasoundTrackerSource
 */
#ifndef vtkUltrasoundOpenIGTLinkSender_h
#define vtkUltrasoundOpenIGTLinkSender_h

#include "EchoramaTrackingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Tracking/Devices/OpenIgtLinkServer.h"
#endif

class vtkMatrix4x4;

class ECHORAMATRACKING_EXPORT vtkUltrasoundOpenIGTLinkSender : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundOpenIGTLinkSender* New();
  vtkTypeMacro(vtkUltrasoundOpenIGTLinkSender, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Listens from now on. Returns false, with an error event, when that is not possible. Does nothing when it does already. */
  bool Start();
  /** Closes the port and all connections. */
  void Stop() { this->Server.reset(); }

  /**
   * Sends a named transform to all clients, such as ProbeToTracker or VolumeToReference; in mm, as KeepCoordinates says. Returns
   * false, with an error event, for a name that is empty or has more than 20 bytes, or a matrix that is not finite or
   * not affine.
   */
  bool SendTransform(const char* name, vtkMatrix4x4* matrix);

  /** Waits for up to \a seconds until all has been handed over. Returns whether it has. */
  bool Flush(double seconds) { return !this->Server || this->Server->Flush(seconds); }

  /** The port it listens at; 0 when it does not. */
  int GetListeningPort() { return this->Server ? this->Server->Port() : 0; }
  /** The clients that are connected. */
  int GetNumberOfClients() { return static_cast<int>(this->Statistics().clients); }
  /** Messages that went out whole, over all clients, since Start(). */
  vtkIdType GetNumberOfSentMessages() { return static_cast<vtkIdType>(this->Statistics().sent); }
  /** Messages that slow clients did not take in time, and volumes that a newer one replaced on their way. */
  vtkIdType GetNumberOfDroppedMessages() { return static_cast<vtkIdType>(this->Statistics().dropped); }

  // BEGIN parameters
  /**
   * Where it listens: 127.0.0.1 for this machine alone, 0.0.0.0 for all that can reach it (OpenIGTLink knows no passwords).
   * Default 127.0.0.1.
   */
  vtkUltrasoundTextMacro(Host);

  /** The port that clients connect to; 0 takes one that is free. In [0, 65535]; default 18944. */
  vtkUltrasoundIntegerMacro(Port);

  /** What the volume is called there: 1 to 20 bytes. Default Volume. */
  vtkUltrasoundTextMacro(DeviceName);

  /**
   * Whether volume and transforms are sent with their own numbers, so that they lie where the poses of a tracker lie that 3D
   * Slicer is given as they are. Off: both are turned from L, P, S to R, A, S, so that patients lie in 3D Slicer as they should.
   * Default off.
   */
  vtkUltrasoundSwitchMacro(KeepCoordinates);

  /**
   * How long an update waits for a first client when there is none, and then again until the volume has been handed over. For
   * scripts that end after their update. In [0, 3600] s; default 0.
   */
  vtkUltrasoundNumberMacro(WaitSeconds);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundOpenIGTLinkSender();
  ~vtkUltrasoundOpenIGTLinkSender() override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundOpenIGTLinkSender(const vtkUltrasoundOpenIGTLinkSender&) = delete;
  void operator=(const vtkUltrasoundOpenIGTLinkSender&) = delete;

#ifndef __VTK_WRAP__
  echorama::OpenIgtLinkServer& Listen(); ///< a server as is wanted; throws what it throws
  echorama::OpenIgtLinkServerStatistics Statistics() const
  {
    return this->Server ? this->Server->Statistics() : echorama::OpenIgtLinkServerStatistics();
  }

  echorama::OpenIgtLinkServerParameters Wanted, Served; // Served: of the server
  std::string DeviceName = "Volume";
  bool KeepCoordinates = false;
  double WaitSeconds = 0.0;
  std::unique_ptr<echorama::OpenIgtLinkServer> Server;
#endif
};

#endif
