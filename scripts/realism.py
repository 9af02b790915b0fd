#!/usr/bin/env python3
"""Measures shipped galaxies with gutil, as docs/morphology.md defines the numbers.

    scripts/realism.py [--size 1024] [--bin 2] [--inclination 0] [--stars] [--all] [GALAXY...]

Each galaxy is rendered without noise, in three wavelengths, surrounded by empty sky and binned. The
table on standard output is Markdown, with published values of the type in brackets. Shapes and arms
are those at 7400 Angstrom, colours 4300 less 7400 Angstrom in magnitudes. Images, pictures of the
apertures and plots stay in build/realism.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
GAMER, GUTIL = ROOT / "build/release/gamer", ROOT / "build/release/gutil"
RED = "3"  # the plane of 7400 Angstrom

COLUMNS = {
    "C": "concentration", "A": "asymmetry", "S": "smoothness", "S (Lotz)": "smoothness_lotz", "G": "gini",
    "M20": "m20", "F": "bulge_statistic", "class": "lotz_class", "M": "multimode", "I": "intensity", "D": "deviation",
}


# Types of the shipped galaxies, and published values of these types: concentration, asymmetry and
# smoothness (Conselice 2003, ApJS 147, 1), Gini and M20 (Lotz et al. 2004, AJ 128, 163), pitch
# angle (Kennicutt 1981, AJ 86, 1847, and of the galaxies themselves).
ELLIPTICAL = ("4.4", "0.02", "0.00", "0.59", "-2.5", "")
S0 = ("3.9", "0.07", "0.08", "0.57", "-2.4")
SAB = ("3.9", "0.07", "0.08", "0.53", "-2.2")
SBC = ("3.4", "0.12", "0.2", "0.50", "-1.9")
SC = ("3.1", "0.15", "0.29", "0.46", "-1.6")
IRR = ("2.9", "0.17", "0.40", "0.45", "-1.3")
OBSERVED = {
    "elliptical": ("E", *ELLIPTICAL), "elliptical_dust": ("E with dust", *ELLIPTICAL),
    "ngc4594": ("Sa", *S0, ""), "one_armed": ("Sab", *SAB, "9"),
    "ngc891": ("Sb, seen face on", *SAB, ""), "dusty_barred": ("SBbc", *SBC, "15"), "ngc1300": ("SBbc", *SBC, "10-15"),
    "milky_way": ("SBbc", *SBC, "10-14"), "ngc4321": ("SABbc", *SBC, "15-20"), "m51": ("Sbc", *SBC, "19"),
    "spiral": ("Sbc", *SBC, "15"), "shader_galaxy": ("Sc", *SC, "18"), "flocculent": ("Sc", *SC, "18"),
    "irregular": ("Irr", *IRR, ""), "clumpy": ("clump cluster", *[""] * 6),
    "tidal": ("in an encounter", *[""] * 6), "lmc": ("SBm", *IRR, ""), "lenticular": ("SB0", *S0, ""),
    "m33": ("Scd", *SC, "20-25"), "m74": ("Sc", *SC, "15"), "m83": ("SABc", *SC, "14"), "m101": ("SABcd", *SC, "20-25"),
    "ngc1097": ("SBb", *SAB, "15"), "ngc2841": ("Sb", *SAB, "<10"), "ngc4414": ("Sc", *SC, "20"),
    "ngc5128": ("S0 pec, seen face on", *S0, ""), "ngc7793": ("Sd", *SC, "15"),
}
BESIDE = ("C", "A", "S", "G", "M20", "pitch (deg)")


def beside(name, values):
    """The values, each with that of the type in brackets if one is published."""
    kind, *observed = OBSERVED.get(name, ("", *[""] * len(BESIDE)))
    cells = [f"{text(values[title])} ({known})" if known else text(values[title]) if title != BESIDE[-1] else ""
             for title, known in zip(BESIDE, observed)]
    return {"type": kind, **dict(zip(BESIDE, cells)), "contrast (mag)": values["contrast (mag)"],
            "slope of P(k)": values["slope of P(k)"],
            "colour at 0.5 Rp": values["colour at 0.5 Rp"]}


def run(*words):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if result.returncode != 0:
        raise RuntimeError(result.stderr.strip())
    return result.stdout


def measured(name, folder, options):
    """The values of one galaxy by column."""
    image, wide, small = (folder / f"{name}{suffix}.fits" for suffix in ("", "_wide", "_small"))
    run(GAMER, "look", name, "--inclination", options.inclination, "--pa", 0, "-o", image, "--overwrite",
        "-s", f"image.size={options.size}", "-s", "spectrum.wavelengths=[4300, 5750, 7400]",
        "-s", f"sampling.stars_per_pixel={int(options.stars)}")
    # 1.5 Petrosian radii may reach beyond the galaxy's ball, where there is no light.
    run(GUTIL, "pad", "--size", 2 * options.size, image, wide, "--overwrite")
    run(GUTIL, "bin", "--factor", options.bin, wide, small, "--overwrite")
    planes = ["--planes", RED, "--json", "--overwrite"]
    shape = json.loads(run(GUTIL, "morphology", *planes, "--sky-sigma", 0, "--plot", folder / f"{name}_shape.png", small))
    arms = json.loads(run(GUTIL, "unwrap", *planes, "--inclination", options.inclination, "--position-angle", 0, small,
                          folder / f"{name}_polar.fits"))
    profile = json.loads(run(GUTIL, "profile", "--planes", f"1,{RED}", "--json", "--overwrite", "--plot",
                             folder / f"{name}_profile.png", small))
    row = shape["morphology"]["rows"][0]
    values = {title: row[column] if column == "lotz_class" else float(row[column]) for title, column in COLUMNS.items()}
    spiral, rings = arms["spirals"]["rows"][0], arms["arms"]["rows"]

    def median(column, by_radius=False):
        found = [ring[column] / (ring["radius"] if by_radius else 1) for ring in rings if ring[column] is not None]
        return statistics.median(found) if found else None

    # The inner disk, where light falls off least: half a Petrosian radius to each side of the
    # centre.
    run(GUTIL, "crop", "--center", f"{row['x']},{row['y']}", "--size", ",".join(2 * [str(round(row["petrosian"]))]),
        small, folder / f"{name}_middle.fits", "--overwrite")
    power = json.loads(run(GUTIL, "spectrum", "--log", "--json", folder / f"{name}_middle.fits"))["fits"]["rows"][2]
    values |= {"slope of P(k)": power["slope"], "arms": spiral["arms"], "pitch (deg)": abs(spiral["pitch"]), "amplitude": spiral["amplitude"],
               "contrast (mag)": median("contrast"), "width/r": median("width", True), "A1": median("a1")}
    disk = next(row for row in profile["disks"]["rows"] if row["plane"] == int(RED))
    values |= {"type": disk["type"], "h/Rp": ratio(disk["inner_scale"], row["petrosian"]),
               "break/h": ratio(disk["break_radius"], disk["inner_scale"])}
    colours = [(one["radius"] / row["petrosian"], one["colour"]) for one in profile["profile"]["rows"]
               if one["plane"] == int(RED) and one["colour"] is not None]
    for share in (0.1, 0.5, 1.0):
        values[f"colour at {share:g} Rp"] = min(colours, key=lambda one: abs(one[0] - share))[1]
    return values


def ratio(a, b):
    return None if a is None or b is None else a / b


def text(value):
    return "" if value is None else f"{value:.2f}" if isinstance(value, float) else str(value)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("galaxy", nargs="*", help="default: all of galaxies/")
    parser.add_argument("--size", type=int, default=1024, help="pixels across the galaxy's ball")
    parser.add_argument("--bin", type=int, default=2, help="pixels that are joined")
    parser.add_argument("--inclination", type=float, default=0, help="deg")
    parser.add_argument("--stars", action="store_true", help="stars are drawn, not smooth light")
    parser.add_argument("--all", action="store_true", help="all numbers, without those of the types")
    options = parser.parse_args()
    names = options.galaxy or sorted(path.stem for path in (ROOT / "galaxies").glob("*.toml"))
    folder = ROOT / "build/realism"
    folder.mkdir(parents=True, exist_ok=True)
    has_head = False
    for name in names:
        try:
            values = measured(name, folder, options)
        except RuntimeError as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        if not options.all:
            values = beside(name, values)
        if not has_head:
            print("| galaxy | " + " | ".join(values) + " |")
            print("|---" * (len(values) + 1) + "|")
            has_head = True
        print(f"| {name} | " + " | ".join(text(value) for value in values.values()) + " |", flush=True)
    return 0 if has_head else 1


if __name__ == "__main__":
    sys.exit(main())
