// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// From version 9.4 on (ParaView 5.13) VTK's own headers bring a copy of JSON for Modern C++ and a macro that renames its
// namespace. Classes in ParaView take that copy: else they would have half of either.
#if __has_include(<vtk_nlohmannjson.h>)
#include <vtk_nlohmannjson.h>
#include VTK_NLOHMANN_JSON(json.hpp)
#else
#include <nlohmann/json.hpp>
#endif
