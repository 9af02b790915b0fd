#!/usr/bin/env python3
"""Draws docs/images/architecture.svg: the path from a scene's row to pixels, how a job survives, and
the layers of the source, which scripts/lint.py lists.

    scripts/architecture.py            # writes the picture
    scripts/architecture.py --check    # exits with 1 where the picture is out of date
"""

import pathlib
import sys
from xml.sax.saxutils import escape

import lint

PICTURE = lint.ROOT / "docs/images/architecture.svg"
# Steps of a row: title, what it does, its file.
PATH = [
    ("render.par, scene.lst", "texts of the user", None),
    ("load_job()", "reads and checks everything before any work", "src/job/job.cc"),
    ("RenderParameters, Camera, Spectrum", "what is asked for", "src/scene/render_parameters.cc"),
    ("Scene", "a row becomes a PlacedGalaxy or PlacedStar", "src/scene/scene.cc"),
    ("Galaxy", "components, textures and arms of a type", "src/galaxy/galaxy.cc"),
    ("GalaxyStatistics", "measures what a seed decides", "src/galaxy/calibration/galaxy_statistics.cc"),
    ("Renderer, PixelCells", "pixel to cells to rays", "src/render/renderer.cc"),
    ("GalaxyIndex", "which galaxies a ray may meet", "src/render/galaxy_index.cc"),
    ("Sampler", "nodes along a ray, light through dust", "src/render/march/adaptive_sampler.cc"),
    ("Medium", "densities of all galaxies at the nodes", "src/render/medium.cc"),
    ("SpectralBasis", "spectral nodes to planes", "src/render/spectral_basis.cc"),
    ("Schedule", "blocks of rows of similar cost", "src/job/schedule.cc"),
    ("Executor", "hands blocks to threads and ranks", "src/parallel/row_handout.cc"),
    ("ImageWriter", "FITS or picture, complete or not there", "src/image/image_writer.cc"),
]
# Steps of a job that survives, each beside a step of the path.
SURVIVAL = [
    ("load_job()", "record", "all texts of a job in one string", "src/job/record.cc"),
    ("Schedule", "resume", "reads the finished rows back", "src/job/resume.cc"),
    ("Executor", "journal", "keeps the finished rows", "src/job/journal.cc"),
    ("ImageWriter", "private folder", "holds unfinished files", "src/image/private_folder.cc"),
]
COLOURS = {
    "core": "#d9d9d9", "noise": "#fde0c5", "sed": "#fbf2c0", "image": "#d5e8d4", "processing": "#e3f0d8",
    "parallel": "#e6d9ec", "galaxy": "#f8cecc", "scene": "#dae8fc", "render": "#cfe2f3", "job": "#ead1dc", "studio": "#d0e0e3",
    "apps": "#ffffff",
}
WIDTH, HEIGHT, GAP = 420, 40, 12  # of a step, pixels
LEFT, TOP = 20, 50


def layer_of(file):
    if not (lint.ROOT / file).exists():
        sys.exit(f"architecture: there is no {file}")
    return lint.layer_of(lint.ROOT / file)


def label(x, y, text, size=13, style=""):
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}"{style}>{escape(text)}</text>'


def step(x, y, width, title, what, file):
    colour = COLOURS.get(layer_of(file), "#ffffff") if file else "#ffffff"
    return [
        f'<rect x="{x:g}" y="{y:g}" width="{width}" height="{HEIGHT}" rx="4" fill="{colour}" stroke="#555"/>',
        label(x + 10, y + 17, title, style=' font-weight="bold"'),
        label(x + 10, y + 33, f"{what} ({file.removeprefix('src/')})" if file else what, 11),
    ]


def arrow(x1, y1, x2, y2):
    return f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="#555" marker-end="url(#head)"/>'


def draw_path():
    lines = [label(LEFT, TOP - 18, "From a scene's row to pixels", 16),
             label(LEFT + WIDTH + 60, TOP - 18, "How a job survives", 16)]
    places = {}
    for i, (title, what, file) in enumerate(PATH):
        y = TOP + i * (HEIGHT + GAP)
        places[title] = y
        lines += step(LEFT, y, WIDTH, title, what, file)
        if i:
            lines.append(arrow(LEFT + WIDTH / 2, y - GAP, LEFT + WIDTH / 2, y))
    for beside, title, what, file in SURVIVAL:
        x, y = LEFT + WIDTH + 60, places[beside]
        lines += step(x, y, WIDTH - 60, title, what, file)
        lines.append(arrow(LEFT + WIDTH, y + HEIGHT / 2, x, y + HEIGHT / 2))
    return lines


def draw_layers(left, top):
    """An arrow leads from a layer to those that it may include, without those that follow from others."""
    below = {**lint.BELOW, "apps": list(lint.BELOW)}
    level = {}
    for layer, others in below.items():
        level[layer] = 1 + max((level[other] for other in others), default=-1)
    direct = {
        layer: [o for o in others if not any(o in below[other] for other in others)]
        for layer, others in below.items()
    }
    order = list(below)
    rows = [[layer for layer in below if level[layer] == n] for n in range(max(level.values()) + 1)]
    for row in rows[1:]:  # above the layers that they may include
        row.sort(key=lambda layer: sum(map(order.index, direct[layer])) / len(direct[layer]))
    width, height, gap = 80, 26, 24
    place = {}
    for n, row in enumerate(rows):
        for k, layer in enumerate(row):
            x = left + 180 + (k - (len(row) - 1) / 2) * (width + 10) - width / 2
            place[layer] = (x, top + (len(rows) - 1 - n) * (height + gap))
    lines = [label(left, top - 18, "Layers: an include points down", 16)]
    for layer, others in direct.items():
        for other in others:
            (x1, y1), (x2, y2) = place[layer], place[other]
            lines.append(arrow(x1 + width / 2, y1 + height, x2 + width / 2, y2))
    for layer, (x, y) in place.items():
        colour = COLOURS.get(layer, "#ffffff")
        lines.append(f'<rect x="{x:g}" y="{y:g}" width="{width}" height="{height}" rx="4" '
                     f'fill="{colour}" stroke="#555"/>')
        lines.append(label(x + width / 2, y + 17, layer, style=' text-anchor="middle"'))
    return lines


def picture():
    width = LEFT + 2 * WIDTH + 20
    height = TOP + len(PATH) * (HEIGHT + GAP)
    head = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" font-family="sans-serif">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    layers = draw_layers(LEFT + WIDTH + 60, TOP + 3 * (HEIGHT + GAP) + 10)
    return "\n".join([*head, *draw_path(), *layers, "</svg>", ""])


def main():
    if sys.argv[1:] == ["--check"]:
        if PICTURE.exists() and PICTURE.read_text() == picture():
            return 0
        print(f"{PICTURE.relative_to(lint.ROOT)} is out of date; run scripts/architecture.py")
        return 1
    PICTURE.write_text(picture())
    return 0


if __name__ == "__main__":
    sys.exit(main())
