#pragma once

#include <filesystem>
#include <string>

#include "gamer/job/journal.h"

namespace gamer {

/// Lines about the journal of an interrupted or running job. `program` is program_text() of this
/// process. Control characters in names are escaped.
std::string status_text(const std::filesystem::path& journal, const JournalStatus& status,
                        const std::string& program);

/// Reads the journal, and describes it as above. Throws InputError if there is none, RunError if it
/// cannot be read.
std::string status_text(const std::filesystem::path& journal);

}  // namespace gamer
