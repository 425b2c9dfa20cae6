#pragma once

#include <IpTNLP.hpp>

// An ordinary Ipopt model of v = (x, y): f = -x^2 + 4 x y - y^2 - 12 y, y - x >= 0.
//
// As min over x, max over y >= x: the inner maximum is at y = max(x, 2 x - 6), so that the outer
// function is 2 x^2 - 12 x for x <= 6. Solution x = y = 3, f = -18, lambda = 6. It is no Nash
// equilibrium: f is concave in x.
class Model : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 2;
    m = 1;
    nnz_jac_g = 2;
    nnz_h_lag = 3;
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index /*n*/, Number* v_l, Number* v_u, Index /*m*/, Number* g_l,
                       Number* g_u) override {
    v_l[0] = v_l[1] = -100.0;
    v_u[0] = v_u[1] = 100.0;
    g_l[0] = 0.0;
    g_u[0] = 1e20;
    return true;
  }

  bool get_starting_point(Index /*n*/, bool /*init_v*/, Number* v, bool /*init_z*/, Number* /*z_l*/,
                          Number* /*z_u*/, Index /*m*/, bool /*init_lambda*/,
                          Number* /*lambda*/) override {
    v[0] = 1.0;
    v[1] = 2.0;
    return true;
  }

  bool eval_f(Index /*n*/, const Number* v, bool /*new_v*/, Number& f) override {
    f = -v[0] * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1] - 12.0 * v[1];
    return true;
  }

  bool eval_grad_f(Index /*n*/, const Number* v, bool /*new_v*/, Number* grad) override {
    grad[0] = -2.0 * v[0] + 4.0 * v[1];
    grad[1] = 4.0 * v[0] - 2.0 * v[1] - 12.0;
    return true;
  }

  bool eval_g(Index /*n*/, const Number* v, bool /*new_v*/, Index /*m*/, Number* g) override {
    g[0] = v[1] - v[0];
    return true;
  }

  bool eval_jac_g(Index /*n*/, const Number* /*v*/, bool /*new_v*/, Index /*m*/, Index /*nnz*/,
                  Index* row, Index* col, Number* values) override {
    if (values == nullptr) {
      row[0] = row[1] = 0;
      col[0] = 0;
      col[1] = 1;
    } else {
      values[0] = -1.0;
      values[1] = 1.0;
    }
    return true;
  }

  bool eval_h(Index /*n*/, const Number* /*v*/, bool /*new_v*/, Number sigma, Index /*m*/,
              const Number* /*lambda*/, bool /*new_lambda*/, Index /*nnz*/, Index* row, Index* col,
              Number* values) override {
    if (values == nullptr) {
      row[0] = col[0] = 0;
      row[1] = 1;
      col[1] = 0;
      row[2] = col[2] = 1;
    } else {
      values[0] = -2.0 * sigma;
      values[1] = 4.0 * sigma;
      values[2] = -2.0 * sigma;
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn /*status*/, Index n, const Number* v,
                         const Number* /*z_l*/, const Number* /*z_u*/, Index /*m*/,
                         const Number* /*g*/, const Number* lambda, Number f,
                         const Ipopt::IpoptData* /*data*/,
                         Ipopt::IpoptCalculatedQuantities* /*cq*/) override {
    if (n == 2) {
      x = v[0];
      y = v[1];
      multiplier = lambda[0];
      objective = f;
    }
  }

  Number x = 0.0, y = 0.0, multiplier = 0.0, objective = 0.0;  // the answer
};
