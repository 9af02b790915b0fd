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

/// The path of the journal, beside the output: "image.fits.journal".
std::filesystem::path journal_path(const OutputOptions& output);

/// "gamer 1.0.0, build 0a1b2c3d": name, version and, if the program can read its own file, a
/// checksum that distinguishes builds.
std::string program_text();

/// Throws InputError on rank 0 if another rank has another build. Every rank calls this function.
void check_same_program(const Ranks& ranks);

/// The head of a new job, with this program and instruction set.
JournalHead make_journal_head(const RenderJob& job, std::string truth);

/// Throws InputError "<label>: ..." that names all differences of two jobs. If the programs differ,
/// it names only these. Otherwise it names parameters with both values, other texts with their
/// first different line, and the truth.
void check_same_job(const JournalHead& then, const JournalHead& now, const std::string& label);
/// Throws InputError unless an existing image belongs to this job. BMP pictures cannot be checked.
void check_same_job(const std::filesystem::path& image, const Record& now);
/// The check above with `then`, the image's record.
void check_same_job(const std::filesystem::path& image, const Record& then, const Record& now);

/// The mask of instruction sets that reproduces the journal's rows. Throws InputError if this
/// machine lacks the journal's instruction set.
std::int64_t journal_simd_targets(const Journal& journal);

/// Whether writers keep only single precision of the pixels.
bool is_single_precision(const OutputOptions& output);

/// `blocks` without the finished rows. `finished` is in ascending order.
std::vector<RowRange> unfinished_blocks(std::span<const RowRange> blocks,
                                        std::span<const RowRange> finished);

/// An executor that takes finished rows from a journal and computes the others. Each run is the
/// next section of the journal, unless go_to() names another.
class JournaledExecutor : public Executor {
 public:
  /// `journal` is the journal on rank 0; null on other ranks or if none is kept. Both arguments
  /// outlive this object.
  JournaledExecutor(Executor& executor, Journal* journal);

  /// Runs the blocks; rows of an earlier process come first. Throws InputError if the journal holds
  /// rows that the job lacks.
  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override;
  int workers() const override { return executor_.workers(); }
  const RunTimes& times() const override { return executor_.times(); }

  int next_section() const { return section_; }
  /// Sets the section of the next run.
  void go_to(int section) { section_ = section; }
  /// Sets whether the following runs need only single precision; at first false.
  void keep_single(bool single) { single_ = single; }
  /// Whether the rows being consumed come from an earlier process.
  bool is_replaying() const { return replaying_; }

 private:
  Executor& executor_;
  Journal* journal_;
  int section_ = 0;
  bool single_ = false;
  bool replaying_ = false;
};

}  // namespace gamer
