// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "JobPanel.h"
#include "ResultRecipe.h"
#include "Workspace.h"
#include <vector>
#include <vtkSmartPointer.h>

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QToolButton;
class vtkImageData;

namespace echorama {

class ParameterPanel;

/// Makes one volume of others: stitched, and on request embedded in a background. It becomes a volume of the session, linked to
/// its sources: when they change the panel says so, and makes it again. A preview is made of voxels twice as large, and the
/// full result takes its place.
class ResultPanel : public JobPanel {
  Q_OBJECT

public:
  explicit ResultPanel(Workspace& workspace, QWidget* parent = nullptr);

  /// The result that is made next; 0: a new volume.
  int Target() const { return target_; }
  /// Shows how it was made, and makes this one from now on.
  void SetTarget(int id);
  /// Writes the target in the background; the extension names the format.
  void Save(const QString& path);

public slots:
  void Make(bool preview);
  /// Of the sources that are still there, as it was made before.
  void MakeAgain(int id);
  /// From a result to its sources, and back.
  void Compare();
  void ShowResults();

signals:
  /// A volume that was not there before.
  void Made(int id);

private:
  void MakeFields();
  QWidget* MoreFields();
  void Arrange();
  void TakeFields();
  void ShowFields();
  void ShowForms();
  void ShowState() override;
  void Begin(int target, const std::vector<int>& sources, const ResultRecipe& recipe);
  void Put(int target, const std::vector<int>& sources, const std::string& record, vtkImageData* image);
  std::vector<int> Sources(int target) const;
  int Compared() const;
  QString NameOf(int id) const;

  ResultRecipe recipe_;
  int target_ = 0;
  QComboBox *into_, *method_, *texture_, *form_ = nullptr;
  QDoubleSpinBox *spacing_, *margin_;
  QCheckBox *gain_, *deformable_, *embed_, *takesResults_ = nullptr;
  QLineEdit* noise_ = nullptr;
  QToolButton* more_;
  QWidget *moreStitch_ = nullptr, *moreEmbed_ = nullptr, *moreBox_;
  ParameterPanel *stitchMore_ = nullptr, *embedMore_ = nullptr;
  QPushButton *preview_, *make_, *again_, *compare_, *save_;
  QLabel *of_, *text_, *changed_;
};

} // namespace echorama
