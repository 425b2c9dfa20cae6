// Problems with general constraints.
#include <problems/small_problem_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

// TensCalc (github hespanha/tenscalc @f127cb5) examples/minmaxTest.m, case 2.5
SmallProblem tc2_5() {
  SmallProblem p{.name = "tc2.5", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective(-2.0 * square(y1 - 1.0) + square(y2 + 1.0));
  p.model.constraint(-x - y1 + y2, 0.0, 0.0);
  p.starts = {{0.1, 0.1, 0.1}};
  p.solutions.push_back(
      {.v = {-2.0, 1.0, -1.0}, .objective = 0.0, .lambda = {0.0}, .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// TensCalc (github hespanha/tenscalc @f127cb5) examples/minmaxTest.m, case 3.5
SmallProblem tc3_5() {
  SmallProblem p{.name = "tc3.5", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y1 = p.model.variable(kMax, "y1", -1.0, 1.0);
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective(square(y2) - 2.0 * square(y1 + 2.0));
  p.model.constraint(-x - y1 + y2, 0.0, 0.0);
  p.starts = {{0.1, 0.1, 0.1}};
  p.solutions.push_back({.v = {1.0, -1.0, 0.0},
                         .objective = -2.0,
                         .lambda = {0.0},
                         .z_lower = {0.0, -4.000000000000001, 0.0},
                         .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// SinhaMaloDeb2014TP7 in BOLIB (Zhou, Zemkoho, Tin): of the 165 BOLIBver2 problems in
// cinaral/BOLIB.jl, 16 have antisymmetric objectives (grad_y F = -k grad_y f, k>0), this is the
// only one with a nonlinear objective
SmallProblem bolib_tp7() {
  SmallProblem p{.name = "bolib_tp7", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1", 0.0);
  const Expression x2 = p.model.variable(kMin, "x2", 0.0);
  const Expression y1 = p.model.variable(kMax, "y1", 0.0);
  const Expression y2 = p.model.variable(kMax, "y2", 0.0);
  p.model.objective((-x1 - y1) * (x2 + y2) / (x1 * y1 + x2 * y2 + 1.0));
  p.model.constraint(x1 - x2, -kNoBound, 0.0);
  p.model.constraint(square(x1) + square(x2), -kNoBound, 100.0);
  p.model.constraint(-x1 + y1, -kNoBound, 0.0);
  p.model.constraint(-x2 + y2, -kNoBound, 0.0);
  p.starts = {{1.0, 1.0, 0.0, 1.0}, {1.0, 1.5, 0.5, 0.5}};
  p.solutions.push_back(
      {.v = {7.0710678118654755, 7.0710678118654755, 0.0, 7.0710678118654755},
       .objective = -1.9607843137254901,
       .lambda = {0.27185958523127535, 0.000384467512495193, 0.0, -0.133211196763325},
       .z_lower = {0.0, 0.0, -0.005437191704625477, 0.0},
       .global = true});
  p.random_start_box = {{0.0, 10.0}, {0.0, 10.0}, {0.0, 10.0}, {0.0, 10.0}};
  return p;
}

// ClarkWesterberg1988 in BOLIBver2; 1<=x<=19 (=dom Y) made explicit
SmallProblem cw88() {
  SmallProblem p{.name = "cw88", .expectation = Expectation::Degenerate};
  const Expression x = p.model.variable(kMin, "x", 1.0, 19.0);
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(x - 4.0 * y);
  p.model.constraint(-2.0 * x + y, -kNoBound, 0.0);
  p.model.constraint(2.0 * x + 5.0 * y, -kNoBound, 108.0);
  p.model.constraint(2.0 * x - 3.0 * y, -kNoBound, -4.0);
  p.starts = {{20.0, 0.0}, {10.0, 10.0}};
  p.solutions.push_back({.v = {19.0, 14.0},
                         .objective = -37.0,
                         .lambda = {0.0, 0.0, -1.333333333333333},
                         .z_upper = {1.6666666666666663, 0.0},
                         .global = true});
  p.random_start_box = {{1.0, 19.0}, {0.0, 22.0}};
  return p;
}

// HaurieSavardWhite1990 in BOLIBver2; dom Y bounds made explicit
SmallProblem haurie90() {
  SmallProblem p{.name = "haurie90", .expectation = Expectation::Degenerate};
  const Expression x = p.model.variable(kMin, "x", 2.0, 12.0);
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(x + 5.0 * y);
  p.model.constraint(-3.0 * x + 2.0 * y, -kNoBound, 6.0);
  p.model.constraint(3.0 * x + 4.0 * y, -kNoBound, 48.0);
  p.model.constraint(2.0 * x - 5.0 * y, -kNoBound, 9.0);
  p.model.constraint(-x - y, -kNoBound, -8.0);
  p.starts = {{1.0, 1.0}, {6.0, 5.0}};
  p.solutions.push_back({.v = {12.0, 3.0},
                         .objective = 27.0,
                         .lambda = {0.0, -1.25, 0.0, 0.0},
                         .z_upper = {2.75, 0.0},
                         .global = true});
  // The two constraints that meet at (2, 6) pinch y: a local minmax without independent gradients.
  p.solutions.push_back(
      {.v = {2.0, 6.0}, .objective = 32.0, .lambda = {-2.5, 0.0, 0.0, 0.0}, .z_lower = {8.5, 0.0}});
  p.random_start_box = {{2.0, 12.0}, {0.0, 12.0}};
  return p;
}

// adversarial perturbation in a ball centred at x (analytic): phi=(|x|+1)^2/2+|x-a|^2
SmallProblem attack_ball() {
  SmallProblem p{.name = "attack_ball", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective(square(x2) + square(y1) / 2.0 + square(y2) / 2.0 + square(x1 - 2.0));
  p.model.constraint(square(-x1 + y1) + square(-x2 + y2), -kNoBound, 1.0);
  p.starts = {{1.0, 1.0, 1.0, 1.5}};
  p.solutions.push_back(
      {.v = {1.0, 0.0, 2.0, 0.0}, .objective = 3.0, .lambda = {-1.0}, .global = true});
  p.random_start_box = {{-1.0, 3.0}, {-2.0, 2.0}, {-3.0, 5.0}, {-4.0, 4.0}};
  return p;
}

// phi=x^4/4+x^2/2+x-1/4, x^3+x+1=0
SmallProblem eq_coupled() {
  SmallProblem p{.name = "eq_coupled", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective(pow(x, 4.0) / 2.0 + x - square(y2) / 2.0 - square(y1 - 1.0) / 2.0);
  p.model.constraint(-square(x) + y1 + y2, 0.0, 0.0);
  p.starts = {{1.0, 0.0, 0.0}};
  p.solutions.push_back({.v = {-0.6823278038280194, 0.732785615938384, -0.26721438406161596},
                         .objective = -0.6453530449018225,
                         .lambda = {-0.2672143840616159},
                         .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// nonconvex x-set x1*x2>=1, disc for y (analytic)
SmallProblem hyperbola() {
  SmallProblem p{.name = "hyperbola", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective(square(x1) / 2.0 + x1 * y1 + square(x2) / 2.0 + x2 * y2);
  p.model.constraint((-x1) * x2, -kNoBound, -1.0);
  p.model.constraint(square(y1) + square(y2), -kNoBound, 1.0);
  p.starts = {{2.0, 1.0, 0.1, 0.2}};
  p.solutions.push_back({.v = {1.0, 1.0, 0.7071067811865476, 0.7071067811865476},
                         .objective = 2.414213562373095,
                         .lambda = {1.707106781186547, -0.7071067811865474},
                         .global = true});
  p.solutions.push_back({.v = {-1.0, -1.0, -0.7071067811865476, -0.7071067811865476},
                         .objective = 2.414213562373095,
                         .lambda = {1.707106781186547, -0.7071067811865474},
                         .global = true});
  p.random_start_box = {{-3.0, 3.0}, {-3.0, 3.0}, {-1.0, 1.0}, {-1.0, 1.0}};
  return p;
}

// Disciplined Saddle Programming README (cvxgrp/dsp)
SmallProblem game_dsp() {
  SmallProblem p{.name = "game_dsp", .expectation = Expectation::Degenerate};
  const Expression x1 = p.model.variable(kMin, "x1", 0.0);
  const Expression x2 = p.model.variable(kMin, "x2", 0.0);
  const Expression y1 = p.model.variable(kMax, "y1", 0.0);
  const Expression y2 = p.model.variable(kMax, "y2", 0.0);
  p.model.objective(x1 * y1 + 2.0 * x1 * y2 + 3.0 * x2 * y1 + x2 * y2);
  p.model.constraint(x1 + x2, 1.0, 1.0);
  p.model.constraint(y1 + y2, 1.0, 1.0);
  p.starts = {{0.5, 0.5, 0.5, 0.5}};
  p.solutions.push_back(
      {.v = {0.6666666666666666, 0.3333333333333333, 0.3333333333333333, 0.6666666666666666},
       .objective = 1.6666666666666665,
       .lambda = {-1.6666666666666663, -1.6666666666666663}});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// CB2, Charalambous & Conn; Luksan-Vlcek test set
SmallProblem cb2() {
  SmallProblem p{.name = "cb2", .expectation = Expectation::Degenerate};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression y1 = p.model.variable(kMax, "y1", 0.0);
  const Expression y2 = p.model.variable(kMax, "y2", 0.0);
  const Expression y3 = p.model.variable(kMax, "y3", 0.0);
  p.model.objective(y1 * (square(x1) + pow(x2, 4.0)) + y2 * (square(2.0 - x1) + square(2.0 - x2)) +
                    2.0 * y3 * exp(-x1 + x2));
  p.model.constraint(y1 + y2 + y3, 1.0, 1.0);
  p.starts = {{2.0, 2.0, 0.3333333333333333, 0.3333333333333333, 0.3333333333333333}};
  p.solutions.push_back(
      {.v = {1.1390376519926628, 0.8995599383953928, 0.43048117400366864, 0.5695188259963314, 0.0},
       .objective = 1.9522244938706588,
       .lambda = {-1.9522244938706592},
       .z_lower = {0.0, 0.0, 0.0, 0.0, -0.378146867049727}});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// DEM, Demyanov & Malozemov; Luksan-Vlcek test set
SmallProblem dem() {
  SmallProblem p{.name = "dem", .expectation = Expectation::Degenerate};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression y1 = p.model.variable(kMax, "y1", 0.0);
  const Expression y2 = p.model.variable(kMax, "y2", 0.0);
  const Expression y3 = p.model.variable(kMax, "y3", 0.0);
  p.model.objective(y1 * (5.0 * x1 + x2) + y2 * (-5.0 * x1 + x2) +
                    y3 * (square(x1) + square(x2) + 4.0 * x2));
  p.model.constraint(y1 + y2 + y3, 1.0, 1.0);
  p.starts = {{1.0, 1.0, 0.3333333333333333, 0.3333333333333333, 0.3333333333333333}};
  p.solutions.push_back(
      {.v = {0.0, -3.0, 0.3333333333333333, 0.3333333333333333, 0.3333333333333333},
       .objective = -3.0,
       .lambda = {3.0000000000000004}});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

}  // namespace

std::vector<SmallProblem> constrained_problems() {
  return {tc2_5(),      tc3_5(),     bolib_tp7(), cw88(), haurie90(), attack_ball(),
          eq_coupled(), hyperbola(), game_dsp(),  cb2(),  dem()};
}

}  // namespace ipminmax::testing
