/* A program that finds Ipopt's C functions at run time, as interpreters do, in a process that has
 * Ipopt itself, too: argv[1] is libipminmax_ipopt, argv[2] Ipopt. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv) {
  static const char *const names[] = {"CreateIpoptProblem", "IpoptSolve", "AddIpoptStrOption",
                                      "FreeIpoptProblem"};
  void *ipopt, *ours;
  size_t i;
  if (argc != 3) return 2;
  ipopt = dlopen(argv[2], RTLD_NOW | RTLD_GLOBAL);
  ours = ipopt != NULL ? dlopen(argv[1], RTLD_NOW | RTLD_LOCAL) : NULL;
  if (ours == NULL) {
    fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  for (i = 0; i < sizeof names / sizeof *names; ++i) {
    Dl_info mine, theirs;
    if (dladdr(dlsym(ours, names[i]), &mine) == 0 || dladdr(dlsym(ipopt, names[i]), &theirs) == 0 ||
        strstr(mine.dli_fname, "libipminmax_ipopt") == NULL ||
        strstr(theirs.dli_fname, "libipopt.") == NULL) {
      fprintf(stderr, "%s is not found where it should be\n", names[i]);
      return 1;
    }
  }
  return 0;
}
