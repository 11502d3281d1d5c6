# SPDX-License-Identifier: BSD-3-Clause
"""SeedsItkTransform.py DIR: transforms of ITK and elastix of every kind, whole and broken, for the fuzzer to start from."""
import sys
from pathlib import Path

folder = Path(sys.argv[1])
head = "#Insight Transform File V1.0\n"
rows, angles = "0 -1 0 1 0 0 0 0 1 4 5 -6", "0.1 -0.2 0.3 4 5 -6"


def itk(kind, parameters, fixed="7 -8 9"):
    return f"#Transform 0\nTransform: {kind}_double_3_3\nParameters: {parameters}\nFixedParameters: {fixed}\n"


def elastix(kind, parameters, more=""):
    return f'// of elastix\n(Transform "{kind}") // a comment\n(TransformParameters {parameters})\n(CenterOfRotationPoint 7 -8 9)\n\n{more}'


composite = "#Transform 0\nTransform: CompositeTransform_double_3_3\n"
seeds = {
    "affine.tfm": head + itk("AffineTransform", rows),
    "euler.tfm": head + itk("Euler3DTransform", angles, "7 -8 9 1"),
    "versor.tfm": head + itk("VersorRigid3DTransform", "0.6 0 0 4 5 -6"),
    "quaternion.tfm": head + itk("QuaternionRigidTransform", "0.6 0 0 0.8 4 5 -6"),
    "translation.tfm": head + itk("TranslationTransform", "4 5 -6", ""),
    "composite.tfm": head + composite + itk("AffineTransform", rows) + itk("Euler3DTransform", angles),
    "mirror.tfm": head + itk("AffineTransform", "-1 0 0 0 1 0 0 0 1 4 5 -6"),
    "cut.tfm": head + itk("AffineTransform", rows)[:-30],
    "far.tfm": head + itk("TranslationTransform", "1e300 1e300 -1e300", ""),
    "euler.txt": elastix("EulerTransform", angles, '(ComputeZYX "true")\n(UseDirectionCosines "true")\n(NumberOfParameters 6)\n'),
    "affine.txt": elastix("AffineTransform", rows, "(FixedImageDimension 3)\n(MovingImageDimension 3)\n"),
    "chain.txt": elastix("AffineTransform", rows,
                         '(InitialTransformParametersFileName "gone.txt")\n(HowToCombineTransforms "Compose")\n'),
    "first.txt": elastix("TranslationTransform", "4 5 -6", '(InitialTransformParameterFileName "NoInitialTransform")\n'),
    "cut.txt": elastix("EulerTransform", angles)[:-5],
}
for name, content in seeds.items():
    (folder / name).write_text(content)
