"""A gstudio server and a headless Chromium that shows its page, for the tests."""

import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    webdriver = None

GSTUDIO = pathlib.Path(sys.argv[1]).resolve()
GAMER = pathlib.Path(sys.argv[2]).absolute()
SOURCE = pathlib.Path(sys.argv[3]).resolve()
ENVIRONMENT = {**os.environ, "GAMER_DATA": str(SOURCE), "GAMER_CACHE": "off", "SOURCE_DATE_EPOCH": "1000000000"}

PARAMETERS = """# A view from a slant.
[image]
size = [48, 36]
[camera]
projection = "orthographic"
position = [0, -8, 6]
width = 2.2
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
"""

SCENE = """galaxy x y z
mine 0 0 0
"""

GALAXY = """# A galaxy of the tests.
[galaxy]
name = "Mine"

[arms]
model = "logarithmic"

[[component]]
class = "bulge"
name = "core"
sed = "E"
effective_radius = 0.1   # small
fraction = 0.25

[[component]]
class = "disk"
name = "disk"
sed = "Sbc"
fraction = 0.75
noise = { octaves = 2 }

# Dust
[[component]]
class = "dust"
name = "lanes"
optical_depth = 0.5
noise = false
"""

FILES = {"render.par": PARAMETERS, "scene.lst": SCENE, "mine.toml": GALAXY}


def missing():
    """The missing requirement of the tests, or an empty text."""
    if webdriver is None:
        return "selenium is not installed (python3-selenium)"
    if not shutil.which("chromium") or not shutil.which("chromedriver"):
        return "Chromium is not installed (chromium, chromium-driver)"
    return ""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Server:
    """gstudio on a folder with a small scene."""

    def __init__(self, port=0, files=FILES, arguments=("render.par", "scene.lst")):
        self._folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self._folder.name)
        for name, text in files.items():
            (self.path / name).write_text(text)
        self.arguments = arguments
        self.port = port or free_port()
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [GSTUDIO, *self.arguments, "--no-browser", "--port", str(self.port), "--folder", "out",
             "--threads", "2", "--token-file", "token"], cwd=self.path, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        if not self.address.startswith("http://127.0.0.1:"):
            raise RuntimeError(f"no address but {self.address!r}")

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()

    def close(self):
        self.kill()
        self._folder.cleanup()

    def gamer(self, output, *settings, galaxy=None, scene=None):
        """The path of the image that the command line makes of the scene, with another galaxy or list."""
        folder = self.path / "gamer"
        folder.mkdir(exist_ok=True)
        for name in FILES:
            shutil.copy(self.path / name, folder)
        if galaxy is not None:
            (folder / "mine.toml").write_text(galaxy)
        if scene is not None:
            (folder / "scene.lst").write_text(scene)
        subprocess.run([GAMER, "render.par", "scene.lst", "-o", output, "--overwrite", *settings],
                       cwd=folder, env=ENVIRONMENT, capture_output=True, timeout=120, check=True)
        return folder / output


def start_browser(width=1280, height=720):
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                     "--hide-scrollbars", f"--window-size={width},{height}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    browser.set_script_timeout(30)
    set_size(browser, width, height)
    return browser


def set_size(browser, width, height, has_fingers=False):
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": has_fingers})
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": has_fingers})


class Page:
    """The page in the browser, as a person or its console controls it."""

    def __init__(self, browser, address, fresh=True):
        self.browser = browser
        script = None
        if fresh:
            script = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument",
                                             {"source": "sessionStorage.clear()"})
        browser.get(address)
        self.wait("globalThis.studio && studio.preview")
        if script:
            browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)
        self.settle()

    def run(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def make(self, promise, *arguments):
        """Waits for a promise that an expression gives."""
        self.browser.execute_async_script(
            f"const done = arguments[arguments.length - 1]; ({promise}).then(() => done())", *arguments)

    def value(self, expression):
        return self.run(f"return {expression}")

    def wait(self, condition, seconds=60):
        """Waits for an expression of JavaScript to hold."""
        end = time.monotonic() + seconds
        while True:
            try:
                if self.value(f"Boolean({condition})"):
                    return
            except Exception:
                if time.monotonic() > end:
                    raise
            if time.monotonic() > end:
                raise TimeoutError(f"{condition} after {seconds} s; {self.log()}")
            time.sleep(0.02)

    def settle(self):
        """Waits until all edits are made and the last frame of the present view is shown."""
        self.wait("globalThis.studio && studio.preview")
        self.make("studio.doc.queue")
        self.wait("studio.preview.isFinal && studio.preview.asked.size === 0 && studio.ui.tone")

    def log(self):
        return [entry["message"] for entry in self.browser.get_log("browser")
                if "favicon" not in entry["message"]]

    def find(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def keys(self, *keys):
        """Presses the last key while the others are held."""
        chain = ActionChains(self.browser)
        for key in keys[:-1]:
            chain.key_down(key)
        chain.send_keys(keys[-1])
        for key in reversed(keys[:-1]):
            chain.key_up(key)
        chain.perform()

    def drag(self, element, x, y, steps=4):
        chain = ActionChains(self.browser).move_to_element(element).click_and_hold()
        for _ in range(steps):
            chain.move_by_offset(x // steps, y // steps).pause(0.05)
        chain.release().perform()

    def touch(self, element, *paths):
        """Moves fingers at the same time along paths of places, counted from the middle of an element."""
        def finger(number, path):
            place = lambda at, milliseconds: {"type": "pointerMove", "duration": milliseconds, "x": at[0], "y": at[1],
                                              "origin": {"element-6066-11e4-a52e-4f735466cecf": element.id}}
            steps = [place(path[0], 0), {"type": "pointerDown", "button": 0}, *(place(at, 60) for at in path[1:]),
                     {"type": "pointerUp", "button": 0}]
            return {"type": "pointer", "id": f"finger{number}", "parameters": {"pointerType": "touch"}, "actions": steps}
        self.browser.execute("actions", {"actions": [finger(i, path) for i, path in enumerate(paths)]})

    def select(self, name):
        self.find(f".component [data-role=pick]").click()
        index = self.value("studio.components.components.map((c) => c.name)").index(name)
        self.run("studio.components.select(arguments[0])", index)

    def sums(self):
        """The three channels of the shown pixels, each a list: red, green, blue."""
        flat = self.value("Array.from(studio.picture.sums())")
        return [flat[channel::4] for channel in range(3)]

    def shown(self):
        """RGB bytes of the picture at one screen pixel for each pixel, with rows from the bottom."""
        return self.run("""
          const {picture, ui} = studio;
          picture.draw(ui.tone, ui.look, null, null);
          return Array.from(picture.shown()).filter((_, i) => i % 4 !== 3);""")
