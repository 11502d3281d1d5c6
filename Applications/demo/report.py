# SPDX-License-Identifier: BSD-3-Clause
"""The report of the demo: numbers, sentences and pictures put into report.html, one file that needs no other."""
import base64
import dataclasses
import datetime
import html
import json
import math
import os
import pathlib
import platform
import string
import subprocess

import echorama
import numpy as np

import pictures
from volumes import Displacement, Lattice, Volume, box_around, overlaps, way_down

WORDS = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six", 7: "Seven", 8: "Eight", 9: "Nine", 10: "Ten"}


@dataclasses.dataclass(frozen=True)
class Report:
    path: pathlib.Path
    summary: str  # a few lines for the terminal


def mm(value):
    """A length that a person can read: two figures below 10 mm, whole numbers above."""
    return f"{value:.2f}" if value < 1 else f"{value:.1f}" if value < 10 else f"{value:.0f}"


def times(numbers, form="{:.0f}"):
    return " × ".join(form.format(number) for number in numbers)


def spacing_text(spacing):
    return f"{spacing[0]:.3g}" if np.ptp(spacing) < 1e-6 * spacing[0] else times(spacing, "{:.3g}")


def data_uri(path):
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()


def row(*cells):
    """A table row: text to the left, numbers (given as tuples of one) to the right. Cells are HTML."""
    return "<tr>" + "".join(f'<td class="n">{cell[0]}</td>' if isinstance(cell, tuple) else f"<td>{cell}</td>" for cell in cells) + "</tr>"


def poses_of(pose_file):
    """VolumeToWorld of each file, by its full path."""
    return {(pose_file.parent / volume["file"]).resolve(): np.array(volume["VolumeToWorld"], float)
            for volume in json.loads(pose_file.read_text())["volumes"]}


def motion(volume, pose):
    """How far a pose moves the middle of the real voxels (mm), and by how much it turns (degrees)."""
    low, high = volume.real_box()
    middle = (low + high) / 2
    moved = pose[:3, :3] @ middle + pose[:3, 3]
    cosine = (np.trace(pose[:3, :3]) - 1) / 2
    return float(np.linalg.norm(moved - middle)), math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


def motion_text(volume, pose):
    distance, angle = motion(volume, pose)
    return "stayed" if distance < 1e-6 and angle < 1e-4 else f"{mm(distance)} mm, {angle:.1f}°"


def score_section(names, before, after):
    """Table with bars, and what the numbers mean."""
    longest = max([*before, 1e-9])
    rows = []
    for name, first, last in zip(names, before, after):
        if first < 1e-9 and last < 1e-9:
            rows.append(row(name, ("0",), ("0",), "held fixed: the others are measured against it"))
            continue
        bars = "".join(f'<div><span class="bar {kind}" style="width: {max(0.3, 95 * value / longest):.1f}%"></span></div>'
                       for kind, value in (("before", first), ("after", last)))
        rows.append(row(name, (mm(first),), (mm(last),), f'<div style="min-width: 14rem">{bars}</div>'))
    return ("<p>These volumes were moved on purpose, so where they belong is known. The score of a volume is the mean distance, over points "
            "spread through its real voxels, between where a point lies and where it belongs. 0 would be perfect.</p>"
            '<table><tr><th>volume</th><th class="n">before, mm</th><th class="n">after, mm</th><th style="width: 50%"></th></tr>'
            + "".join(rows) + "</table>")


def meaning(worst_mm, voxel_mm):
    """What a score means, in a sentence."""
    if worst_mm <= 0.5 * voxel_mm:
        return "That is less than half a voxel: no eye will see it."
    if worst_mm <= voxel_mm:
        return "That is less than one voxel, about as good as pictures of this resolution allow."
    if worst_mm <= 3 * voxel_mm:
        return "That is a few voxels: fine contours may look slightly doubled."
    return "That is more than three voxels: the alignment did not succeed, and the stitched volume should not be used."


def signed(value):
    return f"{value:.2f}".replace("-", "\u2212")


def weakest_correlation(pairs, count):
    """Of the worst volume with its best partner: pairs that hardly touch say little."""
    return min(max((pair.correlation for pair in pairs if index in (pair.first, pair.second) and math.isfinite(pair.correlation)),
                   default=0.0) for index in range(count))


def all_joined(pairs, count):
    joined = {0}
    for _ in range(count):
        joined |= {end for pair in pairs for end in (pair.first, pair.second) if {pair.first, pair.second} & joined}
    return len(joined) == count


def verdict(pairs_before, pairs_after, count):
    """Whether the volumes agree where they overlap: a sentence, and whether there is doubt."""
    if not all_joined(pairs_after, count):
        return "Some of the volumes overlap no other by at least 5%. Where they lie is not supported by anything.", True
    weakest = weakest_correlation(pairs_after, count)
    now = (f"Where they overlap, each correlates with a neighbour by at least {signed(weakest)}; before the alignment it was "
           f"{signed(weakest_correlation(pairs_before, count))}.")
    if weakest >= 0.4:
        return f"The volumes show the same structures in the same places. {now}", False
    if weakest >= 0.2:
        return f"The volumes agree in part. {now} Look at the pictures below before relying on the result.", True
    return f"The volumes hardly agree. {now} The alignment is probably wrong, or they do not show the same tissue.", True


def overlap_table(names, pairs_before, pairs_after, what="before → after"):
    known = {(pair.first, pair.second): pair for pair in pairs_before}
    rows = []
    for pair in pairs_after:
        old = known.get((pair.first, pair.second))
        rows.append(row(f"{names[pair.first]} and {names[pair.second]}", (f"{pair.percent:.0f}%",),
                        ((signed(old.correlation) if old else "–") + f" → <strong>{signed(pair.correlation)}</strong>",),
                        ((f"{old.difference:.1f}" if old else "–") + f" → <strong>{pair.difference:.1f}</strong>",)))
    return (f'<table><tr><th>pair</th><th class="n">overlap, of the smaller</th><th class="n">correlation, {what}</th>'
            f'<th class="n">mean difference in grey, {what}</th></tr>' + "".join(rows) + "</table>")


def embedding_section(stitched_file, embedded_file):
    """What embedding made, in a paragraph and a table, and whether the data are untouched."""
    volumes = []
    for file in (embedded_file, stitched_file):
        reader = echorama.vtkUltrasoundReader()
        reader.SetFileName(str(file))
        reader.Update()
        volumes.append(reader.GetOutput())
    measure = echorama.vtkUltrasoundEmbedQuality()
    measure.SetInputData(volumes[0])
    measure.SetOriginalData(volumes[1])
    measure.Update()
    if not measure.GetReport():
        raise ValueError("the embedded volume cannot be measured")
    numbers = json.loads(measure.GetReport())
    voxels, border = numbers["voxels"], numbers["border"]
    wrong = voxels["altered"] + voxels["pretended"] + voxels["lost"]
    total = voxels["data"] + voxels["blend"] + voxels["invented"]
    text = ("<p>A stitched volume has an outline that no machine makes. Here it lies in the fan that a machine would have needed to see it all; "
            "what is missing was filled with noise that has the brightness, the contrast and the grain of what lies beside it. It is made up, and "
            "marked as such, voxel by voxel, in <code>embedded.Embedding.mha</code>.</p>")
    rows = [row("voxels that show the data, to the last bit", (f"{100 * voxels['data'] / total:.0f}%",)),
            row("voxels at their border, mixed with background", (f"{100 * voxels['blend'] / total:.0f}%",)),
            row("voxels that were invented", (f"{100 * voxels['invented'] / total:.0f}%",)),
            row("voxels that are not what their label says", (str(wrong),))]
    if border["percentile95"] is not None:
        rows.append(row("brightness jumps across 95% of the border by at most, grey levels", (f"{border['percentile95']:.1f}",)))
    if numbers["reference"]["percentile95"] is not None:
        rows.append(row("the same inside the tissue, at surfaces drawn at random", (f"{numbers['reference']['percentile95']:.1f}",)))
    if border["deviation_ratio"] is not None:
        rows.append(row("contrast of the noise, over that of the tissue beside it", (f"{border['deviation_ratio']:.2f}",)))
    if numbers["crop"]["share"] is not None:
        rows.append(row("of the data, what the largest crop without ragged borders would have kept", (f"{100 * numbers['crop']['share']:.0f}%",)))
    return text + "<table>" + "".join(rows) + "</table>", wrong


def what_bending_did(rigid_mm, deformable_mm):
    """A sentence about the mean distance of landmarks."""
    change = f"from {mm(rigid_mm)} to {mm(deformable_mm)}&nbsp;mm"
    if deformable_mm < 0.95 * rigid_mm:
        return f"Taking the deformation back as far as the images show it brought landmarks nearer to each other, {change} on average."
    if deformable_mm <= 1.05 * rigid_mm:
        return f"What the images show of the deformation hardly changed the distances of landmarks, {change} on average."
    return f"What was taken for deformation moved landmarks apart, {change} on average: here the rigid result is the better one."


def steps_table(steps):
    done = "".join(row(html.escape(what), f"<code>{html.escape(command)}</code>", (f"{took:.2f}",)) for what, command, took in steps.done)
    return f'<table><tr><th>step</th><th>command</th><th class="n">seconds</th></tr>{done}</table>'


def pressed_section(out, pressed, quick):
    """The volumes of a probe that pressed: aligned rigidly and deformably, in numbers and pictures. Returns HTML and a line."""
    files = [file.resolve() for file in pressed.files]
    written = json.loads(pressed.deformable.read_text())["volumes"]
    fields = {(out / volume["file"]).resolve(): Displacement(out / volume["displacement"]) for volume in written if "displacement" in volume}
    poses = poses_of(pressed.rigid)
    rigid = [Volume.read(file).moved(poses[file]) for file in files]
    bent = [dataclasses.replace(volume, displacement=fields.get(file)) for volume, file in zip(rigid, files)]
    stitched = Volume.read(out / "pressed.stitched.mha")
    names = [html.escape(volume.name) for volume in rigid]

    grid_rigid, grid_bent = Lattice.over(rigid), Lattice.over(bent)
    pairs_rigid, pairs_bent = overlaps(grid_rigid), overlaps(grid_bent)
    shared = grid_rigid.real.sum(axis=0) > 1
    centre = grid_rigid.points[shared if shared.any() else grid_rigid.real.any(axis=0)].mean(axis=0)
    down = way_down(grid_rigid.points, grid_rigid.real[0])
    low, high = box_around(rigid)
    window = pictures.window_of(stitched)
    step = max(float((high - low).max()) / (200 if quick else 520), 0.5 * float(stitched.spacing.min()))
    pictures.draw_slices(out / "pressed.png", rigid, bent, stitched, pictures.views_through(centre, down, low, high)[:2], window, step,
                         ("aligned rigidly, averaged", "deformation taken back, averaged", "deformation taken back, stitched"))
    figures = (f'<figure><img src="{data_uri(out / "pressed.png")}" alt="Two planes of the pressed volumes">'
               "<figcaption>Two planes through one point of the overlap. Left: the volumes averaged where a rigid alignment puts them. Middle: "
               "averaged, each read through the displacement that was found for it. Right: stitched in the same way.</figcaption></figure>")
    shown = sorted(sorted(pairs_bent, key=lambda pair: -pair.percent)[:2], key=lambda pair: pair.first)
    if shown:
        pictures.draw_overlays(out / "pressed_pairs.png", rigid, bent, shown, down, low, high, window, step,
                               ("aligned rigidly", "deformation taken back"))
        figures += (f'<figure><img src="{data_uri(out / "pressed_pairs.png")}" alt="Pairs of pressed volumes in two colours">'
                    "<figcaption>The pairs in green and magenta: grey where both show the same.</figcaption></figure>")

    rows = "".join(row(html.escape(name), *((mm(error[key]),) for key in ("mean_mm", "median_mm", "percentile95_mm", "max_mm")))
                   for name, error in pressed.errors.items())
    told = []
    for name, verdict_of, found in zip(names, pressed.verdicts, pressed.deformations):
        if found is not None:
            told.append(f"{name} is {verdict_of}, and " + (f"was bent by up to {mm(found['largest_mm'])}&nbsp;mm" if found["applied"] else
                        f"was not bent: {html.escape(found['reason'])}"))
        elif verdict_of == "failed":
            told.append(f"{name} could not be aligned, and was not bent")
    rigid_mm, deformable_mm = (pressed.errors[name]["mean_mm"] for name in ("aligned rigidly", "aligned deformably"))
    sentence = what_bending_did(rigid_mm, deformable_mm)
    took = sum(seconds for _, _, seconds in pressed.steps.done)
    text = (
        "<h2>Under a probe that presses</h2>"
        "<p>A probe is pressed on skin, and tissue gives way. Here the face lies 5&nbsp;mm below the skin of an abdomen of the same kind, behind a cap of gel, in "
        "three views; each deforms the tissue in its own way, so no rigid motion is right everywhere. Gel or skin touches at least "
        f"{100 * min(pressed.coupled):.0f}% of the face in each view.</p>"
        "<p>Where places of the tissue are in every volume is known; <em>the truth</em> below is the poses and displacements that the volumes "
        "were made with. Images alone do not lead there: sound is bent on its way, so that each volume shows tissue some 2&nbsp;mm from where it is. "
        f"How far {pressed.errors['aligned rigidly']['pairs']} pairs of places lie apart:</p>"
        '<table><tr><th></th><th class="n">mean, mm</th><th class="n">median, mm</th><th class="n">95% within, mm</th><th class="n">at most, mm</th></tr>'
        f"{rows}</table><p class=\"verdict{' doubt' if deformable_mm > 0.95 * rigid_mm else ''}\">{sentence}</p>"
        f"<p>{'. '.join(told)}.</p><p>How alike the volumes are where they overlap, aligned rigidly and with the deformation taken back:</p>"
        f"{overlap_table(names, pairs_rigid, pairs_bent, 'rigid → deformable')}{figures}"
        f"<p>It took {took:.0f} seconds of computing beside what is above:</p>{steps_table(pressed.steps)}")
    return text, f"pressed   landmarks {mm(rigid_mm)} mm apart after rigid, {mm(deformable_mm)} mm after deformable alignment ({took:.0f} s computing)"


def style():
    """What all pages of the demo look like."""
    return f"<style>\n{(pathlib.Path(__file__).parent / 'style.css').read_text()}</style>"


def machine():
    threads = len(os.sched_getaffinity(0))
    return f"{platform.machine()} with {threads} core{'s' if threads > 1 else ''}"


def version_of(program):
    answer = subprocess.run([program, "--version"], capture_output=True, text=True)
    return answer.stdout.strip() or "echorama"


def write_report(out, steps, files, truth_file, before, after, quick, pressed=None):
    """Draws the pictures and writes report.html into the folder \a out. The scores (mm per volume, in the order of files) are
    None where there is no truth. \a pressed: what was found of pressed volumes, if there are any."""
    at_first = [Volume.read(file) for file in files]
    poses = [poses_of(out / "poses.json")[file.resolve()] for file in files]
    now = [volume.moved(pose) for volume, pose in zip(at_first, poses)]
    stitched = Volume.read(out / "stitched.mha")
    embedded = Volume.read(out / "embedded.mha")
    embedding, wrong = embedding_section(out / "stitched.mha", out / "embedded.mha")
    names = [html.escape(volume.name) for volume in at_first]

    grid_before, grid_after = Lattice.over(at_first), Lattice.over(now)
    pairs_before, pairs_after = overlaps(grid_before), overlaps(grid_after)
    shared = grid_after.real.sum(axis=0) > 1
    if not shared.any():
        shared = grid_after.real.any(axis=0)
    centre = grid_after.points[shared].mean(axis=0)
    down = way_down(grid_after.points, grid_after.real[0])
    low, high = box_around(at_first + now)
    margin = 0.02 * (high - low).max()
    low, high = low - margin, high + margin
    window = pictures.window_of(stitched)
    views = pictures.views_through(centre, down, low, high)
    step = max(float((high - low).max()) / (200 if quick else 520), 0.5 * float(stitched.spacing.min()))

    pictures.draw_slices(out / "slices.png", at_first, now, stitched, views, window, step)
    pictures.draw_edges(out / "edges.png", now, stitched, views, window, step)
    fan_low, fan_high = embedded.as_seen().real_box()
    wide = np.minimum(low, fan_low - margin), np.maximum(high, fan_high + margin)
    pictures.draw_embedded(out / "embedded.png", stitched, embedded, pictures.views_through(centre, down, *wide), window, step)
    pictures.draw_rendering(out / "rendering.png", stitched, centre, down, window)
    shown = sorted(sorted(pairs_after, key=lambda pair: -pair.percent)[: max(1, min(3, len(files) - 1))], key=lambda pair: pair.first)
    overlays = ""
    if shown:
        pictures.draw_overlays(out / "overlays.png", at_first, now, shown, down, low, high, window, step)
        overlays = (f'<figure><img src="{data_uri(out / "overlays.png")}" alt="Pairs of volumes in two colours, before and after alignment">'
                    "<figcaption>Pairs laid over each other, one in green, one in magenta. Where both show the same, the colours add up to "
                    "grey; a structure that is out of place stands there twice, once in each colour. Dim grey: only one of the two.</figcaption></figure>")

    sentence, doubt = verdict(pairs_before, pairs_after, len(files))
    real_low, real_high = stitched.real_box()
    size = times((real_high - real_low) / 10).replace(" ", "\u00a0") + "\u00a0cm"
    seconds = {what: took for what, _, took in steps.done}
    total = sum(seconds.values())
    count = WORDS.get(len(files), str(len(files)))
    title = f"{count} ultrasound volumes, stitched into one"
    facts = []
    if truth_file:
        moving = [index for index, value in enumerate(before) if value > 1e-9]
        worst_before, worst_after = max(before), max(after)
        voxel = float(max(volume.spacing.max() for volume in at_first))
        truth = poses_of(truth_file)
        truth_poses = [truth[file.resolve()] for file in files]
        knocks = [motion(at_first[index], truth_poses[index]) for index in moving]
        lead = (f"{count} overlapping volumes of a simulated abdomen were knocked out of place, by about {knocks[0][0]:.0f}&nbsp;mm and "
                f"{knocks[0][1]:.0f}&nbsp;degrees each. Echorama found where they belong, to within <strong>{mm(worst_after)}&nbsp;mm</strong>, and "
                f"blended them into one volume of {size}. {meaning(worst_after, voxel)}")
        facts += [("out of place before (worst volume)", f"{mm(worst_before)} mm"), ("after", f"{mm(worst_after)} mm")]
        score = score_section(names, before, after)
        score += f"<p>At worst a volume is {mm(worst_after)}&nbsp;mm off on average. {meaning(worst_after, voxel)}</p>"
        input_text = ("<p>Simulated volumes of one piece of tissue: an organ with a capsule, vessels, cysts, bright and dark lesions and a stone with "
                      "its shadow, scanned by a curved 3D probe from different places, with different gain. They share speckle only as "
                      "far as their angles of view are alike, as real volumes do. The first stays in place; the others were knocked.</p>")
        moved_heading, moved_poses = "out of place by", truth_poses
    else:
        lead = (f"{count} overlapping volumes were aligned, starting from where their files say they lie, and blended into one volume "
                f"of {size}.")
        facts += [("correlation in the overlaps, at least", signed(weakest_correlation(pairs_after, len(files))))]
        score = ("<p>Nobody knows where these volumes truly belong, so there is no error in millimetres to report. What can be said is how well they "
                 "agree, in the next section. The table above tells how far each volume was moved.</p>")
        input_text = "<p>The volumes as their files place them. The first one stays where it is.</p>"
        moved_heading, moved_poses = "moved by", poses
    facts += [("size of the stitched volume", size), ("of computing", f"{total:.1f} s")]

    rows = [row(name, (times(volume.dimensions, "{}"),), (spacing_text(volume.spacing),), (times(volume.extent_mm),),
                (f"{volume.real_percent:.0f}%",), (motion_text(volume, pose),)) for name, volume, pose in zip(names, at_first, moved_poses)]
    pressed_text, pressed_line = pressed_section(out, pressed, quick) if pressed else ("", None)
    listing = {
        "stitched.mha": "the stitched volume; its valid region lies beside it",
        "embedded.mha": "the same in the fan of a machine; <code>embedded.Embedding.mha</code> beside it says what was invented",
        "poses.json": "where each volume belongs, for <code>echorama stitch --poses</code> and <code>echorama view --poses</code>",
        "slices.png, overlays.png, edges.png, embedded.png, rendering.png": "the pictures of this page",
        "report.html": "this page: one file, to be kept or sent",
    }
    if truth_file:
        listing[truth_file.parent.name] = "the three volumes as they went in, and <code>truth.json</code>, the poses that put them back"
        listing["start.json"] = "poses that leave every volume where it lay, to score the start"
    if pressed:
        listing["pressed"] = "the volumes of the probe that presses, with their truth and landmarks"
        listing["pressed.json, pressed.rigid.json"] = "where they belong, with and without the displacements (<code>pressed.displacement-N.vti</code>)"
        listing["pressed.stitched.mha"] = "the three, stitched"

    page = string.Template((pathlib.Path(__file__).parent / "report.html").read_text()).substitute(
        style=style(), title=title, lead=lead, facts="".join(f"<li><strong>{value}</strong>{name}</li>" for name, value in facts),
        input_text=input_text, input_rows="".join(rows), moved_heading=moved_heading,
        steps=steps_table(steps), pressed=pressed_text,
        score=score, verdict=sentence, verdict_class="doubt" if doubt else "",
        overlap_table=overlap_table(names, pairs_before, pairs_after), resolution=f"{2 * grid_after.step:.0f}",
        rendering=data_uri(out / "rendering.png"), slices=data_uri(out / "slices.png"), edges=data_uri(out / "edges.png"),
        embedding=embedding, embedded=data_uri(out / "embedded.png"),
        overlays=overlays, folder=html.escape(str(out)), files="".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in listing.items()),
        version=html.escape(version_of(steps.program)), date=datetime.date.today().isoformat(), machine=html.escape(machine()))
    path = out / "report.html"
    path.write_text(page)

    lines = [f"volumes   {len(files)}, stitched into {size}"]
    if truth_file:
        lines.append(f"off       {mm(worst_before)} mm before, {mm(worst_after)} mm after (the worst volume)")
    lines.append("overlap   " + sentence)
    lines.append("embedded  " + ("no voxel of the data is altered" if wrong == 0 else f"{wrong} voxels are not what their labels say"))
    if pressed_line:
        lines.append(pressed_line)
    lines.append(f"seconds   {total:.1f} computing")
    return Report(path, "\n".join(lines))
