"""Astropy quantities and plain numbers. Astropy is needed only where it is used."""

import numbers

import numpy as np

from ._core import InputError


class UnitError(InputError):
    """A quantity has a unit that a parameter cannot have."""


def is_quantity(value):
    return hasattr(value, "unit") and hasattr(value, "to_value")


def astropy_unit(text):
    """The Astropy unit of a declaration; None where it has no counterpart."""
    from astropy import units

    if text == "":
        return units.dimensionless_unscaled
    try:
        return units.Unit(text)
    except ValueError:
        return None


def plain(value, unit, name):
    """The value without its unit, in the declared unit. Arrays become lists, and a SkyCoord its
    right ascension and declination."""
    if unit == "deg" and hasattr(value, "icrs"):
        value = [value.icrs.ra, value.icrs.dec]
    if is_quantity(value):
        wanted = astropy_unit(unit)
        if wanted is None:
            raise UnitError(f"{name} is in {unit}: give a plain number, not {value.unit}")
        try:
            value = _converted(value, wanted)
        except Exception as error:
            described = f"in {unit}" if unit else "a number without a unit"
            raise UnitError(f"{name} is {described}, not in {value.unit}") from error
    elif isinstance(value, (list, tuple)) and any(is_quantity(item) for item in value):
        return [plain(item, unit, name) for item in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple):
        return list(value)
    if isinstance(value, list):
        return [item.item() if isinstance(item, np.generic) else item for item in value]
    return value


def _converted(value, wanted):
    """The value in another unit. 550 nm are 5500 Angstrom, not 5499.999999999999."""
    if value.unit == wanted:
        return value.to_value(wanted)
    if hasattr(value.unit, "physical_unit") and str(wanted) == "mag":
        from astropy import units

        return value.to_value(units.ABmag)
    converted = value.to_value(wanted)
    digits = np.vectorize(lambda number: float(f"{number:.15g}"), otypes=[float])
    return digits(converted) if np.size(converted) else converted


def is_number(value):
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_))
