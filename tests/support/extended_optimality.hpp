#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>

#include "core/problem.hpp"
#include "core/result.hpp"

/// Second-order conditions by dense linear algebra in extended precision, at the solution of the
/// active set's equations near a returned point. Shares no code with the library, for judging its
/// verdicts.
namespace ipminmax::testing {

using Extended = long double;
using ExtendedVector = Eigen::Matrix<Extended, Eigen::Dynamic, 1>;
using ExtendedMatrix = Eigen::Matrix<Extended, Eigen::Dynamic, Eigen::Dynamic>;

/// f and g with first derivatives, and the Hessian of f + lambda' g.
class ExtendedFunctions {
 public:
  virtual ~ExtendedFunctions() = default;
  [[nodiscard]] virtual const ProblemStructure& structure() const = 0;
  /// False where undefined.
  [[nodiscard]] virtual bool first(const ExtendedVector& v, ExtendedVector& gradient,
                                   ExtendedVector& g, ExtendedMatrix& jacobian) = 0;
  [[nodiscard]] virtual bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                                    ExtendedMatrix& hessian) = 0;
};

/// The formulas of a Model, swept in extended precision.
class ExtendedModel final : public ExtendedFunctions {
 public:
  explicit ExtendedModel(const Model& model)
      : tape_(model.tape_),
        objective_(model.objective_),
        constraints_(model.constraints_),
        structure_(AutodiffProblem(model).structure()) {}

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override {
    sweep(v);
    gradient = adjoint_of(objective_, v.size());
    g.resize(rows());
    jacobian.resize(rows(), v.size());
    for (Eigen::Index j = 0; j < rows(); ++j) {
      const Expression& row = constraints_[static_cast<std::size_t>(j)];
      g[j] = row.is_constant() ? Extended{row.constant()} : value_[row.position()];
      jacobian.row(j) = adjoint_of(row, v.size()).transpose();
    }
    return gradient.allFinite() && g.allFinite() && jacobian.allFinite();
  }

  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override {
    sweep(v);
    hessian.resize(v.size(), v.size());
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      hessian.col(i) = second_adjoint(lambda, i, v.size());
    }
    return hessian.allFinite();
  }

 private:
  struct Partial {
    Extended a = 0, b = 0, aa = 0, ab = 0;
  };
  [[nodiscard]] Eigen::Index rows() const { return static_cast<Eigen::Index>(constraints_.size()); }

  void sweep(const ExtendedVector& v) {
    value_.assign(tape_->size(), 0);
    partial_.assign(tape_->size(), {});
    for (std::size_t k = 0; k < tape_->size(); ++k) {
      const Operation& o = (*tape_)[k];
      const Extended a =
          o.kind == Operation::Kind::Variable ? v[static_cast<Eigen::Index>(o.a)] : value_[o.a];
      const Extended b = o.has_two_operands() ? value_[o.b] : 0;
      apply(o, a, b, value_[k], partial_[k]);
    }
  }
  static void apply(const Operation& o, Extended a, Extended b, Extended& value, Partial& p) {
    const Extended c = o.c;
    switch (o.kind) {
      case Operation::Kind::Variable:
        value = a;
        break;
      case Operation::Kind::Shift:
        value = a + c, p = {1};
        break;
      case Operation::Kind::Scale:
        value = c * a, p = {c};
        break;
      case Operation::Kind::Reciprocal:
        value = c / a, p = {-c / (a * a), 0, 2 * c / (a * a * a)};
        break;
      case Operation::Kind::Power:
        value = std::pow(a, c);
        p = {c * std::pow(a, c - 1), 0, c == 1 ? 0 : c * (c - 1) * std::pow(a, c - 2)};
        break;
      case Operation::Kind::Exp:
        value = std::exp(a), p = {value, 0, value};
        break;
      case Operation::Kind::Log:
        value = std::log(a), p = {1 / a, 0, -1 / (a * a)};
        break;
      case Operation::Kind::Sin:
        value = std::sin(a), p = {std::cos(a), 0, -value};
        break;
      case Operation::Kind::Cos:
        value = std::cos(a), p = {-std::sin(a), 0, -value};
        break;
      case Operation::Kind::Add:
        value = a + b, p = {1, 1};
        break;
      case Operation::Kind::Multiply:
        value = a * b, p = {b, a, 0, 1};
        break;
    }
  }

  /// Puts the adjoints of the variables together.
  [[nodiscard]] ExtendedVector collect(const std::vector<Extended>& adjoint, Eigen::Index n) const {
    ExtendedVector sum = ExtendedVector::Zero(n);
    for (std::size_t k = 0; k < tape_->size(); ++k) {
      if ((*tape_)[k].kind == Operation::Kind::Variable) {
        sum[static_cast<Eigen::Index>((*tape_)[k].a)] += adjoint[k];
      }
    }
    return sum;
  }
  [[nodiscard]] ExtendedVector adjoint_of(const Expression& e, Eigen::Index n) const {
    std::vector<Extended> adjoint(tape_->size(), 0);
    if (!e.is_constant()) adjoint[e.position()] = 1;
    for (std::size_t k = tape_->size(); k-- > 0;) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable || adjoint[k] == 0) continue;
      adjoint[o.a] += partial_[k].a * adjoint[k];
      if (o.has_two_operands()) adjoint[o.b] += partial_[k].b * adjoint[k];
    }
    return collect(adjoint, n);
  }
  [[nodiscard]] ExtendedVector second_adjoint(const ExtendedVector& lambda, Eigen::Index direction,
                                              Eigen::Index n) const {
    const std::size_t size = tape_->size();
    std::vector<Extended> tangent(size, 0), adjoint(size, 0), slope(size, 0);
    for (std::size_t k = 0; k < size; ++k) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable) {
        tangent[k] = static_cast<Eigen::Index>(o.a) == direction ? 1 : 0;
        continue;
      }
      tangent[k] = partial_[k].a * tangent[o.a];
      if (o.has_two_operands()) tangent[k] += partial_[k].b * tangent[o.b];
    }
    if (!objective_.is_constant()) adjoint[objective_.position()] += 1;
    for (Eigen::Index j = 0; j < rows(); ++j) {
      const Expression& row = constraints_[static_cast<std::size_t>(j)];
      if (!row.is_constant()) adjoint[row.position()] += lambda[j];
    }
    for (std::size_t k = size; k-- > 0;) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable) continue;
      const Partial& p = partial_[k];
      Extended da = p.aa * tangent[o.a];
      if (o.has_two_operands()) {
        da += p.ab * tangent[o.b];
        adjoint[o.b] += p.b * adjoint[k];
        slope[o.b] += p.b * slope[k] + p.ab * tangent[o.a] * adjoint[k];
      }
      adjoint[o.a] += p.a * adjoint[k];
      slope[o.a] += p.a * slope[k] + da * adjoint[k];
    }
    return collect(slope, n);
  }

  std::shared_ptr<const Tape> tape_;
  Expression objective_;
  std::vector<Expression> constraints_;
  ProblemStructure structure_;
  std::vector<Extended> value_;
  std::vector<Partial> partial_;
};

/// Functions known in double precision only.
class ExtendedProblem final : public ExtendedFunctions {
 public:
  explicit ExtendedProblem(Problem& problem) : problem_(problem) {}
  [[nodiscard]] const ProblemStructure& structure() const override { return problem_.structure(); }

  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override {
    const ProblemStructure& s = structure();
    const std::vector<double> at = rounded(v);
    std::vector<double> slope(at.size()), rows(s.constraint_lower.size());
    std::vector<double> values(s.jacobian.size());
    if (!problem_.gradient(at, true, slope) || !problem_.constraints(at, true, rows) ||
        !problem_.jacobian(at, true, values)) {
      return false;
    }
    const auto m = static_cast<Eigen::Index>(rows.size());
    gradient = Eigen::Map<const Eigen::VectorXd>(slope.data(), v.size()).cast<Extended>();
    g = Eigen::Map<const Eigen::VectorXd>(rows.data(), m).cast<Extended>();
    jacobian.setZero(m, v.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      jacobian(s.jacobian[k].row, s.jacobian[k].col) += values[k];
    }
    return true;
  }
  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override {
    const ProblemStructure& s = structure();
    std::vector<double> values(s.hessian.size());
    if (!problem_.hessian(rounded(v), true, 1.0, rounded(lambda), true, values)) return false;
    hessian.setZero(v.size(), v.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, col] = s.hessian[k];
      hessian(row, col) += values[k];
      if (row != col) hessian(col, row) += values[k];
    }
    return true;
  }

 private:
  static std::vector<double> rounded(const ExtendedVector& v) {
    std::vector<double> values(static_cast<std::size_t>(v.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<double>(v[static_cast<Eigen::Index>(i)]);
    }
    return values;
  }
  Problem& problem_;
};

enum class ExtendedVerdict : std::uint8_t {
  NoSolution,  ///< Newton's method finds none near, or its signs are wrong
  Strict,      ///< second-order sufficient conditions
  Dependent,   ///< of Max: dependent gradients, or his weakly active bounds decide
  Singular,    ///< curvature zero, as far as can be seen
  Wrong,       ///< a direction of wrong curvature
};
[[nodiscard]] inline std::string_view name_of(ExtendedVerdict verdict) {
  constexpr std::string_view kNames[] = {"no solution", "strict", "dependent", "singular", "wrong"};
  return kNames[static_cast<std::size_t>(verdict)];
}

struct ExtendedOptimality {
  ExtendedVerdict verdict = ExtendedVerdict::NoSolution;
  Extended residual = 0;  ///< of the equations
  Extended moved = 0;     ///< longest entry of the way from the returned point
  Extended curvature =
      0;         ///< least of Min's (of phi) and, negated, of Max's; of a diagonal of ones
  int weak = 0;  ///< active with multiplier zero
  bool independent = true;  ///< all active gradients of each player
};

/// The check at the returned point of result.
[[nodiscard]] ExtendedOptimality extended_optimality(ExtendedFunctions& functions,
                                                     const Result& result);

}  // namespace ipminmax::testing
