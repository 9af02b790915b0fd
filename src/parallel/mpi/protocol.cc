#ifdef GAMER_HAVE_MPI

#include "parallel/mpi/protocol.h"

#include <thread>

namespace gamer::mpi {

bool test(MPI_Request& request) {
  int done = 0;
  MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void wait(MPI_Request& request) {
  for (Pause pause; !test(request);) std::this_thread::sleep_for(pause.next());
}

bool test_all(std::vector<MPI_Request>& requests) {
  int done = 0;
  MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
  return done != 0;
}

}  // namespace gamer::mpi

#endif
