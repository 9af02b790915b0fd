#include "scene/usual_names.h"

#include <fmt/format.h>

#include <map>

#include "gamer/core/near.h"

namespace gamer {

const NameGroups& usual_names(column::Column column) {
  using namespace column;
  static const std::map<Column, NameGroups> names = {
      {ra,
       {{"alpha_j2000", "ra_j2000", "raj2000", "_raj2000", "ra_icrs", "right_ascension", "radeg"},
        {"alphawin_j2000"}}},
      {dec,
       {{"delta_j2000", "dec_j2000", "dej2000", "_dej2000", "de_icrs", "declination", "decdeg",
         "dedeg"},
        {"deltawin_j2000"}}},
      {px, {{"x_image"}, {"xwin_image"}, {"x"}}},
      {py, {{"y_image"}, {"ywin_image"}, {"y"}}},
      {pa, {{"theta_j2000", "position_angle", "posang"}, {"thetawin_j2000"}}},
      {axis_ratio, {{"q", "b_a", "ba_ratio", "ba"}}},
      {half_light_radius, {{"r_e", "re", "reff", "r_eff", "hlr", "r50"}}},
      {sersic_index, {{"sersic_n", "n_sersic", "nsersic"}}},
      {redshift,
       {{"z", "zspec", "z_spec", "zphot", "z_phot", "photoz", "photo_z", "z_best", "zbest"},
        {"z_true", "ztrue"}}},
      {apparent_magnitude,
       {{"mag_{letter}", "{letter}_mag", "{letter}mag", "mag_{band}", "{band}_mag", "{band}"},
        {"m_{letter}"},
        {"mag_auto"},
        {"mag"}}},
      {id, {{"number"}, {"source_id"}, {"objid", "obj_id"}, {"name"}}},
  };
  static const NameGroups none;
  const auto found = names.find(column);
  return found == names.end() ? none : found->second;
}

NameGroups usual_names(column::Column column, const std::string& reference_band) {
  const std::string band = lower(reference_band);
  const std::string letter = band.substr(band.rfind('_') + 1);
  NameGroups groups = usual_names(column);
  for (std::vector<std::string>& group : groups) {
    for (std::string& name : group) {
      name = fmt::format(fmt::runtime(name), fmt::arg("band", band), fmt::arg("letter", letter));
    }
  }
  return groups;
}

}  // namespace gamer
