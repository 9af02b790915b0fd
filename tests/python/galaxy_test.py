"""Galaxies as objects: parameters, components, texts."""

import copy
import pickle
import tomllib

import pytest
from astropy import units as u

import gamer


def test_every_shipped_galaxy_keeps_its_text():
    assert "ngc4321" in gamer.galaxies()
    for name in gamer.galaxies():
        galaxy = gamer.Galaxy.load(name)
        text = galaxy.to_toml()
        assert tomllib.loads(text) == galaxy.to_dict()
        # Without the text, the dictionary is written anew.
        other = gamer.Galaxy.from_dict(galaxy.to_dict(), name)
        assert other.to_toml() != "" and other == galaxy
        assert tomllib.loads(other.to_toml()) == galaxy.to_dict()


def test_declared_parameters():
    galaxy = gamer.Galaxy.load("ngc891")
    names = list(galaxy.components)
    for name in names:
        component = galaxy[name]
        for key in component:
            declared = component.declaration(key)
            assert declared.description and declared.type
            assert key in dir(component) and key in component._ipython_key_completions_()
        assert "description" in component._repr_html_()
    dust = next(galaxy[name] for name in names if "optical_depth" in galaxy[name])
    assert dust.declaration("optical_depth").interval == (0, 1000, False, False)
    dust["optical_depth"] = 3
    assert dust["optical_depth"] == dust.optical_depth == 3
    del dust["optical_depth"]
    assert dust["optical_depth"] == 1
    assert "<table>" in galaxy._repr_html_()
    assert "ngc891" in repr(galaxy)


def test_changes_reach_the_text_and_copies_are_apart():
    galaxy = gamer.Galaxy.load("ngc4321")
    name = next(iter(galaxy.components))
    copy = galaxy.copy()
    copy[name]["active"] = False
    assert galaxy[name]["active"] is True and copy != galaxy
    assert tomllib.loads(copy.to_toml())["component"][0]["active"] is False
    assert "#" in galaxy.to_toml() or galaxy.to_toml() == gamer.Galaxy.load("ngc4321").to_toml()


def test_components_are_added_and_removed(smooth):
    ring = smooth.add("disk", name="ring", sed="Scd", fraction=0.1, rh=0.5)
    assert ring["class"] == "disk" and "ring" in smooth
    assert ring["noise"]["octaves"] > 0
    ring["noise"]["octaves"] = 3
    ring["noise"] = dict(octaves=4, spectral_index=1.5)
    assert smooth.to_dict()["component"][-1]["noise"] == {"octaves": 4, "spectral_index": 1.5}
    ring["noise"] = False
    with pytest.raises(gamer.InputError, match="fractions"):
        smooth.check()
    smooth["disk"]["fraction"] = 0.6
    smooth.check()
    del smooth["ring"]
    assert "ring" not in smooth
    with pytest.raises(gamer.InputError, match="already"):
        smooth.add("disk", name="bulge", sed="Sbc")
    with pytest.raises(KeyError, match="bulge, disk"):
        smooth.remove("halo")
    unnamed = gamer.Galaxy.from_dict({"component": [
        {"class": "bulge", "sed": "E", "effective_radius": 0.1}, {"class": "bulge", "sed": "Scd", "effective_radius": 0.2}]})
    unnamed.remove("bulge1")
    assert list(unnamed.components) == ["bulge2"]


@pytest.mark.parametrize("key, value, message", [
    ("fraction", 1.5, r"fraction.*\]0, 1\]"),
    ("fraction", "much", "fraction must be number"),
    ("fraction", True, "fraction must be number"),
    ("fraction", float("nan"), "fraction"),
    ("active", 1, "active must be"),
    ("sed", 5, "sed must be"),
])
def test_wrong_values(smooth, key, value, message):
    before = smooth.to_dict()
    with pytest.raises(gamer.InputError, match=message):
        smooth["bulge"][key] = value
    assert smooth.to_dict() == before


def test_wrong_names(smooth):
    with pytest.raises(KeyError, match="did you mean 'fraction'"):
        smooth["bulge"]["fractoin"] = 0.2
    with pytest.raises(gamer.InputError, match="no component 'halo'"):
        smooth["halo"]
    with pytest.raises(AttributeError):
        smooth["bulge"].nothing
    with pytest.raises(gamer.InputError, match="unknown galaxy.*did you mean"):
        gamer.Galaxy.load("ngc4322")
    with pytest.raises(gamer.InputError, match="unknown class 'disc'"):
        gamer.Galaxy.from_dict({"component": [{"class": "disc"}]})
    with pytest.raises(gamer.InputError, match="component"):
        gamer.Galaxy.from_dict({"component": {"class": "disk"}})
    with pytest.raises(gamer.InputError, match="galaxy:1"):
        gamer.Galaxy.from_toml("[galaxy")


def test_quantities():
    camera = gamer.Camera(projection="sky", center=[150 * u.deg, 2 * u.deg],
                          pixel_scale=0.05 * u.arcmin)
    assert camera["pixel_scale"] == pytest.approx(3, rel=1e-15)
    assert camera["center"] == [150.0, 2.0]
    with pytest.raises(gamer.UnitError, match="arcsec, not in kpc"):
        camera["pixel_scale"] = 2 * u.kpc
    galaxy = gamer.Galaxy.load("ngc891")
    dust = next(c for c in galaxy.components.values() if "optical_depth" in c)
    dust["optical_depth"] = 2 * u.dimensionless_unscaled
    assert dust["optical_depth"] == 2
    with pytest.raises(gamer.UnitError, match="without a unit, not in mag"):
        dust["optical_depth"] = 2 * u.mag
    with pytest.raises(gamer.UnitError, match="galaxy radii"):
        dust["z0"] = 1 * u.kpc


def test_a_galaxy_from_nothing():
    own = gamer.Galaxy(name="mine")
    with pytest.raises(gamer.InputError, match="at least one"):
        own.check()
    own.add("disk", name="disk", sed="Sbc", noise=False, fraction=0.7)
    own.add("bulge", name="bulge", sed="E", effective_radius=0.1, fraction=0.5)
    with pytest.raises(gamer.InputError, match="fractions"):
        own.check()
    own.normalise()
    own.check()
    assert own["disk"]["fraction"] == pytest.approx(7 / 12, rel=1e-15)
    assert own["bulge"]["fraction"] == pytest.approx(5 / 12, rel=1e-15)
    with pytest.raises(gamer.InputError, match="no component of galaxy 'empty' has a fraction"):
        gamer.Galaxy(name="empty").normalise()
    with pytest.raises(gamer.InputError, match=r"Galaxy.load\(\) reads"):
        gamer.Galaxy("ngc4321")


def test_sections_behind_components():
    """A component that is called "arms" hides the section of this name."""
    galaxy = gamer.Galaxy.load("ngc4321")
    assert galaxy["arms"]["class"] != "" and list(galaxy).count("arms") == 1
    assert galaxy.section("arms")["model"] == "logarithmic"
    galaxy.section("arms")["pitch_angle"] = 12
    assert gamer.Galaxy.from_toml(galaxy.to_toml()).section("arms")["pitch_angle"] == 12
    with pytest.raises(KeyError, match="galaxy, arms, not 'arm'"):
        galaxy.section("arm")


def test_components_keep_their_class(smooth):
    with pytest.raises(gamer.InputError, match="remove it and add another"):
        smooth["disk"]["class"] = "bar"
    smooth["disk"]["class"] = "disk"
    with pytest.raises(TypeError, match=r"galaxy\['disk'\].update"):
        smooth["disk"] = {"rh": 0.2}
    with pytest.raises(AttributeError, match="did you mean 'effective_radius'"):
        smooth["bulge"].effective_radii


def test_copies_and_pickles(smooth):
    camera = gamer.Camera(projection="sky", center=[1, 2])
    renderer = gamer.Renderer([dict(galaxy=smooth, ra=1, dec=2)], camera, size=8)
    for clone in (copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        assert clone(camera).given() == camera.given()
        assert clone(smooth) == smooth
        assert clone(renderer).parameters.to_toml() == renderer.parameters.to_toml()


def test_converted_units_are_round():
    assert gamer.Camera(pixel_scale=0.1 / 60 * u.arcmin)["pixel_scale"] == 0.1
    parameters = gamer.RenderParameters({"spectrum": {"wavelengths": [550, 640.3] * u.nm}})
    assert parameters["spectrum"]["wavelengths"] == [5500, 6403]
