// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkSMUltrasoundSourceProxy
 * @brief a filter in ParaView whose information properties are as new as its data
 *
 * ParaView asks for them when a filter is made, and not again when it has run. A handle that is placed by one (the box of the
 * Ultrasound Pose Editor) follows with this proxy: <UltrasoundSourceProxy> instead of <SourceProxy> in the XML.
 */
#ifndef vtkSMUltrasoundSourceProxy_h
#define vtkSMUltrasoundSourceProxy_h

#include "EchoramaPluginServerManagerModule.h"
#include "vtkSMSourceProxy.h"

class ECHORAMAPLUGINSERVERMANAGER_EXPORT vtkSMUltrasoundSourceProxy : public vtkSMSourceProxy {
public:
  static vtkSMUltrasoundSourceProxy* New();
  vtkTypeMacro(vtkSMUltrasoundSourceProxy, vtkSMSourceProxy);

protected:
  vtkSMUltrasoundSourceProxy() = default;
  ~vtkSMUltrasoundSourceProxy() override = default;

  void PostUpdateData(bool usingCache) override;

private:
  vtkSMUltrasoundSourceProxy(const vtkSMUltrasoundSourceProxy&) = delete;
  void operator=(const vtkSMUltrasoundSourceProxy&) = delete;
};

#endif
