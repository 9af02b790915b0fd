#include "gamer/image/fits/psfex_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gamer/core/error.h"
#include "image/fits/fits_file.h"

namespace gamer {
namespace {

constexpr const char* table_name = "PSF_DATA";
constexpr int largest_side = 4095, largest_degree = 20;

bool move_to_table(FitsFile& file) {
  const int count = file.hdu_count();
  for (int hdu = 2; hdu <= count; ++hdu) {
    file.move_to(hdu);
    int type = 0;
    file.call(fits_get_hdu_type, &type);
    if (type == BINARY_TBL && file.text("EXTNAME") == table_name) return true;
  }
  return false;
}

/// A number of the current header; `missing` where there is none.
double number(FitsFile& file, const std::string& key, double missing) {
  int status = 0;
  double value = missing;
  fits_read_key(file.handle(), TDOUBLE, key.c_str(), &value, nullptr, &status);
  fits_clear_errmsg();
  return status == 0 ? value : missing;
}

/// A whole number within [least, most].
int whole(FitsFile& file, const std::string& key, int missing, int least, int most) {
  const double value = number(file, key, missing);
  if (!(value >= least && value <= most && value == std::floor(value))) {
    file.fail(fmt::format("{} is {} in table {}; a whole number from {} to {} is needed", key,
                          value, table_name, least, most));
  }
  return static_cast<int>(value);
}

void read_polynomial(FitsFile& file, PsfexFile& psf) {
  constexpr int most_axes = 9;
  const int axes = whole(file, "POLNAXIS", 0, 0, most_axes);
  if (axes == 0) return;
  if (axes != 2 || number(file, "POLNGRP", 1) != 1) {
    file.fail("a PSF that varies with X_IMAGE and Y_IMAGE in one group is needed (PSFVAR_KEYS)");
  }
  for (int axis = 1; axis <= axes; ++axis) {
    PsfexFile::Axis made;
    made.name = file.text(fmt::format("POLNAME{}", axis));
    made.zero = number(file, fmt::format("POLZERO{}", axis), 0);
    made.scale = number(file, fmt::format("POLSCAL{}", axis), 1);
    if (made.name != "X_IMAGE" && made.name != "Y_IMAGE") {
      file.fail(
          fmt::format("its PSF varies with '{}'; X_IMAGE and Y_IMAGE are possible", made.name));
    }
    if (!std::isnormal(made.scale) || !std::isfinite(made.zero)) {
      file.fail(fmt::format("POLZERO{0} and POLSCAL{0} are no scale", axis));
    }
    psf.axes.push_back(made);
  }
  if (psf.axes[0].name == psf.axes[1].name) file.fail("both axes of its polynomial are one");
  psf.degree = whole(file, "POLDEG1", 0, 0, largest_degree);
}

}  // namespace

std::optional<PsfexFile> read_psfex_file(const std::filesystem::path& path) {
  FitsFile file = FitsFile::open(path, path.string());
  if (!move_to_table(file)) return std::nullopt;
  PsfexFile psf;
  psf.width = whole(file, "PSFAXIS1", 0, 1, largest_side);
  psf.height = whole(file, "PSFAXIS2", 0, 1, largest_side);
  psf.sampling = number(file, "PSF_SAMP", 1);
  constexpr double finest = 1e-2, coarsest = 1e2;
  if (!(psf.sampling >= finest && psf.sampling <= coarsest)) {
    file.fail(fmt::format("PSF_SAMP is {}; [{}, {}] is possible", psf.sampling, finest, coarsest));
  }
  read_polynomial(file, psf);
  psf.components = (psf.degree + 1) * (psf.degree + 2) / 2;
  const int stored = whole(file, "PSFAXIS3", 1, 1, (largest_degree + 1) * (largest_degree + 2));
  int column = 0, type = 0, any_null = 0;
  LONGLONG repeat = 0, width = 0;
  file.call(fits_get_colnum, CASEINSEN, const_cast<char*>("PSF_MASK"), &column);
  file.call(fits_get_coltypell, column, &type, &repeat, &width);
  const LONGLONG count = LONGLONG{psf.width} * psf.height * psf.components;
  if (stored != psf.components || repeat != count) {
    file.fail(fmt::format("PSF_MASK holds {} numbers in {} components; {} x {} x {} are needed",
                          repeat, stored, psf.width, psf.height, psf.components));
  }
  file.check_data(0);
  psf.values.resize(static_cast<std::size_t>(count));
  file.call(fits_read_col_dbl, column, LONGLONG{1}, LONGLONG{1}, count, 0.0, psf.values.data(),
            &any_null);
  if (!std::ranges::all_of(psf.values, [](double v) { return std::isfinite(v); })) {
    file.fail("PSF_MASK has values that are not finite");
  }
  return psf;
}

}  // namespace gamer
