// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// JSON for Modern C++, for kernels, classes and programs alike. What is compiled for ParaView names another place
// (Plugin/VtkJson.h).
#ifdef ECHORAMA_JSON
#include ECHORAMA_JSON
#else
#include <nlohmann/json.hpp>
#endif
