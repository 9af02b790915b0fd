#pragma once

namespace gamer {

/// Mean transmission of the intergalactic medium towards a source at `redshift`, by the Lyman
/// series and continuum of hydrogen; Madau 1995 (ApJ 441, 18), Eqs. 12, 15 and footnote 3.
/// `wavelength` is the observed one, Angstrom; 1 longward of Lyman alpha at the source.
double madau95_transmission(double wavelength, double redshift);

}  // namespace gamer
