// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

class FileActions;
class Workbench;

/// Offers the sessions that ended without being saved (a crash, a power cut), the newest first, one at a time.
void OfferAbandoned(Workbench* bench, FileActions* files);

} // namespace echorama
