// ctest runs this program under mpirun with the name of a scenario. Every rank checks; the exit
// code is 0 when all ranks find what is expected.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/parallel/ranks.h"
#include "parallel/checks.h"

namespace gamer {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

Ranks* ranks = nullptr;

const auto nothing = [](RowRange, auto) {};

/// The sum of all ranks' numbers, each of which is broadcast in turn.
std::int64_t sum_over_ranks(std::int64_t number) {
  std::int64_t sum = 0;
  for (int rank = 0; rank < ranks->size(); ++rank) {
    sum += ranks->common_bits(rank == ranks->rank() ? number : -1);
  }
  return sum;
}

TEST(Ranks, Broadcast) {
  for (const std::size_t length : {0u, 1u, 5000u, 20'000'000u}) {
    std::string text(length, 'x');
    for (std::size_t i = 0; i < length; ++i) text[i] = static_cast<char>(i * i % 251);
    EXPECT_TRUE(ranks->broadcast(ranks->rank() == 0 ? text : "other") == text) << length;
  }
}

TEST(Ranks, Gather) {
  for (const std::size_t length : {0u, 1u, 3'000'000u}) {
    const auto text = [&](int rank) { return std::string(length, static_cast<char>('a' + rank)); };
    std::vector<std::string> expected;
    for (int rank = 0; ranks->rank() == 0 && rank < ranks->size(); ++rank) {
      expected.push_back(text(rank));
    }
    EXPECT_TRUE(ranks->gather(text(ranks->rank())) == expected) << length;
  }
}

TEST(Ranks, CommonBits) {
  const std::int64_t own = 0b1000 | (std::int64_t{1} << (40 + ranks->rank()));
  const std::int64_t expected = ranks->size() == 1 ? own : 0b1000;
  EXPECT_EQ(ranks->common_bits(own), expected);
  EXPECT_EQ(ranks->common_bits(-1), -1);
}

TEST(Ranks, EveryRowArrivesOnceWithItsValues) {
  for (const int threads : {1, 2, 4}) {
    const auto executor = ranks->executor(threads);
    EXPECT_EQ(executor->workers(), threads * ranks->size());
    for (const int rows : {0, 1, 3, 16, 101}) {
      for (const int block : {1, 3, 16, 1000}) {
        for (const std::size_t width : {0u, 1u, 37u}) {
          RowCheck check(even_blocks(rows, block), width);
          executor->run(check.blocks(), width, check.compute(), check.consume());
          if (ranks->rank() == 0) check.expect_all_consumed();
          EXPECT_EQ(sum_over_ranks(check.computed()), rows);
        }
      }
    }
  }
}

TEST(Ranks, BlocksMayDifferAndLeaveRowsOut) {
  const bool first = ranks->rank() == 0;
  for (const std::size_t width : {3u, 50'000u}) {
    RowCheck check({{1000, 1040}, {90, 97}, {0, 2}, {5, 6}, {100, 103}, {200, 230}}, width);
    ranks->executor(2)->run(first ? check.blocks() : std::vector<RowRange>(), width,
                            check.compute(), check.consume());
    if (first) check.expect_all_consumed();
    EXPECT_EQ(sum_over_ranks(check.computed()), check.rows());
  }
}

TEST(Ranks, BlocksOfZerosArriveToo) {
  constexpr std::size_t width = 3000;
  const auto value = [](int row) { return row % 3 == 0 ? 1e-300 : row % 3 == 1 ? 0.0 : -0.0; };
  int right = 0;
  ranks->executor(1)->run(
      even_blocks(60, 1), width,
      [&](RowRange rows, std::span<double> values) {
        std::this_thread::sleep_for(milliseconds(1));
        values.back() = value(rows.first);
      },
      [&](RowRange rows, std::span<const double> values) {
        ASSERT_EQ(values.size(), width);
        const bool are_zero =
            std::all_of(values.begin(), values.end() - 1, [](double v) { return v == 0; });
        right += are_zero && values.back() == value(rows.first) &&
                         std::signbit(values.back()) == std::signbit(value(rows.first))
                     ? 1
                     : 0;
      });
  EXPECT_EQ(right, ranks->rank() == 0 ? 60 : 0);
}

TEST(Ranks, ResultsOfSeveralMessages) {
  // A block needs 2.5 messages of 2^20 values.
  constexpr std::size_t width = (std::size_t{5} << 19) / 2;
  RowCheck check(even_blocks(8, 2), width);
  ranks->executor(1)->run(check.blocks(), width, check.compute(), check.consume());
  if (ranks->rank() == 0) check.expect_all_consumed();
}

TEST(Ranks, ComputeTogether) {
  constexpr std::size_t width = 3;
  for (const int threads : {1, 2}) {
    for (const int rows : {0, 1, 40}) {
      // Blocks go from the last to the first; where there are several, row 0 is left out.
      std::vector<RowRange> blocks = even_blocks(rows, 3);
      std::reverse(blocks.begin(), blocks.end());
      if (blocks.size() > 1) blocks.back().first = 1;
      RowCheck check(blocks, width);
      const std::vector<double> all =
          ranks->compute_together(check.blocks(), width, threads, check.compute());
      ASSERT_EQ(all.size(), static_cast<std::size_t>(rows) * width);
      for (std::size_t i = 0; i < all.size(); ++i) {
        const bool is_left_out = rows > 3 && i < width;
        const int row = static_cast<int>(i / width);
        EXPECT_EQ(all[i], is_left_out ? 0 : RowCheck::value(row, i % width));
      }
      // Each row is computed once.
      EXPECT_EQ(sum_over_ranks(check.computed()), check.rows());
    }
  }
}

TEST(Ranks, EveryRankComputes) {
  RowCheck check(even_blocks(40, 1), 3);
  const auto compute = check.compute();
  ranks->executor(1)->run(
      check.blocks(), 3,
      [&](RowRange range, std::span<double> values) {
        std::this_thread::sleep_for(milliseconds(20));
        compute(range, values);
      },
      check.consume());
  EXPECT_GE(check.computed(), 40 / ranks->size() / 2);
  if (ranks->rank() == 0) check.expect_all_consumed();
}

TEST(Ranks, SlowBlockDoesNotHoldOthersUp) {
  // The first block takes as long as all other blocks take one worker.
  constexpr int rows = 61;
  constexpr milliseconds short_time(10);
  const auto start = Clock::now();
  ranks->executor(1)->run(
      even_blocks(rows, 1), 1,
      [&](RowRange range, auto) {
        std::this_thread::sleep_for(range.first == 0 ? (rows - 1) * short_time : short_time);
      },
      nothing);
  const auto time = Clock::now() - start;
  const auto serial = 2 * (rows - 1) * short_time;
  if (ranks->size() == 1) {
    EXPECT_GE(time, serial);
  } else {
    // One block may wait behind the slow block on its rank.
    EXPECT_LT(time, serial * 3 / 4);
  }
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

TEST(Ranks, WaitingBurnsNoCore) {
  const double before = cpu_seconds();
  const auto start = Clock::now();
  ranks->executor(1)->run(
      even_blocks(2 * ranks->size(), 1), 1,
      [](RowRange, auto) { std::this_thread::sleep_for(milliseconds(300)); }, nothing);
  if (ranks->rank() == 0) std::this_thread::sleep_for(milliseconds(300));
  ranks->broadcast("");
  const std::chrono::duration<double> time = Clock::now() - start;
  EXPECT_LT(cpu_seconds() - before, 0.1 * time.count());
}

TEST(Ranks, TellWhereTheTimeWent) {
  // The first block takes as long as six others.
  const auto executor = ranks->executor(1);
  executor->run(
      even_blocks(7, 1), 1,
      [](RowRange range, auto) {
        std::this_thread::sleep_for(milliseconds(range.first == 0 ? 300 : 50));
      },
      [](RowRange, auto) { std::this_thread::sleep_for(milliseconds(5)); });
  const RunTimes& times = executor->times();
  const auto in_milliseconds = [](double seconds) { return static_cast<int>(1000 * seconds); };
  const int worked = in_milliseconds(times.compute);
  EXPECT_GE(sum_over_ranks(worked), 600);
  EXPECT_GE(in_milliseconds(times.consume), ranks->rank() == 0 ? 35 : 0);
  EXPECT_NEAR(worked + in_milliseconds(times.waiting) +
                  (ranks->size() == 1 ? in_milliseconds(times.consume) : 0),
              in_milliseconds(times.wall), 3);
}

TEST(Ranks, SlowConsumerHoldsWorkersBack) {
  constexpr int rows = 60;
  RowCheck check(even_blocks(rows, 1), 1);
  int consumed = 0;
  int computed_here_at_third = 0;
  ranks->executor(1)->run(check.blocks(), 1, check.compute(), [&](RowRange, auto) {
    std::this_thread::sleep_for(milliseconds(5));
    if (++consumed == 3) computed_here_at_third = check.computed();
  });
  if (ranks->rank() == 0) {
    // One result waits, and the thread holds another.
    EXPECT_LE(computed_here_at_third, 3 + 2);
  }
}

/// The outcome of run(): "" for success, "input: ...", "run: ...", "stopped: code".
std::string outcome(const Executor::Compute& compute, const Executor::Consume& consume) {
  try {
    ranks->executor(2)->run(even_blocks(100000, 1), 4, compute, consume);
    return "";
  } catch (const InputError& error) {
    return std::string("input: ") + error.what();
  } catch (const RunError& error) {
    return std::string("run: ") + error.what();
  } catch (const Stopped& stopped) {
    return "stopped: " + std::to_string(stopped.code);
  } catch (const std::exception& error) {
    return std::string("other: ") + error.what();
  }
}

TEST(Ranks, ComputeFailsOnEachRank) {
  const auto pause = [] { std::this_thread::sleep_for(milliseconds(1)); };
  for (int failing = 0; failing < ranks->size(); ++failing) {
    std::atomic<int> calls = 0;
    const auto throwing = [&](auto exception) {
      return [&, exception](RowRange, auto) {
        pause();
        if (ranks->rank() == failing && ++calls >= 5) throw exception;
      };
    };
    const auto start = Clock::now();
    const std::string input = outcome(throwing(InputError("a.toml:3:1: wrong")), nothing);
    EXPECT_EQ(input, ranks->rank() == 0 ? "input: a.toml:3:1: wrong" : "stopped: 2");
    const std::string run = outcome(throwing(RunError("lost")), nothing);
    EXPECT_EQ(run, ranks->rank() == 0 ? "run: lost" : "stopped: 1");
    const std::string other = outcome(throwing(std::out_of_range("far")), nothing);
    const std::string on_first =
        failing == 0 ? "other: far" : "run: rank " + std::to_string(failing) + ": far";
    EXPECT_EQ(other, ranks->rank() == 0 ? on_first : "stopped: 1");
    EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
  }
}

TEST(Ranks, LongMessagesArriveWhole) {
  const int last = ranks->size() - 1;
  const std::string message(100'000, 'm');
  const std::string thrown = outcome(
      [&](RowRange, auto) {
        std::this_thread::sleep_for(milliseconds(1));
        if (ranks->rank() == last) throw InputError(message);
      },
      nothing);
  EXPECT_EQ(thrown, ranks->rank() == 0 ? "input: " + message : "stopped: 2");
}

TEST(Ranks, AllFailAtOnce) {
  const std::string thrown =
      outcome([](RowRange, auto) { throw InputError("everywhere"); }, nothing);
  EXPECT_EQ(thrown, ranks->rank() == 0 ? "input: everywhere" : "stopped: 2");
}

TEST(Ranks, ConsumeFails) {
  int consumed = 0;
  const std::string thrown =
      outcome([](RowRange, auto) { std::this_thread::sleep_for(milliseconds(1)); },
              [&](RowRange, auto) {
                if (++consumed == 7) throw RunError("disk full");
              });
  EXPECT_EQ(thrown, ranks->rank() == 0 ? "run: disk full" : "stopped: 1");
  EXPECT_EQ(consumed, ranks->rank() == 0 ? 7 : 0);
}

TEST(Ranks, ConsumeOfTheLastBlockFails) {
  constexpr int rows = 12;
  int consumed = 0;
  const auto run = [&] {
    ranks->executor(1)->run(even_blocks(rows, 1), 1, nothing, [&](RowRange, auto) {
      if (++consumed == rows) throw RunError("disk full");
    });
  };
  if (ranks->rank() == 0) {
    EXPECT_THROW(run(), RunError);
  } else {
    EXPECT_THROW(run(), Stopped);
  }
}

TEST(Ranks, RunsAgainAfterFailures) {
  RowCheck check(even_blocks(50, 3), 11);
  ranks->executor(2)->run(check.blocks(), 11, check.compute(), check.consume());
  if (ranks->rank() == 0) check.expect_all_consumed();
}

TEST(Ranks, RejectsWrongNumbers) {
  EXPECT_THROW(ranks->executor(0), std::invalid_argument);
  const std::vector<RowRange> wrong = {{2, 2}};
  EXPECT_THROW(ranks->executor(1)->run(wrong, 1, nothing, nothing), std::invalid_argument);
}

/// Runs `body` and returns its exit code and message as a program's main would.
std::pair<int, std::string> guarded(const std::function<void()>& body) {
  try {
    body();
    return {0, ""};
  } catch (const InputError& error) {
    return {2, error.what()};
  } catch (const Stopped& stopped) {
    return {stopped.code, ""};
  } catch (const std::exception& error) {
    return {1, error.what()};
  }
}

struct Expected {
  int code;                           ///< exit code of this rank before end()
  int job_code;                       ///< value that end() returns
  std::optional<std::string> report;  ///< message on rank 0
};

/// The exit code: 0 when code, job_code and report are as expected.
int check_end(const std::function<void()>& body, const Expected& expected) {
  const auto [code, message] = guarded(body);
  std::optional<std::string> report;
  const bool first = ranks->rank() == 0;
  const int job_code = ranks->end(code, message, [&](const std::string& text) { report = text; });
  const bool right = code == expected.code && job_code == expected.job_code &&
                     report == (first ? expected.report : std::nullopt);
  if (!right) {
    std::fprintf(stderr, "code %d, job %d, report '%s'\n", code, job_code,
                 report.value_or("none").c_str());
  }
  return right ? 0 : 1;
}

void run_slowly() {
  ranks->executor(1)->run(
      even_blocks(100000, 1), 1,
      [](RowRange, auto) { std::this_thread::sleep_for(milliseconds(1)); }, nothing);
}

/// Rank `leaver` throws `error`, and the others call `call`.
template <typename Error>
std::function<void()> leave(int leaver, const Error& error, const std::function<void()>& call) {
  return [=] {
    if (ranks->rank() == leaver) throw error;
    call();
  };
}

/// A run in which rank `still` stops and never continues.
int run_and_stand_still(int still, double patience) {
  ranks->give_up_after(patience);
  const auto [code, message] = guarded([&] {
    ranks->executor(1)->run(
        even_blocks(100000, 1), 1,
        [&](RowRange, auto) {
          std::this_thread::sleep_for(milliseconds(1));
          if (ranks->rank() == still) raise(SIGSTOP);
        },
        nothing);
  });
  return ranks->end(code, message,
                    [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); });
}

/// Lets another process stop this one, and later continue it.
void stand_still_later(milliseconds later, milliseconds duration) {
  const pid_t parent = getpid();
  if (fork() != 0) return;
  std::this_thread::sleep_for(later);
  kill(parent, SIGSTOP);
  std::this_thread::sleep_for(duration);
  kill(parent, SIGCONT);
  _exit(0);
}

void call_gather() { ranks->gather("text"); }
void call_broadcast() { ranks->broadcast("text"); }
void call_common_bits() { ranks->common_bits(1); }
/// Repeats the call, which may succeed until rank 0 learns that a rank has left.
void call_repeatedly(const std::function<void()>& call) {
  for (int i = 0; i < 5; ++i) {
    call();
    std::this_thread::sleep_for(milliseconds(50));
  }
}

using Scenarios = std::map<std::string, std::function<int()>>;

/// Scenarios in which ranks leave, each with its own message.
Scenarios leaving() {
  const InputError input("scene.lst:1:1: wrong");
  const std::string text = input.what();
  const RunError run("out of memory");
  const int last = ranks->size() - 1;
  const Expected all_two{2, 2, text};
  const Expected all_one{1, 1, "out of memory"};
  return {
      {"first-leaves-broadcast",
       [=] { return check_end(leave(0, input, call_broadcast), all_two); }},
      {"first-leaves-gather", [=] { return check_end(leave(0, input, call_gather), all_two); }},
      {"first-leaves-bits", [=] { return check_end(leave(0, input, call_common_bits), all_two); }},
      {"first-leaves-run", [=] { return check_end(leave(0, input, run_slowly), all_two); }},
      {"last-leaves-broadcast",
       [=] {
         return check_end(leave(last, input, [] { call_repeatedly(call_broadcast); }), all_two);
       }},
      {"last-leaves-gather",
       [=] {
         return check_end(leave(last, input, [] { call_repeatedly(call_gather); }), all_two);
       }},
      {"gather-is-last",
       [=] {
         // Ranks leave as soon as their text is sent, while rank 0 still waits for the last text.
         return check_end(
             [=] {
               if (ranks->rank() == last) std::this_thread::sleep_for(milliseconds(100));
               call_gather();
             },
             {0, 0, std::nullopt});
       }},
      {"last-leaves-bits",
       [=] {
         return check_end(leave(last, run, [] { call_repeatedly(call_common_bits); }), all_one);
       }},
      {"last-leaves-run", [=] { return check_end(leave(last, run, run_slowly), all_one); }},
      {"all-leave", [=] { return check_end([=] { throw input; }, all_two); }},
      {"last-fails-late",
       [=] {
         const Expected expected{ranks->rank() == last ? 1 : 0, 1, "out of memory"};
         return check_end(leave(last, run, [] {}), expected);
       }},
  };
}

/// Scenarios in which ranks fail or stand still during a run.
Scenarios failing() {
  const InputError input("scene.lst:1:1: wrong");
  const RunError run("out of memory");
  const int last = ranks->size() - 1;
  const Expected all_two{2, 2, input.what()};
  return {
      {"compute-fails",
       [=] {
         return check_end(
             [=] {
               ranks->executor(1)->run(
                   even_blocks(100000, 1), 1,
                   [=](RowRange, auto) {
                     std::this_thread::sleep_for(milliseconds(1));
                     if (ranks->rank() == last) throw input;
                   },
                   nothing);
             },
             all_two);
       }},
      {"first-stands-still", [=] { return run_and_stand_still(0, 0.2); }},
      {"last-stands-still", [=] { return run_and_stand_still(last, 1); }},
      {"all-stand-still-a-while",
       [=] {
         ranks->give_up_after(0.6);
         stand_still_later(milliseconds(300), milliseconds(1500));
         return check_end(
             [] {
               ranks->executor(1)->run(
                   even_blocks(600, 1), 1,
                   [](RowRange, auto) { std::this_thread::sleep_for(milliseconds(5)); }, nothing);
             },
             {0, 0, std::nullopt});
       }},
      {"destructor-after-throw",
       [=] {
         // main returns 0 after its handler; ~Ranks ends the job.
         const auto [code, message] = guarded(leave(last, run, run_slowly));
         return code == 1 ? 0 : 1;
       }},
  };
}

Scenarios scenarios() {
  Scenarios all = leaving();
  all.merge(failing());
  return all;
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  gamer::Ranks ranks(&argc, &argv);
  gamer::ranks = &ranks;
  if (argc != 3 || std::stoi(argv[1]) != ranks.size()) {
    std::fprintf(stderr, "usage: mpirun -n N ranks_program N suite|<scenario>\n");
    return 1;
  }
  const std::string name = argv[2];
  if (name == "suite") return ranks.end(RUN_ALL_TESTS());
  return gamer::scenarios().at(name)();
}
