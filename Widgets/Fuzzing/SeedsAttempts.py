# SPDX-License-Identifier: BSD-3-Clause
"""SeedsAttempts.py DIR: small histories of attempts, whole and broken in one place, for the fuzzer to start from."""
import sys
from pathlib import Path

folder = Path(sys.argv[1])
head = "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,project\n"
line = '2024-05-17T09:30:00Z,"Doe, J",12.5,1.25,2,0.5,9,14,"a ""liver"""\n'
seeds = {
    "one": head + line,
    "two": head + line + line.replace("12.5", "1e-3"),
    "windows": (head + line).replace("\n", "\r\n"),
    "mark": "\ufeff" + head + line,
    "lines": head + line.replace("liver", "two\nlines"),
    "cut": head + line + line[:40],
    "number": head + line.replace("1.25", "nan"),
    "other": "a,b,c\n1,2,3\n",
}
for name, text in seeds.items():
    (folder / name).write_bytes(text.encode())
