#pragma once

#include <IpTNLP.hpp>

namespace ipminmax {

/// C callbacks whose user data is a Model, an Ipopt::TNLP.
template <class Model>
struct CCallbacks {
  static Model& model_of(void* user_data) { return *static_cast<Model*>(user_data); }

  static int eval_f(int n, double* x, int new_x, double* f, void* user_data) {
    return model_of(user_data).eval_f(n, x, new_x != 0, *f) ? 1 : 0;
  }
  static int eval_grad_f(int n, double* x, int new_x, double* grad, void* user_data) {
    return model_of(user_data).eval_grad_f(n, x, new_x != 0, grad) ? 1 : 0;
  }
  static int eval_g(int n, double* x, int new_x, int m, double* g, void* user_data) {
    return model_of(user_data).eval_g(n, x, new_x != 0, m, g) ? 1 : 0;
  }
  static int eval_jac_g(int n, double* x, int new_x, int m, int entries, int* row, int* col,
                        double* values, void* user_data) {
    return model_of(user_data).eval_jac_g(n, x, new_x != 0, m, entries, row, col, values) ? 1 : 0;
  }
  static int eval_h(int n, double* x, int new_x, double sigma, int m, double* lambda,
                    int new_lambda, int entries, int* row, int* col, double* values,
                    void* user_data) {
    const bool good = model_of(user_data).eval_h(n, x, new_x != 0, sigma, m, lambda,
                                                 new_lambda != 0, entries, row, col, values);
    return good ? 1 : 0;
  }
  static int intermediate(int mode, int iter, double f, double inf_pr, double inf_du, double mu,
                          double d_norm, double regularization, double alpha_du, double alpha_pr,
                          int trials, void* user_data) {
    const bool goes_on = model_of(user_data).intermediate_callback(
        static_cast<Ipopt::AlgorithmMode>(mode), iter, f, inf_pr, inf_du, mu, d_norm,
        regularization, alpha_du, alpha_pr, trials, nullptr, nullptr);
    return goes_on ? 1 : 0;
  }
};

}  // namespace ipminmax
