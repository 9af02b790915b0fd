#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "gamer/core/error.h"
#include "gamer/core/printable.h"
#include "gamer/image/clean_up.h"

/// Exit codes of the programs.
enum ExitCode { done = 0, failed = 1, wrong_input = 2 };

/// Runs a program of one process and returns its exit code. It is the one place where errors are
/// reported, each as one line on stderr. `run` returns the exit code where it does not throw.
template <class Run>
int run_program(const std::string& name, Run&& run) {
  const auto report = [](const std::string& message) {
    fmt::print(stderr, "{}\n", gamer::printable(message));
  };
  gamer::open_standard_streams();
  gamer::clean_up_on_signals();
  try {
    return run();
  } catch (const gamer::InputError& error) {
    report(error.what());
    return wrong_input;
  } catch (const gamer::RunError& error) {
    report(error.what());
  } catch (const std::bad_alloc&) {
    report(name + ": out of memory");
  } catch (const std::exception& error) {
    report(name + ": " + error.what());
  }
  return failed;
}
