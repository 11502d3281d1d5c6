// SPDX-License-Identifier: BSD-3-Clause
// A sequence is one large array with a long header: frame after frame of pixels, and ten lines or so of text per frame.
//
// Opening passes over the text once. What it says goes to flat lists of (frame, name, value), one per kind of value, with
// every name stored once; the lists are sorted by frame where the file was not, and looked up by bisection. So neither time
// nor memory depends on what a header promises, only on its length.
//
// Pixels: a raw frame is one seek and one read. A compressed stream can only be passed forwards; on the way its decoder's
// state is kept at multiples of a number of frames, which is doubled (and every second state dropped) when there are more
// than 256 of them. A jump then costs the decompression of one such stretch, 1/256 of the file at most, and the memory
// stays the same. Interleaved frames cost a pass over the file each, so that as many as 64 MB hold are taken in one pass.
#include "Readers/SequenceFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Words.h"
#include "Readers/ByteOrder.h"
#include "Readers/Compression.h"
#include "Readers/DataFile.h"
#include "Readers/FrameOrientation.h"
#include "Readers/HeaderLines.h"
#include "Readers/SequenceText.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <unordered_map>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr std::size_t MostMoments = 256;              // of a decoder, 40 kB each
constexpr std::uint64_t FirstStretch = 1u << 18;      // bytes between two of them at first
constexpr std::uint64_t InterleavedBytes = 64u << 20; // of frames that are taken from an interleaved file in one pass
constexpr std::uint64_t PassBytes = 4u << 20;         // of such a file that are looked at together

bool EndsWith(std::string_view text, std::string_view end)
{
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::string Upper(std::string_view text)
{
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  return upper;
}

// Strings that come again and again, as numbers.
class Names {
public:
  std::uint32_t Number(std::string_view name)
  {
    const auto [place, fresh] = numbers_.try_emplace(std::string(name), static_cast<std::uint32_t>(names_.size()));
    if (fresh)
      names_.push_back(&place->first);
    return place->second;
  }
  const std::string& operator[](std::uint32_t number) const { return *names_[number]; }
  std::size_t Count() const { return names_.size(); }

private:
  std::unordered_map<std::string, std::uint32_t> numbers_;
  std::vector<const std::string*> names_;
};

template <class Value>
struct Entry {
  std::int32_t frame;
  std::uint32_t name;
  Value value;
};

// What frames have under some names, at most one value each.
template <class Value>
class FrameValues {
public:
  void Add(std::int32_t frame, std::uint32_t name, Value value) { entries_.push_back({frame, name, std::move(value)}); }

  // Sorts by frame and drops repetitions. \returns an entry that contradicts an earlier one, or nullptr.
  const Entry<Value>* Sort(std::size_t names)
  {
    const auto before = [](const auto& a, const auto& b) { return a.frame < b.frame; };
    if (!std::is_sorted(entries_.begin(), entries_.end(), before))
      std::stable_sort(entries_.begin(), entries_.end(), before);
    std::vector<std::size_t> latest(names, entries_.size()); // where each name was seen last
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const std::size_t seen = latest[entries_[i].name];
      if (seen < kept && entries_[seen].frame == entries_[i].frame) {
        if (!(entries_[seen].value == entries_[i].value))
          return &entries_[i];
        continue;
      }
      latest[entries_[i].name] = kept;
      if (kept != i)
        entries_[kept] = std::move(entries_[i]);
      ++kept;
    }
    entries_.resize(kept);
    entries_.shrink_to_fit();
    return nullptr;
  }

  const std::vector<Entry<Value>>& All() const { return entries_; }

  // The entries of a frame, as a pair of iterators.
  auto Of(std::int32_t frame) const
  {
    const auto begin =
        std::lower_bound(entries_.begin(), entries_.end(), frame, [](const auto& e, int f) { return e.frame < f; });
    auto end = begin;
    while (end != entries_.end() && end->frame == frame)
      ++end;
    return std::make_pair(begin, end);
  }

  // That of a frame, where all have one name; or nullptr.
  const Value* Only(std::int32_t frame) const
  {
    const auto [begin, end] = Of(frame);
    return begin == end ? nullptr : &begin->value;
  }

private:
  std::vector<Entry<Value>> entries_;
};

// The first three rows of a matrix, and what is wrong with it.
struct Matrix {
  std::array<double, 12> rows{};
  const char* fault = nullptr;

  bool operator==(const Matrix& other) const { return fault == other.fault && rows == other.rows; }
};

Matrix ParseMatrix(std::string_view text)
{
  Matrix matrix;
  const std::vector<std::string_view> words = SplitWords(text);
  std::array<double, 16> numbers{};
  bool parsed = words.size() == numbers.size();
  for (std::size_t i = 0; parsed && i < numbers.size(); ++i)
    parsed = ParseNumber(words[i], numbers[i]) && std::isfinite(numbers[i]);
  if (!parsed) {
    matrix.fault = "its matrix is not 16 finite numbers";
    return matrix;
  }
  std::copy_n(numbers.begin(), 12, matrix.rows.begin());
  // Programs write the last row with rounding: -0 0 -0 1.
  if (std::fabs(numbers[12]) > 1e-9 || std::fabs(numbers[13]) > 1e-9 || std::fabs(numbers[14]) > 1e-9 ||
      std::fabs(numbers[15] - 1.0) > 1e-9) {
    matrix.fault = "the last row of its matrix is not 0 0 0 1";
    return matrix;
  }
  Eigen::Matrix3d axes;
  for (Eigen::Index row = 0; row < 3; ++row)
    for (Eigen::Index column = 0; column < 3; ++column)
      axes(row, column) = numbers[static_cast<std::size_t>(4 * row + column)];
  for (Eigen::Index column = 0; column < 3; ++column)
    axes.col(column) /= axes.col(column).stableNorm(); // NaN for a column of zeros
  if (!(std::fabs(axes.determinant()) > 1e-9))
    matrix.fault = "its matrix is singular";
  return matrix;
}

std::string FrameSizeText(const std::array<int, 3>& size)
{
  return size[2] == 1 ? SizeText(size[0], size[1]) : SizeText(size);
}

std::string FramesText(std::int64_t frames)
{
  return std::to_string(frames) + (frames == 1 ? " frame" : " frames");
}

} // namespace

struct SequenceFile::Parts {
  SequenceContent content;
  ImageHeader header;
  bool interleaved = false;
  FrameOrientation turn;
  std::int64_t dataOffset = 0;

  Names names;
  FrameValues<double> times;              // NaN: not a finite number
  FrameValues<std::uint32_t> imageStatus; // numbers of names, as all of this type
  FrameValues<Matrix> matrices;
  FrameValues<std::uint32_t> statuses;
  FrameValues<std::string> texts;

  std::ifstream stream;
  std::unique_ptr<Inflater> inflater;
  int next = -1; // the frame at whose beginning the inflater stands, -1: not known
  std::vector<std::shared_ptr<const Inflater::State>> moments{}; // at frame 0, stretch, 2 stretch ...
  int stretch = 1;                                               // frames
  std::vector<char> batch;                                       // interleaved frames that were taken together
  int batchBegin = 0, batchEnd = 0;
  std::vector<char> scratch;

  void Take(std::int64_t frame, std::string_view key, std::string_view value);
  void CheckFields(std::int64_t frames);
  template <class Value>
  void SortFields(FrameValues<Value>& values, std::int64_t frames, const char* ending);
  void FindOrientation();
  void CheckSizes(const FrameAxis& axis);
  void NoteFaults();

  void OpenData();
  void ReadInflated(int index, char* out, const Progress& progress);
  void ReadInterleaved(int index, char* out, const Progress& progress);
};

const SequenceTransform* SequenceFrame::Find(std::string_view name) const
{
  const auto found = std::find_if(transforms.begin(), transforms.end(), [name](const auto& t) { return t.name == name; });
  return found == transforms.end() ? nullptr : &*found;
}

std::uint64_t SequenceContent::FrameBytes() const
{
  return static_cast<std::uint64_t>(dimensions[0]) * static_cast<std::uint64_t>(dimensions[1]) *
         static_cast<std::uint64_t>(dimensions[2]) * components * SizeOf(type);
}

// Sorts a field of a frame into the lists.
void SequenceFile::Parts::Take(std::int64_t frame, std::string_view key, std::string_view value)
{
  if (frame > std::numeric_limits<std::int32_t>::max())
    FailFile(content.path, "it has fields of frame " + std::to_string(frame) + ", which cannot be");
  const std::int32_t f = static_cast<std::int32_t>(frame);
  constexpr std::string_view transform = "Transform", status = "Status";
  if (EndsWith(key, transform) && FramesOf(key))
    matrices.Add(f, names.Number(key.substr(0, key.size() - transform.size())), ParseMatrix(value));
  else if (EndsWith(key, "TransformStatus") && FramesOf(key.substr(0, key.size() - status.size())))
    statuses.Add(f, names.Number(key.substr(0, key.size() - transform.size() - status.size())), names.Number(value));
  else if (key == "Timestamp") {
    double time = 0.0;
    const bool finite = ParseNumber(value, time) && std::isfinite(time);
    times.Add(f, 0, finite ? time : std::numeric_limits<double>::quiet_NaN());
  } else if (key == "ImageStatus" || key == status) // MetaImage, NRRD
    imageStatus.Add(f, 0, names.Number(value));
  else
    texts.Add(f, names.Number(key), std::string(value));
}

template <class Value>
void SequenceFile::Parts::SortFields(FrameValues<Value>& values, std::int64_t frames, const char* ending)
{
  if (const Entry<Value>* twice = values.Sort(names.Count() + 1))
    FailFile(content.path, (ending[0] == '=' ? std::string(ending + 1) : names[twice->name] + ending) +
                               " is given twice for frame " + std::to_string(twice->frame) + ", with different values");
  if (!values.All().empty() && values.All().back().frame >= frames)
    FailFile(content.path, "it has fields of frame " + std::to_string(values.All().back().frame) +
                               ", though it says that it has " + FramesText(frames) + " (counted from 0)");
}

void SequenceFile::Parts::CheckFields(std::int64_t frames)
{
  SortFields(times, frames, "=Timestamp");
  SortFields(imageStatus, frames, "=the status of the image");
  SortFields(matrices, frames, "Transform");
  SortFields(statuses, frames, "TransformStatus");
  SortFields(texts, frames, "");
}

void SequenceFile::Parts::FindOrientation()
{
  // Plus names these differently in the two formats.
  for (auto field = content.fields.begin(); field != content.fields.end();) {
    if (field->first == "UltrasoundImageOrientation" || field->first == "ultrasound image orientation")
      content.orientation = TrimBlanks(field->second);
    else if (field->first == "UltrasoundImageType" || field->first == "ultrasound image type")
      content.imageType = TrimBlanks(field->second);
    else {
      ++field;
      continue;
    }
    field = content.fields.erase(field);
  }
  content.geometry = header.geometry;
  if (!content.HasImages())
    return;
  const std::string code = Upper(content.orientation);
  if (!turn.Parse(code))
    FailFile(content.path, "its image orientation is \"" + content.orientation +
                               "\"; two or three letters are needed, one of M and U, one of F and N, one of A and D");
  const std::array<int, 3> inFile = content.dimensions;
  for (std::size_t i = 0; i < 3; ++i)
    content.dimensions[i] = inFile[static_cast<std::size_t>(turn.axis[i])];
  for (std::size_t i = 0; i < 3; ++i)
    turn.flip[i] = turn.flip[i] && content.dimensions[i] > 1; // of one sample nothing turns
  if (code.empty() || code == "XX") {
    if (!matrices.All().empty())
      content.notes.push_back("the file does not say its image orientation: MF was assumed");
    turn.flip[2] = header.reverseSlices;
    if (header.reverseSlices)
      content.notes.push_back("the axes in the file are left-handed: the slices of each frame were taken in reverse");
  } else if (!turn.IsIdentity()) {
    const bool pairs = content.imageType == "RF_IQ_LINE" || content.imageType == "RF_I_LINE_Q_LINE";
    if (pairs && (turn.flip[0] || turn.flip[1]))
      FailFile(content.path, "its frames hold pairs of numbers (" + content.imageType + ") in orientation " +
                                 content.orientation + ", which cannot be turned to MF");
    content.notes.push_back("frames were turned from " + content.orientation + " to MF orientation");
  }
  if (!content.imageType.empty() && content.imageType != "BRIGHTNESS" && content.imageType != "RGB_COLOR" &&
      content.imageType != "XX")
    content.notes.push_back("the pixels are not brightness but " + content.imageType);

  ImageGeometry& g = content.geometry;
  g.dimensions = content.dimensions;
  if (!code.empty() && code != "XX" && (!turn.IsIdentity() || header.reverseSlices)) {
    const Eigen::Vector3d spacing = g.spacing;
    for (std::size_t i = 0; i < 3; ++i)
      g.spacing[static_cast<Eigen::Index>(i)] = spacing[turn.axis[i]];
    g.origin.setZero();
    g.direction.setIdentity();
  }
}

void SequenceFile::Parts::CheckSizes(const FrameAxis& axis)
{
  const std::string& path = content.path;
  if (axis.frames < 1)
    FailFile(path, "it has no frames");
  const bool images = content.HasImages();
  const std::uint64_t bytesThere = images ? FileSize(header.dataPath) : 0;
  // A list of frames costs memory per frame, so that there must be a byte for each at the least.
  if (static_cast<std::uint64_t>(axis.frames) > static_cast<std::uint64_t>(axis.headerBytes) + bytesThere)
    FailFile(path, "it says that it has " + FramesText(axis.frames) + ", more than the bytes of the file");
  content.frames = static_cast<int>(axis.frames);
  if (!images) {
    content.dimensions = {0, 0, 1};
    return;
  }
  if (content.dimensions[2] < 1)
    FailFile(path, "its frames are of " + FrameSizeText(content.dimensions) + " pixels");
  if (!header.typeIsKnown)
    FailFile(path, "its pixels are of a type that is not supported");
  if (header.encoding == ImageHeader::Encoding::Text)
    FailFile(path, "its pixels are written as text; only binary ones are supported");
  if (content.components < 1 || content.components > 4)
    FailFile(path, "it has " + std::to_string(content.components) + " numbers per pixel; 1 to 4 are possible");
  if (interleaved && content.components != 1)
    FailFile(path, "its frames are interleaved and have several numbers per pixel, which is not supported");
  const double frame = static_cast<double>(content.dimensions[0]) * content.dimensions[1] * content.dimensions[2] *
                       static_cast<double>(content.components * SizeOf(content.type)),
               all = frame * static_cast<double>(content.frames);
  const std::uint64_t offset = static_cast<std::uint64_t>(std::max<std::int64_t>(0, header.dataOffset));
  const double there = bytesThere > offset ? static_cast<double>(bytesThere - offset) : 0.0;
  const std::string says = FramesText(content.frames) + " of " + FrameSizeText(content.dimensions) + " pixels";
  const bool raw = header.encoding == ImageHeader::Encoding::Raw;
  const bool cutOff = raw && there > all && header.dataPath != header.path &&
                      std::find(content.fields.begin(), content.fields.end(), RecorderField) != content.fields.end();
  if (cutOff)
    content.notes.push_back("the recording was cut off: the pixels of a last frame were left out");
  CheckBytes(header.dataPath, says, all, raw || header.dataOffset >= 0 ? there : 0.0, !raw, !cutOff && header.dataOffset >= 0);
  CheckMemory(path, 2.0 * frame);
  dataOffset =
      header.dataOffset >= 0 ? header.dataOffset : static_cast<std::int64_t>(bytesThere - static_cast<std::uint64_t>(all));
}

// Sentences on what cannot be used, one per name and reason, whatever the number of frames.
void SequenceFile::Parts::NoteFaults()
{
  const auto more = [](int count) { return count > 1 ? " and " + std::to_string(count - 1) + " more" : std::string(); };
  struct Fault {
    int first, count = 0;
  };
  std::map<std::pair<std::uint32_t, std::string>, Fault> faults;
  std::vector<int> valid(names.Count(), 0);
  std::vector<bool> listed(names.Count(), false);
  std::vector<int> badly(names.Count(), -1); // in which frame each was last said not to be valid
  auto status = statuses.All().begin();
  for (const auto& [frame, name, matrix] : matrices.All()) {
    if (!listed[name]) {
      listed[name] = true;
      content.transforms.push_back(names[name]);
    }
    if (matrix.fault)
      ++faults.try_emplace({name, matrix.fault}, Fault{frame}).first->second.count;
    for (; status != statuses.All().end() && status->frame <= frame; ++status)
      if (TransformStatusOf(names[status->value]) != TransformStatus::Valid)
        badly[status->name] = status->frame;
    valid[name] += !matrix.fault && badly[name] != frame;
  }
  for (const auto& [what, fault] : faults)
    content.notes.push_back(names[what.first] + "Transform was taken as INVALID in frame " + std::to_string(fault.first) +
                            more(fault.count) + ": " + what.second);
  for (const std::string& name : content.transforms)
    if (const int count = valid[names.Number(name)]; count < content.frames)
      content.notes.push_back(name + "Transform is valid in " + std::to_string(count) + " of " + FramesText(content.frames));

  int bad = 0, first = 0, untimed = 0, firstUntimed = 0;
  for (const auto& entry : imageStatus.All())
    if (Upper(names[entry.value]) != "OK" && ++bad == 1)
      first = entry.frame;
  if (bad > 0 && content.HasImages())
    content.notes.push_back("the image is marked as not valid in frame " + std::to_string(first) + more(bad));
  for (const auto& entry : times.All())
    if (std::isnan(entry.value) && ++untimed == 1)
      firstUntimed = entry.frame;
  if (untimed > 0)
    content.notes.push_back("the time is not a finite number in frame " + std::to_string(firstUntimed) + more(untimed));
}

SequenceFile::SequenceFile(const std::string& path) : parts_(new Parts)
{
  Parts& p = *parts_;
  p.content.path = path;
  FrameAxis axis;
  axis.field = [&p](std::int64_t frame, std::string_view key, std::string_view value) { p.Take(frame, key, value); };
  p.header = ReadSequenceHeader(path, axis);
  p.interleaved = axis.fastest;
  p.content.format = p.header.format;
  p.content.dimensions = p.header.geometry.dimensions;
  p.content.type = p.header.type;
  p.content.components = p.header.components;
  p.content.fields = std::move(p.header.fields);
  p.CheckFields(axis.frames);
  p.CheckSizes(axis);
  p.FindOrientation();
  p.NoteFaults();
  if (p.content.transforms.empty() && p.content.HasImages()) {
    // Only then does the geometry of the header matter.
    p.content.notes.insert(p.content.notes.end(), p.header.notes.begin(), p.header.notes.end());
    try {
      p.content.geometry.Check(path);
    } catch (const Error& error) {
      FailFile(path, std::string("it has no transforms, and its header does not place it: ") + error.what());
    }
  }
}

SequenceFile::~SequenceFile() = default;

const SequenceContent& SequenceFile::Content() const
{
  return parts_->content;
}

namespace {

void CheckIndex(const SequenceContent& content, int index)
{
  if (index < 0 || index >= content.frames)
    throw Error(Error::Kind::InvalidParameter, content.path + ": there is no frame " + std::to_string(index) + "; it has " +
                                                   FramesText(content.frames) + " (counted from 0)");
}

} // namespace

SequenceFrame SequenceFile::Frame(int index) const
{
  const Parts& p = *parts_;
  SequenceFrame frame;
  frame.time = Time(index);
  if (const std::uint32_t* status = p.imageStatus.Only(index))
    frame.imageValid = Upper(p.names[*status]) == "OK";
  frame.imageValid = frame.imageValid && p.content.HasImages();
  std::unordered_map<std::uint32_t, std::uint32_t> statuses;
  const auto [firstStatus, lastStatus] = p.statuses.Of(index);
  for (auto entry = firstStatus; entry != lastStatus; ++entry)
    statuses.emplace(entry->name, entry->value);
  const auto [begin, end] = p.matrices.Of(index);
  for (auto entry = begin; entry != end; ++entry) {
    SequenceTransform transform;
    transform.name = p.names[entry->name];
    if (const auto status = statuses.find(entry->name); status != statuses.end())
      transform.statusText = p.names[status->second];
    const Matrix& matrix = entry->value;
    if (matrix.fault) {
      if (TransformStatusOf(transform.statusText) == TransformStatus::Valid)
        transform.statusText = "INVALID";
    } else
      transform.matrix.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(matrix.rows.data());
    transform.status = TransformStatusOf(transform.statusText);
    frame.transforms.push_back(std::move(transform));
  }
  const auto [firstText, lastText] = p.texts.Of(index);
  for (auto entry = firstText; entry != lastText; ++entry)
    frame.fields.emplace_back(p.names[entry->name], entry->value);
  return frame;
}

double SequenceFile::Time(int index) const
{
  CheckIndex(parts_->content, index);
  const double* time = parts_->times.Only(index);
  return time ? *time : std::numeric_limits<double>::quiet_NaN();
}

void SequenceFile::Parts::OpenData()
{
  if (stream.is_open())
    return;
  stream = OpenToRead(header.dataPath);
  if (header.encoding == ImageHeader::Encoding::Zlib) {
    const std::uint64_t frame = content.FrameBytes(), all = frame * static_cast<std::uint64_t>(content.frames);
    inflater = std::make_unique<Inflater>(stream, dataOffset, header.dataPath, all);
    inflater->Read(nullptr, header.skipDecoded);
    moments.push_back(inflater->Save());
    stretch = static_cast<int>(std::max<std::uint64_t>(1, std::min<std::uint64_t>(FirstStretch / frame, 1u << 30)));
  }
}

void SequenceFile::Parts::ReadInflated(int index, char* out, const Progress& progress)
{
  const std::uint64_t frame = content.FrameBytes();
  const int kept = std::min(index / stretch, static_cast<int>(moments.size()) - 1);
  if (next < kept * stretch || next > index) {
    next = -1;
    inflater->Restore(*moments[static_cast<std::size_t>(kept)]);
    next = kept * stretch;
  }
  const int begin = next;
  while (true) {
    if (next > 0 && next % stretch == 0 && next / stretch == static_cast<int>(moments.size())) {
      moments.push_back(inflater->Save());
      if (moments.size() > MostMoments) {
        for (std::size_t i = 0; 2 * i < moments.size(); ++i)
          moments[i] = moments[2 * i];
        moments.resize((moments.size() + 1) / 2);
        stretch *= 2;
      }
    }
    const int now = next;
    next = -1; // unless all goes well
    const double frames = index - begin + 1;
    inflater->Read(now == index ? out : nullptr, frame, progress.Part((now - begin) / frames, (now - begin + 1) / frames));
    if (now + 1 == content.frames)
      inflater->Finish();
    next = now + 1;
    if (now == index)
      return;
  }
}

void SequenceFile::Parts::ReadInterleaved(int index, char* out, const Progress& progress)
{
  const std::uint64_t frame = content.FrameBytes(), size = SizeOf(content.type), pixels = frame / size;
  if (index < batchBegin || index >= batchEnd) {
    batchBegin = batchEnd = 0;
    const std::uint64_t count = std::min<std::uint64_t>(std::max<std::uint64_t>(1, InterleavedBytes / frame),
                                                        static_cast<std::uint64_t>(content.frames - index));
    const std::uint64_t perPixel = static_cast<std::uint64_t>(content.frames) * size;
    const std::uint64_t step = std::max<std::uint64_t>(1, PassBytes / perPixel);
    std::vector<char> piece(static_cast<std::size_t>(std::min(step, pixels) * perPixel));
    batch.resize(static_cast<std::size_t>(count * frame));
    if (inflater)
      inflater->Restore(*moments[0]);
    else
      stream.seekg(dataOffset);
    for (std::uint64_t pixel = 0; pixel < pixels; pixel += step) {
      const std::uint64_t here = std::min(step, pixels - pixel);
      if (inflater)
        inflater->Read(piece.data(), here * perPixel);
      else if (!stream.read(piece.data(), static_cast<std::streamsize>(here * perPixel)))
        FailFile(header.dataPath, "the data end early");
      for (std::uint64_t f = 0; f < count; ++f)
        for (std::uint64_t i = 0; i < here; ++i)
          std::memcpy(batch.data() + f * frame + (pixel + i) * size,
                      piece.data() + i * perPixel + (static_cast<std::uint64_t>(index) + f) * size, size);
      progress(static_cast<double>(pixel + here) / static_cast<double>(pixels));
    }
    if (inflater)
      inflater->Finish();
    batchBegin = index;
    batchEnd = index + static_cast<int>(count);
  }
  std::memcpy(out, batch.data() + static_cast<std::uint64_t>(index - batchBegin) * frame, frame);
}

void SequenceFile::ReadFrame(int index, void* pixels, const Progress& progress)
{
  Parts& p = *parts_;
  CheckIndex(p.content, index);
  if (!p.content.HasImages())
    throw Error(Error::Kind::InvalidParameter, p.content.path + ": it has no images, only poses");
  const std::uint64_t bytes = p.content.FrameBytes();
  const bool turned = !p.turn.IsIdentity();
  if (turned)
    p.scratch.resize(bytes);
  char* const out = static_cast<char*>(pixels);
  char* const raw = turned ? p.scratch.data() : out;

  progress(0.0);
  p.OpenData();
  p.stream.clear();
  if (p.interleaved)
    p.ReadInterleaved(index, raw, progress);
  else if (p.inflater)
    p.ReadInflated(index, raw, progress);
  else {
    p.stream.seekg(p.dataOffset + static_cast<std::int64_t>(bytes) * index);
    p.stream.read(raw, static_cast<std::streamsize>(bytes));
    if (!p.stream)
      FailFile(p.header.dataPath, "the data end early, in frame " + std::to_string(index));
    progress(1.0);
  }
  const std::size_t size = SizeOf(p.content.type);
  if (p.header.bigEndian != HostIsBigEndian)
    SwapBytes(raw, size, bytes / size);
  if (turned)
    p.turn.Turn(size * p.content.components, p.content.dimensions, raw, out);
}

bool LooksLikeSequence(const std::string& path)
{
  try {
    const FileFormat format = FormatOfContent(path);
    if (format != FileFormat::MetaImage && format != FileFormat::Nrrd)
      return false;
    HeaderLines lines(path);
    std::string line;
    while (lines.Position() < 65536 && lines.Next(line)) {
      const std::vector<std::string_view> words = SplitWords(line);
      if (IsFrameField(line))
        return true;
      if (!words.empty() && (words[0] == "Kinds" || words[0] == "kinds:"))
        for (const std::string_view word : words)
          if (word == "list" || word == "time")
            return true;
      if (line.empty() && format == FileFormat::Nrrd)
        return false;
      if (!words.empty() && words[0] == "ElementDataFile")
        return false;
    }
  } catch (const Error&) {
  }
  return false;
}

bool NamesSequence(const std::string& path)
{
  const FileFormat format = FormatOfName(path);
  const std::string before = Upper(fs::path(path).stem().extension().string());
  return (format == FileFormat::MetaImage || format == FileFormat::Nrrd) && (before == ".IGS" || before == ".SEQ");
}

} // namespace echorama
