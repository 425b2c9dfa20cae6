// What the collection lacks: rows without bounds, repeated and dependent rows, fixed variables.
#include <numbers>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

MinimizationProblem hs071_free_row() {
  Draft p("hs071_free_row", 17.0140173, {1.0, 5.0, 5.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>(1.0, 5.0);
  p.minimize(x1 * x4 * (x1 + x2 + x3) + x3);
  p.range(-kInf, exp(x1) * x2, kInf);
  p.at_least(x1 * x2 * x3 * x4, 25.0);
  p.equal(square(x1) + square(x2) + square(x3) + square(x4), 40.0);
  return p;
}

MinimizationProblem hs028_repeated_row() {
  Draft p("hs028_repeated_row", 0.0, {-4.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(square(x1 + x2) + square(x2 + x3));
  p.equal(x1 + 2.0 * x2 + 3.0 * x3, 1.0);
  p.equal(x1 + 2.0 * x2 + 3.0 * x3, 1.0);
  return p.degenerate();
}

MinimizationProblem hs050_dependent_rows() {
  Draft p("hs050_dependent_rows", 0.0, {35.0, -31.0, 11.0, 5.0, -5.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x2 - x3) + pow(x3 - x4, 4.0) + square(x4 - x5));
  p.equal(x1 + 2.0 * x2 + 3.0 * x3, 6.0);
  p.equal(x2 + 2.0 * x3 + 3.0 * x4, 6.0);
  p.equal(x3 + 2.0 * x4 + 3.0 * x5, 6.0);
  p.equal(x1 + 3.0 * x2 + 5.0 * x3 + 3.0 * x4, 12.0);
  return p.degenerate();
}

MinimizationProblem hs007_squared_row() {
  Draft p("hs007_squared_row", -std::numbers::sqrt3, {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(log(1.0 + square(x1)) - x2);
  p.equal(square(square(1.0 + square(x1)) + square(x2) - 4.0), 0.0);
  return p.degenerate();
}

MinimizationProblem hs035_fixed_variable() {
  Draft p("hs035_fixed_variable", 0.25, {0.5, 0.5, 0.5});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.5, 0.0}, {kInf, 0.5, kInf});
  p.minimize(9.0 - 8.0 * x1 - 6.0 * x2 - 4.0 * x3 + 2.0 * square(x1) + 2.0 * square(x2) +
             square(x3) + 2.0 * x1 * x2 + 2.0 * x1 * x3);
  p.at_least(-x1 - x2 - 2.0 * x3, -3.0);
  return p;
}

MinimizationProblem hs021_bound_as_row() {
  Draft p("hs021_bound_as_row", -99.96, {-1.0, -1.0});
  const auto [x1, x2] = p.variables<2>({2.0, -50.0}, {50.0, 50.0});
  p.minimize(0.01 * square(x1) + square(x2) - 100.0);
  p.at_least(10.0 * x1 - x2, 10.0);
  p.at_least(x1, 2.0);
  return p.degenerate();
}

MinimizationProblem hs043_empty_row() {
  Draft p("hs043_empty_row", -44.0, {0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(square(x1) + square(x2) + 2.0 * square(x3) + square(x4) - 5.0 * x1 - 5.0 * x2 -
             21.0 * x3 + 7.0 * x4);
  p.at_most(square(x1) + square(x2) + square(x3) + square(x4) + x1 - x2 + x3 - x4, 8.0);
  p.at_most(square(x1) + 2.0 * square(x2) + square(x3) + 2.0 * square(x4) - x1 - x4, 10.0);
  p.at_most(0.0, 1.0);
  p.at_most(2.0 * square(x1) + square(x2) + square(x3) + 2.0 * x1 - x2 - x4, 5.0);
  return p;
}

MinimizationProblem hs012_narrow_range() {
  Draft p("hs012_narrow_range", -30.0, {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(0.5 * square(x1) + square(x2) - x1 * x2 - 7.0 * x1 - 7.0 * x2);
  p.range(25.0 - 1e-3, 4.0 * square(x1) + square(x2), 25.0);
  return p;
}

// Nothing is left to choose: two equations, two variables, an objective to evaluate.
MinimizationProblem hs008_square() {
  Draft p("hs008_square", -7.62987, {2.0, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(x1 - 2.0 * x2 - square(x1) / 10.0);
  p.equal(square(x1) + square(x2), 25.0);
  p.equal(x1 * x2, 9.0);
  return p.several_minima();
}

}  // namespace

std::vector<MinimizationProblem> hock_schittkowski_variants() {
  return {hs071_free_row(),    hs028_repeated_row(),   hs050_dependent_rows(),
          hs007_squared_row(), hs035_fixed_variable(), hs021_bound_as_row(),
          hs043_empty_row(),   hs012_narrow_range(),   hs008_square()};
}

}  // namespace ipminmax::testing
