// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QString>

class QWidget;

namespace echorama {

class Workbench;

/// What a person has chosen once for all: words, kept in the settings.
struct Preferences {
  QString colours = "many"; ///< a name of TintSets()
  QString theme = "dark";   ///< of ThemeNames()
  QString language;         ///< "de"; empty: that of the system

  static Preferences Kept();
  void Keep() const;
};

/// Applies to the session: volumes get tints of the chosen set.
void Apply(const Preferences& preferences, Workbench* bench);

/// The dialog; one per \a window. What is chosen is kept and applied at once.
void ShowPreferences(QWidget* window, Workbench* bench);

} // namespace echorama
