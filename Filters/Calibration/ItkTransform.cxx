// SPDX-License-Identifier: BSD-3-Clause
// elastix' transforms are those of ITK under other names, so both formats come down to a type, its parameters and its fixed
// parameters. The type is looked at as soon as it is read: the numbers of a B-spline may fill a line of many megabytes.
#include "Filters/Calibration/ItkTransform.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Readers/HeaderLines.h"
#include <filesystem>
#include <map>
#include <optional>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr const char* ItkMagic = "#Insight Transform File V1.0";
constexpr double LargestMm = 1e7;
constexpr int LongestChain = 32;

using Numbers = std::vector<double>;

struct TransformType {
  const char* name; // as ITK has it, without "Transform..."
  const char* elastix;
  std::size_t parameters, fixed;
  bool zyx; // a further fixed parameter, which may be missing: the order of the angles
  Eigen::Matrix3d (*matrix)(const Numbers& parameters, bool zyx);
};

Eigen::Matrix3d NoTurn(const Numbers&, bool)
{
  return Eigen::Matrix3d::Identity();
}

Eigen::Matrix3d OfRows(const Numbers& p, bool)
{
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p.data());
}

Eigen::Matrix3d OfAngles(const Numbers& p, bool zyx)
{
  const auto about = [&p](int axis) { return Eigen::AngleAxisd(p[static_cast<std::size_t>(axis)], Eigen::Vector3d::Unit(axis)); };
  return (zyx ? about(2) * about(1) * about(0) : about(2) * about(0) * about(1)).toRotationMatrix();
}

// Not normalized: one that is none fails as a matrix that is no rotation.
Eigen::Matrix3d OfQuaternion(const Numbers& p, bool)
{
  return Eigen::Quaterniond(p[3], p[0], p[1], p[2]).toRotationMatrix();
}

Eigen::Matrix3d OfVersor(const Numbers& p, bool)
{
  const double square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
  return Eigen::Quaterniond(std::sqrt(std::max(0.0, 1.0 - square)), p[0], p[1], p[2]).toRotationMatrix();
}

// The translation is last in the parameters of all, the centre of rotation first in the fixed ones.
constexpr TransformType TransformTypes[] = {
    {"Affine", "AffineTransform", 12, 3, false, OfRows},
    {"MatrixOffsetTransformBase", "", 12, 3, false, OfRows},
    {"Rigid3D", "", 12, 3, false, OfRows},
    {"Euler3D", "EulerTransform", 6, 3, true, OfAngles},
    {"VersorRigid3D", "", 6, 3, false, OfVersor},
    {"QuaternionRigid", "", 7, 3, false, OfQuaternion},
    {"Translation", "TranslationTransform", 3, 0, false, NoTurn},
};

// A transform of a file, and the lines where it is.
class ItkTransformReader {
public:
  ItkTransformReader(const std::string& path, int depth) : lines_(path), path_(path), depth_(depth) {}

  // From the fixed to the moving image.
  Pose Read()
  {
    if (!Next())
      lines_.Fail("the file is empty");
    return line_.compare(0, std::string_view(ItkMagic).size(), ItkMagic) == 0 ? ReadItk() : ReadElastix();
  }

private:
  struct Entry {
    std::vector<std::string> values;
    std::int64_t line;
  };

  // The next line that is not empty.
  bool Next()
  {
    while (lines_.Next(line_))
      if (!TrimBlanks(line_).empty())
        return true;
    return false;
  }

  template <class Words>
  Numbers NumbersOf(const std::string& key, const Words& words, std::size_t least, std::size_t most, std::int64_t line) const
  {
    if (words.size() < least || words.size() > most)
      lines_.FailAt(line, key + " holds " + std::to_string(words.size()) + " numbers; " + std::to_string(least) + " are needed");
    Numbers numbers(words.size());
    for (std::size_t i = 0; i < words.size(); ++i)
      if (!ParseNumber(words[i], numbers[i]) || !std::isfinite(numbers[i]))
        lines_.FailAt(line, key + " holds \"" + std::string(words[i]).substr(0, 60) + "\", which is not a finite number");
    return numbers;
  }

  Pose PoseOf(const TransformType& type, const Numbers& parameters, const Numbers& fixed, std::int64_t line) const
  {
    const Eigen::Matrix3d matrix = type.matrix(parameters, fixed.size() > type.fixed && fixed.back() != 0.0);
    if (!IsRotation(matrix)) {
      const double off = (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
      lines_.FailAt(line, IsRotation(-matrix)
                              ? std::string("its matrix is a mirror, not a rotation (determinant -1)")
                              : "its matrix M is not a rotation, and only rigid transforms are poses: M^T M differs "
                                "from the identity by " +
                                    NumberText(off));
    }
    const Eigen::Vector3d centre = type.fixed == 3 ? Eigen::Vector3d(fixed.data()) : Eigen::Vector3d::Zero();
    Pose pose = Pose::Identity();
    pose.linear() = NearestRotation(matrix); // about the centre, which stays exact
    pose.translation() = centre - pose.linear() * centre + Eigen::Vector3d(parameters.data() + parameters.size() - 3);
    if (!(pose.translation().cwiseAbs().maxCoeff() <= LargestMm) || !(centre.cwiseAbs().maxCoeff() <= LargestMm))
      lines_.FailAt(line, "it leads beyond 1e7 mm");
    return pose;
  }

  // "Euler3DTransform_double_3_3"
  const TransformType* ItkType(std::string_view name) const
  {
    const std::string given(name);
    const std::size_t at = given.find('_');
    const std::string kind = given.substr(0, at), rest = at == std::string::npos ? "" : given.substr(at);
    if (rest != "_double_3_3" && rest != "_float_3_3")
      lines_.FailHere("a transform of type " + given.substr(0, 80) +
                      " is not read: three dimensions are needed (..._double_3_3)");
    if (kind == "CompositeTransform")
      return nullptr;
    for (const TransformType& type : TransformTypes)
      if (kind == type.name || kind == type.name + std::string("Transform"))
        return &type;
    lines_.FailHere("a transform of type " + kind.substr(0, 80) + " is not read: only rigid ones are poses");
  }

  Pose ReadItk()
  {
    // Of a composite the last part comes first: T(x) = T1(T2(x)).
    std::optional<Pose> all;
    bool isComposite = false;
    const TransformType* type = nullptr;
    std::optional<Numbers> parameters, fixed;
    const auto finish = [&] {
      if (type)
        lines_.FailHere(std::string(parameters ? "FixedParameters" : "Parameters") + " of the " + type->name +
                        " transform are missing (truncated?)");
    };
    while (Next()) {
      const std::string_view text = TrimBlanks(line_);
      if (text[0] == '#')
        continue;
      const std::size_t colon = text.find(':');
      const std::string key(text.substr(0, colon));
      const std::string_view value = colon == std::string_view::npos ? std::string_view() : TrimBlanks(text.substr(colon + 1));
      if (key == "Transform") {
        finish();
        const bool isFirst = !all && !isComposite;
        type = ItkType(value);
        if (!isFirst && (!type || !isComposite))
          lines_.FailHere("it holds several transforms; one is needed, or one composite of them");
        isComposite = isComposite || !type;
        parameters.reset();
        fixed.reset();
      } else if (key != "Parameters" && key != "FixedParameters") {
        lines_.FailHere("\"" + std::string(text.substr(0, 60)) + "\" belongs to no transform of ITK");
      } else if (type) {
        std::optional<Numbers>& numbers = key == "Parameters" ? parameters : fixed;
        const std::size_t count = key == "Parameters" ? type->parameters : type->fixed;
        numbers = NumbersOf(key, SplitWords(value), count, count + (type->zyx && key != "Parameters"), lines_.Line());
        if (parameters && fixed) {
          const Pose pose = PoseOf(*type, *parameters, *fixed, lines_.Line());
          all = all ? *all * pose : pose;
          type = nullptr;
        }
      } else if (!isComposite || all || !value.empty()) {
        lines_.FailHere(key + " without a transform before them");
      }
    }
    finish();
    if (!all)
      lines_.Fail("it holds no transform (truncated?)");
    return *all;
  }

  // The line as an entry: (Key value "a text" value) // comment
  void Take()
  {
    const std::string_view text = TrimBlanks(line_);
    if (text[0] != '(')
      lines_.FailHere("it is neither a transform of ITK nor of elastix: \"" + std::string(text.substr(0, 60)) + "\"");
    std::vector<std::string> words;
    std::size_t at = 1;
    for (;;) {
      at = text.find_first_not_of(Blanks, at);
      if (at == std::string_view::npos)
        lines_.FailHere("the bracket is not closed (truncated?)");
      if (text[at] == ')')
        break;
      const bool quoted = text[at] == '"';
      const std::size_t end = quoted ? text.find('"', at + 1) : text.find_first_of(" \t)", at);
      if (end == std::string_view::npos)
        lines_.FailHere(quoted ? "the quotation mark is not closed (truncated?)" : "the bracket is not closed (truncated?)");
      words.emplace_back(text.substr(at + quoted, end - at - quoted));
      at = end + quoted;
    }
    const std::string_view rest = TrimBlanks(text.substr(at + 1));
    if (words.size() < 2 || (!rest.empty() && rest.substr(0, 2) != "//"))
      lines_.FailHere("it is no parameter of elastix: \"" + std::string(text.substr(0, 60)) + "\"");
    const std::string key = words.front();
    words.erase(words.begin());
    if (!entries_.emplace(key, Entry{words, lines_.Line()}).second)
      lines_.FailHere(key + " is given twice");
    if (key == "Transform")
      type_ = ElastixType(words.front());
  }

  const TransformType* ElastixType(const std::string& name) const
  {
    for (const TransformType& type : TransformTypes)
      if (name == type.elastix && !name.empty())
        return &type;
    lines_.FailHere("a transform of elastix' type " + name.substr(0, 80) + " is not read: only rigid ones are poses");
  }

  const Entry* Find(const char* key) const
  {
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : &found->second;
  }

  const Entry& Need(const char* key) const
  {
    const Entry* entry = Find(key);
    if (!entry)
      lines_.Fail(std::string(key) + " is missing (truncated?)");
    return *entry;
  }

  // Whether the value is \a wanted, where it is given at all. \returns true then, too, false for \a other
  bool Is(const char* key, const std::string& wanted, const std::string& other) const
  {
    const Entry* entry = Find(key);
    if (entry && entry->values.front() != wanted && entry->values.front() != other)
      lines_.FailAt(entry->line, std::string(key) + " is \"" + entry->values.front().substr(0, 60) + "\", neither " + wanted +
                                     " nor " + other);
    return !entry || entry->values.front() == wanted;
  }

  Pose ReadElastix()
  {
    do
      if (TrimBlanks(line_).substr(0, 2) != "//")
        Take();
    while (Next());
    Need("Transform");
    for (const char* key : {"FixedImageDimension", "MovingImageDimension"})
      if (const Entry* entry = Find(key); entry && entry->values.front() != "3")
        lines_.FailAt(entry->line, std::string(key) + " is " + entry->values.front().substr(0, 60) + "; 3 is needed");
    if (!Is("UseDirectionCosines", "true", "false"))
      lines_.FailAt(Find("UseDirectionCosines")->line,
                    "the images were taken without their direction, so that it does not lead from points to points");
    const Entry& given = Need("TransformParameters");
    const Numbers parameters = NumbersOf("TransformParameters", given.values, type_->parameters, type_->parameters, given.line);
    if (const Entry* count = Find("NumberOfParameters"); count && count->values.front() != std::to_string(parameters.size()))
      lines_.FailAt(count->line, "NumberOfParameters is " + count->values.front().substr(0, 60) + ", but there are " +
                                     std::to_string(parameters.size()));
    Numbers fixed;
    if (type_->fixed > 0) {
      const Entry& centre = Need("CenterOfRotationPoint");
      fixed = NumbersOf("CenterOfRotationPoint", centre.values, type_->fixed, type_->fixed, centre.line);
      if (type_->zyx)
        fixed.push_back(Find("ComputeZYX") && Is("ComputeZYX", "true", "false") ? 1.0 : 0.0);
    }
    const Pose pose = PoseOf(*type_, parameters, fixed, given.line);
    const Entry* before = Find("InitialTransformParametersFileName"); // until elastix 5.0
    before = before ? before : Find("InitialTransformParameterFileName");
    return !before || before->values.front() == "NoInitialTransform" ? pose : pose * Before(*before);
  }

  // The transform that was there before, and that this one follows.
  Pose Before(const Entry& entry) const
  {
    if (!Find("HowToCombineTransforms") ||
        !Is("HowToCombineTransforms", "Compose", "Add")) // versions differ in what they take it for
      lines_.FailAt(
          entry.line,
          "it is to be added to an initial transform, not composed with it (HowToCombineTransforms), which is not rigid");
    if (depth_ >= LongestChain)
      lines_.FailAt(entry.line, "more than " + std::to_string(LongestChain) + " transforms follow each other (in a circle?)");
    const fs::path name = entry.values.front(), beside = fs::path(path_).parent_path() / name.filename();
    std::error_code none;
    if (!fs::exists(name, none) && !fs::exists(beside, none))
      lines_.FailAt(entry.line, "its initial transform " + name.string() + " is not there, nor a file of that name beside it");
    return ItkTransformReader((fs::exists(name, none) ? name : beside).string(), depth_ + 1).Read();
  }

  HeaderLines lines_;
  std::string path_, line_;
  int depth_;
  std::map<std::string, Entry> entries_; // of elastix
  const TransformType* type_ = nullptr;
};

} // namespace

Pose ReadItkTransform(const std::string& path)
{
  return ItkTransformReader(path, 1).Read().inverse(Eigen::Isometry);
}

void WriteItkTransform(const std::string& path, const Pose& volumeToWorld)
{
  if (!IsRotation(volumeToWorld.linear()) || !volumeToWorld.translation().allFinite())
    throw Error(Error::Kind::InvalidParameter, path + ": the pose is not rigid");
  const Pose inverse = volumeToWorld.inverse(Eigen::Isometry);
  std::string text = std::string(ItkMagic) + "\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters:";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      text += " " + NumberText(inverse(row, column));
  for (int row = 0; row < 3; ++row)
    text += " " + NumberText(inverse(row, 3));
  WriteTextFile(path, text + "\nFixedParameters: 0 0 0\n");
}

} // namespace echorama
