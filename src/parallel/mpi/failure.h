#pragma once

#include <exception>
#include <string>

namespace gamer::mpi {

constexpr int input_error_code = 2;
constexpr int run_error_code = 1;

/// A failure as it travels between ranks: the exit code and the message.
struct Failure {
  int code;
  std::string message;
};

/// The failure that other ranks get for an exception of this rank.
Failure describe(const std::exception_ptr& exception, int rank);
/// The exception that rank 0 throws for a failure: InputError or RunError.
std::exception_ptr make_exception(const Failure& failure);

}  // namespace gamer::mpi
