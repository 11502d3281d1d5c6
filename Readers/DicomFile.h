// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <memory>
#include <string>

namespace echorama {

/// Whether a folder holds DICOM: one of its first files (by name) is.
bool IsDicomFolder(const std::string& path);

/// Opens a DICOM file, a series by any one of its slices, or a folder that holds one series. What is read:
///
/// * objects with functional groups (Enhanced US Volume): their pictures are placed by the patient's planes or, where there
///   are none, by the volume's, in the scanner's own frame; pictures that are no tissue intensities are left out; a temporal
///   position makes a time series. Volume to Transducer becomes probeToWorld (their x is our x, their y our z);
/// * slices in a file each, of one SeriesInstanceUID, sorted along their normal; the others are looked for in the folder. A
///   temporal position makes a time series, too; trigger times may be those of volumes or each slice's own;
/// * files of several frames that say that these are counted by space and how far apart; Cartesian volumes of Philips (QLAB's
///   export and Affiniti) by private elements that are publicly known;
/// * GE Kretz files inside DICOM (private element (7FE1,1101)), as OpenKretz reads them;
/// * a single picture, as one slice.
///
/// Slices must be evenly spaced, to a thousandth. Pixels of 8, 16 and 32 bits, compressed in any way that gdcm decodes;
/// MONOCHROME1 is inverted, colours become luminance, and a rescale makes floats. What names a person, an institution or a
/// day is not kept.
///
/// \throws Error(BadFile) that names the file and what is wrong: cines of a plane over time, missing slices, several series,
/// data that end early; Error(FileSystem), Error(TooLarge).
std::unique_ptr<VolumeSource> OpenDicom(const std::string& path, const VolumeReadParameters& parameters = {});

} // namespace echorama
