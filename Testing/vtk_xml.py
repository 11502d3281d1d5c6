# SPDX-License-Identifier: BSD-3-Clause
"""Data of arrays as VTK's XML files hold them: for the seeds of fuzzers."""
import base64
import struct
import zlib


def lengths(data, word, block):
    """The data as VTK writes them: behind their length, or in compressed blocks behind the lengths of those."""
    if not block:
        return struct.pack("<" + word, len(data)), data
    blocks = [zlib.compress(data[i:i + block]) for i in range(0, len(data), block)]
    sizes = [len(blocks), block, len(data) % block, *map(len, blocks)]
    return struct.pack(f"<{len(sizes)}{word}", *sizes), b"".join(blocks)


def coded(data, word, block):
    """The same as base64; lengths of blocks are coded by themselves."""
    header, data = lengths(data, word, block)
    return base64.b64encode(header) + base64.b64encode(data) if block else base64.b64encode(header + data)
