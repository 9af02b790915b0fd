#!/usr/bin/python3
"""Makes docs/images/studio.png anew: the page of gstudio with the galaxy of docs/studio.md, in a
headless Chromium. It needs a release build, python3-selenium, chromium and chromium-driver."""

import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else SOURCE / "build/release"
OUTPUT = SOURCE / "docs/images/studio.png"
sys.argv = [sys.argv[0], str(BUILD / "gstudio"), str(BUILD / "gamer"), str(SOURCE)]
sys.path.insert(0, str(SOURCE / "tests/programs/studio"))

from studio_page import ENVIRONMENT, GAMER, Page, Server, missing, start_browser  # noqa: E402

ARMS = [[None, "arms.model", "logarithmic"], [None, "arms.pitch_angle", 16],
        [None, "arms.scale", 0.33], [None, "arms.begin", 0.3], [2, "inner", 0.3], [3, "inner", 0.3],
        [4, "shift", 15]]
BAR = [[5, "half_length", 0.33], [5, "axis_ratio", 0.35], [5, "index", 1], [5, "decline", 2], [5, "cut", 0.3]]


def main():
    if missing():
        sys.exit(missing())
    spiral = subprocess.run([GAMER, "new", "spiral"], env=ENVIRONMENT, capture_output=True,
                            text=True, check=True).stdout
    server = Server(files={"mine.toml": spiral}, arguments=("mine.toml",))
    browser = start_browser(1440, 900)
    try:
        page = Page(browser, server.address)
        page.make("studio.components.add('bar')")
        for edits, label in ((BAR, "bar: half_length"), (ARMS, "arms")):
            page.make("studio.doc.edit(arguments[0], arguments[1])",
                      [{"set": edit} for edit in edits], label)
        page.make("studio.parameters.componentActions('fraction').commit(0.2)")
        page.settle()
        browser.save_screenshot(str(OUTPUT))
    finally:
        browser.quit()
        server.close()


if __name__ == "__main__":
    main()
