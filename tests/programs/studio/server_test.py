"""The server of gstudio, driven by a client of the standard library.

server_test.py GSTUDIO GAMER SOURCE_DIR
"""

import http.client
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import numpy
from astropy.io import fits

from studio_client import BINARY, TEXT, Closed, Studio

GSTUDIO, GAMER, SOURCE = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
ENVIRONMENT = {"GAMER_DATA": str(SOURCE), "SOURCE_DATE_EPOCH": "1000000000"}

GALAXY = """# My galaxy.
[arms]
model = "logarithmic"  # spirals

[[component]]
class = "bulge"
sed = "E"
effective_radius = 0.1

# The arms.
[[component]]
class = "disk"
name = "arms"
sed = "Sbc"
noise = { octaves = 2 }

[[component]]
class = "dust"
optical_depth = 0.5
noise = { octaves = 2 }
"""

PARAMETERS = """[image]
size = [24, 18]
output = "out.fits"
[camera]
position = [0, -3, 1]
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
"""

SCENE = """galaxy x y z inclination pa size
mine 0 0 0 50 30 1
mine 0.5 2 0.1 10 0 0.5
"""

SKY_PARAMETERS = """[image]
size = 24
[camera]
projection = "sky"
pixel_scale = 0.3
[spectrum]
bands = ["sdss_g", "sdss_r"]
[photometry]
reference_band = "sdss_r"
[sampling]
tolerance = 0.01
"""

SKY_SCENE = """galaxy dx dy redshift size_arcsec apparent_magnitude inclination pa
mine 0 0 0.1 2 20 70 30
mine 1.5 1 0.4 1 22 50 130
"""

FILES = {"mine.toml": GALAXY, "render.par": PARAMETERS, "scene.lst": SCENE}


class Folder:
    """A folder with a galaxy and a scene, and a studio in it."""

    def __init__(self, *arguments, files=FILES, cache="off"):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="gstudio"))
        for name, text in files.items():
            (self.path / name).parent.mkdir(parents=True, exist_ok=True)
            (self.path / name).write_text(text)
        self.arguments = arguments or ("mine.toml",)
        self.environment = {**ENVIRONMENT, "GAMER_CACHE": str(cache)}
        self.studio = None

    def __enter__(self):
        self.studio = Studio(GSTUDIO, self.arguments, self.path, self.environment)
        return self

    def __exit__(self, *_):
        self.studio.stop()
        shutil.rmtree(self.path)

    def open(self):
        """A new page, and the document that it opens."""
        self.studio.enter()
        page = self.studio.page()
        return page, page.ask("open")

    def gamer(self, *arguments):
        subprocess.run([GAMER, *arguments, "-q"], cwd=self.path, check=True,
                       env={**os.environ, **ENVIRONMENT})

    def shell(self, command):
        """Runs a command line that the page gives."""
        subprocess.run(command + " -q", cwd=self.path, check=True, shell=True,
                       env={**os.environ, **ENVIRONMENT,
                            "PATH": f"{GAMER.parent}:{os.environ['PATH']}"})


def rotation(degrees):
    """A turn about z."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def shortest_turn(to):
    """The rotation by the shortest turn from z to a unit vector (Rodrigues' formula)."""
    cross = numpy.cross([0, 0, 1], to)
    matrix = numpy.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    return numpy.eye(3) + matrix + matrix @ matrix / (1 + to[2])


def texts(document, **changes):
    """The parts of a document that go with every view."""
    return {key: document[key] for key in ("parameters", "scene", "galaxies")} | changes


def frames(page, number, levels):
    """The frames of a view, one for each level."""
    found = []
    while len(found) < levels:
        message = page.receive()
        if isinstance(message, dict):
            raise AssertionError(message)
        if message[0]["id"] == number:
            found.append(message)
    return found


def view(page, number, document, sizes, **changes):
    page.send({"op": "view", "id": number, "sizes": sizes, **texts(document), **changes})
    return frames(page, number, len(sizes))


def cube(frame):
    head, planes = frame
    return numpy.array(planes).reshape(len(planes), head["height"], head["width"])


def render(page, number, document, name, **changes):
    """Renders, and returns the last message and the progress."""
    page.send({"op": "render", "id": number, "name": name, **texts(document), **changes})
    progress = []
    while True:
        message = page.receive()
        if message.get("id") != number or message["op"] == "log":
            continue
        if message["op"] != "progress":
            return message, progress
        progress.append((message["done"], message["total"]))


class Access(unittest.TestCase):
    def test_who_may_come_in(self):
        with Folder() as folder:
            studio = folder.studio
            own, evil = f"127.0.0.1:{studio.port}", f"evil.org:{studio.port}"
            cookie = studio.enter()
            self.assertRegex(cookie, rf"^gstudio-{studio.port}=[0-9a-f]{{32}}; HttpOnly; "
                                     "SameSite=Strict; Path=/$")
            self.assertNotIn(studio.token, cookie)
            fields = [("Cookie", studio.cookie)]
            cases = [("/", fields, own, 200), ("/", fields, f"localhost:{studio.port}", 200),
                     ("/", fields, "localhost:1", 200), ("/", [], own, 403),
                     ("/", [("Cookie", studio.cookie[:-1])], own, 403),
                     (f"/?token={studio.token[:-1]}", [], own, 403),
                     (f"/?token={'0' * 32}", fields, own, 403),
                     (f"/?token={studio.token}", [], evil, 403), ("/", fields, evil, 403),
                     ("/", fields, "", 400), ("/style.css", [], own, 403),
                     ("/", [*fields, ("Origin", "http://evil.org")], own, 403),
                     ("/", [*fields, ("Origin", "null")], own, 403),
                     ("/", [*fields, ("Origin", f"http://{own}")], own, 200),
                     ("/ws", fields, own, 400), ("/nothing", fields, own, 404),
                     ("/../../etc/passwd", fields, own, 404), ("/output/x.fits", fields, own, 404),
                     ("/output/../mine.toml", fields, own, 404)]
            for target, given, host, status in cases:
                with self.subTest(target=target, fields=given, host=host):
                    self.assertEqual(studio.get(target, given, host=host)[0], status)
            self.assertEqual(studio.get("/", fields, method="POST")[0], 405)
            self.assertEqual(studio.get("/", [*fields, ("Host", evil)])[0], 400)

    def test_every_answer_is_safe(self):
        with Folder() as folder:
            studio = folder.studio
            studio.enter()
            for target in ("/", "/style.css", "/nothing"):
                status, fields, _ = studio.get(target, [("Cookie", studio.cookie)])
                policy = fields["Content-Security-Policy"]
                self.assertIn("default-src 'none'", policy)
                self.assertNotIn("unsafe", policy)
                self.assertNotIn("*", policy)
                self.assertEqual((fields["X-Content-Type-Options"], fields["Cache-Control"]),
                                 ("nosniff", "no-store"))

    def test_web_sockets(self):
        with Folder() as folder:
            studio = folder.studio
            studio.enter()
            self.assertEqual(studio.page().status, 101)
            self.assertEqual(studio.page(host=f"localhost:{studio.port}").status, 101)
            for changes in ({"host": "evil.org"}, {"origin": "http://evil.org"}, {"origin": "null"},
                            {"origin": ""}, {"cookie": "x=y"}, {"cookie": ""},
                            {"origin": f"https://127.0.0.1:{studio.port}"}):
                with self.subTest(changes):
                    self.assertIn(studio.page(**changes).status, (400, 403))

    def test_other_addresses_are_not_bound(self):
        with Folder() as folder:
            with open("/proc/net/tcp", encoding="ascii") as table:
                places = [line.split()[1] for line in table if line.split()[3] == "0A"]
            own = [place for place in places if int(place.split(":")[1], 16) == folder.studio.port]
            self.assertEqual([place.split(":")[0] for place in own], ["0100007F"])

    def test_secrets_are_new_at_each_start(self):
        with Folder() as folder:
            first = folder.studio.token
            port = folder.studio.port
            folder.studio.process.kill()
            folder.studio.stop()
            again = Studio(GSTUDIO, ("mine.toml", "--port", str(port)), folder.path, ENVIRONMENT)
            self.assertEqual(again.port, port)
            self.assertNotEqual(again.token, first)
            self.assertEqual(again.get(f"/?token={first}")[0], 403)
            again.enter()
            self.assertEqual(again.page().ask("open")["galaxies"], {"mine": GALAXY})
            folder.studio = again

    def test_secrets_of_a_file_stay(self):
        with Folder("mine.toml", "--token-file", "secrets") as folder:
            first = folder.studio
            first.enter()
            self.assertEqual((folder.path / "secrets").stat().st_mode & 0o777, 0o600)
            first.process.kill()
            first.stop()
            again = Studio(GSTUDIO, ("mine.toml", "--token-file", "secrets", "--port", str(first.port)),
                           folder.path, ENVIRONMENT)
            folder.studio = again
            self.assertEqual(again.token, first.token)
            again.cookie = first.cookie
            self.assertEqual(again.page().ask("open")["op"], "document")
            (folder.path / "secrets").chmod(0o644)
            with self.assertRaisesRegex(RuntimeError, "others may read"):
                Studio(GSTUDIO, ("mine.toml", "--token-file", "secrets"), folder.path, ENVIRONMENT)
            (folder.path / "secrets").chmod(0o600)
            (folder.path / "secrets").write_text("short")
            with self.assertRaisesRegex(RuntimeError, "no secrets"):
                Studio(GSTUDIO, ("mine.toml", "--token-file", "secrets"), folder.path, ENVIRONMENT)

    def test_a_port_in_use(self):
        with Folder() as folder, self.assertRaisesRegex(RuntimeError, "in use"):
            Studio(GSTUDIO, ("mine.toml", "--port", str(folder.studio.port)), folder.path)


class Messages(unittest.TestCase):
    def test_wrong_ones_do_no_harm(self):
        with Folder() as folder:
            page, document = folder.open()
            wrong = [b"", b"{", b"[]", b"null", b'{"id":1}', b'{"id":1,"op":"x"}',
                     b'{"id":1,"op":"open","more":1}', b"[" * 100000, b'{"id":' * 50000,
                     b'{"id":1e999,"op":"open"}', b'{"id":1,"op":"view"}']
            for message in wrong:
                page.send_bytes(TEXT, message)
                answer = page.receive()
                self.assertEqual(answer["op"], "error", message[:40])
            text = document["galaxies"]["mine"]
            for edit in ({"set": [9, "rh", 1]}, {"set": [0, "rh", {}]}, {"set": [0, "effective_radius", -1]},
                         {"add": "x"}, {"clone": -1}, {"move": [0, 7]}, {"delete": 3}, {}):
                answer = page.ask("edit", galaxy_text=text, edits=[edit])
                self.assertEqual(answer["op"], "error", edit)
            self.assertIn("effective_radius = -1 is outside",
                          page.ask("edit", galaxy_text=text,
                                   edits=[{"set": [0, "effective_radius", -1]}])["message"])
            self.assertEqual(page.ask("open")["op"], "document")

    def test_random_ones_do_no_harm(self):
        random.seed(2)
        with Folder() as folder:
            page, document = folder.open()
            good = json.dumps({"op": "view", "id": 3, "sizes": [[8, 6, 0.1]], **texts(document)})
            for _ in range(300):
                bad = bytearray(good.encode())
                for _ in range(random.randint(1, 4)):
                    place = random.randrange(len(bad))
                    bad[place : place + random.randint(0, 3)] = random.randbytes(random.randint(0, 3))
                page.send_bytes(TEXT, bytes(byte & 0x7F for byte in bad))
            self.assertEqual(page.ask("open")["op"], "document")
            self.assertIsNone(folder.studio.process.poll())

    def test_too_long_and_binary_ones_end_the_connection(self):
        with Folder() as folder:
            for kind, message in ((TEXT, b" " * ((1 << 20) + 1)), (BINARY, b"x")):
                page, _ = folder.open()
                # The server may close before it has read all of a message that is too long.
                with self.assertRaises((Closed, ConnectionError)):
                    page.send_bytes(kind, message)
                    page.receive()
            self.assertEqual(folder.open()[1]["op"], "document")

    def test_too_many_wait(self):
        with Folder() as folder:
            page, _ = folder.open()
            begin = time.monotonic()
            for number in range(600):
                page.send({"op": "cancel", "id": number})
            for number in range(600):
                self.assertEqual(page.receive()["op"], "cancelled")
            # 400 messages are answered at once, then 200 a second.
            self.assertGreater(time.monotonic() - begin, 0.9)

    def test_too_many_pages(self):
        with Folder() as folder:
            folder.studio.enter()
            pages = [folder.studio.page() for _ in range(17)]
            self.assertEqual([page.status for page in pages], [101] * 16 + [503])
            pages[0].close()
            for _ in range(200):
                page = folder.studio.page()
                if page.status == 101:
                    break
                time.sleep(0.05)
            self.assertEqual(page.status, 101)

    def test_strange_requests(self):
        with Folder() as folder:
            for request in (b"\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a" * 10000,
                            b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999\r\n\r\nx",
                            b"\x16\x03\x01" + b"\0" * 100, b"GET / HTTP/9.9\r\n\r\n"):
                with socket.create_connection(("127.0.0.1", folder.studio.port), timeout=5) as client:
                    client.sendall(request)
                    client.shutdown(socket.SHUT_WR)
                    self.assertNotIn(b"200", client.recv(1 << 16).split(b"\r\n")[0])
            self.assertEqual(folder.open()[1]["op"], "document")


class Views(unittest.TestCase):
    def test_pixels_are_those_of_the_program(self):
        with Folder() as folder:
            page, document = folder.open()
            # The page has seeing of its own, and a view of the sphere has none.
            self.assertNotIn("seeing", document["parameters"])
            settings = ["image.size=[40,30]", "camera.width=1.8"]
            coarse, fine = view(page, 1, document, [[10, 7, 0.05], [40, 30, None]],
                                settings=settings)
            self.assertEqual((coarse[0]["width"], coarse[0]["last"]), (10, False))
            folder.shell(page.ask("command", name="x.fits", settings=settings,
                                  **texts(document))["command"].replace("gstudio-output/", ""))
            with fits.open(folder.path / "x.fits") as file:
                numpy.testing.assert_array_equal(cube(fine), file[0].data)
                for key in ("CRPIX1", "CRVAL1", "CDELT1", "CTYPE1", "CRPIX2", "CDELT2"):
                    self.assertEqual(fine[0]["wcs"][key], file[0].header[key], key)

    def test_planes_of_fluxes_have_zero_points(self):
        with Folder() as folder:
            page, document = folder.open()
            settings = ["image.size=[8,6]"]
            (frame,) = view(page, 1, document, [[8, 6, None]], settings=settings)
            self.assertEqual({plane["zero_point"] for plane in frame[0]["planes"]}, {None})
            document["scene"] = f"galaxy x y z apparent_magnitude\n{document['chosen']} 0 0 0 15\n"
            (frame,) = view(page, 2, document, [[8, 6, None]],
                            settings=[*settings, "image.unit=nJy", "scene.unit=kpc"])
            for plane in frame[0]["planes"]:
                self.assertAlmostEqual(plane["zero_point"], 31.4, places=9)

    def test_a_scene(self):
        with Folder("render.par", "scene.lst") as folder:
            page, document = folder.open()
            self.assertEqual((document["chosen"], document["own"]), ("mine", ["mine"]))
            (frame,) = view(page, 1, document, [[24, 18, None]])
            folder.gamer("render.par", "scene.lst")
            whole = fits.getdata(folder.path / "out.fits")
            numpy.testing.assert_array_equal(cube(frame), whole)
            (parts,) = view(page, 2, document, [[24, 18, None]], planes="components")
            components = [plane["component"] for plane in parts[0]["planes"]]
            self.assertEqual(components, [0, 0, 0, 1, 1, 1])
            numpy.testing.assert_allclose(cube(parts).reshape(2, 3, 18, 24).sum(0), whole, rtol=3e-7)

    def test_edits_are_seen(self):
        with Folder() as folder:
            page, document = folder.open()
            answer = page.ask("edit", galaxy_text=GALAXY,
                              edits=[{"set": [1, "noise.octaves", 3]}, {"delete": 0}])
            self.assertEqual(answer["galaxy_text"],
                             GALAXY.replace("octaves = 2", "octaves = 3", 1).replace(
                                 GALAXY[GALAXY.index("[[component]]"):GALAXY.index("# The arms")], "")
                             .replace('"dust"\n', '"dust"\n').replace(
                                 "noise = { octaves = 2 }\n", 'noise = { octaves = 2 }\nname = "dust3"\n'))
            self.assertEqual([one["name"] for one in answer["model"]["components"]],
                             ["arms", "dust3"])
            (frame,) = view(page, 1, document, [[20, 20, None]],
                            galaxies={"mine": answer["galaxy_text"]}, settings=["image.size=20"])
            (folder.path / "edited.toml").write_text(answer["galaxy_text"])
            folder.gamer("look", "edited.toml", "-o", "x.fits", "-s", "image.size=20")
            numpy.testing.assert_array_equal(cube(frame), fits.getdata(folder.path / "x.fits"))

    def test_an_equal_view_measures_nothing(self):
        rows = "".join(f"mine {i % 8 - 4} {i} {i // 8 - 4} {i % 90} {7 * i % 180} 0.5 {i % 30}\n" for i in range(60))
        scene = "galaxy x y z inclination pa size seed\n" + rows
        with Folder("render.par", "scene.lst", files={**FILES, "scene.lst": scene}) as folder:
            page, document = folder.open()

            def measured(number, sizes, settings=()):
                page.send({"op": "view", "id": number, "parameters": document["parameters"], "scene": document["scene"],
                           "galaxies": document["galaxies"], "settings": list(settings), "sizes": sizes})
                return [page.receive()[0]["measured"] for _ in sizes]

            levels = [[12, 9, 0.05], [18, 14, 0.02], [24, 18, None]]
            coarse, finer, fine = measured(1, levels)
            self.assertGreater(min(coarse, fine), 30)
            self.assertEqual(finer, 0)
            self.assertEqual(measured(2, levels), [0, 0, 0])
            # Galaxies of fine levels are released while the camera moves, but their measurements are kept.
            for turn in range(12):
                self.assertEqual(measured(3 + turn, levels[:1], ["camera.up=[0.01, 0, 1]"]), [0])
            self.assertEqual(measured(20, levels), [0, 0, 0])

    def test_coarse_views_share_a_measurement(self):
        with Folder() as folder:
            page, document = folder.open()
            levels = [[12, 12, 0.1], [16, 16, 0.05], [20, 20, 0.02]]
            first, *others = (head["measured"] for head, _ in view(page, 1, document, levels))
            self.assertGreater(first, 0)
            self.assertEqual(others, [0, 0])
            # A near view has narrower rays, and shares the measurement as well.
            ((near, _),) = view(page, 2, document, [[30, 30, 0.03]], settings=["camera.width=0.2"])
            self.assertEqual(near["measured"], 0)

    def test_magnitudes_through_dust_are_measured_once_for_a_side(self):
        files = {**FILES, "render.par": SKY_PARAMETERS, "scene.lst": SKY_SCENE}
        with Folder("render.par", "scene.lst", files=files) as folder:
            page, document = folder.open()
            levels, zoom = [[20, 20, 0.05], [24, 24, None]], "camera.pixel_scale=0.25"
            measured = lambda all_frames: [head["measured"] for head, _ in all_frames]
            self.assertGreater(min(measured(view(page, 1, document, levels))), 2)
            self.assertEqual(measured(view(page, 2, document, levels)), [0, 0])
            coarse, fine = view(page, 3, document, levels, settings=[zoom])
            self.assertEqual(coarse[0]["measured"], 0)
            folder.gamer("render.par", "scene.lst", "-o", "x.fits", "-s", zoom)
            numpy.testing.assert_array_equal(cube(fine), fits.getdata(folder.path / "x.fits"))
            # Another magnitude, redder light and another side need new measurements.
            galaxies = {"mine": GALAXY.replace('sed = "Sbc"', 'sed = "E"')}
            scene = SKY_SCENE.replace(" 70 ", " 20 ")
            (other,) = view(page, 4, document, levels[1:], galaxies=galaxies, scene=scene)
            (folder.path / "mine.toml").write_text(galaxies["mine"])
            (folder.path / "scene.lst").write_text(scene)
            folder.gamer("render.par", "scene.lst", "-o", "y.fits")
            numpy.testing.assert_array_equal(cube(other), fits.getdata(folder.path / "y.fits"))

    def test_the_cache_changes_no_bit(self):
        runs = []
        with tempfile.TemporaryDirectory() as cache:
            for words, place in (((), "off"), ((), cache), ((), cache), (("--no-cache",), cache)):
                with Folder("mine.toml", *words, cache=place) as folder:
                    page, document = folder.open()
                    runs.append(view(page, 1, document, [[20, 20, 0.05], [40, 40, None]]))
                files = [path for path in pathlib.Path(cache).rglob("*") if path.is_file()]
                self.assertEqual(len(files) > 0, len(runs) > 1)
        for run in runs[1:]:
            for frame, expected in zip(run, runs[0]):
                numpy.testing.assert_array_equal(cube(frame), cube(expected))
        # Coarse views are measured each time.
        self.assertEqual([[head["measured"] > 0 for head, _ in run] for run in runs],
                         [[True, True], [True, True], [True, False], [True, True]])

    def test_a_newer_view_cancels(self):
        with Folder() as folder:
            page, document = folder.open()
            # The galaxy is measured before views are cancelled.
            view(page, 1, document, [[20, 20, 0.1]])
            for number in range(10, 14):
                page.send({"op": "view", "id": number, "sizes": [[1500, 1500, 1e-4]],
                           **texts(document), "settings": ["image.size=1500"]})
                time.sleep(0.3)
                # The view would take far longer than the page waits.
                page.send({"op": "cancel", "id": 100 + number})
                self.assertEqual(page.receive(), {"op": "cancelled", "id": number})
            page.send({"op": "view", "id": 20, "sizes": [[1500, 1500, 1e-4]], **texts(document)})
            page.send({"op": "view", "id": 21, "sizes": [[20, 20, None]], **texts(document)})
            self.assertEqual(page.receive(), {"op": "cancelled", "id": 20})
            self.assertEqual(page.receive()[0]["id"], 21)
            page.send({"op": "cancel", "id": 22})
            self.assertEqual(page.receive(), {"op": "cancelled", "id": None})

    def test_two_pages(self):
        with Folder() as folder:
            first, document = folder.open()
            second = folder.studio.page()
            expected = {width: cube(view(first, 1, document, [[width, 10, 0.05]])[0])
                        for width in (10, 15)}
            for number in range(8):
                for page, width in ((first, 10), (second, 15)):
                    page.send({"op": "view", "id": number, "sizes": [[width, 10, 0.05]],
                               **texts(document)})
                for page, width in ((first, 10), (second, 15)):
                    (frame,) = frames(page, number, 1)
                    numpy.testing.assert_array_equal(cube(frame), expected[width])
            second.close()
            self.assertEqual(len(view(first, 9, document, [[10, 10, 0.05]])), 1)

    def test_paths_are_refused(self):
        with Folder() as folder:
            page, document = folder.open()
            for changes in ({"settings": ["camera.header=/etc/passwd"]},
                            {"galaxies": {"mine": GALAXY.replace('"E"', '"/etc/passwd"')}},
                            {"scene": document["scene"].replace("mine", "../mine")}):
                for op, more in (("view", {"sizes": [[8, 8, 0.1]]}), ("command", {}),
                                 ("render", {"name": "x.fits"})):
                    answer = page.ask(op, **more, **texts(document, **changes))
                    self.assertEqual(answer["op"], "error")
                    self.assertIn("is a path", answer["message"])


class Files(unittest.TestCase):
    def test_saving_keeps_the_text(self):
        with Folder() as folder:
            page, _ = folder.open()
            edited = page.ask("edit", galaxy_text=GALAXY, edits=[{"set": [None, "arms.count", 3]}])
            text = edited["galaxy_text"]
            self.assertEqual(text, GALAXY.replace("# spirals\n", "# spirals\ncount = 3\n"))
            self.assertEqual(page.ask("save", galaxy="mine", galaxy_text=text)["op"], "saved")
            self.assertEqual((folder.path / "mine.toml").read_text(), text)
            self.assertEqual(page.ask("open")["galaxies"]["mine"], text)
            self.assertEqual(page.ask("save", galaxy="mine", galaxy_text="x")["op"], "error")
            (folder.path / "mine.toml").write_text(GALAXY)
            answer = page.ask("save", galaxy="mine", galaxy_text=text + "# more\n")
            self.assertIn("changed by another program", answer["message"])
            self.assertEqual((folder.path / "mine.toml").read_text(), GALAXY)
            self.assertEqual(page.ask("save", galaxy="mine", galaxy_text=text, overwrite=True)["op"],
                             "saved")

    def test_saving_under_another_name(self):
        with Folder() as folder:
            page, _ = folder.open()
            answer = page.ask("save_as", name="new one", galaxy_text=GALAXY)
            self.assertEqual(answer["file"], "new one.toml")
            file = folder.path / "gstudio-output" / "new one.toml"
            self.assertEqual(file.read_text(), GALAXY)
            self.assertIn("exists", page.ask("save_as", name="new one", galaxy_text=GALAXY)["message"])
            for name in ("../x", "/tmp/x", ".x", "", "x/y", "-x"):
                self.assertEqual(page.ask("save_as", name=name, galaxy_text=GALAXY)["op"], "error")
            self.assertEqual([one["name"] for one in page.ask("outputs")["outputs"]],
                             ["new one.toml"])
            fields = [("Cookie", folder.studio.cookie)]
            status, headers, body = folder.studio.get("/output/new%20one.toml", fields)
            self.assertEqual(status, 404)  # names are not decoded
            os.symlink("/etc/passwd", folder.path / "gstudio-output" / "link.toml")
            self.assertEqual(folder.studio.get("/output/link.toml", fields)[0], 404)

    def test_a_galaxy_of_the_catalogue_stays(self):
        with Folder("spiral") as folder:
            page, document = folder.open()
            self.assertEqual((document["chosen"], document["own"]), ("spiral", []))
            text = document["galaxies"]["spiral"]
            self.assertIn("catalogue", page.ask("save", galaxy="spiral", galaxy_text=text)["message"])

    def test_a_render_is_that_of_the_program(self):
        for arguments in (("mine.toml",), ("render.par", "scene.lst")):
            with self.subTest(arguments), Folder(*arguments) as folder:
                page, document = folder.open()
                settings = ["image.size=[32,20]", 'image.unit="relative"']
                for text in (GALAXY, GALAXY.replace("0.1", "0.2")):
                    changes = {"settings": settings, "galaxies": {"mine": text}}
                    last, progress = render(page, 50, document, "x.fits", overwrite=True, **changes)
                    self.assertEqual(last, {"op": "rendered", "id": 50, "file": "x.fits"})
                    self.assertEqual(progress[-1], (20, 20))
                    made = folder.path / "gstudio-output" / "x.fits"
                    mine = made.read_bytes()
                    status, _, body = folder.studio.get(
                        "/output/x.fits", [("Cookie", folder.studio.cookie)])
                    self.assertEqual((status, body == mine), (200, True))
                    command = page.ask("command", name="x.fits", **texts(document, **changes))
                    if text == GALAXY:
                        self.assertEqual(command["unsaved"], [])
                        line = command["command"]
                    else:
                        self.assertEqual(command["unsaved"], ["mine"])
                        line = ("gamer gstudio-output/x.sources/scene.par "
                                "gstudio-output/x.sources/scene.lst -o gstudio-output/x.fits "
                                "-s 'image.size=[32,20]' -s 'image.unit=\"relative\"'")
                    folder.shell(line + " --overwrite")
                    self.assertEqual(made.read_bytes(), mine)
                    (frame,) = view(page, 60, document, [[32, 20, None]], **changes)
                    numpy.testing.assert_array_equal(cube(frame), fits.getdata(made))

    def test_neighbours_of_unsaved_texts_go_along(self):
        head = "# wavelength: Angstrom\n# flux: flambda\n"
        galaxy = GALAXY.replace('sed = "Sbc"', 'sed = "only_mine"').replace('sed = "E"', 'sed = "spectra/old.sed"')
        files = {"work/mine.toml": galaxy, "work/only_mine.sed": head + "1000 0.2\n5500 1\n20000 3\n",
                 "work/spectra/old.sed": head + "1000 1\n5500 1\n20000 1\n", "work/secret.sed": head + "1000 1\n20000 1\n",
                 "work/scene.lst": SCENE, "render.par": PARAMETERS}
        with Folder("render.par", "work/scene.lst", files=files) as folder:
            page, document = folder.open()
            changes = {"galaxies": {"mine": galaxy.replace("0.1", "0.2")}}
            last, _ = render(page, 1, document, "x.fits", **changes)
            self.assertEqual(last, {"op": "rendered", "id": 1, "file": "x.fits"})
            sources = folder.path / "gstudio-output" / "x.sources"
            self.assertEqual(sorted(str(one.relative_to(sources)) for one in sources.rglob("*.*")),
                             ["mine.toml", "only_mine.sed", "scene.lst", "scene.par", "spectra/old.sed"])
            (frame,) = view(page, 2, document, [[24, 18, None]], **changes)
            made = fits.getdata(folder.path / "gstudio-output" / "x.fits")
            numpy.testing.assert_array_equal(cube(frame), made)
            # A path that the files do not name is refused.
            changes = {"galaxies": {"mine": galaxy.replace('"only_mine"', '"./secret.sed"')}}
            self.assertIn("is a path", render(page, 3, document, "y.fits", **changes)[0]["message"])

    def test_a_scene_is_edited_and_saved(self):
        with Folder("render.par", "scene.lst") as folder:
            page, document = folder.open()
            self.assertEqual(document["scene_file"], "scene.lst")
            edited = page.ask("edit_scene", scene=SCENE, edits=[{"set": [1, "x", 0.25]}])["scene"]
            self.assertEqual(edited, SCENE.replace("mine 0.5 2", "mine 0.25 2"))
            self.assertEqual(page.ask("save_scene", scene=edited)["op"], "saved")
            self.assertEqual((folder.path / "scene.lst").read_text(), edited)
            for scene in ("x", "galaxy x\n../mine 0\n", ""):
                self.assertEqual(page.ask("save_scene", scene=scene)["op"], "error", scene)
            (folder.path / "scene.lst").write_text(SCENE)
            self.assertIn("another program", page.ask("save_scene", scene=edited + "# more\n")["message"])
            self.assertEqual((folder.path / "scene.lst").read_text(), SCENE)
            added = page.ask("edit_scene", scene=SCENE, edits=[{"add": [0, "elliptical"]}])["scene"]
            galaxy = page.ask("galaxy", galaxy="elliptical")["galaxy_text"]
            self.assertEqual(galaxy, (SOURCE / "galaxies/elliptical.toml").read_text())
            for name in ("../mine", "/etc/passwd", "mine2", ""):
                self.assertEqual(page.ask("galaxy", galaxy=name)["op"], "error", name)
            changes = {"scene": added, "galaxies": {**document["galaxies"], "elliptical": galaxy}}
            self.assertEqual(page.ask("command", **texts(document, **changes))["unsaved"], ["scene"])
            (frame,) = view(page, 4, document, [[24, 18, None]], **changes)
            (folder.path / "scene.lst").write_text(added)
            folder.gamer("render.par", "scene.lst", "-o", "all.fits")
            numpy.testing.assert_array_equal(cube(frame), fits.getdata(folder.path / "all.fits"))
        with Folder("mine.toml") as folder:
            page, document = folder.open()
            self.assertIsNone(document["scene_file"])
            self.assertIn("no scene", page.ask("save_scene", scene=SCENE)["message"])

    def test_rows_keep_their_orientation_in_space(self):
        above = 'position = [0, 0, 10]\nup = [0, 1, 0]\nprojection = "orthographic"\nwidth = 2.5'
        parameters = PARAMETERS.replace("position = [0, -3, 1]", above)
        with Folder("render.par", "scene.lst", files={**FILES, "render.par": parameters}) as folder:
            page, document = folder.open()
            scene = page.ask("fix_orientations", **texts(document))["scene"]
            names, *rows = [line.split() for line in scene.splitlines()]
            for row, inclination, angle in zip(rows, (50, 10), (30, 0)):
                word = dict(zip(names, row))
                self.assertEqual(word["inclination"], "-")
                # The node lies at `pa` from +y to -x, and the axis is z turned about the node.
                i, a = math.radians(inclination), math.radians(angle)
                node = numpy.array([-math.sin(a), math.cos(a), 0])
                axis = numpy.array([math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i)])
                numpy.testing.assert_allclose([float(word[name]) for name in ("ox", "oy", "oz")], axis, atol=1e-15)
                turned = rotation(float(word["pa"])) @ [1, 0, 0]
                numpy.testing.assert_allclose(shortest_turn(axis) @ turned, node, atol=1e-15)
            # The camera sees the former scene; another camera sees another side.
            (before,) = view(page, 1, document, [[24, 18, None]])
            (after,) = view(page, 2, document, [[24, 18, None]], scene=scene)
            numpy.testing.assert_allclose(cube(after), cube(before), rtol=2e-6)
            moved = ["camera.position=[6,-8,0.5]", "camera.up=[0,0,1]"]
            (frame,) = view(page, 3, document, [[24, 18, None]], scene=scene, settings=moved)
            (towards,) = view(page, 4, document, [[24, 18, None]], settings=moved)
            self.assertGreater(numpy.abs(cube(frame) - cube(towards)).max(), 0.05 * cube(frame).max())
            self.assertEqual(page.ask("save_scene", scene=scene)["op"], "saved")
            folder.gamer("render.par", "scene.lst", "-o", "all.fits", *(f"--set={one}" for one in moved))
            numpy.testing.assert_array_equal(cube(frame), fits.getdata(folder.path / "all.fits"))
            self.assertEqual(page.ask("fix_orientations", **texts(document, scene=scene))["scene"], scene)
            sky = ['camera.projection="sky"', "camera.pixel_scale=1", "camera.center=[0,0]"]
            self.assertEqual(page.ask("fix_orientations", **texts(document), settings=sky)["op"], "error")

    def test_galaxies_of_a_row_keep_their_flattening(self):
        scene = "galaxy sersic_index axis_ratio pa x y z\nsersic 1 0.4 20 0 0 0\n"
        with Folder("render.par", "scene.lst", files={**FILES, "scene.lst": scene}) as folder:
            page, document = folder.open()
            fixed = page.ask("fix_orientations", **texts(document))["scene"]
            self.assertIn("sersic 1 0.4 ", fixed)
            (before,) = view(page, 1, document, [[24, 18, None]])
            (after,) = view(page, 2, document, [[24, 18, None]], scene=fixed)
            numpy.testing.assert_allclose(cube(after), cube(before), rtol=2e-6)

    def test_errors_of_renders_are_the_programs(self):
        with Folder() as folder:
            page, document = folder.open()
            last, _ = render(page, 1, document, "x.fits", settings=["image.size=0"])
            self.assertIn("size", last["message"])
            for name in ("x.sh", "../x.fits", "x"):
                self.assertIn("no name", render(page, 2, document, name)[0]["message"])
            self.assertEqual(render(page, 3, document, "x.fits", settings=["image.size=8"])[0]["op"],
                             "rendered")
            self.assertIn("exists already",
                          render(page, 4, document, "x.fits", settings=["image.size=8"])[0]["message"])

    def test_a_render_is_cancelled(self):
        with Folder() as folder:
            page, document = folder.open()
            large = {"settings": ["image.size=3000", "sampling.tolerance=1e-4"], **texts(document)}
            for number in (70, 71):
                page.send({"op": "render", "id": number, "name": f"{number}.fits", **large})
            while page.receive()["op"] != "progress":
                pass
            self.assertEqual([job["id"] for job in page.ask("outputs")["jobs"]], [70, 71])
            page.send({"op": "cancel", "id": 1, "target": 71})
            page.send({"op": "cancel", "id": 2, "target": 70})
            ended = []
            while len(ended) < 2:
                message = page.receive()
                if message["op"] == "cancelled":
                    ended.append(message["id"])
            self.assertEqual(sorted(ended), [70, 71])
            self.assertEqual(list((folder.path / "gstudio-output").glob("*.fits")), [])

    def test_a_render_ends_with_the_program_and_is_resumed(self):
        with Folder() as folder:
            page, document = folder.open()
            changes = {"settings": ["image.size=[600,600]", "sampling.tolerance=1e-3"]}
            page.send({"op": "render", "id": 5, "name": "x.fits", **texts(document, **changes)})
            while page.receive()["op"] != "progress":
                pass
            children = subprocess.run(["pgrep", "-P", str(folder.studio.process.pid)], text=True,
                                      capture_output=True, check=True).stdout.split()
            folder.studio.process.kill()
            folder.studio.stop()
            for _ in range(1000):
                if not any(os.path.exists(f"/proc/{child}") for child in children):
                    break
                time.sleep(0.02)
            folder.studio = Studio(GSTUDIO, ("mine.toml",), folder.path, ENVIRONMENT)
            page, document = folder.open()
            last, _ = render(page, 6, document, "x.fits", resume=True, **changes)
            self.assertEqual(last["op"], "rendered")
            folder.shell(page.ask("command", name="y.fits", **texts(document, **changes))["command"])
            made = folder.path / "gstudio-output"
            numpy.testing.assert_array_equal(fits.getdata(made / "x.fits"), fits.getdata(made / "y.fits"))


class CommandLine(unittest.TestCase):
    def run_studio(self, *arguments):
        result = subprocess.run([GSTUDIO, *arguments], capture_output=True, text=True, timeout=60,
                                env={**os.environ, **ENVIRONMENT})
        return result.returncode, result.stdout, result.stderr

    def test_answers_and_errors(self):
        self.assertEqual(self.run_studio("--version")[0], 0)
        code, text, _ = self.run_studio("--help")
        self.assertEqual(code, 0)
        self.assertIn("--no-browser", text)
        for arguments, problem in ((("--port", "70000"), "--port"), (("no.toml",), "no.toml"),
                                   (("a.par", "b.lst"), "a.par"), (("a", "b", "c"), "gstudio")):
            code, out, error = self.run_studio(*arguments)
            self.assertEqual((code, out), (2, ""))
            self.assertIn(problem, error)

    def test_a_browser_gets_a_private_file(self):
        with Folder() as folder:
            folder.studio.stop()
            bin_folder = folder.path / "bin"
            bin_folder.mkdir()
            script = bin_folder / "xdg-open"
            script.write_text('#!/bin/sh\ncp -p "$1" "$OUT"; echo "$1" > "$OUT.name"\n')
            script.chmod(0o755)
            out = folder.path / "opened.html"
            process = subprocess.Popen(
                [GSTUDIO, "mine.toml"], cwd=folder.path, stdout=subprocess.PIPE, text=True,
                env={**os.environ, **ENVIRONMENT, "DISPLAY": ":0", "OUT": str(out),
                     "PATH": f"{bin_folder}:{os.environ['PATH']}"})
            address = process.stdout.readline().strip()
            for _ in range(1000):
                name = folder.path / "opened.html.name"
                if name.exists() and name.read_text():
                    break
                time.sleep(0.05)
            self.assertIn(f"url={address}\"", out.read_text())
            self.assertEqual(out.stat().st_mode & 0o777, 0o600)
            self.assertNotIn(address.split("=")[1], (folder.path / "opened.html.name").read_text())
            process.terminate()
            process.wait(timeout=60)
            process.stdout.close()
            # A signal that ends gstudio removes the file, too.
            self.assertFalse(os.path.exists((folder.path / "opened.html.name").read_text().strip()))
            folder.studio = Studio(GSTUDIO, folder.arguments, folder.path, ENVIRONMENT)

    def test_signals_end_it(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            folder = Folder()
            with folder:
                folder.studio.process.send_signal(number)
                self.assertEqual(folder.studio.process.wait(timeout=60), -number)


if __name__ == "__main__":
    del sys.argv[1:4]
    unittest.main()
