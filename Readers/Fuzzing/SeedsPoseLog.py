# SPDX-License-Identifier: BSD-3-Clause
"""SeedsPoseLog.py DIR: recordings of trackers in all formats, whole and wrong in one place, for the fuzzer to start from."""
import sys
from pathlib import Path

folder = Path(sys.argv[1])
head = "time,tool,tx,ty,tz,qw,qx,qy,qz,status\n"
names = "Sample:,Hour,Minutes,Seconds,ms" + "".join(f",X{s},Y{s},Z{s},qo{s},qx{s},qy{s},qz{s}" for s in "ab")
ndi = "Test Date: \r\nday, month, year\r\n2, 2, 2021\r\n\r\n" + names + "\r\n"
identity = "1,0,0,5,0,1,0,0,0,0,1,0,0,0,0,1"
sequence = "ObjectType = Image\nNDims = 3\nDimSize = 0 0 1\nElementSpacing = 1 1 1\nElementType = MET_OTHER\nKinds = domain domain list\n"
frame = "Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1\nSeq_Frame0000_Timestamp = 1\n"
seeds = {
    "plain.csv": head + "1,Probe,1,2,3,0.6,0.8,0,0,OK\n2,\"Reference, old\",1,2,nan,1,0,0,0,OUT_OF_VIEW\n",
    "blanks.txt": "# timestamp tx ty tz qx qy qz qw\n2 1 2 3 .8 0 0 .6\n",
    "semicolons.csv": "\ufefft;x;y;z;q0;q1;q2;q3\r\n1;2;3;4;1;0;0;0\r\n",
    "ndi.csv": ndi + "1, 23 , 59 , 59, 821,0,0,0,0,0,0,0,1,2,3,0.6,0.8,0,0, \r\n2, 0 , 0 , 0, 1,1,2,3,\r\n",
    "pairs.csv": f"# t, A, B\n0.5,{identity},{identity}\n0.6,{identity},nan\n",
    "poses.igs.mha": sequence + frame + "ElementDataFile = LOCAL\n",
    "open.csv": head + '1,"Probe,1,2,3,1,0,0,0,OK\n',
}
for name, content in seeds.items():
    (folder / name).write_text(content, encoding="utf-8", newline="")
