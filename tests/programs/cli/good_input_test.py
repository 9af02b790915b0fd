"""Images are identical for any ranks and threads, and when their header or journal makes them again."""

import unittest

from gamer_program import LAUNCHER, Folder, main, read_primary


class GoodInput(unittest.TestCase):
    def pixels(self, folder, name):
        cards, data = read_primary((folder.path / name).read_bytes())
        self.assertEqual((cards["NAXIS1"], cards["NAXIS2"], cards["NAXIS3"]), ("24", "18", "3"))
        self.assertGreater(len(set(data)), 100)
        return cards["DATASUM"], data

    def make(self, folder, output, *arguments, ranks=1):
        result = folder.run(*arguments, "-o", output, ranks=ranks)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertRegex(result.stdout, rf"^{output}: 24 x 18 pixels, 3 planes, [0-9.]+ s\n$")
        return self.pixels(folder, output)

    def test_pixels_do_not_depend_on_threads_and_ranks(self):
        with Folder() as folder:
            files = ("render.par", "scene.lst")
            expected = self.make(folder, "one.fits", *files, "-j", "1")
            self.assertEqual(self.make(folder, "four.fits", *files, "-j", "4"), expected)
            for ranks in (2, 3) if LAUNCHER else ():
                name = f"ranks{ranks}.fits"
                self.assertEqual(self.make(folder, name, *files, ranks=ranks), expected)
            if LAUNCHER:
                self.assertEqual(self.make(folder, "both.fits", *files, "-j", "2", ranks=2),
                                 expected)

    def test_the_header_is_enough(self):
        with Folder() as folder:
            first = self.make(folder, "one.fits", "render.par", "scene.lst", "-s", "noise.seed=5")
            for name in ("render.par", "scene.lst", "spiral.toml"):
                (folder.path / name).unlink()
            self.assertEqual(self.make(folder, "again.fits", "--from-header", "one.fits"), first)
            self.assertEqual(self.make(folder, "third.fits", "--from-header", "again.fits"), first)
            if LAUNCHER:
                self.assertEqual(
                    self.make(folder, "ranks.fits", "--from-header", "one.fits", ranks=3), first)
            other = self.make(folder, "other.fits", "--from-header", "one.fits", "-s",
                              "noise.seed=6")
            self.assertNotEqual(other, first)

    def test_the_header_is_enough_where_folders_differ(self):
        with Folder() as folder:
            (folder.path / "lists").mkdir()
            (folder.path / "scene.lst").rename(folder.path / "lists/scene.lst")
            (folder.path / "types").mkdir()
            (folder.path / "spiral.toml").rename(folder.path / "types/spiral.toml")
            text = (folder.path / "lists/scene.lst").read_text()
            (folder.path / "lists/scene.lst").write_text(
                text.replace("spiral", "../types/spiral.toml"))
            first = self.make(folder, "one.fits", "render.par", "lists/scene.lst")
            (folder.path / "lists/scene.lst").unlink()
            (folder.path / "types/spiral.toml").unlink()
            self.assertEqual(self.make(folder, "again.fits", "--from-header", "one.fits"), first)

    def test_a_damaged_image_is_not_made_again(self):
        with Folder() as folder:
            for name in ("one.fits", "one.fits.fz", "one.png"):
                with self.subTest(name):
                    arguments = ("render.par", "scene.lst", "-o", name, "-q")
                    self.assertEqual(folder.run(*arguments).returncode, 0)
                    content = (folder.path / name).read_bytes()
                    # The flipped bit of the record turns FITS's 0.5 into another place of a galaxy.
                    table = content.find(b"INPUTS") if "fits" in name else content.find(b"gaMR")
                    place = content.find(b"0.5 2 0.1", table) if "fits" in name else table + 40
                    self.assertGreater(place, table)
                    damaged = bytearray(content)
                    damaged[place] ^= 1
                    folder.write(name, bytes(damaged))
                    again = folder.run("--from-header", name, "-o", "again.fits")
                    what = "HDU . [(]INPUTS[)] is damaged" if "fits" in name else "or it is damaged"
                    self.assertRegex(again.stderr, rf"^{name}: .*{what}.*\n$")
                    self.assertEqual(again.returncode, 2)
                    self.assertFalse((folder.path / "again.fits").exists())
                    resumed = folder.run(*arguments, "--resume")
                    self.assertRegex(resumed.stderr, rf"^{name}: .*damaged.*; --overwrite starts anew\n$")
                    self.assertEqual(resumed.returncode, 2)
                    # The damaged bit is near the end of the file.
                    damaged = bytearray(content)
                    damaged[-9000 if "fits" in name else -40] ^= 1
                    folder.write(name, bytes(damaged))
                    self.assertEqual(folder.run(*arguments, "--resume").returncode, 2)
                    folder.write(name, content)
                    self.assertEqual(folder.run(*arguments, "--resume").returncode, 0)

    def test_an_existing_output_is_kept(self):
        with Folder() as folder:
            folder.write("out.fits", "precious")
            result = folder.run("render.par", "scene.lst")
            self.assertEqual(result.returncode, 2)
            self.assertIn("--overwrite", result.stderr)
            self.assertEqual((folder.path / "out.fits").read_text(), "precious")
            result = folder.run("render.par", "scene.lst", "--overwrite", "--quiet")
            self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))
            self.pixels(folder, "out.fits")

    def test_layouts_and_pictures(self):
        with Folder() as folder:
            result = folder.run("render.par", "scene.lst", "-s", "image.layout=files")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue(result.stdout.startswith("out_4400A.fits and 2 more: "))
            planes = [read_primary((folder.path / f"out_{label}.fits").read_bytes())[1]
                      for label in ("4400A", "5500A", "8000A")]
            _, cube = self.make(folder, "cube.fits", "render.par", "scene.lst")
            self.assertEqual(b"".join(planes), cube)
            for name, magic in (("p.png", b"\x89PNG"), ("p.bmp", b"BM")):
                result = folder.run("render.par", "scene.lst", "-o", name)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertTrue((folder.path / name).read_bytes().startswith(magic))

    def test_preview_is_small(self):
        with Folder() as folder:
            result = folder.run("render.par", "scene.lst", "--preview", "-s",
                                "camera.supersample=2", "-s", "sampling.tolerance=1e-5")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue(result.stdout.startswith("out.fits: 6 x 5 pixels, 3 planes"))
            header = (folder.path / "out.fits").read_bytes()[:11520].decode("ascii", "replace")
            self.assertRegex(header, r"HIERARCH GAMER SAMPLING TOLERANCE = +0\.01 ")
            self.assertRegex(header, r"HIERARCH GAMER CAMERA SUPERSAMPLE = +1 ")


if __name__ == "__main__":
    main()
