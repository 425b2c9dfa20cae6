// Gradient and Hessian of a model from Eigen's AutoDiff: a scalar of scalars gives second derivatives. Constants
// become Second(First(1.0)), because Eigen's operators take no plain numbers two levels deep.
#include <Eigen/Core>
// The unsupported header does not include it.
#include <unsupported/Eigen/AutoDiff>

#include <cstdio>
#include <ipminmax/core/solver.hpp>

using First = Eigen::AutoDiffScalar<Eigen::Vector2d>;
using Second = Eigen::AutoDiffScalar<Eigen::Matrix<First, 2, 1>>;

Second payoff(const Second& x, const Second& y) {
  const Second s = x * x - Second(First(1.0));
  return Second(First(0.25)) * s * s + Second(First(0.05)) * x + x * y - y * y;
}

/// Value, gradient and Hessian of the payoff at v.
Second at(std::span<const double> v) {
  const auto variable = [&](int i) {
    Second s(First(v[static_cast<std::size_t>(i)], Eigen::Vector2d::Unit(i)));
    for (int j = 0; j < 2; ++j) s.derivatives()(j) = First(i == j ? 1.0 : 0.0);
    for (int j = 0; j < 2; ++j) s.derivatives()(j).derivatives().setZero();
    return s;
  };
  return payoff(variable(0), variable(1));
}

class WithAutoDiff : public ipminmax::Problem {
 public:
  WithAutoDiff() {
    s_.variable_players = {ipminmax::Player::Min, ipminmax::Player::Max};
    s_.variable_lower = {-2.0, -2.0};
    s_.variable_upper = {2.0, 2.0};
    s_.hessian = {{0, 0}, {1, 0}, {1, 1}};  // one triangle
  }
  const ipminmax::ProblemStructure& structure() const override { return s_; }
  bool starting_point(ipminmax::StartingPoint& start) override {
    start.v[0] = 1.5;
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    f = at(v).value().value();
    return true;
  }
  bool constraints(std::span<const double>, bool, std::span<double>) override { return true; }
  bool jacobian(std::span<const double>, bool, std::span<double>) override { return true; }
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    const Second f = at(v);
    grad[0] = f.value().derivatives()(0);
    grad[1] = f.value().derivatives()(1);
    return true;
  }
  bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>, bool,
               std::span<double> values) override {
    const Second f = at(v);
    values[0] = sigma * f.derivatives()(0).derivatives()(0);
    values[1] = sigma * f.derivatives()(1).derivatives()(0);
    values[2] = sigma * f.derivatives()(1).derivatives()(1);
    return true;
  }

 private:
  ipminmax::ProblemStructure s_;
};

int main() {
  WithAutoDiff problem;
  std::printf("x = %.4f\n", ipminmax::solve(problem, {}).v[0]);
}
