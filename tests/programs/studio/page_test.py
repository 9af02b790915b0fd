"""The page of gstudio in a real browser: page_test.py GSTUDIO GAMER SOURCE.

Selenium drives a headless Chromium. Where either is missing, the tests are skipped."""

import shlex
import shutil
import struct
import subprocess
import sys
import unittest

from studio_page import ENVIRONMENT, FILES, GALAXY, GAMER, SOURCE, Page, Server, missing, set_size, start_browser

if not missing():
    from studio_page import Keys

SKIPPED = 77  # exit status


def read_planes(path):
    """Planes of a FITS image of floats, each a list from the bottom."""
    content = path.read_bytes()
    cards, at = {}, 0
    while "END" not in cards:
        for i in range(at, at + 2880, 80):
            card = content[i:i + 80].decode("ascii")
            cards.setdefault(card[:8].strip(), card[10:].split("/")[0].strip())
        at += 2880
    size = int(cards["NAXIS1"]) * int(cards["NAXIS2"])
    planes = int(cards.get("NAXIS3", 1))
    values = struct.unpack_from(f">{size * planes}f", content, at)
    return [values[i * size:(i + 1) * size] for i in range(planes)]


def read_bmp(path):
    """RGB bytes of a 24-bit BMP, rows from the bottom."""
    content = path.read_bytes()
    start, = struct.unpack_from("<I", content, 10)
    width, height = struct.unpack_from("<ii", content, 18)
    stride = (3 * width + 3) // 4 * 4
    rows = range(height) if height > 0 else reversed(range(-height))
    out = []
    for row in rows:
        line = content[start + row * stride:start + row * stride + 3 * width]
        for x in range(width):
            out += [line[3 * x + 2], line[3 * x + 1], line[3 * x]]
    return out


@unittest.skipIf(missing(), missing())
class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.addClassCleanup(cls.server.close)
        cls.browser = start_browser()
        cls.addClassCleanup(cls.browser.quit)

    def setUp(self):
        self.page = Page(self.browser, self.server.address)
        self.page.log()

    def tearDown(self):
        self.assertEqual(self.page.log(), [])

    def assert_planes(self, sums, planes, least):
        """Channels are planes, but for the rounding of floats; red is the longest wavelength."""
        peak = max(planes[0])
        for channel, plane in zip(sums, reversed(planes)):
            self.assertEqual(len(channel), len(plane))
            for a, b in zip(channel, plane):
                self.assertLessEqual(abs(a - b), least * max(abs(b), 1e-3 * peak))

    def slide(self, key, pixels):
        slider = self.page.find(f'#parameters [data-key="{key}"] .slider')
        self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", slider)
        at = float(slider.get_attribute("value")) / 1000
        start = (at - 0.5) * (slider.size["width"] - 10)
        from selenium.webdriver.common.action_chains import ActionChains
        chain = ActionChains(self.browser).move_to_element_with_offset(slider, round(start), 0)
        chain.click_and_hold()
        for _ in range(4):
            chain.move_by_offset(pixels // 4, 0).pause(0.06)
        self.middle = None
        chain.perform()
        self.middle = self.page.value("[studio.doc.draft !== null, studio.doc.history.states.length]")
        ActionChains(self.browser).release().perform()
        self.page.settle()

    def test_pixels_are_those_of_the_command_line(self):
        page = self.page
        planes = read_planes(self.server.gamer("a.fits"))
        self.assertEqual(page.value("studio.picture.frame.header.is_whole"), False)
        self.assert_planes(page.sums(), planes, 5e-7)

    def test_colours_are_those_of_the_command_line(self):
        page = self.page
        page.run("studio.look.togglePixels()")
        for contrast in (3, 1):
            page.run(f"studio.look.put('contrast', {contrast})")
            expected = read_bmp(self.server.gamer(f"contrast{contrast}.bmp", "--set", f"image.contrast={contrast}"))
            shown = page.shown()
            self.assertEqual(len(shown), len(expected))
            self.assertLessEqual(max(abs(a - b) for a, b in zip(shown, expected)), 1)
            differ = sum(a != b for a, b in zip(shown, expected))
            self.assertLess(differ, 0.01 * len(shown))

    def test_canvas_has_the_pixels_of_the_picture(self):
        page = self.page
        state = "[studio.canvas.width, studio.canvas.height, getComputedStyle(studio.canvas).imageRendering]"
        page.run("studio.picture.draw(studio.ui.tone, studio.ui.look)")
        self.assertEqual(page.value(state), [48, 36, "auto"])
        self.assertGreater(page.value("studio.canvas.clientWidth"), 200)
        page.keys("x")
        page.wait("studio.canvas.style.imageRendering === 'pixelated'")
        self.assertEqual(page.value(state), [48, 36, "pixelated"])
        # If far fewer pixels are shown, only those are drawn.
        page.run("studio.picture.draw(studio.ui.tone, {...studio.ui.look, pixels: false}, null, [24, 18])")
        self.assertEqual(page.value(state), [24, 18, "auto"])
        page.run("studio.look.togglePixels()")

    def test_stretch_asks_for_no_render(self):
        page = self.page
        asked = page.value("studio.connection.next")
        before = page.shown()
        page.run("studio.look.put('exposure', 2)")
        brighter = page.shown()
        self.assertGreater(sum(brighter), sum(before))
        page.run("studio.look.set({mode: 'linear', auto: false})")
        self.assertLess(sum(page.shown()), sum(brighter))
        page.find(".handle.white").send_keys(Keys.SHIFT, Keys.ARROW_LEFT)
        page.find(".look [title^='Back']").click()
        self.assertEqual(page.shown(), before)
        self.assertEqual(page.value("studio.connection.next"), asked)

    def test_psf_is_that_of_gutil(self):
        page = self.page
        rendered = self.server.gamer("f.fits")
        convolved = rendered.with_name("convolved.fits")
        subprocess.run([GAMER.with_name("gutil"), "convolve", "--psf", "gaussian", "--fwhm", "3", rendered,
                        convolved, "--overwrite"], env=ENVIRONMENT, check=True, capture_output=True)
        page.run("studio.look.put('psf', 3)")
        seen = page.value("Array.from(studio.picture.pixelsOf(studio.picture.seen(studio.stage.seeing())))")
        planes = read_planes(convolved)
        for channel, plane in enumerate(reversed(planes)):
            worst = max(abs(a - b) for a, b in zip(seen[channel::4], plane))
            self.assertLess(worst, 1e-6 * max(plane))
        # Noise adds one normal deviate to each pixel and channel.
        page.run("studio.look.put('psf', 0); studio.look.put('noise', 0.5)")
        noisy = page.value("Array.from(studio.picture.pixelsOf(studio.picture.seen(studio.stage.seeing())))")
        plain = page.value("Array.from(studio.picture.sums())")
        deviates = [a - b for i, (a, b) in enumerate(zip(noisy, plain)) if i % 4 != 3]
        mean = sum(deviates) / len(deviates)
        rms = (sum(one * one for one in deviates) / len(deviates)) ** 0.5
        self.assertLess(abs(mean), 4 * 0.5 / len(deviates) ** 0.5)
        self.assertLess(abs(rms - 0.5), 4 * 0.5 / (2 * len(deviates)) ** 0.5)

    def test_strips_show_the_finest_level_in_the_making(self):
        page = self.page
        page.run("""globalThis.partial = 0;
          studio.preview.addEventListener('strip', () => { partial += studio.picture.frame.header.isPartial ? 1 : 0; });
          return studio.doc.set({'image.size': [400, 300]}, 'size');""")
        page.settle()
        self.assertGreater(page.value("partial"), 0)
        planes = read_planes(self.server.gamer("g.fits", "--set=image.size=[400,300]"))
        self.assert_planes(page.sums(), planes, 5e-7)

    def test_picture_follows_a_slider(self):
        page = self.page
        page.select("lanes")
        before = page.sums()
        self.slide("optical_depth", 60)
        self.assertEqual(self.middle, [True, 1])
        depth = page.value("studio.doc.model.components[2].values.optical_depth")
        self.assertGreater(depth, 0.5)
        after = page.sums()
        self.assertLess(sum(after[2]), sum(before[2]))
        self.assertEqual(page.value("studio.doc.history.states.length"), 2)
        # The text differs in this value alone.
        text = page.value("studio.doc.text")
        self.assertEqual(text, GALAXY.replace("optical_depth = 0.5", f"optical_depth = {depth}"))
        self.assert_planes(after, read_planes(self.server.gamer("b.fits", galaxy=text)), 5e-7)

    def test_parameters_that_cannot_matter_are_hidden_or_say_why(self):
        page = self.page
        shown = lambda key: page.value(f"[...document.querySelectorAll('#parameters [data-key=\"{key}\"]')].map((row) => "
                                       "[!row.hidden, row.querySelector('input').disabled, row.querySelector('label').title.split('\\n')[0]])")[0]
        page.run("studio.parameters.choose('galaxy')")
        self.assertFalse(shown("arms.winding_b")[0])
        self.assertEqual(shown("arms.pitch_angle")[:2], [True, False])
        search = page.find("#filters input")
        search.send_keys("winding")
        self.assertEqual(shown("arms.winding_b"), [True, True, "Belongs to model ringermacher-mead."])
        search.clear()
        page.make("studio.doc.edit([{set: [null, 'arms.model', 'ringermacher-mead']}], 'law')")
        page.settle()
        page.run("studio.parameters.search.value = ''; studio.parameters.filter()")
        self.assertEqual(shown("arms.winding_b")[:2], [True, False])
        self.assertFalse(shown("arms.pitch_angle")[0])
        page.run("studio.parameters.choose('component')")
        page.select("disk")
        self.assertFalse(shown("outer_rh")[0])
        page.make("studio.doc.edit([{set: [1, 'break_radius', 0.5]}, {set: [1, 'outer_rh', 0.05]}], 'break')")
        page.settle()
        self.assertEqual(shown("outer_rh")[:2], [True, False])
        # Keys that need a break are removed with it.
        page.make("studio.doc.edit([{set: [1, 'break_radius', 0]}], 'no break')")
        page.settle()
        self.assertFalse(shown("outer_rh")[0])
        self.assertNotIn("outer_rh", page.value("studio.doc.history.state.galaxies.mine"))

    def test_keys_work_after_a_value_is_typed(self):
        page = self.page
        page.run("studio.components.select(2)")
        field = page.find('#parameters [data-key="optical_depth"] input[type=text]')
        field.click()
        page.keys(Keys.CONTROL, "a")
        field.send_keys("1.25", Keys.ENTER)
        page.settle()
        self.assertIn("optical_depth = 1.25", page.value("studio.doc.text"))
        page.keys("m")
        page.wait("studio.ui.isMuted('mine', 'lanes')")
        # A text that is no number stays in the field.
        field.click()
        field.send_keys(Keys.END, "x", Keys.ENTER)
        self.assertEqual(page.value("document.activeElement.value"), "1.25x")
        field.send_keys(Keys.ESCAPE)
        page.settle()

    def test_share_of_light_follows_without_a_render(self):
        page = self.page
        page.select("core")
        asked = page.value("studio.connection.next")
        page.run("studio.preview.showShares([{set: [0, 'fraction', 0.5]}, {set: [1, 'fraction', 0.5]}])")
        shown = page.sums()
        self.assertEqual(page.value("studio.connection.next"), asked)
        page.run("return studio.doc.edit([{set: [0, 'fraction', 0.5]}, {set: [1, 'fraction', 0.5]}], 'share')")
        page.settle()
        rendered = page.sums()
        # The render chooses its own nodes, so that it agrees to the tolerance.
        scale = max(rendered[0])
        self.assertLess(max(abs(a - b) for a, b in zip(shown[0], rendered[0])), 0.01 * scale)

    def test_shares_that_move_are_two_sums(self):
        page = self.page
        for share in (0.4, 0.6, 0.8):
            page.run("studio.preview.showShares([{set: [0, 'fraction', arguments[0]]}, {set: [1, 'fraction', 1 - arguments[0]]}])",
                     share)
            grouped = page.shown()
            if share > 0.4:
                self.assertFalse(page.value("studio.picture.isSummed"))
                self.assertTrue(page.value("studio.picture.summed !== null"))
            page.run("studio.picture.sumUp()")
            whole = page.shown()
            # The last bit of eight may be rounded differently.
            self.assertLessEqual(max(abs(a - b) for a, b in zip(grouped, whole)), 1)
            self.assertGreater(max(whole), 100)
        # A new frame needs new sums.
        page.run("studio.preview.ask(false)")
        page.settle()
        page.shown()
        self.assertIsNone(page.value("studio.picture.summed"))

    def test_shares_keep_their_sum(self):
        page = self.page
        page.select("core")
        self.slide("fraction", 50)
        shares = page.value("studio.doc.model.components.map((c) => c.values.fraction ?? 0)")
        self.assertGreater(shares[0], 0.25)
        self.assertAlmostEqual(sum(shares), 1, places=9)

    def test_orbit_pan_zoom_and_centre(self):
        page = self.page
        canvas = page.find("#picture")
        first = page.value("studio.ui.camera")
        page.drag(canvas, 80, 40)
        page.settle()
        camera = page.value("studio.ui.camera")
        self.assertNotEqual(camera["position"], first["position"])
        self.assertAlmostEqual(sum(x * x for x in camera["position"]), 100, places=5)
        # The frame shows the view of this camera.
        rendered = self.server.gamer("c.fits", f"--set=camera.position={camera['position']}")
        self.assert_planes(page.sums(), read_planes(rendered), 5e-7)
        from selenium.webdriver.common.action_chains import ActionChains
        ActionChains(self.browser).key_down(Keys.SHIFT).perform()
        page.drag(canvas, 40, 0)
        ActionChains(self.browser).key_up(Keys.SHIFT).perform()
        page.settle()
        panned = page.value("studio.ui.camera")
        self.assertNotEqual(panned["target"], [0, 0, 0])
        from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
        ActionChains(self.browser).scroll_from_origin(ScrollOrigin.from_element(canvas), 0, -240).perform()
        page.wait("studio.ui.camera.width < 1.8")
        ActionChains(self.browser).move_to_element_with_offset(canvas, 60, 20).double_click().perform()
        page.wait(f"studio.ui.camera.target[0] !== {panned['target'][0]}")
        page.keys("0")
        page.settle()
        self.assertEqual(page.value("studio.ui.camera.position"), first["position"])

    def test_galaxies_with_an_inclination_are_orbited(self):
        page = self.own_server({**FILES, "scene.lst": "galaxy x y z inclination pa\nmine 0 0 0 60 25\n"})
        canvas, scene = page.find("#picture"), page.value("studio.doc.scene")
        before = page.sums()[0]
        page.drag(canvas, 40, 20)
        page.wait(f"studio.doc.scene !== {scene!r}")
        page.settle()
        after = page.sums()[0]
        self.assertGreater(sum(abs(a - b) for a, b in zip(before, after)), 0.05 * sum(before))
        # The picture is that of the program with the saved scene and camera.
        camera = page.value("studio.ui.camera")
        rendered = self.server.gamer("i.fits", f"--set=camera.position={camera['position']}",
                                     scene=page.value("studio.doc.scene"))
        self.assert_planes(page.sums(), read_planes(rendered), 5e-7)
        # "Face-on" looks along the galaxy's own axis.
        page.keys("1")
        page.settle()
        row = dict(zip(*(line.split() for line in page.value("studio.doc.scene").splitlines())))
        for name, place in zip(("ox", "oy", "oz"), page.value("studio.ui.camera.position")):
            self.assertAlmostEqual(10 * float(row[name]), place, places=6)
        page.keys(Keys.CONTROL, "z")
        page.wait(f"studio.doc.scene === {scene!r}")
        page.keys("0")
        page.settle()
        self.assertEqual(page.value("studio.doc.scene"), scene)
        self.assertEqual(page.sums()[0], before)

    def test_fingers_orbit_pan_and_zoom(self):
        page = self.page
        canvas = page.find("#picture")
        first = page.value("studio.ui.camera")
        page.touch(canvas, [(0, 0), (40, 10), (80, 20)])
        page.settle()
        orbited = page.value("studio.ui.camera")
        self.assertNotEqual(orbited["position"], first["position"])
        self.assertEqual([orbited["target"], orbited["width"]], [first["target"], first["width"]])
        # Two fingers side by side pan: the picture follows them by 60 pixels.
        page.keys("0")
        page.settle()
        width = page.value("studio.canvas.clientWidth")
        page.touch(canvas, [(-50, 0), (-20, 0), (10, 0)], [(50, 0), (80, 0), (110, 0)])
        page.settle()
        panned = page.value("studio.ui.camera")
        self.assertAlmostEqual(panned["target"][0], -60 / width * first["width"], delta=0.02 * first["width"])
        self.assertAlmostEqual(panned["width"], first["width"], delta=0.1 * first["width"])
        # Two fingers that part to twice their distance zoom in by two.
        page.keys("0")
        page.settle()
        page.touch(canvas, [(-50, 0), (-75, 0), (-100, 0)], [(50, 0), (75, 0), (100, 0)])
        page.settle()
        zoomed = page.value("studio.ui.camera")
        self.assertAlmostEqual(zoomed["width"], first["width"] / 2, places=6)
        for a, b in zip(zoomed["target"], first["target"]):
            self.assertAlmostEqual(a, b, delta=0.05 * first["width"])

    def test_arms_are_tables_of_their_own(self):
        page = self.page
        page.find("#tab-galaxy").click()
        arms = "studio.doc.model.arms.length"
        page.find(".arm-head button").click()
        page.wait(f"{arms} === 2")
        page.settle()
        added = "[[arm]]\noffset = 0\n\n[[arm]]\noffset = 180\n\n"
        self.assertEqual(page.value("studio.doc.text"), GALAXY.replace("[[component]]", added + "[[component]]", 1))
        page.find(".arm-head button").click()
        page.wait(f"{arms} === 3")
        page.run("document.querySelectorAll('details.group').forEach((one) => { one.open = true; })")
        page.find("[aria-label='Clone arm 1']").click()
        page.wait(f"{arms} === 4")
        page.find("[aria-label='Delete arm 2']").click()
        page.wait(f"{arms} === 3")
        page.find("[aria-label='Move arm 1 down']").click()
        page.wait("studio.doc.model.arms[0].offset === 180")
        page.run("const one = document.querySelectorAll('[data-key=strength] input[type=text]')[1];"
                 "one.value = '0.5'; one.dispatchEvent(new Event('change'));")
        page.wait("studio.doc.model.arms[1].strength === 0.5")
        page.settle()
        self.assertIn("offset = 0\nstrength = 0.5\n", page.value("studio.doc.text"))
        for _ in range(6):
            page.keys(Keys.CONTROL, "z")
        page.wait("!studio.doc.history.canUndo")
        self.assertEqual(page.value("studio.doc.text"), GALAXY)
        page.settle()
        page.find("#tab-component").click()

    def test_rows_of_the_scene_are_edited(self):
        scene = "# Two.\ngalaxy x   y z seed # columns\nmine   0   0 0 1\n# behind\nmine   0.5 0 -1 2 # small\n"
        page = self.own_server({**FILES, "scene.lst": scene})
        page.find("#tab-scene").click()
        self.assertEqual(len(self.browser.find_elements("css selector", ".scene-row")), 2)
        page.find(".scene-row:nth-child(2)").click()
        page.wait("studio.ui.row === 1")
        self.slide("x", 40)
        x = page.value("studio.scenePanel.state({name: 'x', type: 'number'}).value")
        self.assertGreater(x, 0.5)
        text = page.value("studio.doc.scene")
        self.assertRegex(text, rf"\nmine   {x} +0 -1 2 # small\n$")
        self.assertTrue(text.startswith(scene[:scene.index("0.5")]))
        # The picture is that of the edited list.
        self.assert_planes(page.sums(), read_planes(self.server.gamer("s.fits", scene=text)), 5e-7)
        page.find("[aria-label='Clone the row']").click()
        page.wait("studio.scenePanel.table.rows.length === 3")
        page.find("[aria-label^='Add a galaxy']").click()
        name = page.find("dialog input")
        name.clear()
        name.send_keys("elliptical", Keys.ENTER)
        page.wait("studio.scenePanel.table.rows.length === 4")
        page.settle()
        self.assertEqual(page.value("studio.scenePanel.table.rows[3][0]"), "elliptical")
        self.assertEqual(page.value("Object.keys(studio.doc.state.galaxies)"), ["mine", "elliptical"])
        page.find("[aria-label='Delete the row']").click()
        page.wait("studio.scenePanel.table.rows.length === 3")
        page.keys(Keys.CONTROL, "s")
        page.wait("!studio.doc.isChanged")
        self.assertEqual((self.server.path / "scene.lst").read_text(), page.value("studio.doc.scene"))
        for _ in range(4):
            page.keys(Keys.CONTROL, "z")
        page.wait("!studio.doc.history.canUndo")
        self.assertEqual(page.value("studio.doc.scene"), scene)
        page.settle()

    def test_a_list_of_2000_rows_holds_the_visible_ones(self):
        rows = "".join(f"mine {i * 10} 0 0 0.1\n" for i in range(2000))
        page = self.own_server({**FILES, "scene.lst": "galaxy x y z size\n" + rows})
        page.find("#tab-scene").click()
        self.assertLess(len(self.browser.find_elements("css selector", ".scene-row")), 20)
        page.find(".scene-rows").send_keys(Keys.END)
        page.wait("studio.ui.row === 1999")
        page.wait("document.querySelector('.scene-row[aria-selected=true]')"
                  "?.textContent.includes('2000')")
        page.run("return studio.doc.editScene([{set: [1999, 'x', -1]}], 'x')")
        page.settle()
        self.assertTrue(page.value("studio.doc.scene").endswith("\nmine -1    0 0 0.1\n"))

    def test_cursor_tells_the_value(self):
        page = self.page
        from selenium.webdriver.common.action_chains import ActionChains
        ActionChains(self.browser).move_to_element(page.find("#picture")).perform()
        page.wait("document.getElementById('readout').textContent.startsWith('x ')")
        text = page.find("#readout").text
        place, values = (line.split() for line in text.split("\n"))
        x, y = (int(float(place[i]) - 0.5) for i in (1, 3))
        shown = [float(word) for word in values[1:6:2]]
        planes = read_planes(self.server.gamer("a.fits"))
        expected = [float(f"{plane[48 * y + x]:.3e}") for plane in planes]
        self.assertEqual(shown, expected, text)

    def test_mute_and_solo(self):
        page = self.page
        whole = page.sums()
        page.select("core")
        asked = page.value("studio.connection.next")
        page.find(".component.chosen .toggle.M").click()
        muted = page.sums()
        self.assertEqual(page.value("studio.connection.next"), asked)
        page.find(".component.chosen .toggle.M").click()
        self.assertEqual(page.sums(), whole)
        # Alone, the component shows its light without dust, as --set scene.solo does.
        page.find(".component.chosen .toggle.S").click()
        page.settle()
        planes = read_planes(self.server.gamer("d.fits", "--set=scene.solo=core"))
        alone = page.sums()
        self.assertLess(max(abs(a - b) for a, b in zip(alone[2], planes[0])), 0.01 * max(planes[0]))
        page.keys("s")
        page.settle()
        self.assertLess(sum(muted[0]) + 0, sum(whole[0]))
        self.assertEqual(page.value("studio.ui.solo.mine"), None)

    def test_components_are_added_cloned_moved_deleted(self):
        page = self.page
        names = "studio.components.components.map((c) => c.name)"
        page.select("disk")
        page.keys("d")
        page.wait("studio.components.components.length === 4")
        self.assertEqual(page.value(names), ["core", "disk", "disk 2", "lanes"])
        page.keys(Keys.ALT, Keys.ARROW_UP)
        page.wait("studio.components.components[1].name === 'disk 2'")
        page.keys(Keys.DELETE)
        page.wait("studio.components.components.length === 3")
        page.keys("a")
        buttons = self.browser.find_elements("css selector", ".kind-button")
        self.assertEqual(len(buttons), len(page.value("Object.keys(studio.doc.opened.declarations.kinds)")))
        next(one for one in buttons if one.text.startswith("sersic")).click()
        page.wait("studio.components.components.length === 4")
        page.settle()
        shares = page.value("studio.components.components.map((c) => c.values.fraction ?? 0)")
        self.assertAlmostEqual(sum(shares), 1, places=9)
        page.select("disk")
        page.keys("n")
        page.wait("studio.doc.model.components[1].values['noise.seed'] > 0")
        page.settle()

    def test_every_kind_can_be_added(self):
        page = self.page
        for kind in page.value("Object.keys(studio.doc.opened.declarations.kinds)"):
            count = page.value("studio.components.components.length")
            page.run("studio.components.add(arguments[0])", kind)
            page.wait(f"studio.components.components.length === {count + 1}")
        self.assertEqual(self.browser.find_elements("css selector", ".message.problem"), [])

    def test_undo_to_the_start(self):
        page = self.page
        texts = [page.value("studio.doc.text")]
        for depth in range(1, 21):
            page.browser.execute_async_script(
                "const done = arguments[1]; studio.doc.edit([{set: [2, 'optical_depth', arguments[0]]}], 'depth').then(done)", depth)
            texts.append(page.value("studio.doc.text"))
        self.assertEqual(len(set(texts)), 21)
        for text in reversed(texts[:-1]):
            page.keys(Keys.CONTROL, "z")
            page.wait(f"studio.doc.text === {text!r}".replace("\\'", "'"))
        self.assertEqual(page.value("studio.doc.history.canUndo"), False)
        self.assertEqual(page.value("studio.doc.text"), GALAXY)
        page.keys(Keys.CONTROL, Keys.SHIFT, "z")
        page.wait("studio.doc.history.at === 1")
        page.settle()

    def own_server(self, files=FILES):
        """The page of a server that only this test uses."""
        self.server = Server(files=files)
        self.addCleanup(self.server.close)
        self.page = Page(self.browser, self.server.address)
        return self.page

    def test_save_keeps_comments_and_order(self):
        page = self.own_server()
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.2]}], 'radius')")
        page.settle()
        self.assertIn("edited", page.find("#title").text)
        page.keys(Keys.CONTROL, "s")
        page.wait("!studio.doc.isChanged")
        saved = (self.server.path / "mine.toml").read_text()
        self.assertEqual(saved, GALAXY.replace("radius = 0.1 ", "radius = 0.2 "))
        page.keys(Keys.CONTROL, Keys.SHIFT, "s")
        name = page.find("dialog input")
        name.clear()
        name.send_keys("other", Keys.ENTER)
        page.wait("[...document.querySelectorAll('.message')].some((one) => one.textContent.includes('other'))")
        self.assertEqual((self.server.path / "out/other.toml").read_text(), saved)

    def test_render_makes_the_bytes_of_gamer(self):
        page = self.own_server()
        page.run("return studio.doc.edit([{set: [2, 'optical_depth', 1.5]}], 'depth')")
        page.settle()
        page.keys(Keys.CONTROL, "s")
        page.wait("!studio.doc.isChanged")
        page.keys("r")
        name = page.find("#render-name")
        name.clear()
        name.send_keys("e.fits", Keys.ENTER)
        page.wait("document.querySelector('dialog a')")
        page.keys(Keys.ESCAPE)
        rendered = (self.server.path / "out/e.fits").read_bytes()
        page.keys(Keys.CONTROL, Keys.SHIFT, "c")
        page.wait("document.querySelector('dialog textarea')")
        line = shlex.split(page.find("dialog textarea").get_attribute("value"))
        page.keys(Keys.ESCAPE)
        self.assertEqual(line[0], "gamer")
        subprocess.run([GAMER, *line[1:], "-o", "out/e.fits", "--overwrite"], cwd=self.server.path,
                       env=ENVIRONMENT, check=True, capture_output=True, timeout=60)
        self.assertEqual(rendered, (self.server.path / "out/e.fits").read_bytes())

    def test_render_is_cancelled(self):
        page = self.page
        page.keys("r")
        page.find("#render-name").clear()
        page.find("#render-name").send_keys("big.fits")
        page.find("#render-size").clear()
        page.find("#render-size").send_keys("4000")
        page.find("#render-tolerance").clear()
        page.find("#render-tolerance").send_keys("0.00001", Keys.ENTER)
        page.wait("/[0-9]/.test(document.querySelector('dialog .render > .note[role=status]').textContent)")
        page.run("""globalThis.pressed = performance.now();
          const note = document.querySelector('dialog .note[role=status]');
          new MutationObserver(() => { globalThis.stopped ??= performance.now(); }).observe(note, {childList: true, characterData: true, subtree: true});
          [...document.querySelectorAll('dialog button')].find((one) => one.textContent === 'Cancel').click();""")
        page.wait("document.querySelector('dialog .note[role=status]').textContent === 'Cancelled.'")
        page.keys(Keys.ESCAPE)
        self.assertFalse((self.server.path / "out/big.fits").exists())

    def test_reload_keeps_edits_and_view(self):
        page = self.page
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.3]}], 'radius')")
        page.keys("m")
        page.run("studio.navigation.edgeOn(); studio.look.put('gamma', 1.5)")
        page.keys("]")
        page.settle()
        before = page.value("[studio.doc.text, studio.ui.camera, studio.ui.muted, studio.ui.look.gamma, studio.ui.right]")
        self.browser.refresh()
        page.settle()
        after = page.value("[studio.doc.text, studio.ui.camera, studio.ui.muted, studio.ui.look.gamma, studio.ui.right]")
        self.assertEqual(after, before)
        self.assertEqual(page.value("studio.doc.history.canUndo"), True)

    def test_connection_comes_back(self):
        page = self.page
        page.run("studio.connection.socket.close()")
        page.wait("document.getElementById('connection').textContent === 'connection lost'")
        page.wait("document.getElementById('connection').textContent === 'connected'")
        self.assertFalse(page.find("#lost").is_displayed())
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.3]}], 'radius')")
        page.settle()

    def test_restart_of_the_server(self):
        page = self.page
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.3]}], 'radius')")
        page.settle()
        text = page.value("studio.doc.text")
        self.server.kill()
        page.wait("!document.getElementById('lost').hidden")
        self.assertIn("edits are kept", page.find("#lost").text)
        self.server.start()
        page.wait("document.getElementById('lost').hidden")
        self.assertEqual(page.value("studio.doc.text"), text)
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.4]}], 'radius')")
        page.settle()
        page.log()

    def test_restart_with_another_key(self):
        page = self.page
        page.run("return studio.doc.edit([{set: [0, 'effective_radius', 0.3]}], 'radius')")
        page.settle()
        text = page.value("studio.doc.text")
        self.server.kill()
        (self.server.path / "token").unlink()
        self.server.start()
        page.wait("document.getElementById('lost').textContent.includes('no longer valid')")
        page.log()
        self.page = page = Page(self.browser, self.server.address, fresh=False)
        self.assertEqual(page.value("studio.doc.text"), text)

    def test_key_frames_play(self):
        page = self.page
        page.keys("k")
        page.run("studio.navigation.faceOn()")
        page.settle()
        page.keys("k")
        self.assertEqual(page.value("studio.ui.keys.length"), 2)
        page.run("studio.ui.frames = 12; studio.ui.keys[1].time = 11; studio.timeline.go(0, false)")
        page.settle()
        self.assertNotEqual(page.value("studio.ui.camera.position"), page.value("studio.ui.keys[1].camera.position"))
        page.run("document.activeElement.blur()")
        page.keys(" ")
        page.wait("studio.timeline.time === 11 && !studio.timeline.isPlaying")
        page.settle()
        self.assertEqual(page.value("studio.ui.camera.position"), page.value("studio.ui.keys[1].camera.position"))

    def test_film_shows_the_views_of_the_time_line(self):
        page = self.page
        page.keys("k")
        page.run("studio.navigation.faceOn()")
        page.keys("k")
        page.run("studio.ui.frames = 3; studio.ui.keys[1].time = 2; studio.timeline.go(1, false)")
        page.settle()
        settings = page.value("studio.doc.fields(studio.timeline.settings()).settings")
        film = self.server.gamer("film.fits", *(f"--set={one}" for one in settings))
        second = read_planes(film.with_name("film_0002.fits"))
        self.assert_planes(page.sums(), second, 2e-6)

    def test_nine_variations(self):
        page = self.page
        page.select("disk")
        page.keys("v")
        page.wait("document.querySelectorAll('.variation:not(:disabled)').length === 9")
        page.find(".variation:nth-child(5)").click()
        page.wait("studio.doc.history.undoLabel.startsWith('variation')")
        page.settle()

    def test_page_works_at_three_sizes(self):
        page = self.page
        self.addCleanup(set_size, self.browser, 1280, 720)
        for width, height, has_fingers in ((1280, 720, False), (1920, 1080, False), (1024, 768, False), (1024, 768, True),
                                          (768, 1024, True)):
            set_size(self.browser, width, height, has_fingers)
            page.wait(f"innerWidth === {width} && matchMedia('(pointer: coarse)').matches === {str(has_fingers).lower()}")
            box = page.value("(() => { const b = document.getElementById('picture').getBoundingClientRect();"
                             " return [b.width, b.height]; })()")
            self.assertGreater(min(box), 200)
            outside = page.value(
                "[...document.querySelectorAll('button, select, input')].filter((one) => { const b = one.getBoundingClientRect();"
                " const room = (one.closest('.panel, #middle') ?? document.body).getBoundingClientRect();"
                " return b.width > 0 && (b.right > room.right + 1 || b.left < room.left - 1); }).map((one) => one.outerHTML)")
            self.assertEqual(outside, [])

    def test_controls_have_names(self):
        names = self.page.value("""[...document.querySelectorAll('button, select, input, canvas, [role=slider]')]
            .filter((one) => !(one.getAttribute('aria-label') || one.title || one.textContent.trim() ||
                               (one.labels && one.labels.length))).map((one) => one.outerHTML)""")
        self.assertEqual(names, [])


def rms_error(drawn, true):
    """RMS of the difference over that of the true values, for each channel."""
    errors = []
    for channel in range(3):
        pairs = list(zip(drawn[channel::4], true[channel::4]))
        errors.append((sum((a - b) ** 2 for a, b in pairs) / sum(b * b for _, b in pairs)) ** 0.5)
    return errors


# The view of `gamer look` in few pixels, with inclination 35 and position angle 30.
LOOK = """[image]
size = [128, 128]
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 2
[spectrum]
bands = ["bessell_b", "bessell_v", "red_halpha"]
[sampling]
tolerance = 0.01
stars_per_pixel = 0  # a draft shows stars as smooth light
"""
TILTED = "galaxy x y z ox oy oz pa\n{} 0 0 0 0.49673 0.28679 0.81915 120\n"

# Galaxies of the suite. The slow test takes all shipped galaxies, whose drafts take some minutes.
DRAFTED = ("elliptical_dust", "m51", "ngc4594")
ALL_DRAFTED = sorted(path.stem for path in (SOURCE / "galaxies").glob("*.toml"))


@unittest.skipIf(missing(), missing())
class DraftTest(unittest.TestCase):
    """The draft of a moving view, drawn even where drafts are slow."""

    @classmethod
    def setUpClass(cls):
        cls.browser = start_browser()
        cls.addClassCleanup(cls.browser.quit)

    def open(self, *arguments, files=None):
        server = Server(files=files or {}, arguments=arguments)
        self.addCleanup(server.close)
        page = Page(self.browser, server.address)
        page.run("studio.draft.side = 512; studio.draft.isSlow = false")
        return page

    def wait_for_draft(self, page):
        page.run("studio.draft.afterFrame()")
        page.wait("studio.draft.isPresent(studio.draft.key)", 120)

    def test_draft_is_the_true_render(self):
        for galaxy in ALL_DRAFTED if "all_drafts" in sys.argv else DRAFTED:
            page = self.open("render.par", "scene.lst", files={"render.par": LOOK, "scene.lst": TILTED.format(galaxy)})
            self.wait_for_draft(page)
            for position in (None, [5, -6, 4]):
                if position:
                    page.run("studio.ui.setCamera({...studio.ui.camera, position: arguments[0], up: [0, 0, 1]}, false)", position)
                    page.settle()
                true = page.value("Array.from(studio.picture.sums())")
                drawn = page.value("Array.from(studio.draft.channels(studio.ui.camera, 128, 128))")
                errors = rms_error(drawn, true)
                with self.subTest(galaxy=galaxy, position=position, errors=errors):
                    self.assertLess(max(errors), 0.03)
            self.doCleanups()

    def test_draft_is_that_of_a_perspective_camera(self):
        parameters = FILES["render.par"].replace("orthographic", "perspective").replace("width = 2.2", "fov = 12.5")
        page = self.open("render.par", "scene.lst", files={**FILES, "render.par": parameters})
        self.wait_for_draft(page)
        true = page.value("Array.from(studio.picture.sums())")
        drawn = page.value("Array.from(studio.draft.channels(studio.ui.camera, 48, 36))")
        self.assertLess(max(rms_error(drawn, true)), 0.03)

    def test_draft_follows_keys_and_gives_way_to_the_render(self):
        page = self.open("render.par", "scene.lst", files=FILES)
        self.wait_for_draft(page)
        page.run("globalThis.moving = 0; const ask = studio.preview.ask;"
                 "studio.preview.ask = function(isMoving) { moving += isMoving ? 1 : 0; return ask.call(this, isMoving); }")
        page.find("#picture").click()
        page.settle()
        before = page.value("studio.ui.camera.position")
        self.browser.execute_script(
            "const key = new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true});"
            "studio.canvas.dispatchEvent(key); globalThis.was_shown = studio.draft.isShown;")
        self.assertEqual(page.value("was_shown"), True)
        self.assertNotEqual(page.value("studio.ui.camera.position"), before)
        page.wait("!studio.draft.isShown")
        page.settle()
        self.assertEqual(page.value("moving"), 0)
        # An edit ends the draft, and the next draft shows the edited galaxy.
        page.run("return studio.doc.edit([{set: [1, 'sed', 'E']}], 'sed')")
        self.assertEqual(page.value("studio.draft.show()"), False)
        page.settle()
        self.wait_for_draft(page)
        true = page.value("Array.from(studio.picture.sums())")
        drawn = page.value("Array.from(studio.draft.channels(studio.ui.camera, 48, 36))")
        self.assertLess(max(rms_error(drawn, true)), 0.03)

    def test_no_draft_without_a_gpu(self):
        server = Server()
        self.addCleanup(server.close)
        page = Page(self.browser, server.address)
        self.assertEqual(page.value("[studio.draft.isSlow, studio.draft.asked, studio.draft.show()]"), [True, None, False])
        # If the name of the GPU does not tell, the first draft shows whether drafts are slow.
        page.run("studio.draft.isSlow = false; studio.draft.afterFrame()")
        page.wait("studio.draft.key")
        self.assertEqual(page.value("[studio.draft.isSlow, studio.draft.show()]"), [True, False])

    def test_scenes_of_several_galaxies_have_none(self):
        page = self.open("render.par", "scene.lst", files={**FILES, "scene.lst": FILES["scene.lst"] + "mine 1 0 0\n"})
        page.run("studio.draft.afterFrame()")
        page.wait("studio.draft.refused")
        self.assertEqual(self.browser.find_elements("css selector", ".message.problem"), [])

    def test_a_galaxy_turns_under_a_moved_camera(self):
        page = self.open("ngc4594")
        page.run("return studio.doc.set({'image.size': [64, 64]}, 'size')")
        page.settle()
        face_on = page.sums()[0]
        page.run("studio.navigation.edgeOn()")
        page.wait("studio.preview.asked.size > 0")
        page.settle()
        edge_on = page.sums()[0]
        self.assertGreater(sum(abs(a - b) for a, b in zip(face_on, edge_on)), 0.1 * sum(face_on))


class ModuleTest(unittest.TestCase):
    @unittest.skipUnless(shutil.which("node"), "node is not installed (nodejs)")
    def test_modules(self):
        done = subprocess.run(["node", "--test", str(SOURCE / "tests/programs/studio")],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    if missing() and not shutil.which("node"):
        print(f"skipped: {missing()}")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1] + [one for one in sys.argv[4:] if one != "all_drafts"], verbosity=2)
