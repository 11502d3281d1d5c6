#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The examples in Python run as a user would run them: volumes come together, a sweep becomes a volume, pictures are made."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
build = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])

with tempfile.TemporaryDirectory() as folder:
    answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / "stitch_phantom.py"], cwd=folder, capture_output=True, text=True)
    print(answer.stdout, answer.stderr, sep="")
    written = pathlib.Path(folder) / "stitched.vti"
    scores = re.search(r"off by ([\d.]+) mm before, ([\d.]+) mm after", answer.stdout)
    if answer.returncode != 0 or not written.is_file() or written.stat().st_size < 10_000:
        sys.exit("TestExamples: stitched.vti was not written")
    sweep = source.parent / "shared" / "data" / "liver" / "liver_sweep.igs.mha"
    if sweep.is_file():
        answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / "reconstruct_sweep.py", sweep], cwd=folder,
                                capture_output=True, text=True)
        print(answer.stdout, answer.stderr, sep="")
        volume = pathlib.Path(folder) / "sweep.vti"
        if answer.returncode != 0 or "140 frames used" not in answer.stdout or volume.stat().st_size < 100_000:
            sys.exit("TestExamples: the sweep did not become a volume")
    pictures = pathlib.Path(folder) / "pictures"
    liver = sorted(sweep.parent.glob("liver_volume_[AB].mha"))
    answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / "stitching_figures.py", "--size", "60", pictures,
                             *liver], cwd=folder, capture_output=True, text=True)
    print(answer.stdout, answer.stderr, sep="")
    made = [path for path in pictures.glob("*.png") if path.stat().st_size > 2_000]
    if answer.returncode != 0 or len(made) != (7 if liver else 6):
        sys.exit(f"TestExamples: {len(made)} pictures of stitching were made")
    answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / "calibration_figures.py", pictures], cwd=folder,
                            capture_output=True, text=True)
    print(answer.stdout, answer.stderr, sep="")
    if answer.returncode != 0 or (pictures / "PrintableSource.png").stat().st_size < 20_000:
        sys.exit("TestExamples: calibration_figures.py did not make its picture")
    for arguments, wanted in ((["noise_tiling_figures.py", "--spacing", "2", pictures], ["NoiseTiler"]),
                              (["noise_figures.py", pictures], ["NoiseSource"]),
                              (["optical_hardware_figures.py", pictures], ["optical-hardware"]),
                              (["shell_figures.py", "--resolution", "1", pictures], ["shell"]),
                              (["live_image_figures.py", "--spacing", "1.5", pictures], ["live_image"]),
                              (["live_scene_figures.py", "--detail", "5", "--cells", "10", pictures], ["live_scene"]),
                              (["synthesis_mode_figures.py", "--quick", pictures], ["Synthesizer", "SynthesizerClarity", "SynthesizerBeams"]),
                              (["synthesis_tissue_figures.py", pictures], ["TissueSource", "TissueSourceLevels"]),
                              (["pressing_figures.py", "--quick", "--sph", build / "benchmarks" / "BenchmarkSph", pictures],
                               ["Gel", "TissuePress", "Moving", "sph_block", "sph_bodies", "sph_gel"]),
                              (["embedding_figures.py", "--spacing", "3", pictures],
                               ["embedding_coverage", "embedding_background", "embedding_ways", "embedding_outlines"])):
        answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / arguments[0], *arguments[1:]], cwd=folder,
                                capture_output=True, text=True)
        print(answer.stdout, answer.stderr, sep="")
        if answer.returncode != 0 or not all((pictures / f"{name}.png").is_file() for name in wanted):
            sys.exit(f"TestExamples: {arguments[0]} did not make its pictures")
    if not scores or float(scores[1]) < 3.0 or float(scores[2]) > 1.0:
        sys.exit("TestExamples: the volumes did not come together")
