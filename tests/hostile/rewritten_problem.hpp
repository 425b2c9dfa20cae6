#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <support/dice.hpp>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// The same model written in another way: variables u with v = a u + b, rows and objective changed
/// in value but not in meaning.
struct Rewriting {
  struct Variable {
    Player player;
    double lower, upper, start;
  };
  /// factor h + shift, where h is the source or, with a sign, exp(sign (source - origin)).
  struct Row {
    Eigen::Index source;  ///< of the model: row, or its number of rows + variable
    Player owner;
    double lower, upper;
    double factor = 1.0, shift = 0.0;
    double sign = 0.0, origin = 0.0;  ///< sign 0: no exponential
    bool is_redundant = false;
  };
  std::vector<Variable> variables;
  std::vector<Row> rows;
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  double f_factor = 1.0, f_shift = 0.0;
  Eigen::Index model_rows = 0;

  [[nodiscard]] static Rewriting unchanged(Problem& model);
  [[nodiscard]] Eigen::VectorXd original(const std::vector<double>& u) const {
    return a * Eigen::VectorXd::Map(u.data(), std::ssize(u)) + b;
  }
  /// How much the model's variable i changes with u.
  [[nodiscard]] double unit(Eigen::Index i) const { return a.row(i).norm(); }
};

/// The rewritten model; the original must outlive it.
class RewrittenProblem final : public Problem {
 public:
  RewrittenProblem(Problem& model, Rewriting rewriting);

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool objective(std::span<const double> u, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> u, bool, std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> u, bool, std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> u, bool, std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> u, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override;

 private:
  [[nodiscard]] bool see(std::span<const double> u, bool derivatives);
  [[nodiscard]] double slope(const Rewriting::Row& row) const;

  Problem& model_;
  Rewriting r_;
  ProblemStructure structure_;
  Eigen::VectorXd v_, sources_;      ///< values of all rows and variables of the model
  Eigen::MatrixXd source_jacobian_;  ///< in u
};

/// A rewriting that is drawn at random. It says what it did; nothing: the model has no place for it.
struct Transformation {
  std::string name;
  std::optional<std::string> (*apply)(Rewriting&, Dice&);
  enum class Kind { Other, Units, Saddle, Wide };
  Kind kind = Kind::Other;  ///< Saddle, Wide: of models for which it leaves the answer as it is
};
/// In the order in which several are applied.
[[nodiscard]] const std::vector<Transformation>& transformations();

}  // namespace ipminmax::testing
