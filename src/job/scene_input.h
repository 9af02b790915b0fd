#pragma once

#include <filesystem>
#include <string>

#include "gamer/core/resources.h"
#include "gamer/job/job.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"

namespace gamer {

/// The file that a request names, or the image that is to be made again.
const std::filesystem::path& source_of(const JobRequest& request,
                                       const std::filesystem::path& file);

/// Reads a file that the command line names: messages begin with its name. Throws InputError.
const Resources::Text& read_named_file(Resources& resources, const std::string& name,
                                       const std::filesystem::path& path);

/// The request's catalogue, from a file, from standard input ("-") or from the record. The content
/// decides the format. A text's catalogue is a view into the resources. Throws InputError.
Catalogue read_catalogue(const JobRequest& request, const RenderParameters& parameters,
                         Resources& resources);

}  // namespace gamer
