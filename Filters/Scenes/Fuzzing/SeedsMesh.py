# SPDX-License-Identifier: BSD-3-Clause
"""SeedsMesh.py DIR: small PLY, STL, OBJ, glTF and VTK files for the fuzzer to start from."""
import base64
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "Testing"))
from vtk_xml import coded  # noqa: E402

folder = Path(sys.argv[1])


def ply(format_, vertex, face, body, rest=""):
    return (f"ply\nformat {format_} 1.0\ncomment a\n{vertex}element face 1\n{face}{rest}end_header\n").encode() + body


FLOATS = "element vertex 3\nproperty float x\nproperty float y\nproperty float32 z\n"
DOUBLES = "element vertex 3\nproperty uchar red\nproperty double x\nproperty float64 y\nproperty double z\n"
LIST = "property list uchar int vertex_indices\n"
points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
seeds = {
    "ascii.ply": ply("ascii", FLOATS, LIST, b"0 0 0\n1 0 0\n0 1e0 -0.5\n3 0 1 2\n"),
    "little.ply": ply("binary_little_endian", FLOATS, LIST, struct.pack("<9fB3i", *points, 3, 0, 1, 2)),
    "big.ply": ply("binary_big_endian", DOUBLES, "property list ushort uint vertex_index\nproperty char flags\n",
                   b"".join(struct.pack(">B3d", 9, *points[at:at + 3]) for at in (0, 3, 6)) + struct.pack(">H3Ib", 3, 2, 1, 0, 1)),
    "others.ply": ply("binary_little_endian", FLOATS, LIST, struct.pack("<9fB3i", *points, 3, 0, 1, 2) + struct.pack("<HhI", 1, -2, 3),
                      "obj_info b\nelement edge 1\nproperty ushort a\nproperty short b\nproperty uint32 c\n"),
    "triangle.obj": b"# a\no a\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2//1 3\n",
    "backwards.obj": b"v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 0 0 1\r\nf -1 -2 \\\r\n -3 -4\r\ns off\r\n",
}
facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e0 0 0\n vertex -0 1 0.5\nendloop\nendfacet\n"
seeds["text.stl"] = f"solid a\n{facet}{facet}endsolid a\nSOLID\nENDSOLID\n".encode()
seeds["bytes.stl"] = struct.pack("<80sI", b"binary", 2) + 2 * (struct.pack("<3f", 0, 0, 1) + struct.pack("<9f", *points) + b"\0\0")
DATA = struct.pack("<9f3B3H3I", *points, 0, 1, 2, 0, 1, 2, 0, 1, 2)


def gltf(node='{"mesh": 0}', indices=1, mode=4, view="", uri=""):
    return f"""{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{node}],
"meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": {indices}, "mode": {mode}}}]}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
{{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}},
{{"bufferView": 1, "byteOffset": 3, "componentType": 5123, "count": 3, "type": "SCALAR"}},
{{"bufferView": 1, "byteOffset": 9, "componentType": 5125, "count": 3, "type": "SCALAR"}}],
"bufferViews": [{{"buffer": 0, "byteLength": 36{view}}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 21}}],
"buffers": [{{"byteLength": 57{uri}}}]}}"""


def glb(text):
    text += " " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(DATA), len(text), 0x4E4F534A) + text.encode() + \
        struct.pack("<II", len(DATA), 0x4E4942) + DATA


TURNED = '{"children": [1], "translation": [1, 2, 3], "rotation": [0, 0, 1, 1], "scale": [1, 2, -3]}, {"mesh": 0}'
MOVED = '{"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1]}'
seeds.update({
    "bytes.glb": glb(gltf()), "turned.glb": glb(gltf(TURNED, 2, 5, ', "byteStride": 12')), "moved.glb": glb(gltf(MOVED, 3, 6)),
    "inline.gltf": gltf(uri=f', "uri": "data:application/octet-stream;base64,{base64.b64encode(DATA).decode()}"').encode(),
    "beside.gltf": gltf(uri=', "uri": "no%20such.bin"').encode(),
})


def vtp(form, word="I", block=0):
    arrays, appended = [], b""
    for kind, name, components, numbers, code in (
            ("Float32", "Points", 3, [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], "f"), ("Int64", "connectivity", 1, [0, 1, 2, 0, 2, 3], "q"),
            ("Int64", "offsets", 1, [3, 6], "q"), ("Int32", "connectivity", 1, [3, 2, 1, 0], "i"), ("Int32", "offsets", 1, [4], "i")):
        data = coded(struct.pack(f"<{len(numbers)}{code}", *numbers), word, block)
        inline = {"ascii": " ".join(map(str, numbers)).encode(), "binary": data, "appended": b""}[form]
        arrays.append(b'<DataArray type="%s" Name="%s" NumberOfComponents="%d" format="%s"%s>%s</DataArray>' % (
            kind.encode(), name.encode(), components, form.encode(), b' offset="%d"' % len(appended) if form == "appended" else b"", inline))
        appended += data
    return b"""<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="%s"%s>
<PolyData><Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="1" NumberOfPolys="2">
<Points>%s</Points><Polys>%s%s</Polys><Strips>%s%s</Strips></Piece></PolyData>%s
</VTKFile>
""" % (b"UInt64" if word == "Q" else b"UInt32", b' compressor="vtkZLibDataCompressor"' if block else b"", *arrays,
       b'<AppendedData encoding="base64">_%s</AppendedData>' % appended if form == "appended" else b"")


seeds.update({"text.vtp": vtp("ascii"), "bytes.vtp": vtp("binary", "Q"), "blocks.vtp": vtp("binary", "I", 16), "appended.vtp": vtp("appended")})
for name, content in seeds.items():
    (folder / name).write_bytes(content)
