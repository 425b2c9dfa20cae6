#pragma once

#include <algorithm>
#include <span>
#include <stdexcept>
#include <vector>

#include <IpIpoptApplication.hpp>
#include <regression/problem_tnlp.hpp>

#include "game.hpp"

namespace bench {

using ipminmax::testing::IpoptAnswer;

/// Ipopt, silent, for any number of minimizations one after the other.
class IpoptMinimizer {
 public:
  explicit IpoptMinimizer(double tolerance) {
    options().SetIntegerValue("print_level", 0);
    options().SetStringValue("sb", "yes");
    options().SetStringValue("linear_solver", "mumps");
    options().SetNumericValue("tol", tolerance);
    if (application_->Initialize("") != Ipopt::Solve_Succeeded) {
      throw std::runtime_error("Ipopt refuses its options");
    }
  }

  /// For the following minimizations.
  [[nodiscard]] Ipopt::OptionsList& options() { return *application_->Options(); }

  [[nodiscard]] IpoptAnswer minimize(Problem& problem, double seconds) {
    const Ipopt::SmartPtr<ipminmax::testing::ProblemTnlp> model =
        new ipminmax::testing::ProblemTnlp(problem);
    options().SetNumericValue("max_cpu_time", std::max(seconds, 1e-3));
    const Ipopt::ApplicationReturnStatus status = application_->OptimizeTNLP(GetRawPtr(model));
    IpoptAnswer answer = model->answer();
    answer.status = status;
    return answer;
  }

 private:
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application_ = new Ipopt::IpoptApplication(false);
};

inline bool solved_well(const IpoptAnswer& answer) {
  return answer.status == Ipopt::Solve_Succeeded ||
         answer.status == Ipopt::Solved_To_Acceptable_Level;
}

/// Who owns which variable and constraint.
struct Players {
  std::vector<Index> x, y, min_constraints, max_constraints;
  std::vector<Index> place;             ///< of a variable within x or y
  std::vector<Index> constraint_place;  ///< of a constraint within its player's

  explicit Players(const ipminmax::ProblemStructure& s) {
    for (const ipminmax::Player player : s.variable_players) {
      std::vector<Index>& own = player == ipminmax::Player::Min ? x : y;
      own.push_back(static_cast<Index>(place.size()));
      place.push_back(static_cast<Index>(own.size()) - 1);
    }
    for (const ipminmax::Player player : s.constraint_players) {
      std::vector<Index>& own = player == ipminmax::Player::Min ? min_constraints : max_constraints;
      own.push_back(static_cast<Index>(constraint_place.size()));
      constraint_place.push_back(static_cast<Index>(own.size()) - 1);
    }
  }
};

/// The maximization over y at fixed x, as the minimization of -f.
class InnerProblem final : public Problem {
 public:
  /// v: the start of y and the fixed x.
  InnerProblem(Problem& game, const Players& players, std::vector<double> v);

  [[nodiscard]] std::vector<double>& point() { return v_; }
  /// v with the y of an answer.
  [[nodiscard]] std::vector<double> point_with(std::span<const double> y) const;

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override;
  [[nodiscard]] bool objective(std::span<const double> y, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> y, bool, std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> y, bool, std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> y, bool, std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> y, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override;

 private:
  void load(std::span<const double> y);

  Problem& game_;
  const Players& players_;
  ipminmax::ProblemStructure structure_;
  std::vector<std::size_t> jacobian_entries_, hessian_entries_;  ///< of the game
  std::vector<double> v_, trial_, gradient_, constraints_, jacobian_, hessian_, lambda_;
};

}  // namespace bench
