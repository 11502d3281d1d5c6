// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>

namespace echorama {

/// The address of the function \a name in \a library, one of ours that is loaded when it is first needed, and stays: what it
/// brings with it costs more time than all who do not need it shall spend. It lies beside the library of this very function,
/// wherever that was put; else it is looked for where the system looks. \throws Error(NotPossible): "what: ...", with the
/// loader's reason, which names what is missing.
void* LoadedAddress(const std::string& library, const std::string& name, const std::string& what);

/// The same as a pointer to a function of a type: LoadedFunction<int(double)>("libEchoramaSome.so", "EchoramaSome", path)(0.5).
template <class Function>
Function* LoadedFunction(const std::string& library, const std::string& name, const std::string& what)
{
  return reinterpret_cast<Function*>(LoadedAddress(library, name, what));
}

} // namespace echorama
