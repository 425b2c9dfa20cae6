#pragma once

#include <IpTNLP.hpp>

class HS071 : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 4;
    m = 2;
    nnz_jac_g = 8;   // both constraints depend on all variables
    nnz_h_lag = 10;  // lower triangle of a full matrix
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index /*m*/, Number* g_l,
                       Number* g_u) override {
    for (Index i = 0; i < n; ++i) {
      x_l[i] = 1.0;
      x_u[i] = 5.0;
    }
    g_l[0] = 25.0;
    g_u[0] = 2e19;  // no upper bound
    g_l[1] = g_u[1] = 40.0;
    return true;
  }

  bool get_starting_point(Index /*n*/, bool /*init_x*/, Number* x, bool /*init_z*/, Number* /*z_L*/,
                          Number* /*z_U*/, Index /*m*/, bool /*init_lambda*/,
                          Number* /*lambda*/) override {
    x[0] = x[3] = 1.0;
    x[1] = x[2] = 5.0;
    return true;
  }

  bool eval_f(Index /*n*/, const Number* x, bool /*new_x*/, Number& f) override {
    f = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
    return true;
  }

  bool eval_grad_f(Index /*n*/, const Number* x, bool /*new_x*/, Number* grad) override {
    grad[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
    grad[1] = x[0] * x[3];
    grad[2] = x[0] * x[3] + 1.0;
    grad[3] = x[0] * (x[0] + x[1] + x[2]);
    return true;
  }

  bool eval_g(Index n, const Number* x, bool /*new_x*/, Index /*m*/, Number* g) override {
    g[0] = 1.0;
    g[1] = 0.0;
    for (Index i = 0; i < n; ++i) {
      g[0] *= x[i];
      g[1] += x[i] * x[i];
    }
    return true;
  }

  bool eval_jac_g(Index n, const Number* x, bool /*new_x*/, Index m, Index /*nele_jac*/, Index* row,
                  Index* col, Number* values) override {
    for (Index i = 0; i < m; ++i) {
      for (Index j = 0; j < n; ++j) {
        if (values == nullptr) {  // the structure is asked for
          row[i * n + j] = i;
          col[i * n + j] = j;
        } else {
          values[i * n + j] = i == 0 ? product_without(x, j, j) : 2.0 * x[j];
        }
      }
    }
    return true;
  }

  bool eval_h(Index n, const Number* x, bool /*new_x*/, Number sigma, Index /*m*/,
              const Number* lambda, bool /*new_lambda*/, Index /*nele_hess*/, Index* row,
              Index* col, Number* values) override {
    // Second derivatives of f by entry (0,0) (1,0) (1,1) (2,0) ..., zero where f is linear.
    for (Index i = 0, k = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j, ++k) {
        if (values == nullptr) {
          row[k] = i;
          col[k] = j;
          continue;
        }
        values[k] = i == j ? 2.0 * lambda[1] : lambda[0] * product_without(x, i, j);
        if (i == 0) values[k] += sigma * 2.0 * x[3];
        if ((i == 1 || i == 2) && j == 0) values[k] += sigma * x[3];
        if (i == 3 && j == 0) values[k] += sigma * (2.0 * x[0] + x[1] + x[2]);
        if (i == 3 && (j == 1 || j == 2)) values[k] += sigma * x[0];
      }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn /*status*/, Index n, const Number* x,
                         const Number* /*z_L*/, const Number* /*z_U*/, Index /*m*/,
                         const Number* /*g*/, const Number* /*lambda*/, Number /*obj_value*/,
                         const Ipopt::IpoptData* /*ip_data*/,
                         Ipopt::IpoptCalculatedQuantities* /*ip_cq*/) override {
    for (Index i = 0; i < n; ++i) solution[i] = x[i];
  }

  Number solution[4] = {};

 private:
  static Number product_without(const Number* x, Index i, Index j) {
    Number product = 1.0;
    for (Index k = 0; k < 4; ++k) {
      if (k != i && k != j) product *= x[k];
    }
    return product;
  }
};
