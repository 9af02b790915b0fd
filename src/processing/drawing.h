#pragma once

#include <cairo.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace gamer {

struct Colour {
  double red, green, blue;
};
/// Colours of Okabe & Ito, distinguishable with colour blindness.
inline constexpr std::array<Colour, 6> okabe_ito = {{{0.00, 0.45, 0.70},
                                                     {0.84, 0.37, 0.00},
                                                     {0.00, 0.62, 0.45},
                                                     {0.80, 0.47, 0.65},
                                                     {0.34, 0.71, 0.91},
                                                     {0.90, 0.62, 0.00}}};
inline constexpr Colour black = {0.1, 0.1, 0.1}, grey = {0.88, 0.88, 0.88};
/// Size of letters and width of plots, pixels.
inline constexpr double font_size = 24;
inline constexpr int plot_width = 1200;

/// A white picture drawn by Cairo, with (0, 0) at its upper left corner.
class Drawing {
 public:
  Drawing(int width, int height);

  void colour(const Colour& colour, double opacity = 1);
  void line(double x0, double y0, double x1, double y1, double width);
  void dot(double x, double y, double radius);
  /// Makes a box the current path, for outline() or clip().
  void box(double left, double top, double right, double bottom);
  void ellipse(double x, double y, double semi_major, double semi_minor, double angle,
               double width);
  void outline(double width);
  void clip();
  void no_clip();

  double text_width(const std::string& text);
  /// Draws text on the baseline y; with `anchor` 0 it begins at x, with 1 it ends there.
  void text(const std::string& text, double x, double y, double anchor = 0);
  /// Draws text upwards, centred at y.
  void text_upwards(const std::string& text, double x, double y);
  /// Draws 10 to the power `exponent`.
  void power_of_ten(int exponent, double x, double y, double anchor);
  /// Fills the picture with grey values in [0, 1], as many as pixels, from the top.
  void greys(const std::vector<double>& values);

  /// Writes a PNG file, complete or absent. Throws RunError.
  void write(const std::filesystem::path& path, bool overwrite);

 private:
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> cairo_;
};

}  // namespace gamer
