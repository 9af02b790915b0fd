#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Several processes, as Ranks describes them; mpi/mpi_group.cc implements it.
class RankGroup {
 public:
  virtual ~RankGroup() = default;

  virtual int rank() const = 0;
  virtual int size() const = 0;
  virtual void give_up_after(double seconds) = 0;
  virtual std::string broadcast(std::string text) = 0;
  virtual std::vector<std::string> gather(const std::string& text) = 0;
  virtual std::int64_t common_bits(std::int64_t bits) = 0;
  virtual std::unique_ptr<Executor> executor(int threads) = 0;
  virtual int end(int code, const std::string& message,
                  const std::function<void(const std::string&)>& report) = 0;
};

/// Joins the MPI job that this process was started in; null when it was started alone or without
/// MPI.
std::unique_ptr<RankGroup> join_group(int* argc, char*** argv);

/// Name and version of the MPI library, or empty.
std::string mpi_library_version();

}  // namespace gamer
