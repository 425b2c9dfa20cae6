/* A minmax problem through the C interface.
 *
 *   min over x in [-10, 10]   max over y >= x   -x^2 + 4 x y - y^2 - 12 y
 *
 * The inner maximum is at y = max(x, 2 x - 6); for x <= 6 the outer function is 2 x^2 - 12 x.
 * Solution x = y = 3, f = -18, multiplier 6. */
#include <ipminmax.h>
#include <stdio.h>

static int eval_f(int n, double *v, int new_v, double *f, void *user_data) {
  (void)n, (void)new_v, (void)user_data;
  *f = -v[0] * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1] - 12.0 * v[1];
  return 1;
}

static int eval_grad_f(int n, double *v, int new_v, double *grad, void *user_data) {
  (void)n, (void)new_v, (void)user_data;
  grad[0] = -2.0 * v[0] + 4.0 * v[1];
  grad[1] = 4.0 * v[0] - 2.0 * v[1] - 12.0;
  return 1;
}

static int eval_g(int n, double *v, int new_v, int m, double *g, void *user_data) {
  (void)n, (void)new_v, (void)m, (void)user_data;
  g[0] = v[1] - v[0];
  return 1;
}

static int eval_jac_g(int n, double *v, int new_v, int m, int nele_jac, int *row, int *col,
                      double *values, void *user_data) {
  (void)n, (void)v, (void)new_v, (void)m, (void)nele_jac, (void)user_data;
  if (values == NULL) {
    row[0] = 0, col[0] = 0;
    row[1] = 0, col[1] = 1;
  } else {
    values[0] = -1.0;
    values[1] = 1.0;
  }
  return 1;
}

static int eval_h(int n, double *v, int new_v, double obj_factor, int m, double *lambda,
                  int new_lambda, int nele_hess, int *row, int *col, double *values,
                  void *user_data) {
  (void)n, (void)v, (void)new_v, (void)m, (void)lambda, (void)new_lambda, (void)nele_hess;
  (void)user_data;
  if (values == NULL) {
    row[0] = 0, col[0] = 0;
    row[1] = 1, col[1] = 0;
    row[2] = 1, col[2] = 1;
  } else {
    values[0] = -2.0 * obj_factor;
    values[1] = 4.0 * obj_factor;
    values[2] = -2.0 * obj_factor;
  }
  return 1;
}

int main(void) {
  const double x_L[] = {-10.0, -1e20}, x_U[] = {10.0, 1e20};
  const double g_L[] = {0.0}, g_U[] = {1e20};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX};
  double v[] = {1.0, 2.0};
  double f = 0.0, lambda[1] = {0.0};
  IpminmaxCertificate certificate;
  IpminmaxStatistics statistics;
  int certified = 0;
  enum IpminmaxReturnStatus status;

  IpminmaxProblem problem = IpminmaxCreate(2, x_L, x_U, 1, g_L, g_U, 2, 3, IPMINMAX_C_STYLE, eval_f,
                                           eval_g, eval_grad_f, eval_jac_g, eval_h, players, NULL);
  if (problem == NULL) {
    fprintf(stderr, "%s\n", IpminmaxMessage(NULL));
    return 1;
  }
  if (!IpminmaxAddNumOption(problem, "tol", 1e-9) ||
      !IpminmaxAddIntOption(problem, "print_level", 0)) {
    fprintf(stderr, "%s\n", IpminmaxMessage(problem));
    IpminmaxFree(problem);
    return 1;
  }

  status = IpminmaxSolve(problem, v, NULL, &f, lambda, NULL, NULL, NULL);
  printf("Ipminmax %s: %s\n", IpminmaxVersion(), IpminmaxMessage(problem));
  if (IpminmaxGetCertificate(problem, &certificate) &&
      IpminmaxGetStatistics(problem, &statistics)) {
    certified = certificate.point_kind == IPMINMAX_LOCAL_MINMAX;
    printf("x = %.6f, y = %.6f, f = %.6f, lambda = %.6f\n", v[0], v[1], f, lambda[0]);
    printf("inner inertia (%d, %d, %d), expected (%d, %d, %d)\n", certificate.inner.positive,
           certificate.inner.negative, certificate.inner.zero, certificate.inner_expected.positive,
           certificate.inner_expected.negative, certificate.inner_expected.zero);
    printf("full inertia (%d, %d, %d), expected (%d, %d, %d)\n", certificate.full.positive,
           certificate.full.negative, certificate.full.zero, certificate.full_expected.positive,
           certificate.full_expected.negative, certificate.full_expected.zero);
    printf("%s after %d iterations\n", certified ? "certified local minmax" : "not certified",
           statistics.iterations);
  }
  IpminmaxFree(problem);
  return status == IPMINMAX_SOLVE_SUCCEEDED && certified ? 0 : 1;
}
