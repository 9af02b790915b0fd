#include "parallel/mpi/failure.h"

#include <fmt/format.h>

#include "gamer/core/error.h"

namespace gamer::mpi {

Failure describe(const std::exception_ptr& exception, int rank) {
  try {
    std::rethrow_exception(exception);
  } catch (const InputError& error) {
    return {input_error_code, error.what()};
  } catch (const RunError& error) {
    return {run_error_code, error.what()};
  } catch (const std::exception& error) {
    return {run_error_code, fmt::format("rank {}: {}", rank, error.what())};
  } catch (...) {
    return {run_error_code, fmt::format("rank {}: unknown failure", rank)};
  }
}

std::exception_ptr make_exception(const Failure& failure) {
  if (failure.code == input_error_code) return std::make_exception_ptr(InputError(failure.message));
  return std::make_exception_ptr(RunError(failure.message));
}

}  // namespace gamer::mpi
