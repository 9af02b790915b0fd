#pragma once

#include <string>
#include <vector>

#include "gamer/core/resources.h"

namespace gamer {

/// Texts about everything that is declared, made from the declarations.

/// The kinds of components, one per line.
std::string list_components();

/// The names that a scene or a parameter file may use, one per line: galaxies with descriptions,
/// SEDs and bands with wavelengths, noises. Unreadable files are marked.
std::string list_galaxies(Resources& resources);
std::string list_seds(Resources& resources);
std::string list_bands(Resources& resources);
std::string list_instruments(Resources& resources);
std::string list_noises();

/// The parameters of `kind`. A kind is a section of the parameter file ("camera"), "galaxy",
/// "arms", "list" (the columns of a scene list) or a kind of component. An empty `kind` gives all
/// parameters. The tables are for a terminal, or in Markdown. Throws InputError for an unknown
/// kind.
std::string list_parameters(const std::string& kind, bool markdown);

/// The values of `kind` in list_parameters().
std::vector<std::string> parameter_kinds();

/// The file of a galaxy type, shipped or on the data path. Throws InputError for an unknown name.
/// The message proposes similar names.
std::string sample_galaxy(const std::string& type, Resources& resources);

/// A complete parameter file with all defaults and comments.
std::string sample_parameters();

}  // namespace gamer
