#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/image_writer.h"
#include "gamer/job/job.h"
#include "gamer/job/journal.h"
#include "gamer/parallel/executor.h"
#include "gamer/parallel/ranks.h"

namespace gamer {

/// Beside the output: "image.fits.journal".
std::filesystem::path journal_path(const OutputOptions& output);

/// "gamer 1.0.0, build 0a1b2c3d": name, version and, where the program can read itself, a checksum
/// that tells builds apart.
std::string program_text();

/// Throws InputError on rank 0 when another rank is of another build; every rank's part.
void check_same_program(const Ranks& ranks);

/// The head of a job that begins now, with this program and instruction set.
JournalHead make_journal_head(const RenderJob& job, std::string truth);

/// Throws InputError "<label>: ..." that names all that differs: the program or, where that is the
/// same, parameters with both values, other texts with the first line that differs, the truth.
void check_same_job(const JournalHead& then, const JournalHead& now, const std::string& label);
/// Checks that an image that is there already is this job's. BMP pictures do not tell.
void check_same_job(const std::filesystem::path& image, const Record& now);
/// With the record of that image, which has been read.
void check_same_job(const std::filesystem::path& image, const Record& then, const Record& now);

/// The mask of instruction sets that makes the same rows again. Throws InputError when this machine
/// has not the journal's.
std::int64_t journal_simd_targets(const Journal& journal);

/// Whether writers keep no more than single precision of the pixels.
bool is_single_precision(const OutputOptions& output);

/// `blocks`, cut where rows are finished. `finished` is in ascending order.
std::vector<RowRange> unfinished_blocks(std::span<const RowRange> blocks,
                                        std::span<const RowRange> finished);

/// Runs what a journal does not hold, and takes the rows that it holds from there. Each run is the
/// next section of the journal.
class JournaledExecutor : public Executor {
 public:
  /// The journal is rank 0's; null on the others and where none is kept. Both outlive this.
  JournaledExecutor(Executor& executor, Journal* journal);

  /// Rows of an earlier process come first.
  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override;
  int workers() const override { return executor_.workers(); }
  const RunTimes& times() const override { return executor_.times(); }

  /// Whether the runs that follow need single precision only. At first they do not.
  void keep_single(bool single) { single_ = single; }
  /// Whether what is consumed just now is an earlier process's.
  bool is_replaying() const { return replaying_; }

 private:
  Executor& executor_;
  Journal* journal_;
  int section_ = 0;
  bool single_ = false;
  bool replaying_ = false;
};

}  // namespace gamer
