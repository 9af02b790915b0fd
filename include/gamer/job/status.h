#pragma once

#include <filesystem>
#include <string>

#include "gamer/job/journal.h"

namespace gamer {

/// What the journal of an interrupted or running job tells, some lines. `program` is that of this
/// process (program_text()). Control characters of names are escaped.
std::string status_text(const std::filesystem::path& journal, const JournalStatus& status,
                        const std::string& program);

/// Reads the journal and tells about it. Throws InputError, RunError.
std::string status_text(const std::filesystem::path& journal);

}  // namespace gamer
