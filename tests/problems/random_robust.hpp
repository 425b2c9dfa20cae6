#pragma once

#include <Eigen/Dense>
#include <random>
#include <span>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// A box [-1, 1]^n, and a ball of radius 1 or half spaces in it.
struct DisturbanceSet {
  Eigen::Index size = 0;
  bool ball = false;
  std::vector<Eigen::VectorXd> normals{};  ///< normal . y <= 1
};

/// c'x + offset + a'y + x'By + y'Dy / 2 + sum over k of amplitude_k sin(frequency_k . y + x_k).
struct RobustRow {
  Eigen::VectorXd c, a, d, amplitudes;
  Eigen::MatrixXd b, frequencies;  ///< a row for each x, and for each wave
  double offset = -1.0;

  [[nodiscard]] double value(const Eigen::VectorXd& x, const Eigen::VectorXd& y) const;
  /// In y; of_x: in x.
  [[nodiscard]] Eigen::VectorXd gradient(const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                                         Eigen::VectorXd& of_x) const;
  /// In (x, y).
  [[nodiscard]] Eigen::MatrixXd hessian(const Eigen::VectorXd& x, const Eigen::VectorXd& y) const;

 private:
  [[nodiscard]] Eigen::VectorXd phases(const Eigen::VectorXd& x, const Eigen::VectorXd& y) const;
};

/// min x'x / 2 - target'x over x in [-3, 3]^n subject to every row <= 0 for every y in the set.
struct RobustProgram {
  DisturbanceSet set;
  Eigen::VectorXd target;
  std::vector<RobustRow> rows;

  /// 1 to 5 x, 1 to `disturbances` y, 1 to 10 rows; a box, a ball or a polyhedron; half of them with waves.
  [[nodiscard]] static RobustProgram random(std::mt19937_64& random,
                                            Eigen::Index disturbances = 20);
  /// The largest value of a row over the set that projected gradient ascents from so many starts
  /// find: a judge that shares nothing with the solver.
  [[nodiscard]] double largest(const RobustRow& row, const Eigen::VectorXd& x, int starts,
                               std::mt19937_64& random) const;
};

/// As a model, from x = 0 and y = 0.
class RobustProgramModel final : public Problem {
 public:
  explicit RobustProgramModel(const RobustProgram& program);
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> g) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> j) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool, std::span<double> h) override;

 private:
  void add_constraint(Player owner, double upper, Eigen::Index first);
  [[nodiscard]] Eigen::VectorXd x(std::span<const double> v) const {
    return Eigen::VectorXd::Map(v.data(), n_);
  }
  [[nodiscard]] Eigen::VectorXd y(std::span<const double> v) const {
    return Eigen::VectorXd::Map(v.data() + n_, m_);
  }

  const RobustProgram& program_;
  Eigen::Index n_, m_;
  ProblemStructure structure_;
};

}  // namespace ipminmax::testing
