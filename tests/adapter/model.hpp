#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <IpTNLP.hpp>

// An Ipopt model that records how it is called and misbehaves on demand.
//
//   v = (x0, y, x1),  f = 2 x0^2 + x1^2 + 3 x0 y - y^2
//   g0: x0 + x1 = 1,  g1: y - x0 <= 4,  x0 >= -10, -5 <= y <= 5
//
// As min over (x0, x1), max over y: y = 3/2 x0, phi = 2 x0^2 + 9/4 x0^2 + (1 - x0)^2, solution
// x0 = 4/21, x1 = 17/21, y = 2/7. Multiplier of g0: -2 x1 = -34/21, of g1: 0.
class Model : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  IndexStyleEnum style = C_STYLE;
  /// Called at the start of every method with its name (see calls); false makes it return false.
  std::function<bool(const std::string&)> on_call = [](const std::string&) { return true; };
  std::function<bool(Index iteration)> on_iteration = [](Index) { return true; };
  StringMetaDataMapType variable_strings, constraint_strings;
  IntegerMetaDataMapType variable_integers, constraint_integers;
  std::vector<Number> start = {1.0, 0.5, 0.0};

  /// What was called, in order. Structure calls and initial values asked for are part of the name.
  std::vector<std::string> calls;
  std::vector<Index> iterations;
  int evaluations = 0;

  struct Final {
    int count = 0;
    Ipopt::SolverReturn status = Ipopt::UNASSIGNED;
    std::vector<Number> x, z_lower, z_upper, g, lambda;
    Number objective = 0.0;
    bool null_internals = false;
    StringMetaDataMapType variable_strings;
  } final;

  [[nodiscard]] long count(const std::string& name) const {
    return std::count(calls.begin(), calls.end(), name);
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 3;
    m = 2;
    nnz_jac_g = 4;
    nnz_h_lag = 4;
    index_style = style;
    return call("get_nlp_info");
  }

  bool get_var_con_metadata(Index, StringMetaDataMapType& var_string_md,
                            IntegerMetaDataMapType& var_integer_md, NumericMetaDataMapType&, Index,
                            StringMetaDataMapType& con_string_md,
                            IntegerMetaDataMapType& con_integer_md,
                            NumericMetaDataMapType&) override {
    var_string_md = variable_strings;
    var_integer_md = variable_integers;
    con_string_md = constraint_strings;
    con_integer_md = constraint_integers;
    return call("get_var_con_metadata");
  }

  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    x_l[0] = -10.0;
    x_u[0] = 1e20;
    x_l[1] = -5.0;
    x_u[1] = 5.0;
    x_l[2] = -1e20;
    x_u[2] = 1e20;
    g_l[0] = g_u[0] = 1.0;
    g_l[1] = -1e20;
    g_u[1] = 4.0;
    return call("get_bounds_info");
  }

  bool get_starting_point(Index, bool init_x, Number* x, bool init_z, Number* z_L, Number* z_U,
                          Index m, bool init_lambda, Number* lambda) override {
    if (init_x) std::copy(start.begin(), start.end(), x);
    if (init_z) std::fill_n(z_L, 3, 1.0);
    if (init_z) std::fill_n(z_U, 3, 1.0);
    if (init_lambda) std::fill_n(lambda, m, 0.0);
    return call("get_starting_point(" + std::to_string(init_x) + std::to_string(init_z) +
                std::to_string(init_lambda) + ")");
  }

  bool eval_f(Index, const Number* x, bool, Number& obj_value) override {
    obj_value = 2.0 * x[0] * x[0] + x[2] * x[2] + 3.0 * x[0] * x[1] - x[1] * x[1];
    ++evaluations;
    return call("eval_f");
  }

  bool eval_grad_f(Index, const Number* x, bool, Number* grad_f) override {
    grad_f[0] = 4.0 * x[0] + 3.0 * x[1];
    grad_f[1] = 3.0 * x[0] - 2.0 * x[1];
    grad_f[2] = 2.0 * x[2];
    return call("eval_grad_f");
  }

  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    g[0] = x[0] + x[2];
    g[1] = x[1] - x[0];
    return call("eval_g");
  }

  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* iRow, Index* jCol,
                  Number* values) override {
    if (values != nullptr) {
      set(values, {1.0, 1.0, 1.0, -1.0});
      return call("eval_jac_g");
    }
    set_indices(iRow, {0, 0, 1, 1});
    set_indices(jCol, {0, 2, 1, 0});
    return call("eval_jac_g structure");
  }

  // The entry (1, 0) is given above the diagonal.
  bool eval_h(Index, const Number*, bool, Number obj_factor, Index, const Number*, bool, Index,
              Index* iRow, Index* jCol, Number* values) override {
    if (values != nullptr) {
      set(values, {4.0 * obj_factor, 3.0 * obj_factor, -2.0 * obj_factor, 2.0 * obj_factor});
      return call("eval_h");
    }
    set_indices(iRow, {0, 0, 1, 2});
    set_indices(jCol, {0, 1, 1, 2});
    return call("eval_h structure");
  }

  void finalize_metadata(Index, const StringMetaDataMapType& var_string_md,
                         const IntegerMetaDataMapType&, const NumericMetaDataMapType&, Index,
                         const StringMetaDataMapType&, const IntegerMetaDataMapType&,
                         const NumericMetaDataMapType&) override {
    final.variable_strings = var_string_md;
    static_cast<void>(call("finalize_metadata"));
  }

  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_L,
                         const Number* z_U, Index m, const Number* g, const Number* lambda,
                         Number obj_value, const Ipopt::IpoptData* ip_data,
                         Ipopt::IpoptCalculatedQuantities* ip_cq) override {
    ++final.count;
    final.status = status;
    final.x.assign(x, x + n);
    final.z_lower.assign(z_L, z_L + n);
    final.z_upper.assign(z_U, z_U + n);
    final.g.assign(g, g + m);
    final.lambda.assign(lambda, lambda + m);
    final.objective = obj_value;
    final.null_internals = ip_data == nullptr && ip_cq == nullptr;
    static_cast<void>(call("finalize_solution"));
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index iter, Number, Number, Number, Number,
                             Number, Number, Number, Number, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    iterations.push_back(iter);
    return call("intermediate_callback") && on_iteration(iter);
  }

 private:
  [[nodiscard]] bool call(const std::string& name) {
    calls.push_back(name);
    return on_call(name);
  }
  static void set(Number* to, std::initializer_list<Number> values) {
    std::copy(values.begin(), values.end(), to);
  }
  void set_indices(Index* to, std::initializer_list<Index> values) const {
    const Index first = style == C_STYLE ? 0 : 1;
    std::transform(values.begin(), values.end(), to, [&](Index i) { return i + first; });
  }
};
