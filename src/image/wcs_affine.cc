#include "gamer/image/wcs_affine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/message.h"
#include "image/wcs_records.h"

namespace gamer {
namespace {

/// Keywords number at most 99 axes: two digits.
constexpr int most_numbered_axes = 99;

/// The matrix M[i][j] of a map, or its inverse.
using Matrix = std::array<std::array<double, sky_axis_count>, sky_axis_count>;

Matrix matrix_of(const PixelMap& map) { return {{{map.xx, map.xy}, {map.yx, map.yy}}}; }

Matrix inverse(const Matrix& m) {
  const double determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
  if (!std::isfinite(1 / determinant)) throw std::invalid_argument("a singular pixel map");
  // 0 - x avoids negative zeros, which would look odd in cards.
  return {{{m[1][1] / determinant, 0 - m[0][1] / determinant},
           {0 - m[1][0] / determinant, m[0][0] / determinant}}};
}

bool is_diagonal(const Matrix& m) { return m[0][1] == 0 && m[1][0] == 0; }

/// Sets a value that differs from its default, or that has a card already.
void set_unless_default(FitsHeader& header, const std::string& key, double value,
                        double default_value) {
  if (value != default_value || header.has(key)) header.set(key, value);
}

// ---- One description ---------------------------------------------------------------------------

/// The cards of one description; `letter` is "" for the primary description, else "A" to "Z".
class Description {
 public:
  Description(FitsHeader& header, std::string letter)
      : header_(header), letter_(std::move(letter)) {}

  bool exists() const {
    for (const char* name : {"CTYPE", "CRPIX", "CRVAL", "CDELT"}) {
      for (int i = 1; i <= sky_axis_count; ++i) {
        if (header_.has(key(name, i))) return true;
      }
    }
    for (int i = 1; i <= sky_axis_count; ++i) {
      for (int j = 1; j <= sky_axis_count; ++j) {
        if (header_.has(key("CD", i, j)) || header_.has(key("PC", i, j))) return true;
      }
    }
    return false;
  }

  void map(const PixelMap& map, const std::string& label) {
    refuse_tables(label);
    const PixelPosition reference = map({number(key("CRPIX", 1), 0), number(key("CRPIX", 2), 0)});
    header_.set(key("CRPIX", 1), reference.x);
    header_.set(key("CRPIX", 2), reference.y);
    if (map.moves_only()) return;
    if (letter_.empty()) rename_old_elements();
    const Matrix m = matrix_of(map);
    // WCSLIB's order of precedence: PC before CD before CROTA.
    if (has_matrix("PC")) {
      remove_rotations();
      map_pc(m);
    } else if (has_matrix("CD")) {
      map_cd(inverse(m));
      remove_beside_cd();
    } else if (rotation() != 0) {
      rotation_to_pc();
      remove_rotations();
      map_pc(m);
    } else if (is_diagonal(m)) {
      for (int i = 1; i <= sky_axis_count; ++i) {
        const std::string step = key("CDELT", i);
        header_.set(step, number(step, 1) / m[i - 1][i - 1]);
      }
    } else {
      remove_rotations();
      map_pc(m);
    }
  }

 private:
  std::string key(const char* name, int axis) const {
    return fmt::format("{}{}{}", name, axis, letter_);
  }
  std::string key(const char* name, int i, int j) const {
    return fmt::format("{}{}_{}{}", name, i, j, letter_);
  }
  double number(const std::string& name, double default_value) const {
    return header_.number(name).value_or(default_value);
  }

  /// Number of axes that a matrix' cards may name.
  int axes() const {
    const double declared = number("WCSAXES" + letter_, 0);
    constexpr int least_count = 4;
    return declared > least_count ? static_cast<int>(std::min<double>(declared, most_numbered_axes))
                                  : least_count;
  }

  void refuse_tables(const std::string& label) const {
    for (const char* name : {"CPDIS", "CQDIS", "D2IMDIS"}) {
      for (int i = 1; i <= sky_axis_count; ++i) {
        const std::string card = key(name, i);
        if (!header_.has(card)) continue;
        throw input_error({label, 0, 0},
                          "{}: this distortion of the coordinates cannot follow the pixels; delete "
                          "its cards first if it does not matter",
                          card);
      }
    }
  }

  bool has_matrix(const char* name) const {
    const int count = axes();
    for (int i = 1; i <= count; ++i) {
      for (int j = 1; j <= count; ++j) {
        if (header_.has(key(name, i, j))) return true;
      }
    }
    return false;
  }

  /// Renames CD001002 and PC001002, the names before 2002.
  void rename_old_elements() {
    for (const char* name : {"PC", "CD"}) {
      const int count = axes();
      for (int i = 1; i <= count; ++i) {
        for (int j = 1; j <= count; ++j) {
          const std::string old = fmt::format("{}{:03}{:03}", name, i, j);
          const auto value = header_.number(old);
          if (!value) continue;
          if (!header_.has(key(name, i, j))) header_.set(key(name, i, j), *value);
          header_.remove(old);
        }
      }
    }
  }

  int latitude_axis() const {
    const std::string type = header_.text(key("CTYPE", 1)).value_or("");
    // Latitudes are DEC, xLAT and xyLT.
    const bool is_first =
        type.starts_with("DEC-") || type.find("LAT-") == 1 || type.find("LT-") == 2;
    return is_first ? 1 : 2;
  }
  double rotation() const { return number(key("CROTA", latitude_axis()), 0); }
  void remove_rotations() {
    for (int i = 1; i <= sky_axis_count; ++i) header_.remove(key("CROTA", i));
  }
  void remove_beside_cd() {
    remove_rotations();
    for (int i = 1; i <= sky_axis_count; ++i) header_.remove(key("CDELT", i));
  }

  /// Converts CROTAi by Calabretta & Greisen 2002 (A&A 395, 1077), Eqs. 190 and 191.
  void rotation_to_pc() {
    constexpr double half_circle = 180;
    const double angle = rotation() * std::numbers::pi / half_circle;
    const int latitude = latitude_axis(), longitude = sky_axis_count + 1 - latitude;
    const double ratio = number(key("CDELT", latitude), 1) / number(key("CDELT", longitude), 1);
    header_.set(key("PC", longitude, longitude), std::cos(angle));
    header_.set(key("PC", longitude, latitude), -ratio * std::sin(angle));
    header_.set(key("PC", latitude, longitude), std::sin(angle) / ratio);
    header_.set(key("PC", latitude, latitude), std::cos(angle));
  }

  void map_cd(const Matrix& inverse_map) { multiply("CD", inverse_map, 0); }

  void map_pc(const Matrix& m) {
    // CDELTi takes the scale, unless PCi_j couples the sky's axes with a further axis.
    const int count = axes();
    bool is_separate = true;
    for (int i = 1; i <= count; ++i) {
      for (int j = 1; j <= count; ++j) {
        const bool couples = (i <= sky_axis_count) != (j <= sky_axis_count);
        is_separate = is_separate && !(couples && number(key("PC", i, j), 0) != 0);
      }
    }
    Matrix turn = inverse(m);
    const bool has_steps_only =
        is_diagonal(m) && number(key("PC", 1, 2), 0) == 0 && number(key("PC", 2, 1), 0) == 0;
    std::array<double, sky_axis_count> scale = {1, 1};
    if (is_separate && has_steps_only) {
      scale = {m[0][0], m[1][1]};
      turn = {{{1, 0}, {0, 1}}};
    } else if (is_separate) {
      const double size = std::sqrt(std::abs(m[0][0] * m[1][1] - m[0][1] * m[1][0]));
      scale = {size, size};
      for (auto& row : turn) {
        for (double& element : row) element *= size;
      }
    }
    multiply("PC", turn, 1);
    for (int i = 1; i <= sky_axis_count; ++i) {
      if (scale[i - 1] == 1) continue;
      const std::string step = key("CDELT", i);
      header_.set(step, number(step, 1) / scale[i - 1]);
    }
  }

  /// Multiplies the columns of pixel axes 1 and 2 by a matrix from the right.
  void multiply(const char* name, const Matrix& factor, double default_diagonal) {
    for (int i = 1; i <= axes(); ++i) {
      const auto default_value = [&](int j) { return i == j ? default_diagonal : 0; };
      const double a = number(key(name, i, 1), default_value(1));
      const double b = number(key(name, i, 2), default_value(2));
      for (int j = 1; j <= sky_axis_count; ++j) {
        set_unless_default(header_, key(name, i, j), a * factor[0][j - 1] + b * factor[1][j - 1],
                           default_value(j));
      }
    }
  }

  FitsHeader& header_;
  std::string letter_;
};

// ---- SIP ---------------------------------------------------------------------------------------

constexpr int most_sip_order = 9;

/// Coefficients of u^p v^q with p + q <= order.
struct Polynomial {
  int order = 0;
  std::array<std::array<double, most_sip_order + 1>, most_sip_order + 1> terms = {};
};

/// (a u + b v)^n as the coefficients of u^(n - k) v^k.
std::vector<double> power(double a, double b, int n) {
  std::vector<double> terms = {1};
  for (int i = 0; i < n; ++i) {
    std::vector<double> next(terms.size() + 1);
    for (std::size_t k = 0; k < terms.size(); ++k) {
      next[k] += a * terms[k];
      next[k + 1] += b * terms[k];
    }
    terms = std::move(next);
  }
  return terms;
}

/// The polynomial f(M^-1 u).
Polynomial substitute(const Polynomial& f, const Matrix& inverse_map) {
  Polynomial result;
  result.order = f.order;
  for (int p = 0; p <= f.order; ++p) {
    for (int q = 0; p + q <= f.order; ++q) {
      if (f.terms[p][q] == 0) continue;
      const std::vector<double> u = power(inverse_map[0][0], inverse_map[0][1], p);
      const std::vector<double> v = power(inverse_map[1][0], inverse_map[1][1], q);
      for (int k = 0; k <= p; ++k) {
        for (int l = 0; l <= q; ++l) {
          result.terms[p + q - k - l][k + l] += f.terms[p][q] * u[k] * v[l];
        }
      }
    }
  }
  return result;
}

class SipPair {
 public:
  SipPair(FitsHeader& header, const char* first, const char* second)
      : header_(header), names_{first, second} {}

  bool exists() const { return header_.has(order_key(0)) || header_.has(order_key(1)); }

  void map(const Matrix& m, const std::string& label) {
    const Matrix inverse_map = inverse(m);
    const std::array<Polynomial, 2> old = {substitute(read(0, label), inverse_map),
                                           substitute(read(1, label), inverse_map)};
    const std::array<std::optional<double>, 2> bounds = {header_.number(bound_key(0)),
                                                         header_.number(bound_key(1))};
    for (int i = 0; i < sky_axis_count; ++i) {
      Polynomial f;
      for (int k = 0; k < sky_axis_count; ++k) {
        if (m[i][k] == 0) continue;
        f.order = std::max(f.order, old[k].order);
        for (int p = 0; p <= most_sip_order; ++p) {
          for (int q = 0; q <= most_sip_order; ++q) f.terms[p][q] += m[i][k] * old[k].terms[p][q];
        }
      }
      write(i, f);
      if (bounds[0] && bounds[1]) {
        header_.set(bound_key(i), std::abs(m[i][0]) * *bounds[0] + std::abs(m[i][1]) * *bounds[1]);
      }
    }
  }

 private:
  std::string order_key(int i) const { return fmt::format("{}_ORDER", names_[i]); }
  std::string bound_key(int i) const { return fmt::format("{}_DMAX", names_[i]); }
  std::string term_key(int i, int p, int q) const {
    return fmt::format("{}_{}_{}", names_[i], p, q);
  }

  Polynomial read(int i, const std::string& label) const {
    const double order = header_.number(order_key(i)).value_or(0);
    if (!(order >= 0 && order <= most_sip_order && order == std::floor(order))) {
      throw input_error({label, 0, 0}, "{} = {}; SIP polynomials have an order from 0 to {}",
                        order_key(i), order, most_sip_order);
    }
    Polynomial f;
    f.order = static_cast<int>(order);
    for (int p = 0; p <= f.order; ++p) {
      for (int q = 0; p + q <= f.order; ++q) {
        f.terms[p][q] = header_.number(term_key(i, p, q)).value_or(0);
      }
    }
    return f;
  }

  void write(int i, const Polynomial& f) {
    header_.set({order_key(i), static_cast<long long>(f.order), {}});
    for (int p = 0; p <= most_sip_order; ++p) {
      for (int q = 0; p + q <= most_sip_order; ++q) {
        if (p + q <= f.order) {
          set_unless_default(header_, term_key(i, p, q), f.terms[p][q], 0);
        } else {
          header_.remove(term_key(i, p, q));
        }
      }
    }
  }

  FitsHeader& header_;
  std::array<std::string, 2> names_;
};

// ---- IRAF --------------------------------------------------------------------------------------

/// Maps IRAF's physical coordinates: image coordinates are LTM times physical ones plus LTV.
void map_physical(FitsHeader& header, const PixelMap& map) {
  const auto matrix_key = [](int i, int j) { return fmt::format("LTM{}_{}", i + 1, j + 1); };
  const auto vector_key = [](int i) { return fmt::format("LTV{}", i + 1); };
  bool exists = false;
  Matrix old;
  PixelPosition zero = {header.number(vector_key(0)).value_or(0),
                        header.number(vector_key(1)).value_or(0)};
  for (int i = 0; i < sky_axis_count; ++i) {
    exists = exists || header.has(vector_key(i));
    for (int j = 0; j < sky_axis_count; ++j) {
      exists = exists || header.has(matrix_key(i, j));
      old[i][j] = header.number(matrix_key(i, j)).value_or(i == j ? 1 : 0);
    }
  }
  if (!exists) return;
  zero = map(zero);
  header.set(vector_key(0), zero.x);
  header.set(vector_key(1), zero.y);
  if (map.moves_only()) return;
  const Matrix m = matrix_of(map);
  for (int i = 0; i < sky_axis_count; ++i) {
    for (int j = 0; j < sky_axis_count; ++j) {
      set_unless_default(header, matrix_key(i, j), m[i][0] * old[0][j] + m[i][1] * old[1][j],
                         i == j ? 1 : 0);
    }
  }
}

}  // namespace

void map_pixels(FitsHeader& header, const PixelMap& map, const std::string& label) {
  if (map.moves_only() && map.x0 == 0 && map.y0 == 0) return;
  // Changes are made on a copy: after an error the header is as before.
  FitsHeader changed_header = header;
  const Matrix m = matrix_of(map);
  inverse(m);
  std::vector<std::string> letters = {""};
  for (char letter = 'A'; letter <= 'Z'; ++letter) letters.emplace_back(1, letter);
  for (const std::string& letter : letters) {
    Description description(changed_header, letter);
    if (description.exists()) description.map(map, label);
  }
  if (!map.moves_only()) {
    for (const auto& [first, second] : {std::pair("A", "B"), std::pair("AP", "BP")}) {
      SipPair pair(changed_header, first, second);
      if (pair.exists()) pair.map(m, label);
    }
  }
  map_physical(changed_header, map);
  header = std::move(changed_header);
}

}  // namespace gamer
