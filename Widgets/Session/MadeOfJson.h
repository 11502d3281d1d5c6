// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/JsonPlace.h"
#include "Widgets/Session/MadeOf.h"

namespace echorama {

/// What a volume was made of, as JSON, for the files that hold it. To be named in .cxx files only.
namespace MadeOfJson {

JsonPlace::Json Of(const MadeOf& madeOf);
/// \throws Error(BadFile) that names \a place and the field.
MadeOf ToMadeOf(const JsonPlace::Json& value, const JsonPlace& place);

} // namespace MadeOfJson
} // namespace echorama
