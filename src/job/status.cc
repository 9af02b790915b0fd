#include "gamer/job/status.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "gamer/core/printable.h"
#include "gamer/core/shell_word.h"
#include "gamer/core/utc_time.h"
#include "gamer/job/resume.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

std::string line(const std::string& name, const std::string& value) {
  return fmt::format("  {:<8} {}\n", name, printable(value));
}

/// "128 of 512 finished (25 %)". A damaged journal may hold more rows than there are.
std::string share_text(int done, int all) {
  const int known = std::min(done, all);
  const int percent = all > 0 ? static_cast<int>(100LL * known / all) : 100;
  return fmt::format("{} of {} finished ({} %)", known, all, percent);
}

std::string program_line(const std::string& then, const std::string& now) {
  return line(
      "program",
      then == now ? then : fmt::format("{}; this is {}, which cannot go on with it", then, now));
}

/// The command that continues the job from the current folder.
std::string command_text(const JournalPlan& plan) {
  std::error_code error;
  if (plan.folder.empty() || fs::path(plan.folder) == fs::current_path(error)) return plan.command;
  return fmt::format("cd {} && {}", shell_word(plan.folder), plan.command);
}

}  // namespace

std::string status_text(const fs::path& journal, const JournalStatus& status,
                        const std::string& program) {
  const JournalPlan& plan = status.head.plan;
  std::string text = fmt::format("{}: journal of a job that {}\n", printable(journal.string()),
                                 status.is_in_use ? "is running" : "was interrupted");
  text += line("output", plan.output);
  text += line("size", plan.size);
  text += program_line(status.head.program, program);
  if (plan.objects > 0) {
    text += line("TRUTH", "objects: " + share_text(status.finished_objects, plan.objects));
  }
  text += line("rows", share_text(status.finished_rows, plan.rows) +
                           (status.has_end ? "; the files are being given their names" : ""));
  text += line("begun", utc_time_text(plan.begun));
  text += line("last row", utc_time_text(status.changed));
  // A process may be writing just now.
  if (status.damaged_bytes > 0 && !status.is_in_use) {
    text += line("damage", fmt::format("the last {} bytes are cut off or damaged; their rows will "
                                       "be computed again",
                                       status.damaged_bytes));
  }
  text += line("held", status.is_in_use ? "by a running job" : "by no job");
  if (!plan.command.empty()) text += line("go on", command_text(plan));
  return text;
}

std::string status_text(const fs::path& journal) {
  return status_text(journal, Journal::status(journal), program_text());
}

}  // namespace gamer
