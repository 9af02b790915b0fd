#pragma once

#include <filesystem>
#include <string>

#include "gamer/job/journal.h"

namespace gamer {

/// Lines about the journal of an interrupted or running job. `program` is that of this process
/// (program_text()). Control characters of names are escaped.
std::string status_text(const std::filesystem::path& journal, const JournalStatus& status,
                        const std::string& program);

/// Reads the journal, and describes it as above. Throws InputError, RunError.
std::string status_text(const std::filesystem::path& journal);

}  // namespace gamer
