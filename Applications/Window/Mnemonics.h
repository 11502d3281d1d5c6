// SPDX-License-Identifier: BSD-3-Clause
#pragma once

class QMenu;

namespace echorama {

/// Gives every entry of a menu and its submenus that has no letter to choose it by the first of its letters that is free, and a
/// free one to those that share theirs. In any language.
void AddMnemonics(QMenu* menu);

} // namespace echorama
