// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>
#include <istream>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace echorama {

using DicomTag = std::uint32_t; ///< group and element

/// Where the value of an element of the outermost data set lies.
struct DicomPlace {
  std::uint64_t offset = 0, bytes = 0;
};

/// What is kept of a data set. Values that are missing or of another form are empty.
struct DicomData {
  std::map<DicomTag, std::string> values;
  std::map<DicomTag, std::vector<DicomData>> sequences;

  std::string Text(DicomTag tag) const;
  /// \a count numbers written as text, separated by backslashes (DS, IS).
  std::vector<double> Decimals(DicomTag tag, std::size_t count) const;
  std::optional<double> Decimal(DicomTag tag) const;
  /// Of the element with this number that a private creator has reserved, by the creator's name.
  std::vector<double> PrivateDecimals(std::uint32_t group, std::uint32_t element, const std::string& creator,
                                      std::size_t count) const;
  /// \a count numbers in binary, little endian as this machine.
  template <class T>
  std::vector<T> Binary(DicomTag tag, std::size_t count) const;
  std::optional<double> Double(DicomTag tag) const;
  int Short(DicomTag tag, int otherwise) const;
  /// nullptr: it is not there
  const std::vector<DicomData>* Sequence(DicomTag tag) const;
};

/// All elements of a file but its pixels.
struct DicomElements {
  std::string transferSyntax;
  DicomData data;
  DicomPlace pixels, kretz; ///< in the file, or in its inflated data set
  bool encapsulated = false, deflated = false;
};

/// The bytes before the first element: a preamble and "DICM".
constexpr std::uint64_t DicomPreamble = 132;

// The sequences with the attributes of all pictures of an enhanced object, and of each; calibrated regions.
constexpr DicomTag DicomSharedGroups = 0x52009229, DicomPictureGroups = 0x52009230, DicomRegions = 0x00186011;

/// Parses a file of \a bytes bytes that begins like DICOM. Every length is compared with the bytes that are there (in a deflated
/// file: that can be there) before anything is allocated for it. A deflated file is read up to its pixels.
/// \throws Error(BadFile) that names the file and what is wrong.
DicomElements ReadDicomElements(std::istream& stream, std::uint64_t bytes, const std::string& path);

/// Reads \a bytes bytes from \a offset on of the data set of a deflated file. \throws Error(BadFile) when they are not there.
void ReadInflatedDicom(const std::string& path, std::uint64_t offset, char* out, std::uint64_t bytes);

template <class T>
std::vector<T> DicomData::Binary(DicomTag tag, std::size_t count) const
{
  const auto found = values.find(tag);
  if (found == values.end() || found->second.size() != count * sizeof(T))
    return {};
  std::vector<T> numbers(count);
  std::memcpy(numbers.data(), found->second.data(), count * sizeof(T));
  if constexpr (std::is_floating_point_v<T>)
    for (const T number : numbers)
      if (!std::isfinite(number))
        return {};
  return numbers;
}

} // namespace echorama
