#pragma once

namespace gamer {

/// The mean of the taper along z at a distance r from the axis, weighted with sech^2(z/h). The
/// error is below 1e-12.
double mean_taper(double r, double h);
/// The same, weighted with sech^2((z - lift)/h).
double mean_taper(double r, double h, double lift);

}  // namespace gamer
