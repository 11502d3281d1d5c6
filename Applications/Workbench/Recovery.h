// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

class FileActions;
class Workbench;

/// Offers the newest session that ended without being saved (a crash, a power cut), if there is one.
void OfferAbandoned(Workbench* bench, FileActions* files);

} // namespace echorama
