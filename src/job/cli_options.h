#pragma once

#include <vector>

#include "gamer/core/manual.h"

namespace CLI {
class App;
}

namespace gamer {

/// Adds the options and the arguments of a program or of a command to those of its manual.
void add_cli_options(const CLI::App& app, std::vector<ManualOption>& options,
                     std::vector<ManualOption>& arguments);

}  // namespace gamer
