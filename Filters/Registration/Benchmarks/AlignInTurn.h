// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Registration/Benchmarks/AlignSearch.h"

namespace echorama {

/// Aligns any number of volumes, one after the other, with those already placed.
///
/// The volume number \a fixed stays where it is. Then, in turn, the volume that overlaps the placed ones most (where it
/// is, before it is moved) is aligned with all of them together by AlignSearch, and is placed itself. Ties go to the
/// first. An error of one volume is carried on to those placed after it.
/// \returns one result per volume; the fixed one has its own pose, no error, no evaluations and an empty trace.
/// \throws Error(InvalidParameter) when \a fixed is not a volume, Error(BadInput) for fewer than two volumes, and what
/// AlignSearch throws.
std::vector<AlignSearchResult> AlignInTurn(std::vector<PlacedVolume> volumes, int fixed,
                                           const AlignSearchParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
