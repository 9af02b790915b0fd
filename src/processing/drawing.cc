#include "processing/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "image/write_file.h"

namespace gamer {
namespace {

constexpr double superscript = 0.7;  ///< of the font's size

}  // namespace

Drawing::Drawing(int width, int height)
    : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height),
               &cairo_surface_destroy),
      cairo_(cairo_create(surface_.get()), &cairo_destroy) {
  cairo_set_source_rgb(cairo_.get(), 1, 1, 1);
  cairo_paint(cairo_.get());
  cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_.get(), font_size);
}

void Drawing::colour(const Colour& colour, double opacity) {
  cairo_set_source_rgba(cairo_.get(), colour.red, colour.green, colour.blue, opacity);
}

void Drawing::line(double x0, double y0, double x1, double y1, double width) {
  cairo_set_line_width(cairo_.get(), width);
  cairo_move_to(cairo_.get(), x0, y0);
  cairo_line_to(cairo_.get(), x1, y1);
  cairo_stroke(cairo_.get());
}

void Drawing::dot(double x, double y, double radius) {
  cairo_arc(cairo_.get(), x, y, radius, 0, 2 * std::numbers::pi);
  cairo_fill(cairo_.get());
}

void Drawing::box(double left, double top, double right, double bottom) {
  cairo_rectangle(cairo_.get(), left, top, right - left, bottom - top);
}

void Drawing::ellipse(double x, double y, double semi_major, double semi_minor, double angle,
                      double width) {
  cairo_save(cairo_.get());
  cairo_translate(cairo_.get(), x, y);
  cairo_rotate(cairo_.get(), angle);
  cairo_scale(cairo_.get(), semi_major, semi_minor);
  cairo_new_sub_path(cairo_.get());
  cairo_arc(cairo_.get(), 0, 0, 1, 0, 2 * std::numbers::pi);
  cairo_restore(cairo_.get());
  outline(width);
}

void Drawing::outline(double width) {
  cairo_set_line_width(cairo_.get(), width);
  cairo_stroke(cairo_.get());
}

void Drawing::clip() { cairo_clip(cairo_.get()); }

void Drawing::no_clip() { cairo_reset_clip(cairo_.get()); }

double Drawing::text_width(const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_.get(), text.c_str(), &extents);
  return extents.x_advance;
}

void Drawing::text(const std::string& text, double x, double y, double anchor) {
  cairo_move_to(cairo_.get(), x - anchor * text_width(text), y);
  cairo_show_text(cairo_.get(), text.c_str());
}

void Drawing::text_upwards(const std::string& text, double x, double y) {
  cairo_save(cairo_.get());
  cairo_translate(cairo_.get(), x, y);
  cairo_rotate(cairo_.get(), -std::numbers::pi / 2);
  this->text(text, 0, 0, 0.5);
  cairo_restore(cairo_.get());
}

void Drawing::power_of_ten(int exponent, double x, double y, double anchor) {
  const std::string base = "10", raised = fmt::format("{}", exponent);
  const double base_width = text_width(base);
  cairo_set_font_size(cairo_.get(), superscript * font_size);
  const double left = x - anchor * (base_width + text_width(raised));
  text(raised, left + base_width, y - font_size / 2.5);
  cairo_set_font_size(cairo_.get(), font_size);
  text(base, left, y);
}

void Drawing::greys(const std::vector<double>& values) {
  constexpr double white = 255;
  cairo_surface_flush(surface_.get());
  unsigned char* data = cairo_image_surface_get_data(surface_.get());
  const int width = cairo_image_surface_get_width(surface_.get());
  const int height = cairo_image_surface_get_height(surface_.get());
  const int stride = cairo_image_surface_get_stride(surface_.get());
  for (int y = 0; y < height; ++y) {
    auto* row = reinterpret_cast<std::uint32_t*>(data + static_cast<std::ptrdiff_t>(y) * stride);
    for (int x = 0; x < width; ++x) {
      const double value = values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x)];
      const auto level = static_cast<std::uint32_t>(std::clamp(value, 0.0, 1.0) * white + 0.5);
      row[x] = level << 16 | level << 8 | level;
    }
  }
  cairo_surface_mark_dirty(surface_.get());
}

void Drawing::write(const std::filesystem::path& path, bool overwrite) {
  cairo_surface_flush(surface_.get());
  write_file(path, overwrite, [&](std::FILE* file) {
    const auto append = [](void* closure, const unsigned char* data, unsigned length) {
      const std::size_t written = std::fwrite(data, 1, length, static_cast<std::FILE*>(closure));
      return written == length ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
    };
    const cairo_status_t status = cairo_surface_write_to_png_stream(surface_.get(), append, file);
    if (status != CAIRO_STATUS_SUCCESS) throw write_failure(path, cairo_status_to_string(status));
  });
}

}  // namespace gamer
