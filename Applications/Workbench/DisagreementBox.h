// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "JobPanel.h"
#include <array>
#include <memory>
#include <vector>
#include <vtkSmartPointer.h>

class QCheckBox;
class QDoubleSpinBox;
class QLabel;
class QPushButton;
class vtkImageData;

namespace echorama {

struct DisagreementMap;
class Workbench;

/// How far the volumes that are shown are from agreeing, place by place (Filters/Registration/Disagreement.h): found in the
/// background, laid over the slices, told in numbers. When volumes have moved since, it says so, and is no longer trusted.
class DisagreementBox : public JobPanel {
  Q_OBJECT

public:
  explicit DisagreementBox(Workbench* bench, QWidget* parent = nullptr);
  ~DisagreementBox() override;

public slots:
  void Find();

private:
  /// A volume as it was compared.
  struct Compared {
    int id = 0;
    std::array<double, 16> pose{};
    const void* strokes = nullptr;
    bool operator==(const Compared& other) const { return id == other.id && pose == other.pose && strokes == other.strokes; }
  };
  struct Found;
  std::vector<Compared> Now() const;
  void Take(const std::shared_ptr<Found>& found);
  void ShowMap();
  void ShowHere();
  void ShowState() override;

  Workbench* bench_;
  QPushButton* find_;
  QCheckBox* shown_;
  QDoubleSpinBox *scale_, *search_, *block_;
  QLabel *text_, *here_;
  std::shared_ptr<Found> found_;
  vtkSmartPointer<vtkImageData> picture_;
};

} // namespace echorama
