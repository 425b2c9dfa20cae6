/* Linked with another version of Ipopt, libipminmax_ipopt preloaded: said, and no crash. */
#include <stddef.h>

typedef void (*Callback)(void);
extern void *CreateIpoptProblem(int n, double *x_L, double *x_U, int m, double *g_L, double *g_U,
                                int nele_jac, int nele_hess, int index_style, Callback eval_f,
                                Callback eval_g, Callback eval_grad_f, Callback eval_jac_g,
                                Callback eval_h);

int main(void) {
  double lower = 0.0, upper = 1.0;
  return CreateIpoptProblem(1, &lower, &upper, 0, NULL, NULL, 0, 1, 0, NULL, NULL, NULL, NULL,
                            NULL) == NULL
             ? 0
             : 1;
}
