// Hock-Schittkowski problem 71, an ordinary minimization, given to Ipopt and to Ipminmax.
//
//   min  x1 x4 (x1 + x2 + x3) + x3
//   s.t. x1 x2 x3 x4 >= 25,  x1^2 + x2^2 + x3^2 + x4^2 = 40,  1 <= x <= 5
//
// Without Max variables Ipminmax is a minimizer: an Ipopt program is ported by changing the type of
// its application, and the answers can be compared line by line.

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <ipminmax/adapter/minmax_application.hpp>

using Ipopt::Index;
using Ipopt::Number;

namespace {

struct Answer {
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  Index iterations = 0;
  Number objective = 0.0;
  std::array<Number, 4> x{}, z_lower{}, z_upper{};
  std::array<Number, 2> lambda{};
};

class HS071 : public Ipopt::TNLP {
 public:
  [[nodiscard]] const Answer& answer() const { return answer_; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 4;
    m = 2;
    nnz_jac_g = 8;
    nnz_h_lag = 10;
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index, Number* g_l,
                       Number* g_u) override {
    std::fill_n(x_l, n, 1.0);
    std::fill_n(x_u, n, 5.0);
    g_l[0] = 25.0;
    g_u[0] = 2e19;
    g_l[1] = g_u[1] = 40.0;
    return true;
  }

  bool get_starting_point(Index, bool, Number* x, bool init_z, Number*, Number*, Index,
                          bool init_lambda, Number*) override {
    if (init_z || init_lambda) return false;
    x[0] = 1.0;
    x[1] = 5.0;
    x[2] = 5.0;
    x[3] = 1.0;
    return true;
  }

  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
    return true;
  }

  bool eval_grad_f(Index, const Number* x, bool, Number* grad) override {
    grad[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
    grad[1] = x[0] * x[3];
    grad[2] = x[0] * x[3] + 1.0;
    grad[3] = x[0] * (x[0] + x[1] + x[2]);
    return true;
  }

  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    g[0] = x[0] * x[1] * x[2] * x[3];
    g[1] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3];
    return true;
  }

  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    if (values == nullptr) {
      for (Index k = 0; k < 8; ++k) {
        rows[k] = k / 4;
        cols[k] = k % 4;
      }
      return true;
    }
    values[0] = x[1] * x[2] * x[3];
    values[1] = x[0] * x[2] * x[3];
    values[2] = x[0] * x[1] * x[3];
    values[3] = x[0] * x[1] * x[2];
    for (Index j = 0; j < 4; ++j) values[4 + j] = 2.0 * x[j];
    return true;
  }

  bool eval_h(Index, const Number* x, bool, Number sigma, Index, const Number* lambda, bool, Index,
              Index* rows, Index* cols, Number* values) override {
    if (values == nullptr) {
      for (Index row = 0, k = 0; row < 4; ++row)
        for (Index col = 0; col <= row; ++col, ++k) {
          rows[k] = row;
          cols[k] = col;
        }
      return true;
    }
    values[0] = sigma * 2.0 * x[3] + lambda[1] * 2.0;
    values[1] = sigma * x[3] + lambda[0] * x[2] * x[3];
    values[2] = lambda[1] * 2.0;
    values[3] = sigma * x[3] + lambda[0] * x[1] * x[3];
    values[4] = lambda[0] * x[0] * x[3];
    values[5] = lambda[1] * 2.0;
    values[6] = sigma * (2.0 * x[0] + x[1] + x[2]) + lambda[0] * x[1] * x[2];
    values[7] = sigma * x[0] + lambda[0] * x[0] * x[2];
    values[8] = sigma * x[0] + lambda[0] * x[0] * x[1];
    values[9] = lambda[1] * 2.0;
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number* z_L,
                         const Number* z_U, Index, const Number*, const Number* lambda,
                         Number obj_value, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    answer_.objective = obj_value;
    std::copy_n(x, 4, answer_.x.begin());
    std::copy_n(z_L, 4, answer_.z_lower.begin());
    std::copy_n(z_U, 4, answer_.z_upper.begin());
    std::copy_n(lambda, 2, answer_.lambda.begin());
  }

 private:
  Answer answer_;
};

Answer solve_with_ipopt() {
  const Ipopt::SmartPtr<HS071> model = new HS071;
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> app = IpoptApplicationFactory();
  app->Options()->SetIntegerValue("print_level", 0);
  app->Options()->SetStringValue("sb", "yes");
  Answer answer;
  answer.status = app->Initialize("");
  if (answer.status != Ipopt::Solve_Succeeded) return answer;
  const auto status = app->OptimizeTNLP(Ipopt::GetRawPtr(model));
  answer = model->answer();
  answer.status = status;
  if (Ipopt::IsValid(app->Statistics())) answer.iterations = app->Statistics()->IterationCount();
  return answer;
}

Answer solve_with_ipminmax() {
  const Ipopt::SmartPtr<HS071> model = new HS071;
  const Ipopt::SmartPtr<ipminmax::MinMaxApplication> app = new ipminmax::MinMaxApplication;
  app->Options()->SetIntegerValue("print_level", 0);
  app->Options()->SetStringValue("sb", "yes");
  Answer answer;
  answer.status = app->Initialize("");
  if (answer.status != Ipopt::Solve_Succeeded) return answer;
  const auto status = app->OptimizeTNLP(Ipopt::GetRawPtr(model));
  answer = model->answer();
  answer.status = status;
  answer.iterations = app->LastResult().iterations;
  return answer;
}

template <std::size_t N>
void print_rows(const char* name, const std::array<Number, N>& a, const std::array<Number, N>& b) {
  for (std::size_t i = 0; i < N; ++i) std::printf("%-9s[%zu] %18.9f %18.9f\n", name, i, a[i], b[i]);
}

int run() {
  const Answer a = solve_with_ipopt();
  const Answer b = solve_with_ipminmax();
  std::printf("Hock-Schittkowski 71 %11s %18s\n", "Ipopt", "Ipminmax");
  std::printf("%-12s %18d %18d\n", "status", static_cast<int>(a.status),
              static_cast<int>(b.status));
  std::printf("%-12s %18d %18d\n", "iterations", a.iterations, b.iterations);
  std::printf("%-12s %18.9f %18.9f\n", "objective", a.objective, b.objective);
  print_rows("x", a.x, b.x);
  print_rows("lambda", a.lambda, b.lambda);
  print_rows("z_lower", a.z_lower, b.z_lower);
  print_rows("z_upper", a.z_upper, b.z_upper);

  const bool agree = a.status == Ipopt::Solve_Succeeded && b.status == Ipopt::Solve_Succeeded &&
                     std::abs(a.objective - b.objective) <= 1e-6 * std::abs(a.objective);
  std::printf("%s\n", agree ? "Both solvers agree." : "The solvers DISAGREE.");
  return agree ? 0 : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hs071: %s\n", error.what());
    return 2;
  }
}
