# SPDX-License-Identifier: BSD-3-Clause
"""The part of the synthetic demo in which the probe presses the tissue: rigid and deformable alignment, scored by landmarks."""
import dataclasses
import json
import pathlib

LANDMARKS = 40
RESULTS = ["pressed.start.json", "pressed.rigid.json", "pressed.json", "pressed.stitched.mha", "pressed.stitched.ValidRegion.mha",
           "pressed.png", "pressed_pairs.png"]


@dataclasses.dataclass(frozen=True)
class Pressed:
    """What the subcommands said of the pressed volumes."""
    steps: object
    files: list
    rigid: pathlib.Path  # pose files
    deformable: pathlib.Path
    errors: dict  # by where the volumes lie: how far landmarks of one label lie apart, as score tells it
    verdicts: list  # per volume, as the next
    deformations: list  # what was found; None for the fixed volume, and for one that failed
    coupled: list  # the share of the face that gel or skin touches


def scene_file(out, quick):
    """The example scene of a pressed abdomen; coarse, for tests."""
    path = pathlib.Path(__file__).resolve().parents[2] / "Examples" / "scenes" / "pressed.json"
    if not quick:
        return path
    scene = json.loads(path.read_text())
    scene.pop("$schema", None)
    scene["probe"].update(elements=48, sweepSteps=32, samples=160)
    scene["transport"] = {"subRays": 1}
    scene["press"]["spacingMm"] = 10
    scene["gel"]["cellMm"] = 5
    scene["volume"]["spacingMm"] = 2
    coarse = out / "pressed.scene.json"
    coarse.write_text(json.dumps(scene))
    return coarse


def without_displacements(poses, out):
    """The rigid part of a pose file of one folder."""
    written = json.loads(poses.read_text())
    for volume in written["volumes"]:
        volume.pop("displacement", None)
    out.write_text(json.dumps(written, indent=1) + "\n")


def press(steps, out, quick, files_of, write_identities):
    """Runs the subcommands, and keeps what they said."""
    for old in [*(out / name for name in RESULTS), *out.glob("pressed.displacement-*.vti")]:
        old.unlink(missing_ok=True)
    folder = out / "pressed"
    made = steps.run("making three volumes of the abdomen under a probe that presses it through gel: some 90 seconds on two cores",
                     "synthesize", scene_file(out, quick), "-o", folder, "--landmarks", LANDMARKS)
    truth = folder / "truth.json"
    files = files_of(truth)
    poses = {"where they lay": out / "pressed.start.json", "aligned rigidly": out / "pressed.rigid.json",
             "aligned deformably": out / "pressed.json", "the truth": truth}
    found = steps.run("aligning the pressed volumes, rigidly and then deformably", "align", *files, "--deformable", "-o",
                      poses["aligned deformably"])
    write_identities(poses["where they lay"], files)
    without_displacements(poses["aligned deformably"], poses["aligned rigidly"])
    lists = [folder / f"landmarks_{number}.csv" for number in range(1, len(files) + 1)]
    errors = {name: steps.run(f"scoring by landmarks: {name}", "score", file, "--landmarks", *lists)["landmarks"]
              for name, file in poses.items()}
    steps.run("stitching, with the deformation taken back", "stitch", *files, "--poses", poses["aligned deformably"], "-o",
              out / "pressed.stitched.mha")
    return Pressed(steps, files, poses["aligned rigidly"], poses["aligned deformably"], errors,
                   [volume["verdict"] for volume in found["volumes"]],
                   [volume.get("deformation") for volume in found["volumes"]],
                   [volume["gel"]["coupled"] for volume in made["volumes"]])
