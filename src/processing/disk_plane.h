#pragma once

namespace gamer {

/// A thin disk on the pixels: its centre (from 0), its inclination (rad) and the `angle` of its
/// line of nodes (rad from +x towards +y).
struct DiskPlane {
  double x = 0, y = 0;
  double inclination = 0;
  double angle = 0;

  struct Pixel {
    double x, y;
  };
  /// The pixel that shows the point of the disk at radius r (pixels) and azimuth (rad). The azimuth
  /// counts in the disk from the line of nodes, counter-clockwise as the image shows it.
  Pixel pixel(double r, double azimuth) const;
};

}  // namespace gamer
