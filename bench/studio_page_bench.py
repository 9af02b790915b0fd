#!/usr/bin/env python3
"""Latencies of gstudio's page in a headless Chromium that draws without a GPU, as docs/studio.md shows them.

Each time goes from an event of the page (the pointer moved, an edit) to the picture drawn. While a
slider moves, it goes from one picture to the next. A pixel is then read back, which makes the
browser finish its work. Browser and server share the cores. Where other programs run, the least
time is nearer to that of an idle machine than the median.

    bench/studio_page_bench.py [GSTUDIO GAMER] | scripts/put-tables.py docs/studio.md
"""

import os
import pathlib
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAMS = sys.argv[1:3] if len(sys.argv) > 2 else [str(ROOT / "build/release" / name) for name in ("gstudio", "gamer")]
sys.argv = [sys.argv[0], *PROGRAMS, str(ROOT)]
sys.path.insert(0, str(ROOT / "tests/programs/studio"))
from studio_page import Page, Server, missing, set_size, start_browser  # noqa: E402

GALAXY, ARMS = "ngc4321", "arms"  # the catalogue's galaxy, and its disk with noise
SIDE, TOLERANCE = 512, 1e-3  # of the final view
SIZES = ((1280, 720), (1920, 1080))
LIMIT = 60  # seconds that one measurement may take

# Functions of the page: each returns a promise of milliseconds.
FUNCTIONS = """
  const {stage, preview, picture, ui, doc, components} = studio, gl = picture.gl, canvas = picture.canvas;
  const pixel = new Uint8Array(4);
  const finish = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  let drawn = null, last = {};
  stage.ondraw(() => {
    finish();
    last = {frame: picture.frame, at: performance.now()};
    drawn?.();
  });
  const untilDrawn = () => new Promise((resolve) => { drawn = () => { drawn = null; resolve(performance.now()); }; });
  const untilFrame = () => new Promise((resolve) => preview.addEventListener('frame', resolve, {once: true}));
  const untilFrameDrawn = async () => {
    await untilFrame();
    return last.frame === picture.frame ? last.at : untilDrawn();
  };
  const later = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
  const isFinal = () => preview.isFinal && preview.asked.size === 0;
  const final = async () => { while (!isFinal()) await later(20); };
  const pointer = (type, x, y) => canvas.dispatchEvent(new PointerEvent(type, {
      pointerId: 1, isPrimary: true, button: 0, buttons: type === 'pointerup' ? 0 : 1, clientX: x, clientY: y, bubbles: true}));
  const middle = () => { const box = canvas.getBoundingClientRect(); return [box.left + box.width / 2, box.top + box.height / 2]; };
  canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
  // Median interval between two pictures while `change(i)` is called for each frame of the screen.
  const between = async (change) => {
    const ends = [];
    stage.ondraw(() => ends.push(performance.now()));
    for (let i = 0; i <= 30; ++i) {
      await new Promise(requestAnimationFrame);
      change(i);
    }
    await untilDrawn();
    stage.listeners.pop();
    const intervals = ends.slice(1).map((end, i) => end - ends[i]).sort((a, b) => a - b);
    return intervals[Math.floor(intervals.length / 2)];
  };
  const light = () => components.components.findIndex((one) => typeof one.values.fraction === 'number');
  const shares = (i) => [{set: [light(), 'fraction', 0.05 + 0.01 * i]}];
  const timed = (work) => {
    finish();
    const begin = performance.now();
    work();
    picture.draw(ui.tone, {...ui.look, exposure: 0.01}, stage.seeing());
    finish();
    return performance.now() - begin;
  };
  globalThis.bench = {
    final,
    stretch: () => between((i) => {
      ui.look.exposure = 0.01 * i;
      ui.look.auto = false;
      ui.say('look');
    }),
    share: () => between((i) => preview.showShares(shares(i))),
    drawing: async () => timed(() => {}),
    async sharing(i) {
      preview.shares = shares(i);
      return timed(() => preview.weigh());
    },
    async orbit(i) {
      const [x, y] = middle();
      pointer('pointerdown', x, y);
      const begin = performance.now(), frame = untilFrameDrawn();
      pointer('pointermove', x + 5 + i, y + 2);
      const end = await frame;
      pointer('pointerup', x + 5 + i, y + 2);
      return end - begin;
    },
    async drag() {
      const [x, y] = middle();
      let frames = 0;
      const count = () => { ++frames; };
      preview.addEventListener('frame', count);
      pointer('pointerdown', x, y);
      const begin = performance.now();
      for (let i = 1; performance.now() - begin < 3000; ++i) {
        pointer('pointermove', x + i % 200, y + i % 50);
        await new Promise(requestAnimationFrame);
      }
      const milliseconds = performance.now() - begin;
      preview.removeEventListener('frame', count);
      pointer('pointerup', x, y);
      return milliseconds / frames;
    },
    async parameter(i) {
      const disk = components.components.findIndex((one) => one.name === ARMS);
      const edits = [{set: [disk, 'noise.amplitude', 0.5 + 0.01 * i]}];
      const begin = performance.now(), frame = untilFrameDrawn();
      doc.preview(edits);
      const end = await frame;
      await doc.edit(edits, 'noise', 'noise');
      return end - begin;
    },
    async whole() {
      const begin = performance.now();
      preview.isFinal = false;
      preview.ask(false);
      while (!isFinal()) await untilFrame();
      return await untilDrawn() - begin;
    },
  };
"""

# The measurements: description, function of the page, number of times.
WHAT = (("the drawing of the picture alone", "drawing", 30), ("the same with other shares of light", "sharing", 30),
        ("a slider of the stretch, from picture to picture", "stretch", 5),
        ("a slider of a share, from picture to picture", "share", 5), ("orbit, to the first frame", "orbit", 8),
        ("orbit, from frame to frame", "drag", 3), ("a noise parameter of the arms", "parameter", 8),
        (f"{SIDE} x {SIDE} at tolerance {TOLERANCE:g}, by way of a coarse level", "whole", 3))


def call(page, function, *arguments):
    """The result of a function of the page."""
    script = """const [name, i] = arguments, done = arguments[arguments.length - 1];
        bench[name](i).then((ms) => done({ms}), (error) => done({error: String(error)}))"""
    from selenium.common.exceptions import TimeoutException

    try:
        answer = page.browser.execute_async_script(script, function, *arguments)
    except TimeoutException:
        answer = {"error": f"no end after {LIMIT} s; {page.log()}"}
    if "error" in answer:
        sys.exit(f"{function}: {answer['error']}")
    return answer["ms"]


def measure(page, function, times):
    """Median and least of a function of the page, ms."""
    values = []
    for i in range(times + 1):
        call(page, "final")
        values.append(call(page, function, i))
    return statistics.median(values[1:]), min(values[1:])


def measure_program(server, times):
    """Median and least of `gamer look` of the last view, ms."""
    values = []
    for _ in range(times):
        begin = time.perf_counter()
        subprocess.run([PROGRAMS[1], "look", GALAXY, "-q", "-o", "look.fits", "--overwrite", "-s", f"image.size={SIDE}", "-s",
                        f"sampling.tolerance={TOLERANCE}"], cwd=server.path, check=True, env={**os.environ, "GAMER_DATA": str(ROOT)})
        values.append(1000 * (time.perf_counter() - begin))
    return statistics.median(values), min(values)


def main():
    if missing():
        sys.exit(missing())
    server, browser = Server(arguments=(GALAXY,)), start_browser()
    rows = {what: [] for what, _, _ in WHAT}
    try:
        browser.set_script_timeout(LIMIT)
        page = Page(browser, server.address)
        page.make("studio.doc.set(arguments[0], 'size')", {"image.size": [SIDE, SIDE], "sampling.tolerance": TOLERANCE})
        page.run(f"const ARMS = '{ARMS}';{FUNCTIONS}")
        for size in SIZES:
            set_size(browser, *size)
            page.settle()
            for what, function, times in WHAT:
                rows[what] += measure(page, function, times)
                print(f"{size} {what}: {rows[what][-2:]}", file=sys.stderr)
        rows["`gamer look` of the same"] = measure_program(server, 3) * 2
    finally:
        browser.quit()
        server.close()
    heads = [f"{width} x {height}, ms | least" for width, height in SIZES]
    print(f"| in the browser | {' | '.join(heads)} |\n|{'---|' * (1 + 2 * len(SIZES))}")
    for what, values in rows.items():
        print(f"| {what} | {' | '.join(f'{value:.1f}' for value in values)} |")


if __name__ == "__main__":
    main()
