// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <functional>
#include <QString>
#include <QWidget>
#include <vector>

namespace echorama {

/// Controls for described parameters: a slider with its number, a switch or a choice each, which are enabled while they matter.
class ParameterPanel : public QWidget {
  Q_OBJECT

public:
  /// The parameters as they are now.
  using Source = std::function<ParameterList()>;

  /// A parameter, what it is called, and what its slider spans (nothing: its range); the number beside it takes the whole range.
  struct Control {
    const char* name;
    QString label;
    double low = 0.0, high = 0.0;
    QString least = {};        ///< a word for the lowest value
    const char* onlyWhen = ""; ///< of the values that it matters with, the one that counts here; "": all
    QString unit = {};         ///< where that of the parameter is too long
  };

  /// \param controls which, in this order
  /// \param set changes one; what it refuses is not shown
  ParameterPanel(Source source, const std::vector<Control>& controls,
                 std::function<void(const char* name, const std::string& text)> set, QWidget* parent = nullptr);

  /// Shows the values as they are now, calling nobody.
  void ShowValues();

private:
  QWidget* MakeField(const Parameter& parameter, const Control& control);
  QWidget* MakeNumber(const Parameter& parameter, const Control& control);
  void Set(const Parameter& parameter, const std::string& text);

  Source source_;
  std::function<void(const char*, const std::string&)> set_;
  std::vector<std::function<void(ParameterList&)>> shows_;
};

} // namespace echorama
