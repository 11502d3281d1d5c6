// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// JSON for Modern C++, for kernels, classes and programs alike. From version 9.4 on (ParaView 5.13) VTK's own headers bring a
// copy of the library, and a macro that renames its namespace: classes in ParaView take that copy, or there would be half of
// either.
#if defined(ECHORAMA_FOR_PARAVIEW) && __has_include(<vtk_nlohmannjson.h>)
#include <vtk_nlohmannjson.h>
#include VTK_NLOHMANN_JSON(json.hpp)
#else
#include <nlohmann/json.hpp>
#endif
