// ipminmax-worker: ranks of linear_solver mumps_mpi beside the program, which is rank 0:
// mpirun -n 1 program : -n 7 ipminmax-worker
#include <cstdio>
#include <cstring>

#include "linalg/mpi/interface.hpp"

int main(int argc, char** argv) {
  bool verbose = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--version") == 0) {
      std::puts("ipminmax-worker " IPMINMAX_VERSION);
      return 0;
    }
    if (std::strcmp(argv[i], "--verbose") != 0) {
      std::fputs(
          "usage: mpirun -n 1 program : -n 7 ipminmax-worker [--verbose]\n"
          "Serves linear_solver mumps_mpi of the program, which has to be rank 0.\n"
          "  --verbose  at the end one line on the work done and the peak memory\n"
          "  --version  prints the version, which must be the program's\n",
          stderr);
      return 2;
    }
    verbose = true;
  }
  return ipminmax_mpi_work(IPMINMAX_VERSION, verbose);
}
