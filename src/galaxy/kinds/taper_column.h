#pragma once

namespace gamer {

/// The mean of the taper along z at a distance r from the axis, weighted with sech^2(z/h). The
/// error is below 1e-12.
double mean_taper(double r, double h);
/// The mean of the taper along z in a layer that is lifted, weighted with sech^2((z - lift)/h). The
/// error is below 1e-9.
double mean_taper(double r, double h, double lift);

}  // namespace gamer
