#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/problem.hpp"

/// Small minmax problems written as formulas, with exact derivatives and exact sparsity:
///
///   Model model;
///   const Expression x = model.variable(Player::Min, "x", -2.0, 2.0);
///   const Expression y = model.variable(Player::Max, "y");
///   model.objective(square(x) - x * y - exp(y));
///   model.constraint(square(x) + square(y), -kNoBound, 4.0);
///   AutodiffProblem problem(model, {1.0, 0.5});
///
/// A formula is recorded once, as a list of elementary operations. Values and gradients take one
/// sweep over the list, Hessians two sweeps per variable.
namespace ipminmax::testing {

inline constexpr double kNoBound = 2e19;

/// A recorded formula. Operations that need no second operand use the constant c.
struct Operation {
  enum class Kind : std::uint8_t {
    Variable,    ///< the variable number a
    Shift,       ///< a + c
    Scale,       ///< c a
    Reciprocal,  ///< c / a
    Power,       ///< a^c
    Exp,
    Log,
    Sin,
    Cos,
    Add,
    Multiply
  };
  Kind kind = Kind::Variable;
  std::size_t a = 0, b = 0;
  double c = 0.0;

  [[nodiscard]] bool has_two_operands() const {
    return kind == Kind::Add || kind == Kind::Multiply;
  }
  [[nodiscard]] bool is_linear() const {
    return kind == Kind::Variable || kind == Kind::Shift || kind == Kind::Scale ||
           kind == Kind::Add;
  }
};

using Tape = std::vector<Operation>;

/// A number that depends on the variables of one Model, or a constant.
class Expression {
 public:
  Expression(double constant = 0.0) : constant_(constant) {}  // NOLINT: conversion is the point
  Expression(Tape& tape, const Operation& operation) : tape_(&tape), position_(tape.size()) {
    tape.push_back(operation);
  }

  /// What is recorded there.
  [[nodiscard]] static Expression at(Tape& tape, std::size_t position) {
    Expression recorded;
    recorded.tape_ = &tape;
    recorded.position_ = position;
    return recorded;
  }

  [[nodiscard]] bool is_constant() const { return tape_ == nullptr; }
  [[nodiscard]] double constant() const { return constant_; }
  [[nodiscard]] std::size_t position() const { return position_; }

  friend Expression operator+(const Expression& a, const Expression& b) {
    if (a.is_constant()) return b.shifted(a.constant_);
    if (b.is_constant()) return a.shifted(b.constant_);
    return {*a.tape_, {Operation::Kind::Add, a.position_, b.position_}};
  }
  friend Expression operator*(const Expression& a, const Expression& b) {
    if (a.is_constant()) return b.scaled(a.constant_);
    if (b.is_constant()) return a.scaled(b.constant_);
    return {*a.tape_, {Operation::Kind::Multiply, a.position_, b.position_}};
  }
  friend Expression operator/(const Expression& a, const Expression& b) {
    if (b.is_constant()) return a.scaled(1.0 / b.constant_);
    if (a.is_constant()) return b.unary(Operation::Kind::Reciprocal, a.constant_);
    return a * b.unary(Operation::Kind::Reciprocal, 1.0);
  }
  friend Expression operator-(const Expression& a) { return a.scaled(-1.0); }
  friend Expression operator-(const Expression& a, const Expression& b) { return a + (-b); }
  Expression& operator+=(const Expression& b) { return *this = *this + b; }
  Expression& operator-=(const Expression& b) { return *this = *this - b; }

  friend Expression pow(const Expression& a, double exponent) {
    if (a.is_constant()) return std::pow(a.constant_, exponent);
    return a.unary(Operation::Kind::Power, exponent);
  }
  friend Expression square(const Expression& a) { return pow(a, 2.0); }
  friend Expression sqrt(const Expression& a) { return pow(a, 0.5); }
  friend Expression exp(const Expression& a) {
    return a.is_constant() ? std::exp(a.constant_) : a.unary(Operation::Kind::Exp);
  }
  friend Expression log(const Expression& a) {
    return a.is_constant() ? std::log(a.constant_) : a.unary(Operation::Kind::Log);
  }
  friend Expression sin(const Expression& a) {
    return a.is_constant() ? std::sin(a.constant_) : a.unary(Operation::Kind::Sin);
  }
  friend Expression cos(const Expression& a) {
    return a.is_constant() ? std::cos(a.constant_) : a.unary(Operation::Kind::Cos);
  }

  /// The same position of another tape that begins alike.
  [[nodiscard]] Expression on(Tape& tape) const {
    Expression moved = *this;
    if (!is_constant()) moved.tape_ = &tape;
    return moved;
  }

 private:
  [[nodiscard]] Expression unary(Operation::Kind kind, double c = 0.0) const {
    return {*tape_, {kind, position_, 0, c}};
  }
  [[nodiscard]] Expression shifted(double c) const {
    if (is_constant()) return constant_ + c;
    return c == 0.0 ? *this : unary(Operation::Kind::Shift, c);
  }
  [[nodiscard]] Expression scaled(double c) const {
    if (is_constant()) return constant_ * c;
    if (c == 0.0) return 0.0;
    return c == 1.0 ? *this : unary(Operation::Kind::Scale, c);
  }

  Tape* tape_ = nullptr;
  std::size_t position_ = 0;
  double constant_ = 0.0;
};

/// The formulas of a problem. At most 64 variables. Copies share the formulas.
class Model {
 public:
  Expression variable(Player player, std::string name, double lower = -kNoBound,
                      double upper = kNoBound) {
    if (variables() == 64) throw std::length_error("a Model has at most 64 variables");
    const std::size_t number = variables();
    structure_.variable_players.push_back(player);
    structure_.variable_names.push_back(std::move(name));
    structure_.variable_lower.push_back(lower);
    structure_.variable_upper.push_back(upper);
    return {*tape_, {Operation::Kind::Variable, number}};
  }

  void objective(const Expression& f) { objective_ = f; }

  /// Without an owner the constraint belongs to whom its formula implies.
  void constraint(const Expression& g, double lower, double upper,
                  std::optional<Player> owner = {}) {
    constraints_.push_back(g);
    owners_.push_back(owner);
    structure_.constraint_lower.push_back(lower);
    structure_.constraint_upper.push_back(upper);
    structure_.constraint_names.push_back("g" + std::to_string(constraints_.size()));
  }

  [[nodiscard]] std::size_t variables() const { return structure_.variable_players.size(); }

  /// A copy with formulas of its own, to which others can be added, and with all variables and
  /// constraints of one player.
  [[nodiscard]] Model owned_by(Player player) const {
    Model copy = *this;
    copy.tape_ = std::make_shared<Tape>(*tape_);
    copy.objective_ = objective_.on(*copy.tape_);
    for (Expression& g : copy.constraints_) g = g.on(*copy.tape_);
    std::ranges::fill(copy.structure_.variable_players, player);
    copy.owners_.assign(owners_.size(), player);
    return copy;
  }
  [[nodiscard]] const Expression& objective() const { return objective_; }
  [[nodiscard]] const std::vector<Expression>& constraints() const { return constraints_; }
  [[nodiscard]] const Tape& tape() const { return *tape_; }
  [[nodiscard]] std::shared_ptr<const Tape> shared_tape() const { return tape_; }
  /// The variable that was made as number i.
  [[nodiscard]] Expression variable(std::size_t i) const {
    for (std::size_t k = 0; k < tape_->size(); ++k) {
      const Operation& operation = (*tape_)[k];
      if (operation.kind == Operation::Kind::Variable && operation.a == i) {
        return Expression::at(*tape_, k);
      }
    }
    throw std::out_of_range("no such variable");
  }

 private:
  friend class AutodiffProblem;
  friend class NlWriter;

  std::shared_ptr<Tape> tape_ = std::make_shared<Tape>();
  ProblemStructure structure_;  ///< without Jacobian, Hessian and constraint players
  Expression objective_;
  std::vector<Expression> constraints_;
  std::vector<std::optional<Player>> owners_;
};

/// Sweeps over a tape with numbers of type T.
template <typename T>
class TapeSweeps {
 public:
  explicit TapeSweeps(std::shared_ptr<const Tape> tape)
      : tape_(std::move(tape)),
        local_(tape_->size()),
        adjoint_(tape_->size()),
        tangent_(tape_->size()),
        adjoint_tangent_(tape_->size()) {}

  [[nodiscard]] T value(const Expression& e) const {
    return e.is_constant() ? T{e.constant()} : local_[e.position()].value;
  }
  /// Of what was seeded, at the last sweep back.
  [[nodiscard]] T adjoint(std::size_t position) const { return adjoint_[position]; }
  [[nodiscard]] T adjoint_tangent(std::size_t position) const { return adjoint_tangent_[position]; }

  void clear_seeds() { std::ranges::fill(adjoint_, T{0}); }
  void seed(const Expression& e, T weight) {
    if (!e.is_constant()) adjoint_[e.position()] += weight;
  }

  void forward(std::span<const T> v) {
    if (std::ranges::equal(v, evaluated_at_)) return;
    evaluated_at_.assign(v.begin(), v.end());
    const Tape& tape = *tape_;
    for (std::size_t k = 0; k < tape.size(); ++k) {
      const Operation& operation = tape[k];
      if (operation.kind == Operation::Kind::Variable) {
        local_[k].value = v[operation.a];
      } else {
        const T b = operation.has_two_operands() ? local_[operation.b].value : T{0};
        local_[k] = evaluate(operation, local_[operation.a].value, b);
      }
    }
  }

  /// Derivative of every operation along variable number direction.
  void tangent(std::size_t direction) {
    const Tape& tape = *tape_;
    for (std::size_t k = 0; k < tape.size(); ++k) {
      const Operation& operation = tape[k];
      if (operation.kind == Operation::Kind::Variable) {
        tangent_[k] = operation.a == direction ? 1 : 0;
        continue;
      }
      tangent_[k] = local_[k].da * tangent_[operation.a];
      if (operation.has_two_operands()) tangent_[k] += local_[k].db * tangent_[operation.b];
    }
  }

  void back() {
    const Tape& tape = *tape_;
    for (std::size_t k = tape.size(); k-- > 0;) {
      const Operation& operation = tape[k];
      if (adjoint_[k] == 0 || operation.kind == Operation::Kind::Variable) continue;
      adjoint_[operation.a] += local_[k].da * adjoint_[k];
      if (operation.has_two_operands()) adjoint_[operation.b] += local_[k].db * adjoint_[k];
    }
  }

  /// The same and its derivative along the direction of the last tangent.
  void back_with_tangent() {
    const Tape& tape = *tape_;
    std::ranges::fill(adjoint_tangent_, T{0});
    for (std::size_t k = tape.size(); k-- > 0;) {
      const Operation& operation = tape[k];
      const T weight = adjoint_[k];
      const T slope = adjoint_tangent_[k];
      if ((weight == 0 && slope == 0) || operation.kind == Operation::Kind::Variable) continue;
      const Local& local = local_[k];
      T da_tangent = local.daa * tangent_[operation.a];
      if (operation.has_two_operands()) {
        da_tangent += local.dab * tangent_[operation.b];
        adjoint_[operation.b] += local.db * weight;
        adjoint_tangent_[operation.b] +=
            local.db * slope + local.dab * tangent_[operation.a] * weight;
      }
      adjoint_[operation.a] += local.da * weight;
      adjoint_tangent_[operation.a] += local.da * slope + da_tangent * weight;
    }
  }

 private:
  /// Value and partial derivatives of one operation with respect to its operands.
  struct Local {
    T value = 0;
    T da = 0, db = 0;
    T daa = 0, dab = 0;  // no operation has a second derivative in b
  };

  static Local evaluate(const Operation& operation, T a, T b) {
    const T c = operation.c;
    switch (operation.kind) {
      case Operation::Kind::Variable:
        return {};
      case Operation::Kind::Shift:
        return {a + c, 1};
      case Operation::Kind::Scale:
        return {c * a, c};
      case Operation::Kind::Reciprocal:
        return {c / a, -c / (a * a), 0, 2 * c / (a * a * a)};
      case Operation::Kind::Power:
        if (c == 2) return {a * a, 2 * a, 0, 2};
        return {std::pow(a, c), c * std::pow(a, c - 1), 0, c * (c - 1) * std::pow(a, c - 2)};
      case Operation::Kind::Exp:
        return {std::exp(a), std::exp(a), 0, std::exp(a)};
      case Operation::Kind::Log:
        return {std::log(a), 1 / a, 0, -1 / (a * a)};
      case Operation::Kind::Sin:
        return {std::sin(a), std::cos(a), 0, -std::sin(a)};
      case Operation::Kind::Cos:
        return {std::cos(a), -std::sin(a), 0, -std::cos(a)};
      case Operation::Kind::Add:
        return {a + b, 1, 1};
      case Operation::Kind::Multiply:
        return {a * b, b, a, 0, 1};
    }
    return {};
  }

  std::shared_ptr<const Tape> tape_;
  std::vector<T> evaluated_at_;
  std::vector<Local> local_;
  std::vector<T> adjoint_, tangent_, adjoint_tangent_;
};

/// The problem of a Model. Evaluations return false where a value or derivative is not finite.
class AutodiffProblem : public Problem {
 public:
  explicit AutodiffProblem(const Model& model, std::vector<double> start = {})
      : tape_(model.tape_),
        structure_(model.structure_),
        objective_(model.objective_),
        constraints_(model.constraints_),
        start_(std::move(start)),
        sweeps_(tape_) {
    find_structure();
    structure_.constraint_players = implied_constraint_players(structure_);
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      if (model.owners_[i]) structure_.constraint_players[i] = *model.owners_[i];
    }
  }

  void set_start(std::vector<double> v) { start_ = std::move(v); }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start_.size() != start.v.size()) return false;
    std::ranges::copy(start_, start.v.begin());
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    sweeps_.forward(v);
    f = sweeps_.value(objective_);
    return std::isfinite(f);
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    sweeps_.forward(v);
    sweeps_.clear_seeds();
    sweeps_.seed(objective_, 1.0);
    sweeps_.back();
    for (std::size_t i = 0; i < grad.size(); ++i) grad[i] = sweeps_.adjoint(variable_positions_[i]);
    return all_finite(grad);
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    sweeps_.forward(v);
    for (std::size_t i = 0; i < g.size(); ++i) g[i] = sweeps_.value(constraints_[i]);
    return all_finite(g);
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    sweeps_.forward(v);
    std::size_t entry = 0;
    for (std::size_t row = 0; row < constraints_.size(); ++row) {
      sweeps_.clear_seeds();
      sweeps_.seed(constraints_[row], 1.0);
      sweeps_.back();
      for (; entry < values.size() && at(structure_.jacobian[entry].row) == row; ++entry) {
        values[entry] = sweeps_.adjoint(variable_positions_[at(structure_.jacobian[entry].col)]);
      }
    }
    return all_finite(values);
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    sweeps_.forward(v);
    std::size_t entry = 0;
    while (entry < values.size()) {
      const std::size_t col = at(structure_.hessian[entry].col);
      sweeps_.tangent(col);
      sweeps_.clear_seeds();
      sweeps_.seed(objective_, sigma);
      for (std::size_t i = 0; i < lambda.size(); ++i) sweeps_.seed(constraints_[i], lambda[i]);
      sweeps_.back_with_tangent();
      for (; entry < values.size() && at(structure_.hessian[entry].col) == col; ++entry) {
        values[entry] =
            sweeps_.adjoint_tangent(variable_positions_[at(structure_.hessian[entry].row)]);
      }
    }
    return all_finite(values);
  }

 private:
  using Mask = std::uint64_t;  ///< a set of variables

  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  static bool all_finite(std::span<const double> values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  }

  /// Which variables each formula depends on, and which pairs of them nonlinearly.
  void find_structure() {
    const Tape& tape = *tape_;
    const std::size_t n = structure_.variable_players.size();
    std::vector<Mask> depends(tape.size(), 0);
    std::vector<std::vector<Mask>> interacts(tape.size(), std::vector<Mask>(n, 0));
    variable_positions_.resize(n);
    for (std::size_t k = 0; k < tape.size(); ++k) {
      const Operation& operation = tape[k];
      if (operation.kind == Operation::Kind::Variable) {
        variable_positions_[operation.a] = k;
        depends[k] = Mask{1} << operation.a;
        continue;
      }
      const std::size_t a = operation.a;
      const std::size_t b = operation.has_two_operands() ? operation.b : a;
      depends[k] = depends[a] | depends[b];
      for (std::size_t i = 0; i < n; ++i) {
        interacts[k][i] = interacts[a][i] | interacts[b][i];
        if (operation.is_linear()) continue;
        if (depends[a] >> i & 1U) interacts[k][i] |= depends[b];
        if (depends[b] >> i & 1U) interacts[k][i] |= depends[a];
      }
    }

    for (std::size_t row = 0; row < constraints_.size(); ++row) {
      if (constraints_[row].is_constant()) continue;
      for_each(depends[constraints_[row].position()], [&](Index col) {
        structure_.jacobian.push_back({static_cast<Index>(row), col});
      });
    }
    std::vector<Mask> pattern(n, 0);
    const auto include = [&](const Expression& e) {
      if (e.is_constant()) return;
      for (std::size_t i = 0; i < n; ++i) pattern[i] |= interacts[e.position()][i];
    };
    include(objective_);
    for (const Expression& constraint : constraints_) include(constraint);
    for (std::size_t col = 0; col < n; ++col) {
      const Mask from_diagonal = pattern[col] >> col << col;
      for_each(from_diagonal, [&](Index row) {
        structure_.hessian.push_back({row, static_cast<Index>(col)});
      });
    }
  }

  template <typename Function>
  static void for_each(Mask set, Function function) {
    for (; set != 0; set &= set - 1) function(static_cast<Index>(std::countr_zero(set)));
  }

  std::shared_ptr<const Tape> tape_;
  ProblemStructure structure_;
  Expression objective_;
  std::vector<Expression> constraints_;
  std::vector<double> start_;
  std::vector<std::size_t> variable_positions_;  ///< of the variables on the tape
  TapeSweeps<double> sweeps_;
};

}  // namespace ipminmax::testing
