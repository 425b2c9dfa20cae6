#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// A small model, Min's variables first, with what is known of it without the solver.
struct KnownModel {
  std::string name;
  std::shared_ptr<Problem> problem{};
  Eigen::Index x = 0;  ///< Min's variables
  /// Of the only answer, over all of y: the first of Min's variables.
  std::optional<Eigen::VectorXd> answer{};
  /// max over y of f in closed form; empty: from a grid of y.
  std::function<double(const Eigen::VectorXd& x)> phi{};
  /// Min's own constraints where phi is given; empty: the model's.
  std::function<bool(const Eigen::VectorXd& x)> allowed{};
  /// Directions of x, as columns, along which phi may fall or stay.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& x)> directions{};
  bool smooth = true;   ///< else derivatives do not tell whether y is a maximum
  bool saddle = false;  ///< the answer is the same where the players exchange their roles
  bool wide = false;    ///< the same with y in a box 100 times as wide
};

[[nodiscard]] std::vector<KnownModel> known_models();

}  // namespace ipminmax::testing
