/* Problem 71 of Hock and Schittkowski as a program for Ipopt's C interface, compiled against Ipopt's
 * own header and linked with ipminmax_ipopt in place of ipopt. Also asks which library answers. */
#define _GNU_SOURCE
#include <IpStdCInterface.h>
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Number product(const Number *x, Index without, Index also_without) {
  Number result = 1.0;
  Index i;
  for (i = 0; i < 4; ++i)
    if (i != without && i != also_without) result *= x[i];
  return result;
}

static Bool f(Index n, Number *x, Bool new_x, Number *value, UserDataPtr data) {
  (void)n, (void)new_x, (void)data;
  *value = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
  return TRUE;
}

static Bool grad_f(Index n, Number *x, Bool new_x, Number *grad, UserDataPtr data) {
  (void)n, (void)new_x, (void)data;
  grad[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
  grad[1] = x[0] * x[3];
  grad[2] = x[0] * x[3] + 1.0;
  grad[3] = x[0] * (x[0] + x[1] + x[2]);
  return TRUE;
}

static Bool g(Index n, Number *x, Bool new_x, Index m, Number *values, UserDataPtr data) {
  (void)n, (void)new_x, (void)m, (void)data;
  values[0] = product(x, -1, -1);
  values[1] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3];
  return TRUE;
}

static Bool jac_g(Index n, Number *x, Bool new_x, Index m, Index entries, Index *row, Index *col,
                  Number *values, UserDataPtr data) {
  Index i;
  (void)n, (void)new_x, (void)m, (void)entries, (void)data;
  for (i = 0; i < 4; ++i) {
    if (values == NULL) {
      row[i] = 0, row[4 + i] = 1;
      col[i] = col[4 + i] = i;
    } else {
      values[i] = product(x, i, i);
      values[4 + i] = 2.0 * x[i];
    }
  }
  return TRUE;
}

static Bool h(Index n, Number *x, Bool new_x, Number sigma, Index m, Number *lambda,
              Bool new_lambda, Index entries, Index *row, Index *col, Number *values,
              UserDataPtr data) {
  Index i, j, k = 0;
  (void)n, (void)new_x, (void)m, (void)new_lambda, (void)entries, (void)data;
  for (i = 0; i < 4; ++i) {
    for (j = 0; j <= i; ++j, ++k) {
      if (values == NULL) {
        row[k] = i, col[k] = j;
        continue;
      }
      values[k] = i == j ? 2.0 * lambda[1] : lambda[0] * product(x, i, j);
      if (i == 0) values[k] += sigma * 2.0 * x[3];
      if ((i == 1 || i == 2) && j == 0) values[k] += sigma * x[3];
      if (i == 3 && j == 0) values[k] += sigma * (2.0 * x[0] + x[1] + x[2]);
      if (i == 3 && (j == 1 || j == 2)) values[k] += sigma * x[0];
    }
  }
  return TRUE;
}

static Bool watch(Index mode, Index iter, Number value, Number inf_pr, Number inf_du, Number mu,
                  Number d_norm, Number shift, Number alpha_du, Number alpha_pr, Index trials,
                  UserDataPtr data) {
  (void)mode, (void)value, (void)inf_pr, (void)inf_du, (void)mu, (void)d_norm, (void)shift;
  (void)alpha_du, (void)alpha_pr, (void)trials;
  *(Index *)data = iter;
  return TRUE;
}

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      fprintf(stderr, "line %d: %s does not hold\n", __LINE__, #condition); \
      exit(1);                                                              \
    }                                                                       \
  } while (0)

int main(void) {
  Number x_L[] = {1.0, 1.0, 1.0, 1.0}, x_U[] = {5.0, 5.0, 5.0, 5.0};
  Number g_L[] = {25.0, 40.0}, g_U[] = {2e19, 40.0};
  Number x[] = {1.0, 5.0, 5.0, 1.0}, constraints[2], lambda[2], z_L[4], z_U[4], value = 0.0;
  const Number solution[] = {1.0, 4.74299964, 3.82114998, 1.37940829};
  Index last_iteration = -1, i;
  enum ApplicationReturnStatus status;
  Dl_info library;
  IpoptProblem problem =
      CreateIpoptProblem(4, x_L, x_U, 2, g_L, g_U, 8, 10, 0, f, g, grad_f, jac_g, h);
  CHECK(problem != NULL);
  CHECK(dladdr((void *)(size_t)IpoptSolve, &library) != 0);
  CHECK(strstr(library.dli_fname, "libipminmax_ipopt") != NULL);

  CHECK(AddIpoptNumOption(problem, "tol", 1e-9));
  CHECK(AddIpoptStrOption(problem, "mu_strategy", "adaptive"));
  CHECK(AddIpoptIntOption(problem, "print_level", 0));
  CHECK(AddIpoptStrOption(problem, "sb", "yes"));
  CHECK(!AddIpoptStrOption(problem, "no_such_option", "yes"));
  CHECK(!AddIpoptNumOption(problem, "tol", -1.0));
  CHECK(SetIntermediateCallback(problem, watch));
  status = IpoptSolve(problem, x, constraints, &value, lambda, z_L, z_U, &last_iteration);
  CHECK(status == Solve_Succeeded);
  CHECK(last_iteration > 0);
  CHECK(fabs(value - 17.0140173) < 1e-6);
  for (i = 0; i < 4; ++i) CHECK(fabs(x[i] - solution[i]) < 1e-6);
  CHECK(fabs(constraints[0] - 25.0) < 1e-6 && fabs(constraints[1] - 40.0) < 1e-6);
  CHECK(z_L[0] > 1.0 && z_U[0] >= 0.0 && lambda[0] < 0.0);

  /* Warm, from the multipliers; then maximized, which ends elsewhere. */
  CHECK(AddIpoptStrOption(problem, "warm_start_init_point", "yes"));
  CHECK(AddIpoptNumOption(problem, "mu_init", 1e-7));
  CHECK(IpoptSolve(problem, x, constraints, &value, lambda, z_L, z_U, &last_iteration) ==
        Solve_Succeeded);
  CHECK(fabs(value - 17.0140173) < 1e-6);
  FreeIpoptProblem(problem);
  return 0;
}
