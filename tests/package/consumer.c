/* A user's C program built against the installed package; exits nonzero when the answer is wrong. */
#include <ipminmax.h>
#include <ipminmax/adapter/ipminmax.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>

/* min over x, max over y: x^2 + 3 x y - y^2 - x, solution x = 2/13, y = 3/13. */
static int eval_f(int n, double *v, int new_v, double *f, void *user_data) {
  (void)n, (void)new_v, (void)user_data;
  *f = v[0] * v[0] + 3.0 * v[0] * v[1] - v[1] * v[1] - v[0];
  return 1;
}

static int eval_grad_f(int n, double *v, int new_v, double *grad, void *user_data) {
  (void)n, (void)new_v, (void)user_data;
  grad[0] = 2.0 * v[0] + 3.0 * v[1] - 1.0;
  grad[1] = 3.0 * v[0] - 2.0 * v[1];
  return 1;
}

static int eval_h(int n, double *v, int new_v, double obj_factor, int m, double *lambda,
                  int new_lambda, int nele_hess, int *row, int *col, double *values,
                  void *user_data) {
  (void)n, (void)v, (void)new_v, (void)m, (void)lambda, (void)new_lambda, (void)nele_hess;
  (void)user_data;
  if (values == NULL) {
    row[0] = col[0] = 0;
    row[1] = 1, col[1] = 0;
    row[2] = col[2] = 1;
  } else {
    values[0] = 2.0 * obj_factor;
    values[1] = 3.0 * obj_factor;
    values[2] = -2.0 * obj_factor;
  }
  return 1;
}

/* IpminmaxStatistics as an earlier version had it, shorter; and what stands behind it. */
struct OldStatistics {
  int iterations, factorizations, behind;
};

static int fills_old_structures(IpminmaxProblem problem) {
  IpminmaxStatistics all;
  struct OldStatistics old = {0, 0, -7};
  int (*by_symbol)(IpminmaxProblem, IpminmaxStatistics *) = IpminmaxGetStatistics;
  return IpminmaxGetStatistics(problem, &all) && all.iterations > 0 &&
         IpminmaxGetStatisticsSized(problem, (IpminmaxStatistics *)(void *)&old,
                                    offsetof(struct OldStatistics, behind)) &&
         old.iterations == all.iterations && old.factorizations == all.factorizations &&
         old.behind == -7 && by_symbol(problem, &all);
}

int main(void) {
  const double lower[] = {-1e20, -1e20}, upper[] = {1e20, 1e20};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX};
  double v[] = {1.0, 1.0};
  IpminmaxCertificate certificate;
  int right = 0;
  IpminmaxProblem problem = IpminmaxCreate(2, lower, upper, 0, NULL, NULL, 0, 3, IPMINMAX_C_STYLE,
                                           eval_f, NULL, eval_grad_f, NULL, eval_h, players, NULL);
  if (problem == NULL) {
    puts(IpminmaxMessage(NULL));
    return 1;
  }
  right =
      IpminmaxAddIntOption(problem, "print_level", 0) &&
      IpminmaxSolve(problem, v, NULL, NULL, NULL, NULL, NULL, NULL) == IPMINMAX_SOLVE_SUCCEEDED &&
      IpminmaxGetCertificate(problem, &certificate) && fills_old_structures(problem) &&
      certificate.point_kind == IPMINMAX_LOCAL_MINMAX && fabs(v[0] - 2.0 / 13.0) < 1e-6 &&
      fabs(v[1] - 3.0 / 13.0) < 1e-6;
  printf("C: x = %.6f, y = %.6f, %s: %s\n", v[0], v[1], right ? "right" : "WRONG ANSWER",
         IpminmaxMessage(problem));
  IpminmaxFree(problem);
  return right ? 0 : 1;
}
