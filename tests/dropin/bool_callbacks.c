/* Ipopt's C interface as 3.14 declares it: callbacks and functions of type bool. Only the low byte
 * of a bool that is returned is defined, so "false" is tried with garbage above it. The game
 * min over x, max over y of x^2 + 4 x y - y^2 with y >= x - 1: (0, 0), value 0. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct IpoptProblemInfo *IpoptProblem;
typedef bool (*F)(int, double *, bool, double *, void *);
typedef bool (*GradF)(int, double *, bool, double *, void *);
typedef bool (*G)(int, double *, bool, int, double *, void *);
typedef bool (*JacG)(int, double *, bool, int, int, int *, int *, double *, void *);
typedef bool (*H)(int, double *, bool, double, int, double *, bool, int, int *, int *, double *,
                  void *);
typedef bool (*Watch)(int, int, double, double, double, double, double, double, double, double, int,
                      void *);
IpoptProblem CreateIpoptProblem(int, double *, double *, int, double *, double *, int, int, int, F,
                                G, GradF, JacG, H);
void FreeIpoptProblem(IpoptProblem);
bool AddIpoptStrOption(IpoptProblem, char *, char *);
bool AddIpoptNumOption(IpoptProblem, char *, double);
bool AddIpoptIntOption(IpoptProblem, char *, int);
bool SetIpoptProblemScaling(IpoptProblem, double, double *, double *);
bool SetIntermediateCallback(IpoptProblem, Watch);
int IpoptSolve(IpoptProblem, double *, double *, double *, double *, double *, double *, void *);
bool GetIpoptCurrentIterate(IpoptProblem, bool, int, double *, double *, double *, int, double *,
                            double *);
bool GetIpoptCurrentViolations(IpoptProblem, bool, int, double *, double *, double *, double *,
                               double *, int, double *, double *);
void GetIpoptVersion(int *, int *, int *);

/* What a function of type bool may leave in the whole register. */
static long with_garbage(bool value) { return (long)0x7b7b7b00 | (long)value; }
#define CASTED(type, function) ((type)(void (*)(void))(function))

static IpoptProblem problem;
static int stop_at = -1, seen = 0;
static bool fail_structure = false;

static long f(int n, double *v, bool new_v, double *value, void *data) {
  (void)n, (void)new_v, (void)data;
  if (fabs(v[0]) > 4.0) return with_garbage(false); /* undefined there: steps are cut */
  *value = v[0] * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1];
  return with_garbage(true);
}
static bool grad_f(int n, double *v, bool new_v, double *grad, void *data) {
  (void)n, (void)new_v, (void)data;
  grad[0] = 2.0 * v[0] + 4.0 * v[1];
  grad[1] = 4.0 * v[0] - 2.0 * v[1];
  return true;
}
static bool g(int n, double *v, bool new_v, int m, double *values, void *data) {
  (void)n, (void)new_v, (void)m, (void)data;
  values[0] = v[1] - v[0];
  return true;
}
static bool jac_g(int n, double *v, bool new_v, int m, int entries, int *row, int *col,
                  double *values, void *data) {
  (void)n, (void)v, (void)new_v, (void)m, (void)entries, (void)data;
  if (values == NULL) {
    row[0] = row[1] = 1; /* Fortran style */
    col[0] = 1, col[1] = 2;
  } else {
    values[0] = -1.0, values[1] = 1.0;
  }
  return true;
}
static long h(int n, double *v, bool new_v, double sigma, int m, double *lambda, bool new_lambda,
              int entries, int *row, int *col, double *values, void *data) {
  (void)n, (void)v, (void)new_v, (void)m, (void)lambda, (void)new_lambda, (void)entries, (void)data;
  if (values == NULL && fail_structure) return with_garbage(false);
  if (values == NULL) {
    row[0] = col[0] = 1;
    row[1] = 2, col[1] = 1;
    row[2] = col[2] = 2;
  } else {
    values[0] = 2.0 * sigma, values[1] = 4.0 * sigma, values[2] = -2.0 * sigma;
  }
  return with_garbage(true);
}
static long watch(int mode, int iter, double value, double inf_pr, double inf_du, double mu,
                  double d_norm, double shift, double alpha_du, double alpha_pr, int trials,
                  void *data) {
  double v[2], z_L[2], z_U[2], constraints[1], lambda[1], grad_lag[2], violation[1];
  (void)mode, (void)inf_pr, (void)inf_du, (void)mu, (void)d_norm, (void)shift, (void)alpha_du;
  (void)alpha_pr, (void)trials, (void)data;
  if (GetIpoptCurrentIterate(problem, false, 2, v, z_L, z_U, 1, constraints, lambda) &&
      fabs(v[0] * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1] - value) < 1e-9 &&
      GetIpoptCurrentIterate(problem, true, 2, v, z_L, z_U, 1, constraints, lambda) &&
      GetIpoptCurrentViolations(problem, false, 2, NULL, NULL, NULL, NULL, grad_lag, 1, violation,
                                NULL))
    ++seen;
  return with_garbage(iter != stop_at);
}

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      fprintf(stderr, "line %d: %s does not hold\n", __LINE__, #condition); \
      exit(1);                                                              \
    }                                                                       \
  } while (0)

static int solve(double *v) {
  double value;
  v[0] = 3.0, v[1] = 2.5;
  return IpoptSolve(problem, v, NULL, &value, NULL, NULL, NULL, NULL);
}

int main(void) {
  double v_L[] = {-10.0, -10.0}, v_U[] = {10.0, 10.0}, g_L[] = {-1.0}, g_U[] = {2e19};
  double v[2];
  int major = 0, minor = 0, release = -1, iterations;
  problem = CreateIpoptProblem(2, v_L, v_U, 1, g_L, g_U, 2, 3, 1, CASTED(F, f), g, grad_f, jac_g,
                               CASTED(H, h));
  CHECK(problem != NULL);
  GetIpoptVersion(&major, &minor, &release);
  CHECK(major == 3 && minor == 14 && release >= 0);
  CHECK(AddIpoptIntOption(problem, "print_level", 0));
  CHECK(AddIpoptStrOption(problem, "sb", "yes"));
  CHECK(AddIpoptStrOption(problem, "minmax_max_variables", "1"));
  CHECK(SetIntermediateCallback(problem, CASTED(Watch, watch)));
  CHECK(!GetIpoptCurrentIterate(problem, false, 2, v, NULL, NULL, 1, NULL, NULL));

  CHECK(solve(v) == 0);
  CHECK(fabs(v[0]) < 1e-6 && fabs(v[1]) < 1e-6);
  CHECK(seen > 2);
  iterations = seen;

  stop_at = 1, seen = 0;
  CHECK(solve(v) == 5); /* User_Requested_Stop */
  CHECK(seen == 2 && seen < iterations);
  stop_at = -1;

  /* A structure that fails is an error, unless the Hessian is not asked for. */
  fail_structure = true;
  CHECK(solve(v) == -12); /* Invalid_Option, as from Ipopt */
  CHECK(AddIpoptStrOption(problem, "hessian_approximation", "limited-memory"));
  CHECK(solve(v) == 0);
  CHECK(fabs(v[0]) < 1e-6 && fabs(v[1]) < 1e-6);
  FreeIpoptProblem(problem);
  return 0;
}
