# SPDX-License-Identifier: BSD-3-Clause
"""SeedsVdb.py DIR: small OpenVDB files as WriteVdb makes them (nothing else writes them from Python), packed here, whole and
broken in one place."""
import base64
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])
packed = {
    "raw": (
        "eNrtms1u00AQx5M2UIooBPXCieQGl0ikNm6SS0VVDhw4pSBxWq3tcVlpPyJ7YyUXnqGv0pfoc5g34A3obGwrdnrhAhLq/KTRzNj/nRmPffTw/O"
        "JrBynQnnZKuicw9cM4mYwgjqcj3/dgFHrB6SgIxskkOPXenfDxRoh2iPZJW9CZsOs+JpcpAEuk4Za9Zz7znPBHVfnbm9Lfvi39HtoztEdokeRZ"
        "9hiDzKZCX7lhEnM1zI1cKjhwghS4NelW8gSjj9F3k3LFjzGGKp7FQrl5jM5c4RwiT7gu+2i9qttRU2/XC9iWdbeXQtvJKzeCABnP6i7sEivPLV"
        "eLrdwtYXy0kUpgYWhWTPFVq/Feo/mOUuiWskm/VkZGLVLI3ANt27o6PLIih2HO5RKyl7U8BsnXEDN8BbFTsfpKfaFbNej9Rp7XxxQoFq4tbHaG"
        "jx/4br/XN732MLlZgcSRltq2hLO6KJrmqrHP1hfyApMvWiQmVfOIS/jMF+W5X2d/1xf3fLex6+7O7ndzgiAIgiAIgiAIgiAIgiAIgiAIgiAIgi"
        "D+Q+gHAIJ4wAxeDwYbj0Hpy/xfne91Ov0PBeJ+0iqKn5Uv8z/F1XgIdgcnEfqY"
    ),
    "blosc": (
        "eNrtms2O0zAQx5OlfIqFoGUlTiRcAAlFYjfp0vaCiuDAAQmpC9fgOpMlkh1XiRu1l30GrjwGbxRuHHkDGDcJTbqXlRAHpPlJo/G4f3vG4yone6"
        "9ef7SQCu2WVWMnz/mYJ3zoA08SPzwJmD+Ox4n/IgxhNErCYTA63gjRbqK9zTRkRarXDganOUCUCMV0NIzCKDDC82bnr09qP3ta+2tot9GuonHB"
        "isJMFDpPszNTTKLOvFKJpYTrRpAD0yrfSm7g6A3/rHIm2QGOoRlP4lSaelRWmI1L4EFqslxBGzTZ9rt6vV7Adlvz8zLN9OiBKSEFEU/aLNEp7j"
        "zTTC62ctOEo/2NVEA0n6tVJNmql3ivk3xHmWY9ZRenVXIlFzkU5kDbtIc4mgtVcO+Zx7hOS/BKJpZQ3GuXxSDYGuIIryI2WaN2xkwcNtdnNWVZ"
        "wya40y6XIKP5WsOmh9iOk9D0+8u3Qb+4Uq1AYInLTPeEk87mGZOd/vb+MXcx+JClicrljDMB79iiXvfz5b/11QVvd3pv79zFbkwQBEEQBEEQBE"
        "EQBEEQBEEQBEEQBEEQxH+I0/g9O9g8gLCbOXoYQBD0YbjwYXAfuq6JXRzUvo4vy9+ux2KcaYX8Qqrqe+Pr+LL4fw53NPiB3piZu49mXpC5eNxP"
        "rmNbj92pbT16PzX8BhJb7aY="
    ),
    "double": (
        "eNrtmt1qE0EUxzdptFWstrQV77J3CrJgyXY3LUJA9MILQWj10mF29qQOzEfYnSzJla/gI/gaPoyQR+gjeCbZbbKtoCBeCOe3ezgzh//MOXMS9m"
        "rCV68/BsgC7X6wopOmL5KU52mUCJ5EMcTDaCh4FsFpGqcJvslQLIVo99DeGgemlG6+j5OLAoDldpopYCcsZgOv/FJv/e3pyj9+tvJ30R6g3UET"
        "ipelD5SukObSVzO2l2Fl1VTDthcUwJ0t1pIdHL0Rn23BNT/AMdTjs1xqX5A1pd+4AjGQPssWWq/Otrupd/MJrLf1ucbKcpfET/xQgsrPmjzsAv"
        "c+d1xP1gt8H453l1I8dJbZGdN81krd3Uh/QylNS7nJXqMUVk8KKP2R1mmPcJQpW4rweciFkxWEFVdTKPebZTkoPoec4WFyn5U1ER84qn/Ba05q"
        "/7BZrkGzbO5g2UVpsB++41+/99rFVXYGCkucGtcSvqz383LD9UaHW3+aRzj5YOTYFvpccAXv+GS17mr0b/3ilu/c6P/v5gRBEARBEARBEARBEA"
        "RBEARBEARBEARB/Ifs1b7bGSwvQXTqGF0MIAj6MNz6MPSR4Bf+T/nb9UF0Xdhxb4FVefOxQzR/A6yPpf7oL7pB3h91g0/vRwE+PwEYOrA8"
    ),
}
for name, text in packed.items():
    content = zlib.decompress(base64.b64decode(text))
    (folder / name).write_bytes(content)
    (folder / (name + "Cut")).write_bytes(content[:-40])
