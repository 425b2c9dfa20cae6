#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/model/barrier_follower.hpp"
#include "core/model/robust_copies.hpp"
#include "core/problem.hpp"
#include "core/reduction/row_maximum.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// The model with worst cases of robust constraints as constraints on x alone:
///
///     phi_k(x) <= bound of g_r,     phi_k(x) = local max over y of g_r(x, y)  (row_maximum.hpp)
///
/// Rows of the model come first (the first worst case of a robust constraint takes its row), then
/// one for each further worst case. y that f or Max constraints read stays; Max variables that only
/// robust constraints read are fixed, their constraints dropped.
class ReducedRows final : public WorstCaseRows, public BarrierFollower {
 public:
  /// reads_y: n, whether f reads a Max variable. Every robust constraint has a worst case.
  ReducedRows(Problem& model, std::vector<WorstCase> worst_cases, const std::vector<bool>& reads_y,
              const SolverOptions& options, Budget& budget);

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
  [[nodiscard]] bool follow_barrier(double mu) override;

  /// Starts at x of this point of the model, n values, instead of the model's start.
  void start_at(std::vector<double> v) { start_ = std::move(v); }
  /// A result with the y of the worst cases, where they are now, behind its variables, and their
  /// bound multipliers: variable(k, i) in v, z_lower and z_upper.
  [[nodiscard]] Result with_worst_cases(Result result) const;
  // Of a result with worst cases:
  [[nodiscard]] std::vector<double> model_point(std::span<const double> v,
                                                std::size_t k) const override;
  [[nodiscard]] Index row(std::size_t k) const override { return rows_[k]; }
  [[nodiscard]] Index model_variable(Index i) const override { return i; }
  [[nodiscard]] Index model_row(Index j) const override {
    return j < model_rows() ? j : added_rows_[static_cast<std::size_t>(j - model_rows())];
  }
  [[nodiscard]] Index variable(std::size_t k, Index model_variable) const override;
  /// Null: the k-th worst case is that of the model's own y.
  [[nodiscard]] RowMaximum* maximum(std::size_t k) { return maxima_[k].get(); }
  [[nodiscard]] std::size_t size() const { return maxima_.size(); }
  /// Why a worst case could not be followed, last; empty: all could.
  [[nodiscard]] const std::string& failure() const { return failure_; }

 private:
  /// Worst cases that read the same x share a dense block of the Hessian.
  struct Block {
    std::vector<Index> x;
    std::vector<double> values;  ///< lower triangle, by rows
  };
  void drop_unread(const std::vector<bool>& read);
  void add_entries();
  [[nodiscard]] bool move_to(std::span<const double> v);
  [[nodiscard]] Index model_rows() const {
    return static_cast<Index>(model_.structure().constraint_players.size());
  }

  Problem& model_;
  std::vector<double> start_;  ///< empty: the model's
  ProblemStructure structure_;
  std::vector<std::unique_ptr<RowMaximum>> maxima_;
  std::vector<Index> rows_;            ///< of each
  std::vector<Index> added_rows_;      ///< the model's rows that those behind its own stand for
  std::vector<std::size_t> block_of_;  ///< of each
  std::vector<Block> blocks_;
  std::vector<bool> reduced_;                  ///< m: row is that of a worst case
  std::vector<std::size_t> jacobian_entries_;  ///< of the model, that count
  std::vector<double> lambda_, jacobian_, gradient_;
  std::string failure_;
};

}  // namespace ipminmax
