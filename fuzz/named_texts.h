#pragma once

#include <string>
#include <string_view>

#include "gamer/core/resources.h"

/// Data that the fuzzed texts may name; nothing is read from disk. SEDs are "E", "Sbc", "Scd" and
/// "Im", bandpasses "sdss_r" and "sdss_g". The galaxy "ngc4321" has two bulges and dust, whose
/// light is integrated fast; "dust" is dust alone. A luminosity function is "table", and a header
/// "camera.header".
inline gamer::Resources named_texts(std::string_view luminosities = "0.01 1 4000\n10 2 6000\n") {
  const char* sed = "# wavelength: Angstrom\n# flux: flambda\n900 1\n5500 1.5\n25000 0.5\n";
  const char* band =
      "# wavelength: Angstrom\n# response: photons\n5400 0\n5500 1\n6900 1\n7000 0\n";
  const char* galaxy =
      "[arms]\nmodel = \"logarithmic\"\n"
      "[[component]]\nclass = \"bulge\"\nsed = \"E\"\neffective_radius = 0.1\n"
      "[[component]]\nclass = \"bulge\"\nsed = \"Sbc\"\nradius = 1e-6\nfraction = 0.3\n"
      "[[component]]\nclass = \"dust\"\noptical_depth = 0.5\nnoise = false\n";
  const char* dust = "[[component]]\nclass = \"dust\"\noptical_depth = 0.5\nnoise = false\n";
  const char* header =
      "SIMPLE  =                    T\nBITPIX  =                  -32\n"
      "NAXIS   =                    2\nNAXIS1  =                   40\n"
      "NAXIS2  =                   30\nCTYPE1  = 'RA---TAN'\nCTYPE2  = 'DEC--TAN'\n"
      "CRVAL1  =                150.0\nCRVAL2  =                  2.0\n"
      "CRPIX1  =                 20.5\nCRPIX2  =                 15.5\n"
      "CDELT1  =               -1e-04\nCDELT2  =                1e-04\n";
  return gamer::Resources::from_record({
      {"seds/E", "seds/E.sed", sed},
      {"seds/Sbc", "seds/Sbc.sed", sed},
      {"seds/Scd", "seds/Scd.sed", sed},
      {"seds/Im", "seds/Im.sed", sed},
      {"bandpasses/sdss_r", "bandpasses/sdss_r.band", band},
      {"bandpasses/sdss_g", "bandpasses/sdss_g.band", band},
      {"galaxies/ngc4321", "galaxies/ngc4321.toml", galaxy},
      {"galaxies/dust", "galaxies/dust.toml", dust},
      {"luminosities/table", "luminosities/table.lf", std::string(luminosities)},
      {"camera.header", "survey_r.fits", header},
  });
}
