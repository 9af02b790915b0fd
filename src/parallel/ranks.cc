#include "gamer/parallel/ranks.h"

#include <utility>

#include "parallel/job.h"

namespace gamer {

Ranks::Ranks(int* argc, char*** argv) : job_(join_job(argc, argv)) {}

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
