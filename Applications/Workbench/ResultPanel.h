// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "JobPanel.h"
#include "Workspace.h"
#include <vtkSmartPointer.h>

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QPushButton;
class vtkImageData;

namespace echorama {

/// Makes one volume of those that are shown: stitched, and on request embedded in a background. A preview is made of voxels twice
/// as large. The result is shown in a session of its own, beside the volumes, and can be saved; the volumes stay as they are.
class ResultPanel : public JobPanel {
  Q_OBJECT

public:
  explicit ResultPanel(Workspace& workspace, QWidget* parent = nullptr);

  /// A workspace of its own, whose session holds the result and nothing else.
  Workspace& Result() { return result_; }
  /// Puts the view of the result into the panel.
  void SetView(QWidget* view);
  /// Writes the result in the background; the extension names the format.
  void Save(const QString& path);

signals:
  void ResultChanged();

public slots:
  void Make(bool preview);

private:
  void Show(vtkImageData* volume, const QString& text);
  void ShowState() override;

  Workspace result_;
  vtkSmartPointer<vtkImageData> volume_;
  QComboBox *method_, *texture_;
  QDoubleSpinBox *spacing_, *margin_;
  QCheckBox *gain_, *deformable_, *embed_;
  QPushButton *preview_, *make_, *save_;
  QLabel* text_;
};

} // namespace echorama
