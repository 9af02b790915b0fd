#include "gamer/parallel/ranks.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "parallel/rank_group.h"

namespace gamer {

Ranks::Ranks(int* argc, char*** argv) : job_(join_group(argc, argv)) {}

Ranks::Ranks() = default;

Ranks::~Ranks() = default;

int Ranks::rank() const { return job_ ? job_->rank() : 0; }

int Ranks::size() const { return job_ ? job_->size() : 1; }

void Ranks::give_up_after(double seconds) const {
  if (job_) job_->give_up_after(seconds);
}

std::string Ranks::broadcast(std::string text) const {
  return job_ ? job_->broadcast(std::move(text)) : text;
}

std::vector<std::string> Ranks::gather(const std::string& text) const {
  return job_ ? job_->gather(text) : std::vector<std::string>{text};
}

std::int64_t Ranks::common_bits(std::int64_t bits) const {
  return job_ ? job_->common_bits(bits) : bits;
}

std::vector<double> Ranks::compute_together(std::span<const RowRange> blocks,
                                            std::size_t values_per_row, int threads,
                                            const Executor::Compute& compute,
                                            const std::function<void(int rows)>& count) const {
  int rows = 0;
  for (const RowRange& block : blocks) rows = std::max(rows, block.last);
  std::vector<double> all(static_cast<std::size_t>(rows) * values_per_row);
  executor(threads)->run(
      blocks, values_per_row, compute, [&](RowRange range, std::span<const double> values) {
        std::ranges::copy(values,
                          all.begin() + static_cast<std::ptrdiff_t>(values_per_row) * range.first);
        if (count) count(range.size());
      });
  if (size() == 1) return all;
  std::string bytes(rank() == 0 ? all.size() * sizeof(double) : 0, '\0');
  if (!bytes.empty()) std::memcpy(bytes.data(), all.data(), bytes.size());
  bytes = broadcast(std::move(bytes));
  all.resize(bytes.size() / sizeof(double));
  if (!bytes.empty()) std::memcpy(all.data(), bytes.data(), bytes.size());
  return all;
}

std::unique_ptr<Executor> Ranks::executor(int threads) const {
  if (size() == 1) return std::make_unique<ThreadExecutor>(threads);
  return job_->executor(threads);
}

int Ranks::end(int code, const std::string& message,
               const std::function<void(const std::string&)>& report) {
  if (job_) return job_->end(code, message, report);
  if (report && !message.empty()) report(message);
  return code;
}

std::string Ranks::library_version() { return mpi_library_version(); }

}  // namespace gamer
