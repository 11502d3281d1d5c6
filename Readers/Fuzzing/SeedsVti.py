# SPDX-License-Identifier: BSD-3-Clause
"""SeedsVti.py DIR: small VTK image files of each encoding, whole and broken in one place, for the fuzzer to start from."""
import base64
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "Testing"))
from vtk_xml import coded, lengths  # noqa: E402

folder = Path(sys.argv[1])
voxels = bytes(range(60))


def vti(form, word="I", block=0, encoding="base64", order="LittleEndian"):
    header, data = lengths(voxels, word, block)
    text = coded(voxels, word, block)
    inline = {"ascii": b" ".join(b"%d" % v for v in voxels), "binary": text, "appended": b""}[form]
    raw = header + data if encoding == "raw" else text
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
for name, content in seeds.items():
    (folder / (name + ".vti")).write_bytes(content)
