// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Json.h"
#include "Core/Base/Parameters.h"

namespace echorama {

/// The value: a number, true or false, a text, a choice by its name, three numbers.
nlohmann::ordered_json JsonOf(const Parameter& parameter);

/// Each value under its Key().
nlohmann::ordered_json JsonOf(const ParameterList& parameters);

} // namespace echorama
