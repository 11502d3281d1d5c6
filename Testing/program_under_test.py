# SPDX-License-Identifier: BSD-3-Clause
"""Runs the program echorama for its tests, and makes and reads the small files that they need (with no code of ours)."""
import json
import os
import pathlib
import subprocess
import zlib

import numpy

PROGRAM = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"]) / "bin" / "echorama"
SOURCE = pathlib.Path(__file__).resolve().parents[1]
DATA = SOURCE / ".." / "shared" / "data"  # real files, where they are
PLUS = DATA / "plus"
TYPES = {"u1": "MET_UCHAR", "i2": "MET_SHORT", "u2": "MET_USHORT", "f4": "MET_FLOAT", "f8": "MET_DOUBLE"}


def run(*arguments, **options):
    """The finished process of `echorama arguments`; never waits for a terminal."""
    return subprocess.run([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True, timeout=300, **options)


def run_json(*arguments):
    """The one JSON object that `echorama arguments --json` prints; the command must succeed."""
    done = run(*arguments, "--json")
    assert done.returncode == 0, f"{arguments}: {done.stderr}"
    return json.loads(done.stdout)  # fails when there is anything beside one object


def write_mha(path, voxels, spacing=(1, 1, 1), origin=(0, 0, 0), direction=numpy.eye(3), compressed=False, header=None):
    """A MetaImage file of an array [z, y, x]. `header` replaces or adds lines; a value of None leaves a line out."""
    data = numpy.ascontiguousarray(voxels).tobytes()
    if compressed:
        data = zlib.compress(data)
    numbers = lambda values: " ".join(repr(float(value)) for value in values)
    lines = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "BinaryDataByteOrderMSB": "False", "CompressedData": str(compressed),
             "TransformMatrix": numbers(numpy.asarray(direction).T.ravel()), "Offset": numbers(origin), "ElementSpacing": numbers(spacing),
             "DimSize": " ".join(map(str, voxels.shape[::-1])), "ElementType": TYPES[voxels.dtype.str[1:]], **(header or {})}
    text = "".join(f"{key} = {value}\n" for key, value in lines.items() if value is not None)
    pathlib.Path(path).write_bytes(text.encode() + b"ElementDataFile = LOCAL\n" + data)


def read_mha(path):
    """The header as a dictionary, and the voxels [z, y, x]."""
    content = pathlib.Path(path).read_bytes()
    end = content.index(b"\n", content.index(b"ElementDataFile")) + 1
    header = dict(line.split(" = ", 1) for line in content[:end].decode().splitlines())
    data = zlib.decompress(content[end:]) if header.get("CompressedData") == "True" else content[end:]
    kind = {value: key for key, value in TYPES.items()}[header["ElementType"]]
    return header, numpy.frombuffer(data, kind).reshape([int(n) for n in header["DimSize"].split()][::-1])


def write_sequence(path, pixels, transforms, times=None, images=None, header=None):
    """A tracked sequence in MetaImage: pixels [frame, y, x], per frame {name: (matrix, status)}, seconds and ImageStatus."""
    fields = {"UltrasoundImageOrientation": "MF", "Kinds": "domain domain list"}
    for i, frame in enumerate(transforms):
        for name, (matrix, status) in frame.items():
            fields[f"Seq_Frame{i:04}_{name}Transform"] = " ".join(repr(float(value)) for value in numpy.asarray(matrix).ravel())
            fields[f"Seq_Frame{i:04}_{name}TransformStatus"] = status
        if times:
            fields[f"Seq_Frame{i:04}_Timestamp"] = repr(float(times[i]))
        fields[f"Seq_Frame{i:04}_ImageStatus"] = images[i] if images else "OK"
    write_mha(path, pixels, header={**fields, **(header or {})})


def read_sequence(path):
    """The pixels [frame, y, x] of a tracked sequence, and per frame its fields."""
    header, pixels = read_mha(path)
    frames = [{} for _ in pixels]
    for key, value in header.items():
        if key.startswith("Seq_Frame"):
            number, name = key[len("Seq_Frame"):].split("_", 1)
            frames[int(number)][name] = value
    return pixels, frames


def write_plus(path, transforms):
    """A configuration of Plus with (from, to, matrix, further attributes)."""
    elements = [f'<Transform From="{start}" To="{end}" Matrix="{" ".join(map(repr, map(float, numpy.asarray(matrix).ravel())))}" {more}/>'
                for start, end, matrix, more in transforms]
    text = f'<PlusConfiguration version="2.1"><CoordinateDefinitions>{"".join(elements)}</CoordinateDefinitions></PlusConfiguration>'
    pathlib.Path(path).write_text(text)


def turned(degrees, axis=2):
    """A rotation matrix about one axis."""
    angle = numpy.radians(degrees)
    matrix = numpy.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix[a, a] = matrix[b, b] = numpy.cos(angle)
    matrix[b, a], matrix[a, b] = numpy.sin(angle), -numpy.sin(angle)
    return matrix


def blobs(shape=(20, 20, 20), seed=1):
    """Bytes with some structure, none of them zero."""
    generator = numpy.random.default_rng(seed)
    voxels = generator.uniform(20, 200, shape)
    for axis in range(3):
        voxels = (voxels + numpy.roll(voxels, 1, axis) + numpy.roll(voxels, 2, axis)) / 3
    return voxels.astype("u1")


def snapshot(folder):
    """Every file below a folder with its contents: two of them differ when anything was written, left or lost."""
    return {str(path): path.read_bytes() if path.is_file() else None for path in sorted(pathlib.Path(folder).rglob("*"))}


def write_poses(path, files, matrices):
    """A pose file without geometries."""
    volumes = [{"file": str(file), "VolumeToWorld": numpy.asarray(matrix, float).tolist()} for file, matrix in zip(files, matrices)]
    text = {"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS", "volumes": volumes}
    pathlib.Path(path).write_text(json.dumps(text))
