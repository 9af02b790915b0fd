#pragma once

namespace gamer {

/// Flat LambdaCDM without radiation: E(z) = sqrt(Omega_m (1+z)^3 + 1 - Omega_m). Distances are in
/// Mpc; D_C = (c/H0) int dz/E by adaptive quadrature to a relative 1e-9. Redshifts are in [0, 1e4[.
class Cosmology {
 public:
  /// H0 in km/s/Mpc, > 0; omega_m in [0, 1]. Throws std::invalid_argument.
  explicit Cosmology(double h0 = 70, double omega_m = 0.3);

  double h0() const { return h0_; }
  double omega_m() const { return omega_m_; }
  double hubble_distance() const;  ///< c/H0
  double comoving_distance(double redshift) const;
  double luminosity_distance(double redshift) const;  ///< (1+z) D_C
  /// 5 log10(D_L/10 pc), mag.
  double distance_modulus(double redshift) const;

 private:
  double h0_, omega_m_;
};

}  // namespace gamer
