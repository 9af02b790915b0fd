#pragma once

#include <string>

namespace gamer {

/// Opens /dev/null for those of the standard streams that are closed, or the files that the program
/// opens would take their place and get its messages. For main.
void open_standard_streams();

/// From now on SIGINT, SIGTERM and SIGHUP remove the files that are in the making before they end
/// the process (as the signal does, so that shells see 128 + its number), and writing into a closed
/// pipe or beyond the limit of a file's size is an error like others. For main.
void clean_up_on_signals();

/// These signals then also say "<program>: stopped by SIGTERM<rest>" on standard error. Until it is
/// called they say nothing.
void say_when_stopped(const std::string& program, const std::string& rest);
void say_nothing_when_stopped();

}  // namespace gamer
