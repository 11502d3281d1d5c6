// SPDX-License-Identifier: BSD-3-Clause
// The same motions by closed forms; that ITK and elastix understand the files as we do is tried in Testing/interchange.py.
#include "Core/Base/TextFile.h"
#include "Filters/Calibration/ItkTransform.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <filesystem>
#include <sstream>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

class ItkTransformFile : public TemporaryFolder {
protected:
  Pose Read(const std::string& text) const { return ReadItkTransform(Put("a.tfm", text)); }
  void Refused(const std::string& text, const std::string& words) const
  {
    const std::string path = Put("a.tfm", text);
    ExpectRefused([&] { ReadItkTransform(path); }, Error::Kind::BadFile, path, words);
  }
};

const std::string Head = "#Insight Transform File V1.0\n";

std::string Itk(const std::string& type, const std::string& parameters, const std::string& fixed = "7 -8 9")
{
  return "#Transform 0\nTransform: " + type + "_double_3_3\nParameters: " + parameters + "\nFixedParameters: " + fixed + "\n";
}

std::string Elastix(const std::string& type, const std::string& parameters, const std::string& more = "")
{
  return "// of elastix\n(Transform \"" + type + "\") // a comment\n(TransformParameters " + parameters +
         ")\n(CenterOfRotationPoint 7 -8 9)\n\n" + more;
}

const std::string Angles = "0.1 -0.2 0.3 4 5 -6";
const std::string Rows = "0 -1 0 1 0 0 0 0 1 4 5 -6"; // a quarter turn about z

Eigen::AngleAxisd About(int axis, double angle)
{
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis));
}

// What leads from the moving image to the fixed one, of a turn about the centre of all these files, and their translation.
Pose Inverse(const Eigen::Matrix3d& turn, const Vector3d& centre = {7, -8, 9})
{
  Pose pose = Pose::Identity();
  pose.linear() = turn.transpose();
  pose.translation() = centre - turn.transpose() * (centre + Vector3d(4, 5, -6));
  return pose;
}

void ExpectSame(const Pose& a, const Pose& b, double tolerance = 1e-13)
{
  EXPECT_LT((a.matrix() - b.matrix()).cwiseAbs().maxCoeff(), tolerance) << a.matrix() << "\nis not\n" << b.matrix();
}

} // namespace

TEST_F(ItkTransformFile, WhatWeWriteComesBack)
{
  const Pose pose = MotionAbout({1.0, 2.0, 3.0}, {0.1, -2.2, 0.3}, {4.0, 50.0, 6.0});
  WriteItkTransform(Path("b.tfm"), pose);
  ExpectSame(ReadItkTransform(Path("b.tfm")), pose);
}

TEST_F(ItkTransformFile, ItkGetsTheInverse)
{
  const Pose pose = MotionAbout({1.0, 2.0, 3.0}, {0.1, -0.2, 0.3}, {4.0, 5.0, 6.0});
  WriteItkTransform(Path("a.tfm"), pose);
  std::istringstream lines(ReadTextFile(Path("a.tfm")));
  std::string line, word;
  for (const std::string wanted : {"#Insight Transform File V1.0", "#Transform 0", "Transform: AffineTransform_double_3_3"}) {
    std::getline(lines, line);
    EXPECT_EQ(line, wanted);
  }
  lines >> word;
  EXPECT_EQ(word, "Parameters:");
  Pose back = Pose::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      lines >> back.matrix()(row, column);
  for (int row = 0; row < 3; ++row)
    lines >> back.matrix()(row, 3);
  EXPECT_TRUE((back * pose).isApprox(Pose::Identity(), 1e-14));
  lines >> word;
  EXPECT_EQ(word, "FixedParameters:"); // the centre of rotation
  Pose sheared = pose;
  sheared.matrix()(0, 1) += 0.1;
  EXPECT_THROW(WriteItkTransform(Path("b.tfm"), sheared), Error);
  EXPECT_THROW(WriteItkTransform(Path("missing/b.tfm"), pose), Error);
  EXPECT_FALSE(std::filesystem::exists(Path("b.tfm")));
}

TEST_F(ItkTransformFile, EveryRigidTypeOfItk)
{
  const Eigen::Matrix3d zxy = (About(2, 0.3) * About(0, 0.1) * About(1, -0.2)).toRotationMatrix();
  const Eigen::Matrix3d zyx = (About(2, 0.3) * About(1, -0.2) * About(0, 0.1)).toRotationMatrix();
  ExpectSame(Read(Head + Itk("Euler3DTransform", Angles)), Inverse(zxy));
  ExpectSame(Read(Head + Itk("Euler3DTransform", Angles, "7 -8 9 0")), Inverse(zxy));
  ExpectSame(Read(Head + Itk("Euler3DTransform", Angles, "7 -8 9 1")), Inverse(zyx));
  const Eigen::Matrix3d turn = About(0, 2.0 * std::asin(0.6)).toRotationMatrix();
  ExpectSame(Read(Head + Itk("VersorRigid3DTransform", "0.6 0 0 4 5 -6")), Inverse(turn));
  ExpectSame(Read(Head + Itk("QuaternionRigidTransform", "0.6 0 0 0.8 4 5 -6")), Inverse(turn));
  const Eigen::Matrix3d quarter = About(2, std::acos(0.0)).toRotationMatrix();
  for (const char* type : {"AffineTransform", "MatrixOffsetTransformBase", "Rigid3DTransform"})
    ExpectSame(Read(Head + Itk(type, Rows)), Inverse(quarter));
  ExpectSame(Read(Head + Itk("TranslationTransform", "4 5 -6", "")), Inverse(Eigen::Matrix3d::Identity()));
  ExpectSame(
      Read("#Insight Transform File V1.0\r\nTransform: AffineTransform_float_3_3\r\nFixedParameters: 7 -8 9\r\nParameters: " +
           Rows + "\r\n"),
      Inverse(quarter));
}

TEST_F(ItkTransformFile, CompositesAndChainsAreApplied)
{
  const Pose first = Read(Head + Itk("AffineTransform", Rows)), second = Read(Head + Itk("Euler3DTransform", Angles));
  const std::string composite = "#Transform 0\nTransform: CompositeTransform_double_3_3\n";
  const std::string one = Itk("AffineTransform", Rows), two = Itk("Euler3DTransform", Angles);
  ExpectSame(Read(Head + composite + one), first);
  ExpectSame(Read(Head + composite + one + two), second * first); // the inverse of T1(T2(x))
  Refused(Head + one + two, "several transforms");
  Refused(Head + one + composite, "several transforms");
  Refused(Head + composite, "no transform");

  const auto chain = [&](const std::string& file, const std::string& how) {
    return Elastix("AffineTransform", Rows, "(InitialTransformParametersFileName \"" + file + "\")\n" + how);
  };
  const std::string compose = "(HowToCombineTransforms \"Compose\")\n";
  Put("TransformParameters.0.txt", Elastix("EulerTransform", Angles));
  ExpectSame(Read(chain(Path("TransformParameters.0.txt"), compose)), second * first);
  ExpectSame(Read(chain("/gone/TransformParameters.0.txt", compose)), second * first);
  ExpectSame(Read(chain("NoInitialTransform", "")), first);
  Refused(chain("/gone/elsewhere.txt", compose), "line 6: its initial transform /gone/elsewhere.txt is not there");
  Refused(chain(Path("TransformParameters.0.txt"), "(HowToCombineTransforms \"Add\")"), "added");
  Refused(chain(Path("TransformParameters.0.txt"), ""), "added");
  Refused(chain("a.tfm", compose), "in a circle");
}

TEST_F(ItkTransformFile, EveryRigidTypeOfElastix)
{
  const Eigen::Matrix3d zxy = (About(2, 0.3) * About(0, 0.1) * About(1, -0.2)).toRotationMatrix();
  const Eigen::Matrix3d zyx = (About(2, 0.3) * About(1, -0.2) * About(0, 0.1)).toRotationMatrix();
  ExpectSame(Read(Elastix("EulerTransform", Angles)), Inverse(zxy));
  ExpectSame(Read(Elastix("EulerTransform", Angles, "(ComputeZYX \"false\")")), Inverse(zxy));
  ExpectSame(Read(Elastix("EulerTransform", Angles, "(ComputeZYX \"true\")")), Inverse(zyx));
  ExpectSame(Read(Elastix("AffineTransform", Rows, "(Comment \"with ) and // in it\")")),
             Inverse(About(2, std::acos(0.0)).toRotationMatrix()));
  ExpectSame(Read("(TransformParameters 4 5 -6)\n(Transform \"TranslationTransform\")\n"), Inverse(Eigen::Matrix3d::Identity()));
}

TEST_F(ItkTransformFile, DigitsMayBeFew)
{
  const Pose pose = Read(Head + Itk("AffineTransform", "0.877583 -0.479426 0 0.479426 0.877583 0 0 0 1 4 5 -6"));
  EXPECT_TRUE(IsRotation(pose.linear(), 1e-14));
  ExpectSame(pose, Inverse(About(2, 0.5).toRotationMatrix()), 2e-5);
}

TEST_F(ItkTransformFile, WhatIsNotRigidIsRefusedByNameOrAmount)
{
  Refused(Head + Itk("AffineTransform", "1.1 0 0 0 1 0 0 0 1 4 5 6"), "line 5: its matrix M is not a rotation");
  Refused(Head + Itk("AffineTransform", "1.1 0 0 0 1 0 0 0 1 4 5 6"), "differs from the identity by 0.21");
  Refused(Head + Itk("AffineTransform", "1.00001 0 0 0 1 0 0 0 1 4 5 6"), "is not a rotation");
  Refused(Head + Itk("AffineTransform", "-1 0 0 0 1 0 0 0 1 4 5 6"), "mirror");
  Refused(Elastix("AffineTransform", "1 0.1 0 0 1 0 0 0 1 4 5 6"), "line 3: its matrix M is not a rotation");
  Refused(Head + Itk("VersorRigid3DTransform", "0.8 0.8 0 4 5 6"), "is not a rotation");
  Refused(Head + Itk("QuaternionRigidTransform", "0.6 0 0 0.9 4 5 6"), "is not a rotation");
  Refused(Head + Itk("Similarity3DTransform", "0 0 0 4 5 6 1"), "line 3: a transform of type Similarity3DTransform");
  Refused(Head + Itk("BSplineTransform", "0"), "BSplineTransform");
  Refused(Head + "Transform: Euler2DTransform_double_2_2\n", "three dimensions");
  Refused("(Transform \"BSplineTransform\")\n(TransformParameters" + std::string(2000000, ' ') + ")",
          "line 1: a transform of elastix' type BSplineTransform");
  Refused(Elastix("SimilarityTransform", "0"), "SimilarityTransform");
  Refused(Elastix("EulerTransform", Angles, "(UseDirectionCosines \"false\")"),
          "line 6: the images were taken without their direction");
  Refused(Elastix("EulerTransform", Angles, "(FixedImageDimension 2)"), "3 is needed");
}

TEST_F(ItkTransformFile, DamagedFilesAreRefusedWithTheLine)
{
  const std::string good = Head + Itk("Euler3DTransform", Angles), elastix = Elastix("EulerTransform", Angles);
  EXPECT_THROW(ReadItkTransform(Path("missing.tfm")), Error);
  Refused("", "empty");
  Refused("Parameters: 1 2 3\n", "line 1: it is neither");
  Refused(Head, "no transform");
  for (std::size_t size = 0; size + 8 < good.size(); ++size) // the last numbers may be cut unseen
    EXPECT_THROW(Read(good.substr(0, size)), Error) << good.substr(0, size);
  for (std::size_t size = 0; size + 3 < elastix.size(); ++size)
    EXPECT_THROW(Read(elastix.substr(0, size)), Error) << elastix.substr(0, size);
  Refused(Head + Itk("Euler3DTransform", "0.1 0.2 0.3 4 5"), "line 4: Parameters holds 5 numbers; 6 are needed");
  Refused(Head + Itk("Euler3DTransform", Angles, "1 2 3 0 0"), "line 5: FixedParameters holds 5 numbers");
  Refused(Head + Itk("Euler3DTransform", "0.1 0.2 nan 4 5 6"), "line 4: Parameters holds \"nan\"");
  Refused(Head + Itk("Euler3DTransform", "0.1 0.2 0.3 4 5 1e999"), "line 4");
  Refused(Head + Itk("Euler3DTransform", "0.1 0.2 0.3 4 5 1e8"), "1e7 mm");
  Refused(Head + Itk("Euler3DTransform", Angles) + "Parameters: 1\n", "line 6: Parameters without a transform");
  Refused(Head + "Transform: Euler3DTransform_double_3_3\nParameters: " + Angles + "\n",
          "FixedParameters of the Euler3D transform are missing");
  Refused(Elastix("EulerTransform", "0.1 0.2"), "line 3: TransformParameters holds 2 numbers; 6 are needed");
  Refused(Elastix("EulerTransform", "0.1 0.2 0.3 4 5 inf"), "line 3: TransformParameters holds \"inf\"");
  Refused(Elastix("EulerTransform", Angles, "(NumberOfParameters 12)"), "line 6: NumberOfParameters is 12, but there are 6");
  Refused(Elastix("EulerTransform", Angles, "(CenterOfRotationPoint 1 2 3)"), "line 6: CenterOfRotationPoint is given twice");
  Refused(Elastix("EulerTransform", Angles, "(ComputeZYX \"maybe\")"), "line 6: ComputeZYX");
  Refused(Elastix("EulerTransform", Angles, "(Spacing 1 2"), "line 6: the bracket is not closed");
  Refused("(Transform \"EulerTransform\")\n(TransformParameters " + Angles + ")\n", "CenterOfRotationPoint is missing");
}
