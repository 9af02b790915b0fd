// Uses gamer as a library.

#include <gamer/core/version.h>
#include <gamer/parallel/ranks.h>

#include <iostream>

int main(int argc, char** argv) {
  gamer::Ranks ranks(&argc, &argv);
  if (ranks.rank() == 0) {
    std::cout << "gamer " << gamer::version() << " on " << ranks.size() << " ranks, "
              << gamer::available_cores() << " cores\n";
  }
  return ranks.end(0);
}
