#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/model/budget.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/robust/robust_scope.hpp"

namespace ipminmax {

/// The model with copies of y for worst cases of robust constraints:
///
///     x, y, y_1, ..., y_C       g_r(x, y_k) <= 0 with r of worst case k, y_k in Y(x)
///
/// Rows of the model come first (the first worst case of a robust constraint takes its row), then
/// one row for each further worst case and the Max constraints on each copy. Max variables that
/// nothing reads any more are fixed, their constraints dropped.
class RobustCopies final : public Problem {
 public:
  struct WorstCase {
    Index constraint = 0;   ///< robust
    std::vector<double> v;  ///< n; y in it is the start
    bool copied = true;     ///< false: the model's own y; first worst case of its constraint only
    bool held = false;      ///< y stays at v, what follows from it apart: a scenario
    int side = 0;           ///< 1: of the upper bound alone, -1: of the lower one, 0: of both
    [[nodiscard]] bool is_of_same(const WorstCase& other) const {
      return constraint == other.constraint && side * other.side >= 0;
    }
  };
  /// reads_y: n, whether f reads a Max variable. Robust constraints without a worst case
  /// are left out. Where the budget is interrupted it is undefined: one evaluation is many of the
  /// model.
  RobustCopies(Problem& model, std::vector<WorstCase> worst_cases, const std::vector<bool>& reads_y,
               Budget& budget);

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override;
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override;

  /// Starts at x of this point of the model, n values, instead of the model's start.
  void start_at(std::vector<double> v) { start_ = std::move(v); }
  [[nodiscard]] const std::vector<WorstCase>& worst_cases() const { return worst_cases_; }
  /// What the k-th worst case involves.
  [[nodiscard]] const RobustScope& scope(std::size_t k) const { return scopes_[k]; }
  /// The k-th worst case at a result's variables: x with its y, n values.
  [[nodiscard]] std::vector<double> model_point(std::span<const double> v, std::size_t k) const;
  /// Row of the k-th worst case.
  [[nodiscard]] Index row(std::size_t k) const { return parts_[k + 1].row; }
  /// The model's variable and row that a variable and a row of this problem are, or copy.
  [[nodiscard]] Index model_variable(Index i) const {
    return model_variable_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] Index model_row(Index j) const { return model_row_[static_cast<std::size_t>(j)]; }
  /// Variable, of a result, that stands for one of the model in the k-th worst case.
  [[nodiscard]] Index variable(std::size_t k, Index model_variable) const {
    return parts_[k + 1].column[static_cast<std::size_t>(model_variable)];
  }
  /// Whether the row of the k-th worst case holds x where it is: its multiplier exceeds its
  /// distance to the bound.
  [[nodiscard]] bool is_active(const Result& result, std::size_t k) const;

 private:
  /// The model evaluated at one y: its rows that count there and where they and the columns go.
  struct Part {
    std::vector<Index> column;  ///< n: variable of this problem
    std::vector<Index> row_of;  ///< m: row of this problem, -1: does not count here
    std::vector<Index> rows{};  ///< of the model, that count here
    Index row = -1;             ///< of the worst case
    bool with_objective = false;
    std::vector<std::size_t> jacobian, hessian;  ///< entries of the model that count here
    std::vector<Index> serving;  ///< constraints of the model on a y that serves the row
    std::size_t zeros = 0;       ///< entries behind the others
  };
  [[nodiscard]] std::optional<std::size_t> first_of(Index constraint) const;
  void add_base(const std::vector<bool>& reads_y);
  void add_worst_case(std::size_t k);
  [[nodiscard]] Index copy_variable(Index model_variable, std::size_t copy,
                                    const WorstCase& worst_case, bool held);
  [[nodiscard]] Index copy_row(Index model_row, std::size_t copy);
  void drop_unread(const std::vector<bool>& read);
  void serve_rows(const std::vector<bool>& reads_y);
  void hold(const std::vector<Index>& variables, const WorstCase& worst_case);
  void add_entries();
  [[nodiscard]] bool load(std::span<const double> v, const Part& part);
  void load_multipliers(std::span<const double> lambda, const Part& part);

  Problem& model_;
  Budget& budget_;
  std::vector<WorstCase> worst_cases_;
  std::vector<RobustScope> scopes_;  ///< of each worst case
  std::vector<double> start_;        ///< empty: the model's
  ProblemStructure structure_;
  std::vector<Part> parts_;                        ///< the model's own y, then the worst cases
  std::vector<Index> model_variable_, model_row_;  ///< of each variable and row
  std::vector<double> v_, g_, lambda_, jacobian_, hessian_;  ///< in the model's shapes
};

}  // namespace ipminmax
