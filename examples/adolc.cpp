// A model whose formulas ADOL-C records on tapes, which give values, derivatives and sparsity. Debian:
// libadolc-dev; link with -ladolc. A branch on a variable is recorded as it was taken: where it would be taken
// otherwise the functions return a negative number, and the evaluation counts as undefined. With many variables use
// sparse_jac and sparse_hess in place of the dense drivers.
#include <adolc/adolc.h>
#include <adolc/adolc_sparse.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ipminmax/core/solver.hpp>

using ipminmax::Player;
using ipminmax::Triplet;
constexpr int kN = 2, kM = 1;
enum Tape : short { kObjective, kConstraints, kLagrangian };

adouble objective_of(const adouble* v) {
  const adouble s = v[0] * v[0] - 1.0;
  return 0.25 * s * s + 0.05 * v[0] + v[0] * v[1] - v[1] * v[1];
}
adouble constraint_of(const adouble* v) { return v[0] + exp(v[1]); }

/// One tape of the Lagrangian, whose sigma and lambda are parameters, gives every Hessian.
class Taped : public ipminmax::Problem {
 public:
  Taped() {
    s_.variable_players = {Player::Min, Player::Max};
    s_.variable_lower = {-2.0, -2.0};
    s_.variable_upper = {2.0, 2.0};
    s_.constraint_lower = {-1e20};
    s_.constraint_upper = {1.5};
    record();
    unsigned int* rows[kN];  // of each row: how many columns, which
    int how[2] = {0, 0};
    jac_pat(kConstraints, kM, kN, v_, rows, how);
    s_.jacobian = take(rows, kM, kN);
    hess_pat(kLagrangian, kN, v_, rows, 0);
    s_.hessian = take(rows, kN, 0);  // one triangle
    s_.constraint_players = ipminmax::implied_constraint_players(s_);
  }
  const ipminmax::ProblemStructure& structure() const override { return s_; }
  bool starting_point(ipminmax::StartingPoint& start) override {
    start.v[0] = 1.5;
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    return ::function(kObjective, 1, kN, copy(v), &f) >= 0;
  }
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    return ::gradient(kObjective, kN, copy(v), grad.data()) >= 0;
  }
  bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    return ::function(kConstraints, kM, kN, copy(v), g.data()) >= 0;
  }
  bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    double dense[kM][kN], *rows[kM];
    for (int j = 0; j < kM; ++j) rows[j] = dense[j];
    const int status = ::jacobian(kConstraints, kM, kN, copy(v), rows);
    std::ranges::transform(s_.jacobian, values.begin(),
                           [&](const Triplet& entry) { return dense[entry.row][entry.col]; });
    return status >= 0;
  }
  bool hessian(std::span<const double> v, bool, double sigma, std::span<const double> lambda, bool,
               std::span<double> values) override {
    double factors[1 + kM] = {sigma, lambda[0]}, lower[kN][kN], *rows[kN];
    for (int i = 0; i < kN; ++i) rows[i] = lower[i];
    ::set_param_vec(kLagrangian, 1 + kM, factors);
    const int status = ::hessian(kLagrangian, kN, copy(v), rows);
    std::ranges::transform(s_.hessian, values.begin(),
                           [&](const Triplet& entry) { return lower[entry.row][entry.col]; });
    return status >= 0;
  }

 private:
  void record() {
    adouble v[kN];
    double unused = 0.0;
    for (const Tape tape : {kObjective, kConstraints, kLagrangian}) {
      trace_on(tape);
      for (int i = 0; i < kN; ++i) v[i] <<= v_[i];
      if (tape == kObjective) objective_of(v) >>= unused;
      if (tape == kConstraints) constraint_of(v) >>= unused;
      if (tape == kLagrangian) {
        // The numbers of set_param_vec, in the order of these calls: in one expression the compiler
        // may call the second mkparam first.
        const pdouble sigma = mkparam(1.0), lambda = mkparam(1.0);
        sigma* objective_of(v) + lambda* constraint_of(v) >>= unused;
      }
      trace_off();
    }
  }
  /// Entries of the rows left of the diagonal plus width.
  static std::vector<Triplet> take(unsigned int** rows, int count, int width) {
    std::vector<Triplet> entries;
    for (int i = 0; i < count; ++i) {
      for (unsigned int k = 1; k <= rows[i][0]; ++k)
        if (const int j = static_cast<int>(rows[i][k]); j <= i + width) entries.push_back({i, j});
      std::free(rows[i]);
    }
    return entries;
  }
  double* copy(std::span<const double> v) {  // ADOL-C wants pointers to what it does not change
    std::ranges::copy(v, v_);
    return v_;
  }

  ipminmax::ProblemStructure s_;
  double v_[kN] = {1.5, 0.0};
};

int main() {
  Taped problem;
  const ipminmax::Result result = ipminmax::solve(problem, {});
  std::printf("x = %.4f, y = %.4f, f = %.4f: %s\n", result.v[0], result.v[1], result.objective,
              result.message.c_str());
}
