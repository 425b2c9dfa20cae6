// An existing Ipopt model, unchanged, split between two players from outside.
//
// LineFit below knows nothing of minmax: it fits a line to points whose abscissae t_i are only
// known up to errors delta_i with |delta| <= rho,
//
//   f(a, b, delta) = sum_i (a + b (t_i + delta_i) - s_i)^2.
//
// Ipopt minimizes over all of it: the errors are chosen to please the line. SplitTNLP hands the
// errors to a maximizer instead: the line with the best worst case, where the errors are chosen to
// hurt it. The inner problem maximizes a convex function, so it is not concave, yet here its answer
// is known, max over delta = (|r| + rho |b|)^2 with r_i = a + b t_i - s_i, and checks the solver's.

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <ipminmax/adapter/minmax_application.hpp>
#include <ipminmax/adapter/minmax_tnlp.hpp>
#include <vector>

using Ipopt::Index;
using Ipopt::Number;

// ---- Somebody else's model ----------------------------------------------------------------------

namespace {

constexpr Index kPoints = 8;
constexpr std::array<Number, kPoints> kAbscissae = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
constexpr std::array<Number, kPoints> kOrdinates = {1.3, 2.4, 5.8, 6.1, 9.7, 10.2, 13.9, 14.6};
constexpr Number kRho = 0.5;

/// Variables: a, b, delta_0, ..., delta_7. One constraint: |delta|^2 <= rho^2.
class LineFit : public Ipopt::TNLP {
 public:
  [[nodiscard]] const std::vector<Number>& solution() const { return solution_; }
  [[nodiscard]] Number objective() const { return objective_; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 2 + kPoints;
    m = 1;
    nnz_jac_g = kPoints;
    nnz_h_lag = 3 + 3 * kPoints;
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index, Number* g_l,
                       Number* g_u) override {
    std::fill_n(x_l, n, -2e19);
    std::fill_n(x_u, n, 2e19);
    g_l[0] = -2e19;
    g_u[0] = kRho * kRho;
    return true;
  }

  bool get_starting_point(Index, bool, Number* x, bool init_z, Number*, Number*, Index,
                          bool init_lambda, Number*) override {
    if (init_z || init_lambda) return false;
    x[0] = 0.0;
    x[1] = 1.0;
    for (Index i = 0; i < kPoints; ++i) x[2 + i] = i % 2 == 0 ? 0.1 : -0.1;
    return true;
  }

  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = 0.0;
    for (Index i = 0; i < kPoints; ++i) f += residual(x, i) * residual(x, i);
    return true;
  }

  bool eval_grad_f(Index, const Number* x, bool, Number* grad) override {
    grad[0] = grad[1] = 0.0;
    for (Index i = 0; i < kPoints; ++i) {
      const Number r = residual(x, i);
      grad[0] += 2.0 * r;
      grad[1] += 2.0 * r * abscissa(x, i);
      grad[2 + i] = 2.0 * r * x[1];
    }
    return true;
  }

  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    g[0] = 0.0;
    for (Index i = 0; i < kPoints; ++i) g[0] += x[2 + i] * x[2 + i];
    return true;
  }

  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    for (Index i = 0; i < kPoints; ++i) {
      if (values == nullptr) {
        rows[i] = 0;
        cols[i] = 2 + i;
      } else {
        values[i] = 2.0 * x[2 + i];
      }
    }
    return true;
  }

  bool eval_h(Index, const Number* x, bool, Number sigma, Index, const Number* lambda, bool, Index,
              Index* rows, Index* cols, Number* values) override {
    if (values == nullptr) {
      const std::array<Index, 3> line_rows = {0, 1, 1}, line_cols = {0, 0, 1};
      std::copy(line_rows.begin(), line_rows.end(), rows);
      std::copy(line_cols.begin(), line_cols.end(), cols);
      for (Index i = 0; i < kPoints; ++i) {
        for (Index j = 0; j < 3; ++j) rows[3 + 3 * i + j] = 2 + i;
        cols[3 + 3 * i] = 0;
        cols[4 + 3 * i] = 1;
        cols[5 + 3 * i] = 2 + i;
      }
      return true;
    }
    values[0] = sigma * 2.0 * kPoints;
    values[1] = values[2] = 0.0;
    for (Index i = 0; i < kPoints; ++i) {
      const Number t = abscissa(x, i);
      values[1] += sigma * 2.0 * t;
      values[2] += sigma * 2.0 * t * t;
      values[3 + 3 * i] = sigma * 2.0 * x[1];
      values[4 + 3 * i] = sigma * 2.0 * (x[1] * t + residual(x, i));
      values[5 + 3 * i] = sigma * 2.0 * x[1] * x[1] + 2.0 * lambda[0];
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*,
                         const Number*, Index, const Number*, const Number*, Number obj_value,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    solution_.assign(x, x + n);
    objective_ = obj_value;
  }

 private:
  static Number abscissa(const Number* x, Index i) {
    return kAbscissae[static_cast<std::size_t>(i)] + x[2 + i];
  }
  static Number residual(const Number* x, Index i) {
    return x[0] + x[1] * abscissa(x, i) - kOrdinates[static_cast<std::size_t>(i)];
  }

  std::vector<Number> solution_;
  Number objective_ = 0.0;
};

// ---- Our use of it ------------------------------------------------------------------------------

/// What the worst admissible errors make of a line: (|r| + rho |b|)^2.
Number worst_case(Number a, Number b) {
  Number r2 = 0.0;
  for (std::size_t i = 0; i < kAbscissae.size(); ++i) {
    const Number r = a + b * kAbscissae[i] - kOrdinates[i];
    r2 += r * r;
  }
  const Number root = std::sqrt(r2) + kRho * std::abs(b);
  return root * root;
}

void print_inertia(const char* name, const ipminmax::Inertia& found,
                   const ipminmax::Inertia& expected) {
  std::printf("  %-5s found (%d+, %d-, %d zero), expected (%d+, %d-, %d zero)\n", name,
              found.positive, found.negative, found.zero, expected.positive, expected.negative,
              expected.zero);
}

int run() {
  const Ipopt::SmartPtr<LineFit> model = new LineFit;

  const Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt = IpoptApplicationFactory();
  ipopt->Options()->SetIntegerValue("print_level", 0);
  ipopt->Options()->SetStringValue("sb", "yes");
  if (ipopt->Initialize("") != Ipopt::Solve_Succeeded ||
      ipopt->OptimizeTNLP(Ipopt::GetRawPtr(model)) != Ipopt::Solve_Succeeded) {
    std::printf("Ipopt failed.\n");
    return 1;
  }
  const Number pleased_a = model->solution()[0], pleased_b = model->solution()[1];
  const Number pleased = model->objective();

  // Variables 2, ..., 9 go to the maximizer; the constraint reads them, so it goes with them.
  std::vector<Index> errors(kPoints);
  for (Index i = 0; i < kPoints; ++i) errors[static_cast<std::size_t>(i)] = 2 + i;
  const Ipopt::SmartPtr<ipminmax::SplitTNLP> split =
      new ipminmax::SplitTNLP(Ipopt::GetRawPtr(model), errors);

  const Ipopt::SmartPtr<ipminmax::MinMaxApplication> app = new ipminmax::MinMaxApplication;
  app->Options()->SetIntegerValue("print_level", 0);
  app->Options()->SetStringValue("sb", "yes");
  if (app->Initialize("") != Ipopt::Solve_Succeeded) return 1;
  const auto status = app->OptimizeTNLP(Ipopt::GetRawPtr(split));
  const ipminmax::Result& result = app->LastResult();
  const Number a = model->solution()[0], b = model->solution()[1];

  std::printf("%-34s %10s %10s %14s %14s\n", "line a + b t", "a", "b", "f at solution",
              "worst case");
  std::printf("%-34s %10.6f %10.6f %14.6f %14.6f\n", "Ipopt, errors please the line", pleased_a,
              pleased_b, pleased, worst_case(pleased_a, pleased_b));
  std::printf("%-34s %10.6f %10.6f %14.6f %14.6f\n", "Ipminmax, errors hurt the line", a, b,
              model->objective(), worst_case(a, b));
  std::printf("\nworst errors:");
  for (Index i = 0; i < kPoints; ++i)
    std::printf(" %.4f", model->solution()[static_cast<std::size_t>(2 + i)]);

  const ipminmax::Certificate& certificate = result.certificate;
  const std::string_view outcome = name_of(result.status), kind = name_of(certificate.kind);
  std::printf("\nstatus: %.*s, %d iterations; the point: %.*s\n", static_cast<int>(outcome.size()),
              outcome.data(), result.iterations, static_cast<int>(kind.size()), kind.data());
  print_inertia("K_yy", certificate.inner, certificate.inner_expected);
  print_inertia("K", certificate.full, certificate.full_expected);
  std::printf("  curvature margin %.3g, LICQ for Min %s, for Max %s\n", certificate.margin,
              certificate.licq_min ? "yes" : "no", certificate.licq_max ? "yes" : "no");

  const bool right = status == Ipopt::Solve_Succeeded &&
                     certificate.kind == ipminmax::PointKind::LocalMinmax &&
                     std::abs(model->objective() - worst_case(a, b)) <= 1e-5 * worst_case(a, b);
  std::printf("%s\n", right ? "The value equals the worst case in closed form."
                            : "The value is NOT the worst case in closed form.");
  return right ? 0 : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "split_existing_model: %s\n", error.what());
    return 2;
  }
}
