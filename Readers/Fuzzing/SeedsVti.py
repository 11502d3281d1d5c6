# SPDX-License-Identifier: BSD-3-Clause
"""SeedsVti.py DIR: small VTK image and polygon files of each encoding, whole and broken in one place, for the fuzzer to start from."""
import base64
import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])
voxels = bytes(range(60))


def lengths(data, word, block):
    """The data as VTK writes them: behind their length, or in compressed blocks behind the lengths of those."""
    if not block:
        return struct.pack("<" + word, len(data)), data
    blocks = [zlib.compress(data[i:i + block]) for i in range(0, len(data), block)]
    sizes = [len(blocks), block, len(data) % block, *map(len, blocks)]
    return struct.pack(f"<{len(sizes)}{word}", *sizes), b"".join(blocks)


def vti(form, word="I", block=0, encoding="base64", order="LittleEndian"):
    header, data = lengths(voxels, word, block)
    coded = base64.b64encode(header) + base64.b64encode(data) if block else base64.b64encode(header + data)
    inline = {"ascii": b" ".join(b"%d" % v for v in voxels), "binary": coded, "appended": b""}[form]
    raw = header + data if encoding == "raw" else coded
    tail = b'<AppendedData encoding="%s">_%s</AppendedData>' % (encoding.encode(), raw) if form == "appended" else b""
    return b"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="%s" header_type="%s"%s>
  <ImageData WholeExtent="0 4 0 3 0 2" Origin="0 0 0" Spacing="1 1 1" Direction="1 0 0 0 1 0 0 0 1">
    <FieldData><DataArray type="String" Name="Modality" NumberOfTuples="1" format="ascii">77 82 0</DataArray></FieldData>
    <Piece Extent="0 4 0 3 0 2"><PointData Scalars="Echoes">
      <DataArray type="UInt8" Name="Echoes" NumberOfComponents="1" format="%s"%s>%s</DataArray>
    </PointData><CellData></CellData></Piece>
  </ImageData>
  %s
</VTKFile>
""" % (order.encode(), b"UInt64" if word == "Q" else b"UInt32", b' compressor="vtkZLibDataCompressor"' if block else b"",
       form.encode(), b' offset="0"' if form == "appended" else b"", inline, tail)


def vtp(form, word="I", block=0):
    arrays, appended = [], b""
    for kind, name, components, numbers, code in (
            ("Float32", "Points", 3, [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], "f"), ("Int64", "connectivity", 1, [0, 1, 2, 0, 2, 3], "q"),
            ("Int64", "offsets", 1, [3, 6], "q"), ("Int32", "connectivity", 1, [3, 2, 1, 0], "i"), ("Int32", "offsets", 1, [4], "i")):
        header, data = lengths(struct.pack(f"<{len(numbers)}{code}", *numbers), word, block)
        coded = base64.b64encode(header) + base64.b64encode(data) if block else base64.b64encode(header + data)
        inline = {"ascii": " ".join(map(str, numbers)).encode(), "binary": coded, "appended": b""}[form]
        arrays.append(b'<DataArray type="%s" Name="%s" NumberOfComponents="%d" format="%s"%s>%s</DataArray>' % (
            kind.encode(), name.encode(), components, form.encode(), b' offset="%d"' % len(appended) if form == "appended" else b"", inline))
        appended += coded
    return b"""<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="%s"%s>
<PolyData><Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="1" NumberOfPolys="2">
<Points>%s</Points><Polys>%s%s</Polys><Strips>%s%s</Strips></Piece></PolyData>%s
</VTKFile>
""" % (b"UInt64" if word == "Q" else b"UInt32", b' compressor="vtkZLibDataCompressor"' if block else b"", *arrays,
       b'<AppendedData encoding="base64">_%s</AppendedData>' % appended if form == "appended" else b"")


seeds = {
    "ascii": vti("ascii"),
    "binary": vti("binary"),
    "binary64": vti("binary", "Q"),
    "blocks": vti("binary", "I", 32),
    "blocks64": vti("binary", "Q", 32),
    "appended": vti("appended"),
    "appendedBlocks": vti("appended", "I", 32),
    "raw": vti("appended", "Q", 0, "raw"),
    "rawBlocks": vti("appended", "I", 32, "raw"),
    "noBlock": vti("binary", "I", 32).replace(base64.b64encode(struct.pack("<3I", 2, 32, 28)), base64.b64encode(struct.pack("<3I", 2, 0, 28))),
    "bigEndian": vti("ascii", order="BigEndian"),
    "wrongType": vti("binary").replace(b'"UInt8"', b'"Floatnan"'),
    "cut": vti("binary")[:-120],
}
seeds.update({"polygons": vtp("ascii"), "polygonsBinary": vtp("binary", "Q"), "polygonsBlocks": vtp("binary", "I", 16),
              "polygonsAppended": vtp("appended")})
for name, content in seeds.items():
    (folder / (name + ".vti")).write_bytes(content)
