#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <support/dense_algorithm_one.hpp>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// A problem in the paper's form: every bound and inequality is a component of F_x or F_y with a
/// slack, every equality one of G_x or G_y.
class PaperForm {
 public:
  explicit PaperForm(Problem& problem) : problem_(problem) {
    const ProblemStructure& shape = problem.structure();
    for (std::size_t i = 0; i < shape.variable_players.size(); ++i) {
      Side& side = side_of(shape.variable_players[i]);
      side.variables.push_back(i);
      add_inequalities(side, true, i, shape.variable_lower[i], shape.variable_upper[i]);
    }
    for (std::size_t j = 0; j < shape.constraint_lower.size(); ++j) {
      Side& side = side_of(shape.constraint_players[j]);
      const double lower = shape.constraint_lower[j], upper = shape.constraint_upper[j];
      if (lower == upper) {
        side.equalities.push_back({false, j, 1.0, lower});
      } else {
        add_inequalities(side, false, j, lower, upper);
      }
    }
  }

  /// s = max(-F, push max(1, |bound|)), lambda = b / s, nu = 0.
  [[nodiscard]] PaperPoint start(const std::vector<double>& v, double b, double push) const {
    const Values now = evaluate(v, std::vector<double>(constraints(), 0.0));
    PaperPoint z;
    const auto fill = [&](const Side& side, Eigen::VectorXd& x, Eigen::VectorXd& s,
                          Eigen::VectorXd& nu, Eigen::VectorXd& lambda) {
      x.resize(size(side.variables));
      for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = v[side.variables[at(i)]];
      s.resize(size(side.inequalities));
      for (Eigen::Index k = 0; k < s.size(); ++k) {
        const Row& row = side.inequalities[at(k)];
        const double least = row.is_variable ? 0.0 : push * std::max(1.0, std::abs(row.bound));
        s[k] = std::max(-row.sign * (value(now, row) - row.bound), least);
      }
      nu.setZero(size(side.equalities));
      lambda = b * s.cwiseInverse();
    };
    fill(min_, z.x, z.sx, z.nu_x, z.lambda_x);
    fill(max_, z.y, z.sy, z.nu_y, z.lambda_y);
    return z;
  }

  /// The point in the problem's variables.
  [[nodiscard]] std::vector<double> v(const PaperPoint& z) const {
    std::vector<double> v(problem_.structure().variable_players.size());
    for (Eigen::Index i = 0; i < z.x.size(); ++i) v[min_.variables[at(i)]] = z.x[i];
    for (Eigen::Index i = 0; i < z.y.size(); ++i) v[max_.variables[at(i)]] = z.y[i];
    return v;
  }
  /// Coefficients of the constraints in L, which is grad f + J'lambda's lambda.
  [[nodiscard]] std::vector<double> lambda(const PaperPoint& z) const {
    std::vector<double> lambda(constraints(), 0.0);
    const auto add = [&](const Side& side, const Eigen::VectorXd& nu, const Eigen::VectorXd& l,
                         double owner) {
      for (Eigen::Index k = 0; k < nu.size(); ++k) lambda[side.equalities[at(k)].index] += nu[k];
      for (Eigen::Index k = 0; k < l.size(); ++k) {
        const Row& row = side.inequalities[at(k)];
        if (!row.is_variable) lambda[row.index] += owner * row.sign * l[k];
      }
    };
    add(min_, z.nu_x, z.lambda_x, 1.0);
    add(max_, z.nu_y, z.lambda_y, -1.0);
    return lambda;
  }
  /// Multipliers of the bounds of variables with the signs of Result.
  void bound_multipliers(const PaperPoint& z, std::vector<double>& lower,
                         std::vector<double>& upper) const {
    lower.assign(problem_.structure().variable_players.size(), 0.0);
    upper = lower;
    const auto add = [&](const Side& side, const Eigen::VectorXd& l, double owner) {
      for (Eigen::Index k = 0; k < l.size(); ++k) {
        const Row& row = side.inequalities[at(k)];
        if (row.is_variable) (row.sign < 0.0 ? lower : upper)[row.index] = owner * l[k];
      }
    };
    add(min_, z.lambda_x, 1.0);
    add(max_, z.lambda_y, -1.0);
  }

  /// Bounds of variables, which the paper counts with the inequalities: each adds one positive and
  /// one negative eigenvalue.
  [[nodiscard]] Eigen::Index bounds(Player player) const {
    const Side& side = player == Player::Min ? min_ : max_;
    return std::ranges::count_if(side.inequalities, [](const Row& row) { return row.is_variable; });
  }

  [[nodiscard]] PaperFunctions functions() const {
    return [this](const PaperPoint& z) { return derivatives(z); };
  }

  [[nodiscard]] PaperDerivatives derivatives(const PaperPoint& z) const {
    const Values now = evaluate(v(z), lambda(z));
    PaperDerivatives d;
    d.fx = pick(now.gradient, min_);
    d.fy = pick(now.gradient, max_);
    d.gx = residuals(now, min_.equalities);
    d.hx = residuals(now, min_.inequalities);
    d.gy = residuals(now, max_.equalities);
    d.hy = residuals(now, max_.inequalities);
    d.gx_x = jacobian(now, min_.equalities, min_);
    d.hx_x = jacobian(now, min_.inequalities, min_);
    d.gy_x = jacobian(now, max_.equalities, min_);
    d.gy_y = jacobian(now, max_.equalities, max_);
    d.hy_x = jacobian(now, max_.inequalities, min_);
    d.hy_y = jacobian(now, max_.inequalities, max_);
    d.xx = block(now.hessian, min_, min_);
    d.xy = block(now.hessian, min_, max_);
    d.yy = block(now.hessian, max_, max_);
    return d;
  }

 private:
  /// sign (value - bound) <= 0, or = 0.
  struct Row {
    bool is_variable = false;
    std::size_t index = 0;
    double sign = 1.0;
    double bound = 0.0;
  };
  struct Side {
    std::vector<std::size_t> variables;
    std::vector<Row> equalities, inequalities;
  };
  struct Values {
    std::vector<double> v, g;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd jacobian, hessian;
  };

  static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }
  template <class T>
  static Eigen::Index size(const std::vector<T>& list) {
    return static_cast<Eigen::Index>(list.size());
  }
  [[nodiscard]] std::size_t constraints() const {
    return problem_.structure().constraint_lower.size();
  }
  Side& side_of(Player player) { return player == Player::Min ? min_ : max_; }
  static void add_inequalities(Side& side, bool is_variable, std::size_t index, double lower,
                               double upper) {
    if (lower > -1e19) side.inequalities.push_back({is_variable, index, -1.0, lower});
    if (upper < 1e19) side.inequalities.push_back({is_variable, index, 1.0, upper});
  }

  [[nodiscard]] Values evaluate(const std::vector<double>& v,
                                const std::vector<double>& lambda) const {
    const ProblemStructure& shape = problem_.structure();
    const auto n = static_cast<Eigen::Index>(v.size());
    const auto m = static_cast<Eigen::Index>(constraints());
    Values now{v, std::vector<double>(constraints()), Eigen::VectorXd(n),
               Eigen::MatrixXd::Zero(m, n), Eigen::MatrixXd::Zero(n, n)};
    std::vector<double> jacobian(shape.jacobian.size()), hessian(shape.hessian.size());
    const bool ok = problem_.gradient(v, true, {now.gradient.data(), v.size()}) &&
                    problem_.constraints(v, false, now.g) &&
                    problem_.jacobian(v, false, jacobian) &&
                    problem_.hessian(v, false, 1.0, lambda, true, hessian);
    if (!ok) now.gradient.setConstant(std::nan(""));
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      now.jacobian(shape.jacobian[k].row, shape.jacobian[k].col) += jacobian[k];
    }
    for (std::size_t k = 0; k < hessian.size(); ++k) {
      const auto [row, col] = shape.hessian[k];
      now.hessian(row, col) += hessian[k];
      if (row != col) now.hessian(col, row) += hessian[k];
    }
    return now;
  }
  static double value(const Values& now, const Row& row) {
    return row.is_variable ? now.v[row.index] : now.g[row.index];
  }
  static Eigen::VectorXd pick(const Eigen::VectorXd& all, const Side& side) {
    Eigen::VectorXd result(size(side.variables));
    for (Eigen::Index i = 0; i < result.size(); ++i) {
      result[i] = all[static_cast<Eigen::Index>(side.variables[at(i)])];
    }
    return result;
  }
  static Eigen::VectorXd residuals(const Values& now, const std::vector<Row>& rows) {
    Eigen::VectorXd result(size(rows));
    for (Eigen::Index k = 0; k < result.size(); ++k) {
      result[k] = rows[at(k)].sign * (value(now, rows[at(k)]) - rows[at(k)].bound);
    }
    return result;
  }
  static Eigen::MatrixXd jacobian(const Values& now, const std::vector<Row>& rows,
                                  const Side& side) {
    Eigen::MatrixXd result(size(rows), size(side.variables));
    for (Eigen::Index k = 0; k < result.rows(); ++k) {
      const Row& row = rows[at(k)];
      for (Eigen::Index i = 0; i < result.cols(); ++i) {
        const std::size_t variable = side.variables[at(i)];
        const double entry = row.is_variable ? (variable == row.index ? 1.0 : 0.0)
                                             : now.jacobian(static_cast<Eigen::Index>(row.index),
                                                            static_cast<Eigen::Index>(variable));
        result(k, i) = row.sign * entry;
      }
    }
    return result;
  }
  static Eigen::MatrixXd block(const Eigen::MatrixXd& all, const Side& rows, const Side& cols) {
    Eigen::MatrixXd result(size(rows.variables), size(cols.variables));
    for (Eigen::Index i = 0; i < result.rows(); ++i) {
      for (Eigen::Index j = 0; j < result.cols(); ++j) {
        result(i, j) = all(static_cast<Eigen::Index>(rows.variables[at(i)]),
                           static_cast<Eigen::Index>(cols.variables[at(j)]));
      }
    }
    return result;
  }

  Problem& problem_;
  Side min_, max_;
};

}  // namespace ipminmax::testing
