// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Utf8.h"
#include <stdexcept>
#include <string>

namespace echorama {

/// Why a kernel did not return a value. The message is a whole sentence that names the file or parameter and the reason;
/// what it quotes of a file is made printable.
class Error : public std::runtime_error {
public:
  enum class Kind {
    InvalidParameter, ///< a parameter is outside its documented range
    BadInput,         ///< the data cannot be worked on: wrong sizes, nothing valid, constant, not finite
    BadFile,          ///< a file is not what it says it is
    FileSystem,       ///< a path cannot be read or written
    NotPossible,      ///< the question has no answer: no overlap, too little overlap, singular system
    TooLarge,         ///< the result would not fit in memory
    Cancelled,        ///< the caller's Progress asked to stop
  };

  Error(Kind kind, const std::string& message) : std::runtime_error(Printable(message)), kind_(kind) {}
  Kind GetKind() const { return kind_; }

private:
  Kind kind_;
};

/// \throws Error(BadFile): the path, and why it cannot be read.
[[noreturn]] inline void FailFile(const std::string& path, const std::string& reason)
{
  throw Error(Error::Kind::BadFile, path + ": " + reason);
}

} // namespace echorama
