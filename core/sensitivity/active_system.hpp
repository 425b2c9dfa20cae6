#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/kkt/block.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/options.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// What holds a variable or constraint.
enum class Hold : std::uint8_t {
  Free,   ///< nothing: a free variable, an inactive or absent constraint
  Lower,  ///< its lower bound
  Upper,
  Fixed  ///< equal bounds; a variable held from outside
};

/// Per place: the variables, then the constraints, n + m.
using ActiveSet = std::vector<Hold>;

/// The equations of a solution with a given active set, linearized, over all variables and
/// constraints (v, lambda):
///
///     | W  J' |   with the rows and columns of held variables and of inactive constraints
///     | J  0  |   replaced by those of +-1, so that one pattern serves all active sets.
///
/// The +-1 have the signs that the rows have in K's expected inertia (n_x + m_y, n_y + m_x, 0),
/// which is therefore the expected one of every such matrix. Rows and columns are scaled.
class ActiveSystem {
 public:
  /// signs: of the places. entries: of W and J, by places. Analyzes at the first factorize.
  ActiveSystem(std::size_t variables, std::vector<std::int8_t> signs, std::vector<Triplet> entries,
               const SolverOptions& options)
      : n_(variables),
        signs_(std::move(signs)),
        entries_(std::move(entries)),
        derivatives_(static_cast<Index>(signs_.size()), entries_),
        matrix_(derivatives_),
        solver_(make_symmetric_solver(options.linear_solver, solver_options(options))) {
    for (const std::int8_t sign : signs_) ++(sign > 0 ? expected_.positive : expected_.negative);
  }

  [[nodiscard]] bool fits(const std::vector<std::int8_t>& signs,
                          const std::vector<Triplet>& entries) const {
    return signs == signs_ && entries == entries_;
  }

  /// Values of the entries at a solution. scale: factors of rows and columns, per place.
  void set_values(std::span<const double> values, std::vector<double> scale) {
    derivatives_.set_zero();
    for (const auto k : indices(values)) {
      derivatives_.values()[at(derivatives_.triplet_positions()[k])] += values[k];
    }
    scale_ = std::move(scale);
    active_.clear();
  }

  /// Factors for the active set; those of the last call are kept where nothing has changed.
  /// Returns an empty text, or why there are none.
  [[nodiscard]] const std::string& factorize(const ActiveSet& active) {
    if (active == active_) return error_;
    active_ = active;
    if (!is_analyzed_) {
      ++analyses_;
      is_analyzed_ = solver_->analyze(matrix_, signs_).ok;
      if (!is_analyzed_) return error_ = "out of memory";
    }
    matrix_.for_each_entry([&](Index row, Index col, Index p) {
      const std::size_t i = at(row), j = at(col);
      const double value = scale_[i] * derivatives_.values()[at(p)] * scale_[j];
      matrix_.values()[at(p)] = counts(i) && counts(j) ? value : i == j ? signs_[i] : 0.0;
    });
    solver_->reset_quality();
    bool pivoted = false;
    do {
      error_ = factorize_values(pivoted);
    } while (!error_.empty() && !pivoted && solver_->increase_quality());
    return error_;
  }

  /// change: of held variables and of the values of active constraints, else zero. Returns in
  /// solution the change of v and lambda with which the gradient of the Lagrangian stays zero in
  /// the free variables, and in product the change of this gradient and of the constraints' values.
  /// False: no accurate solution.
  [[nodiscard]] bool solve(const std::vector<double>& change, std::vector<double>& solution,
                           std::vector<double>& product) {
    solution = change;
    std::fill(solution.begin() + static_cast<std::ptrdiff_t>(n_), solution.end(), 0.0);
    product.resize(change.size());
    derivatives_.multiply(solution, product);
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(static_cast<Index>(change.size()));
    const auto each = [&](auto use) {
      for (const auto k : indices(change)) {
        if (counts(k)) use(k, rhs[static_cast<Index>(k)]);
      }
    };
    each([&](std::size_t k, double& value) {
      value = scale_[k] * ((k < n_ ? 0.0 : change[k]) - product[k]);
    });
    if (!solve_refined(rhs)) return false;
    each([&](std::size_t k, double value) { solution[k] = scale_[k] * value; });
    derivatives_.multiply(solution, product);
    return true;
  }

  [[nodiscard]] Index factorizations() const { return factorizations_; }
  [[nodiscard]] Index analyses() const { return analyses_; }

 private:
  /// Whether a row is one of W or J.
  [[nodiscard]] bool counts(std::size_t place) const {
    return (active_[place] == Hold::Free) == (place < n_);
  }

  [[nodiscard]] std::string factorize_values(bool& pivoted) {
    ++factorizations_;
    const Factorization found = solver_->factorize(matrix_);
    pivoted = found.trust.pivoted;
    if (found.status == FactorizationStatus::OutOfMemory) return "out of memory";
    if (found.status != FactorizationStatus::Ok)
      return "the KKT matrix is singular: dependent active constraints or a flat direction";
    return found.inertia == expected_ ? ""
                                      : "the KKT matrix has the wrong inertia: no local minmax";
  }

  /// In place.
  [[nodiscard]] bool solve_refined(Eigen::VectorXd& x) {
    const Eigen::VectorXd rhs = x;
    const auto entries = [](Eigen::VectorXd& v) {
      return std::span(v.data(), static_cast<std::size_t>(v.size()));
    };
    for (bool pivoted = false;;) {
      Eigen::VectorXd residual = rhs, product = rhs;
      x.setZero();
      double left = max_norm(rhs), size = 0.0;
      constexpr int kMostRefinements = 10;
      for (int step = 0; step < kMostRefinements && left > parameters::kRounding * size; ++step) {
        solver_->solve_in_place(entries(residual));
        x += residual;
        matrix_.multiply(entries(x), entries(product));
        residual = rhs - product;
        size = max_norm(rhs) + matrix_.max_norm() * max_norm(x);
        const double last = std::exchange(left, max_norm(residual));
        if (!(left < 0.5 * last)) break;
      }
      if (left <= parameters::kZero * size) return true;
      if (!solver_->increase_quality() || !factorize_values(pivoted).empty()) return false;
    }
  }

  std::size_t n_;
  std::vector<std::int8_t> signs_;
  std::vector<Triplet> entries_;
  SymmetricMatrix derivatives_;  ///< W and J
  SymmetricMatrix matrix_;       ///< that is factorized
  Inertia expected_;
  std::unique_ptr<SymmetricSolver> solver_;
  std::vector<double> scale_;
  ActiveSet active_;  ///< factorized
  std::string error_;
  bool is_analyzed_ = false;
  Index factorizations_ = 0, analyses_ = 0;
};

}  // namespace ipminmax
