#!/usr/bin/env python3
"""Makes docs/gallery.md and its pictures; scripts/figures.sh runs it.

A figure is one render of galaxies side by side, which differ in a few parameters. Each galaxy is
measured with gutil in its part of the image.
"""

import array
import json
import math
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TOOLS = pathlib.Path(os.environ.get("GAMER_BIN", ROOT / "build/release")).resolve()
WORK = ROOT / "build/figures"
STYLE = ("--brightness", 1.2, "--contrast", 3, "--saturation", 1.2)  # of gamer look, without its seeing
PIXELS = 150  # of a galaxy's part of the image, on each side
ROOM = 2.0    # of a galaxy's part, galaxy radii

PARAMETERS = """[image]
size = [{width}, {height}]
[camera]
projection = "orthographic"
position = [{x}, {y}, 10]
target = [{x}, {y}, 0]
up = [0, 1, 0]
width = {units}
[sampling]
tolerance = 5e-3
[spectrum]
{spectrum}
"""
COLOURS = 'bands = ["bessell_b", "bessell_v", "red_halpha"]'
BESSELL = 'bands = ["bessell_b", "bessell_v", "bessell_rc"]'
GREEN = "wavelengths = [5500]"

# A smooth disk on which noise and arms are seen alone.
PLAIN = """[arms]
model = "logarithmic"
[[component]]
class = "disk"
name = "disk"
sed = "Sbc"
z0 = 0.02
rh = 0.5
arm_width = 0
fraction = 1
"""
# A slab of light and dust in equal layers.
SLAB = """[[component]]
class = "disk"
name = "light"
sed = "Sbc"
z0 = 0.02
rh = 0.2
arm_width = 0
noise = false
fraction = 1
[[component]]
class = "dust"
name = "dust"
z0 = 0.02
rh = 0.2
arm_width = 0
noise = false
"""


def run(*words):
    environment = {**os.environ, "GAMER_DATA": str(ROOT)}
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=WORK,
                            env=environment)
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {result.stderr.strip()}")
    return result.stdout


class Galaxy:
    """A row of a figure's scene: its type, what it shows, and columns of the scene."""

    def __init__(self, name, label, overrides="-", inclination=0, pa=90):
        self.name, self.label, self.overrides = name, label, overrides
        self.inclination, self.pa = inclination, pa


class Figure:
    def __init__(self, name, title, text, galaxies, columns, measure=None, spectrum=COLOURS, files=None):
        self.name, self.title, self.text, self.galaxies = name, title, text, galaxies
        self.columns, self.measure, self.spectrum, self.files = columns, measure, spectrum, files or {}

    def place(self, n):
        return ROOM * (n % self.columns), -ROOM * (n // self.columns)

    def scene(self):
        lines = ["galaxy x y z inclination pa overrides"]
        for n, one in enumerate(self.galaxies):
            x, y = self.place(n)
            lines.append(f"{one.name} {x:g} {y:g} 0 {one.inclination} {one.pa} {one.overrides}")
        return "\n".join(lines) + "\n"

    def parameters(self):
        rows = -(-len(self.galaxies) // self.columns)
        return PARAMETERS.format(width=PIXELS * self.columns, height=PIXELS * rows, units=ROOM * self.columns,
                                 x=ROOM * (self.columns - 1) / 2, y=-ROOM * (rows - 1) / 2,
                                 spectrum=self.spectrum)

    def render(self):
        for name, text in self.files.items():
            (WORK / f"{name}.toml").write_text(text)
        (WORK / f"{self.name}.par").write_text(self.parameters())
        (WORK / f"{self.name}.lst").write_text(self.scene())
        image = f"{self.name}.fits"
        run(TOOLS / "gamer", f"{self.name}.par", f"{self.name}.lst", "-o", image, "--overwrite", "-q")
        run(TOOLS / "gutil", "rgb", "--method", "auto", *STYLE, "--bits", 8, image,
            ROOT / f"docs/images/gallery_{self.name}.png", "--overwrite")

    def part(self, n):
        """The file of galaxy n alone."""
        rows = -(-len(self.galaxies) // self.columns)
        x, y = PIXELS * (n % self.columns), PIXELS * (rows - 1 - n // self.columns)
        file = f"{self.name}_{n}.fits"
        run(TOOLS / "gutil", "crop", "--box", f"{x + 1},{x + PIXELS},{y + 1},{y + PIXELS}", f"{self.name}.fits",
            file, "--overwrite")
        return file

    def page(self):
        lines = [f"## {self.title}", "", self.text, "", f"![{self.title}](images/gallery_{self.name}.png)", ""]
        titles, rows = self.measure(self) if self.measure else ([], [])
        titles = [""] + titles
        rows = rows or [[] for _ in self.galaxies]
        if len(titles) > 1:
            lines += ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
            lines += ["| " + " | ".join([one.label, *row]) + " |" for one, row in zip(self.galaxies, rows)]
        else:
            lines.append("From the upper left: " + ", ".join(one.label for one in self.galaxies) + ".")
        return "\n".join(lines) + "\n"


# Measurements: titles of columns, and a row for each galaxy.


def planes(file):
    """The pixels of each plane of an image of 4-byte floats."""
    data = (WORK / file).read_bytes()
    cards, end = {}, 0
    for begin in range(0, len(data), 80):
        card = data[begin:begin + 80].decode("ascii")
        if card.startswith("END "):
            end = -(-(begin + 80) // 2880) * 2880
            break
        if card[8:10] == "= ":
            cards[card[:8].strip()] = card[10:].split("/")[0].strip()
    axes = [int(cards[f"NAXIS{k + 1}"]) for k in range(int(cards["NAXIS"]))]
    values = array.array("f", data[end:end + 4 * math.prod(axes)])
    if sys.byteorder == "little":
        values.byteswap()
    size = axes[0] * axes[1]
    return [values[p * size:(p + 1) * size] for p in range(len(values) // size)]


def light(file):
    return [math.fsum(plane) for plane in planes(file)]


def shares(figure):
    """Light in each plane relative to the last galaxy."""
    values = [light(figure.part(n)) for n in range(len(figure.galaxies))]
    return ["share of B", "of V", "of red"], [[f"{own / whole:.3f}" for own, whole in zip(one, values[-1])]
                                              for one in values]


def unwrapped(figure):
    """The results of gutil unwrap for each galaxy."""
    for n in range(len(figure.galaxies)):
        yield json.loads(run(TOOLS / "gutil", "unwrap", "--planes", 2 if figure.spectrum == COLOURS else 1, "--json",
                              "--overwrite", "--inclination", 0, "--position-angle", 0, "--center",
                              f"{(PIXELS + 1) / 2},{(PIXELS + 1) / 2}", figure.part(n), "polar.fits"))


def spirals(figure):
    rows = []
    for told in unwrapped(figure):
        first = told["spirals"]["rows"][0]
        contrasts = sorted(row["contrast"] for row in told["arms"]["rows"] if row["contrast"] is not None)
        has_arms = first["amplitude"] > 0.01
        rows.append([*((str(first["arms"]), f"{abs(first['pitch']):.1f}") if has_arms else ("", "")),
                     f"{first['amplitude']:.2f}",
                     f"{contrasts[len(contrasts) // 2]:.2f}"])
    return ["arms found", "pitch (deg)", "amplitude", "contrast (mag)"], rows


def windings(figure):
    """Pitch at 0.4 radii beside tan P = r/(A W_N) cosh(A/r - ln W_B) of the law, with A = 0.5."""
    rows = []
    for one, told in zip(figure.galaxies, unwrapped(figure)):
        radius = 0.4
        near = min(told["arms"]["rows"], key=lambda row: abs(row["radius"] - radius * PIXELS / ROOM))
        w_b, w_n = (float(part.split("=")[1]) for part in one.overrides.split(";"))
        radius, scale = near["radius"] * ROOM / PIXELS, 0.5
        law = math.atan(radius / (scale * w_n) * math.cosh(scale / radius - math.log(w_b)))
        rows.append([f"{radius:.2f}", f"{abs(near['pitch']):.1f}", f"{math.degrees(law):.1f}"])
    return ["at radius", "pitch (deg)", "pitch of the law (deg)"], rows


def lost(figure):
    """Light relative to the first galaxy, beside that of a slab with the face-on optical depth."""
    values = [light(figure.part(n)) for n in range(len(figure.galaxies))]
    depths = [float(one.overrides.split("=")[1]) for one in figure.galaxies]
    rows = []
    for depth, own in zip(depths, values):
        dimmed = [-2.5 * math.log10(a / b) for a, b in zip(own, values[0])]
        rows.append([f"{value:.3f}" for value in (abs(dimmed[1]), abs(2.5 * math.log10(slab(depth))),
                                                  dimmed[0] - dimmed[2])])
    return ["dimmed in V (mag)", "by integration (mag)", "reddened, B - red (mag)"], rows


def slab(depth):
    """Share of light that leaves a disk with equal scale lengths and heights of light and dust."""
    if depth == 0:
        return 1
    seen = whole = 0
    steps = 4000
    for k in range(steps):
        x = (k + 0.5) * 5 / steps  # Radius in scale lengths of 0.2, to the galaxy's edge.
        u = min(max((1 - 0.2 * x) / 0.3, 0), 1)
        density = math.exp(-x) * u ** 3 * (6 * u * u - 15 * u + 10)
        tau = depth * density
        seen += x * density * (-math.expm1(-tau) / tau if tau > 0 else 1)
        whole += x * density
    return seen / whole


def statistics(figure):
    rows = []
    for n in range(len(figure.galaxies)):
        file = figure.part(n)
        # The middle of the image, where the disk varies little.
        run(TOOLS / "gutil", "crop", "--center", f"{PIXELS // 2},{PIXELS // 2}", "--size", "64,64", file,
            "middle.fits", "--overwrite")
        told = json.loads(run(TOOLS / "gutil", "stats", "--json", "--percentiles", "5,95", "middle.fits"))
        one = told["statistics"]["rows"][0]
        spectrum = json.loads(run(TOOLS / "gutil", "spectrum", "--json", "middle.fits"))
        slope = spectrum["fits"]["rows"][0]["slope"]
        mean = one["mean"]
        rows.append([f"{light(file)[0] / light(figure.part(0))[0]:.3f}", f"{one['sigma'] / mean:.2f}",
                     f"{one['p5'] / mean:.2f}", f"{one['p95'] / mean:.2f}", f"{slope:.2f}"])
    return ["light", "sigma/mean", "5 %", "95 %", "slope of P(k)"], rows


def colours(figure):
    """AB colours; the image's planes are per unit wavelength."""
    pivots = (4398.7, 5500.3, 6563.5)  # Angstrom, of the bands of BESSELL
    rows = []
    for n in range(len(figure.galaxies)):
        blue, green, red = (-2.5 * math.log10(value * pivot ** 2) for value, pivot in zip(light(figure.part(n)), pivots))
        rows.append([f"{blue - green:.2f}", f"{green - red:.2f}"])
    return ["B - V", "V - R"], rows


def shapes(figure):
    rows = []
    for n in range(len(figure.galaxies)):
        run(TOOLS / "gutil", "pad", "--size", 2 * PIXELS, figure.part(n), "wide.fits", "--overwrite")
        told = json.loads(run(TOOLS / "gutil", "morphology", "--planes", 2, "--json", "--sky-sigma", 0, "wide.fits"))
        row = told["morphology"]["rows"][0]
        rows.append([f"{float(row[key]):.2f}" for key in ("concentration", "asymmetry", "gini", "m20")])
    return ["C", "A", "Gini", "M20"], rows


def arms_of(model):
    return f"[arms]\n{model}\n" + PLAIN.split("\n", 2)[2].replace("rh = 0.5", "rh = 0.2").replace("arm_width = 0", "arm_width = 3\nnoise = false")


FIGURES = [
    Figure("spectra", "Spectra",
           "The key `sed` of a component chooses its spectrum. These are elliptical galaxies, one with each shipped\n"
           "spectrum. Figure 1 of Groeneboom & Dahle (2014) shows such spectra. Magnitudes are AB.",
           [Galaxy("elliptical", name, f"bulge1.sed={name}") for name in ("E", "Sbc", "Scd", "Im")], 4, colours, BESSELL),
    Figure("components", "Components alone",
           "Each component of `spiral` is shown alone, as by `--solo`. The last two galaxies have all components, with\n"
           "dust and without it. Shares are relative to the galaxy without dust.",
           [Galaxy("spiral", name, f"galaxy.solo={name.replace(' ', '_')}")
            for name in ("bulge1", "disk", "stars", "star-forming regions", "bright stars", "H II regions")]
           + [Galaxy("spiral", "with dust"), Galaxy("spiral", "without dust", "dust.optical_depth=0")], 3, shares),
    Figure("winding", "Winding of the arms",
           "The arms follow the law of Ringermacher & Mead, with the keys `winding_b` (W_B) and `winding_n` (W_N) of\n"
           "`[arms]`. The table has the measured pitch beside the pitch of this law.",
           [Galaxy("winding", f"W_B {b:g}, W_N {n:g}", f"arms.winding_b={b};arms.winding_n={n}")
            for n in (2, 4, 8) for b in (0.4, 1, 3)], 3, windings, GREEN,
           {"winding": arms_of('model = "ringermacher-mead"\nscale = 0.5')}),
    Figure("pitch", "Pitch angle and number of arms",
           "The arms are logarithmic spirals, with the keys `pitch_angle` and `count` of `[arms]`. The fit finds the\n"
           "values of the file.",
           [Galaxy("pitch", f"{p} deg, {c} arms", f"arms.pitch_angle={p};arms.count={c}")
            for c in (1, 2, 4) for p in (8, 16, 30)], 3, spirals, GREEN,
           {"pitch": arms_of('model = "logarithmic"')}),
    Figure("arm_width", "Width of the arms",
           "The key `arm_width` of a component sets how narrow its arms are: 0 makes no arms, and larger values make\n"
           "narrower arms. The number of arms is 2, and the pitch angle 15 degrees.",
           [Galaxy("pitch", f"{w:g}", f"disk.arm_width={w}") for w in (0, 1, 3, 10)], 4, spirals, GREEN),
    Figure("own_arms", "Arms of their own",
           "The first galaxy has arms that are copies of each other. In the others `strength_variation`,\n"
           "`pitch_variation`, and both with a branch make the arms differ.",
           [Galaxy("pitch", "copies"), Galaxy("pitch", "strength_variation 0.6", "arms.strength_variation=0.6"),
            Galaxy("pitch", "pitch_variation 0.35", "arms.pitch_variation=0.35"),
            Galaxy("branch", "both and a branch")], 4, spirals, GREEN,
           {"branch": arms_of('model = "logarithmic"\npitch_variation = 0.35\nstrength_variation = 0.6\nbegin = 0.05\n'
                              'end = 1\n[[arm]]\n[[arm]]\nstrength = 0.8\n[[arm]]\nleaves = 1\nbegin = 0.4\n'
                              'strength = 0.7\npitch_angles = [28]')}),
    Figure("shape", "Shape of the noise",
           "A disk's noise has the linear shape with `exponent` 1, 3 and 6, then the inverse shape with `exponent`\n"
           "0.5, 1 and 2. Noise does not change the amount of light. Statistics are those of the middle 64 x 64\n"
           "pixels.",
           [Galaxy("noisy", f"linear, exponent {e:g}", f'disk.noise.theta="linear";disk.noise.exponent={e}') for e in (1, 3, 6)]
           + [Galaxy("noisy", f"inverse, exponent {e:g}", f'disk.noise.theta="inverse";disk.noise.exponent={e}')
              for e in (0.5, 1, 2)], 3, statistics, GREEN,
           {"noisy": PLAIN + "noise = { k0 = 2, frequency_scale = 4, octaves = 6, offset = 1 }\n"}),
    Figure("spectrum", "Spectrum of the noise",
           "A disk's noise has `spectral_index` -1, 0.5 and 2, then `frequency_scale` 2, 6 and 12. The columns are\n"
           "those of the table above.",
           [Galaxy("noisy", f"spectral_index {n:g}", f'disk.noise.theta="linear";disk.noise.spectral_index={n}')
            for n in (-1, 0.5, 2)]
           + [Galaxy("noisy", f"frequency_scale {f:g}", f'disk.noise.theta="linear";disk.noise.frequency_scale={f}')
              for f in (2, 6, 12)], 3, statistics, GREEN),
    Figure("twirl", "Twirl",
           "`twirl` 0, 0.3, 0.6 and 1 winds the noise along the arms.",
           [Galaxy("noisy", f"{t:g}", f'disk.noise.theta="linear";disk.noise.exponent=3;disk.twirl={t}')
            for t in (0, 0.3, 0.6, 1)], 4, None, GREEN),
    Figure("dust", "Dust",
           "In this smooth disk dust and light have the same distribution, and `optical_depth` is 0, 0.5, 2 and 8. A\n"
           "column of optical depth tau transmits the share (1 - exp(-tau))/tau of its light. \"By integration\" is the\n"
           "mean of this share over the disk, in magnitudes.",
           [Galaxy("slab", f"{d:g}", f"dust.optical_depth={d}") for d in (0, 0.5, 2, 8)], 4, lost, COLOURS,
           {"slab": SLAB}),
    Figure("inclination", "Inclination",
           "The galaxy `spiral` is seen at inclinations from face on to edge on.",
           [Galaxy("spiral", f"{i} deg", inclination=i) for i in (0, 30, 60, 75, 85, 90)], 3, shapes),
    Figure("seeds", "Seeds", "The key `arms.seed` gives `flocculent` other arms and other noise.",
           [Galaxy("flocculent", f"{s}", f"arms.seed={s}", 30) for s in (1, 2, 3, 4)], 4),
    Figure("shipped", "The shipped galaxies",
           "These are the galaxies of `galaxies/`, inclined as on the sky. [realism.md](realism.md) has their numbers\n"
           "face on.",
           [Galaxy(name, name, "-", i, pa) for name, i, pa in (
               ("elliptical", 30, 60), ("elliptical_dust", 80, 60), ("ngc5128", 76, 120), ("lenticular", 30, 40),
               ("ngc4594", 84, 90), ("ngc2841", 68, 147), ("ngc1097", 46, 130), ("ngc891", 89, 40),
               ("one_armed", 45, 35), ("ngc1300", 35, 80), ("dusty_barred", 40, 100), ("milky_way", 15, 60),
               ("ngc4321", 30, 150), ("m51", 20, 170), ("spiral", 30, 60), ("ngc4414", 55, 155),
               ("m74", 8, 90), ("m83", 24, 45), ("m101", 18, 40), ("flocculent", 48, 60),
               ("m33", 55, 23), ("ngc7793", 50, 98), ("lmc", 35, 170), ("irregular", 35, 110),
               ("clumpy", 35, 60), ("tidal", 25, 40))], 4, shapes),
]

HEAD = """# Gallery

This page shows what the keys of a galaxy do, and what [gutil](gutil.md) measures on the images. The figures follow
those of Groeneboom & Dahle (2014), which is "the paper" below. `scripts/figures.sh` makes the page and its pictures.
Each figure is one render of galaxies side by side, made by these commands:

    gamer build/figures/NAME.par build/figures/NAME.lst -o NAME.fits
    gutil rgb --method auto --brightness 1.2 --contrast 3 --saturation 1.2 --bits 8 NAME.fits NAME.png

Most of these galaxies differ only in the column `overrides` of the scene list ([galaxies.md](galaxies.md)).
[morphology.md](morphology.md) defines the measured numbers. A second run gives identical files.
"""

DEEP = """## A deep field

This command renders a part of `scenes/deepfield_2014`, which has 2000 galaxies of all orientations, sizes and seeds.
The scene follows figure 16 of the paper:

    gamer scenes/deepfield_2014.par scenes/deepfield_2014.lst --region 1,1,600,300 -o deepfield.png

![A deep field](images/gallery_deepfield.png)
"""


def main():
    WORK.mkdir(parents=True, exist_ok=True)
    wanted = sys.argv[1:]
    pages = []
    for figure in FIGURES:
        if wanted and figure.name not in wanted:
            continue
        figure.render()
        pages.append(figure.page())
        print(pages[-1] if wanted else figure.name, flush=True)
    if not wanted or "deepfield" in wanted:
        run(TOOLS / "gamer", ROOT / "scenes/deepfield_2014.par", ROOT / "scenes/deepfield_2014.lst", "--region",
            "1,1,600,300", "-o", "deepfield.png", "--overwrite", "-q")
        (ROOT / "docs/images/gallery_deepfield.png").write_bytes((WORK / "deepfield.png").read_bytes())
    if not wanted:
        (ROOT / "docs/gallery.md").write_text("\n".join([HEAD, *pages, DEEP]))


if __name__ == "__main__":
    main()
