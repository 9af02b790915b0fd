#pragma once

#include <string>
#include <vector>

#include "gamer/core/resources.h"

namespace gamer {

/// Texts about everything that is declared, made from the declarations.

/// The kinds of components, one a line.
std::string list_components();

/// The names that a scene or a parameter file may give, with a line each: galaxies with their
/// descriptions, SEDs and bands with their wavelengths, noises. Files that cannot be read say so.
std::string list_galaxies(Resources& resources);
std::string list_seds(Resources& resources);
std::string list_bands(Resources& resources);
std::string list_instruments(Resources& resources);
std::string list_noises();

/// The parameters of `kind`: a section of the parameter file ("camera"), "galaxy" or "arms", "list"
/// (the columns of a scene list) or a kind of component; of all when it is empty. As tables for a
/// terminal, or in Markdown. Throws InputError for an unknown kind.
std::string list_parameters(const std::string& kind, bool markdown);

/// What list_parameters() knows as `kind`.
std::vector<std::string> parameter_kinds();

/// The file of a shipped galaxy type, or of one on the data path. Throws InputError for an unknown
/// name, with near ones.
std::string sample_galaxy(const std::string& type, Resources& resources);

/// A complete parameter file with all defaults, commented.
std::string sample_parameters();

}  // namespace gamer
