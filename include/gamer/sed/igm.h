#pragma once

#include <array>

namespace gamer {

/// The Lyman limit of Madau 1995, Angstrom. Shortward of this limit no light is left for dust to
/// absorb.
inline constexpr double lyman_limit = 912;

/// Mean transmission exp(-tau) of the intergalactic medium towards a source at `redshift` z;
/// Madau 1995 (ApJ 441, 18). `wavelength` lambda is the observed one, Angstrom. With
/// x = lambda/912 Angstrom, e = 1 + z, tau is the sum of
///
///   lines      A_j (lambda/lambda_j)^3.46 for lambda_j < lambda <= lambda_j e (Eqs. 12 and 15),
///              lambda_j = 1216, 1026, 973, 950 Angstrom, A_j = 0.0036, 0.0017, 0.0012, 0.00093;
///   continuum  0.25 x^3 (e^0.46 - n^0.46) + 9.4 x^1.5 (e^0.18 - n^0.18)
///              - 0.7 x^3 (n^-1.32 - e^-1.32) - 0.023 (e^1.68 - n^1.68) for x < e (footnote 3),
///              n = max(x, 1), and 0 where that is negative.
///
/// The paper has n = x, which for x < 1 would count absorbers behind the observer. For z <= 5 the
/// continuum agrees to 0.02 in transmission with the integral over the paper's distribution of
/// clouds. Shortward of 74 Angstrom in the rest frame tau can fall with z. Higher lines of the
/// series and metals (2 % of the light at z = 3) are neglected. The transmission is 1 longward of
/// Lyman alpha at the source, and at z = 0. Precondition: z >= 0.
double madau95_transmission(double wavelength, double redshift);

/// Observed wavelengths, ascending, at which the transmission bends or jumps: lambda_j and the
/// Lyman limit, each also times e.
std::array<double, 10> madau95_kinks(double redshift);

}  // namespace gamer
