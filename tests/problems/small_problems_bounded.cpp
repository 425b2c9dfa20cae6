// Problems with bounds on the variables only.
#include <problems/small_problem_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

// TensCalc (github hespanha/tenscalc @f127cb5) examples/minmaxTest.m, case 5
SmallProblem tc5() {
  SmallProblem p{.name = "tc5", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = p.model.variable(kMax, "y", -1.0, 1.0);
  p.model.objective(square(x + y) - 2.0 * square(y + 2.0));
  p.starts = {{0.1, 0.1}};
  p.solutions.push_back(
      {.v = {1.0, -1.0}, .objective = -2.0, .z_lower = {0.0, -4.0}, .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-1.0, 1.0}};
  return p;
}

// Jin, Netrapalli, Jordan ICML 2020 (arXiv 1902.00618), Prop. (existence)
SmallProblem jin_none() {
  SmallProblem p{.name = "jin_none", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x", -1.0, 1.0);
  const Expression y = p.model.variable(kMax, "y", -1.0, 1.0);
  p.model.objective(-2.0 * x * y + square(y));
  p.starts = {{0.5, 0.5}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-1.0, 1.0}, {-1.0, 1.0}};
  return p;
}

// Hamm & Noh ICML 2018 "K-beam minimax" (minimax_examples.py), box |u|,|v|<=1/2, f2 rotated
// saddle
SmallProblem kbeam_rot() {
  SmallProblem p{.name = "kbeam_rot", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", -0.5, 0.5);
  const Expression y = p.model.variable(kMax, "y", -0.5, 0.5);
  p.model.objective(square(x) + 2.0 * x * y - square(y));
  p.starts = {{0.3, 0.3}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-0.5, 0.5}, {-0.5, 0.5}};
  return p;
}

// Hamm & Noh ICML 2018 "K-beam minimax" (minimax_examples.py), box |u|,|v|<=1/2, f13
SmallProblem kbeam_f13() {
  SmallProblem p{.name = "kbeam_f13", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", -0.5, 0.5);
  const Expression y = p.model.variable(kMax, "y", -0.5, 0.5);
  p.model.objective((-square(x)) / 2.0 + 2.0 * x * y - square(y));
  p.starts = {{0.3, 0.3}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-0.5, 0.5}, {-0.5, 0.5}};
  return p;
}

// Hamm & Noh ICML 2018 "K-beam minimax" (minimax_examples.py), box |u|,|v|<=1/2, f9 weapons
// allocation
SmallProblem kbeam_weapons() {
  SmallProblem p{.name = "kbeam_weapons", .expectation = Expectation::Local};
  const Expression x = p.model.variable(kMin, "x", -0.5, 0.5);
  const Expression y = p.model.variable(kMax, "y", -0.5, 0.5);
  p.model.objective(exp((-10.0 * x - 5.0) * exp(-y - 1.0 / 2.0)) +
                    exp((10.0 * x - 5.0) * exp(y - 1.0 / 2.0)) - 2.0);
  p.starts = {{0.2, 0.2}};
  p.solutions.push_back({.v = {-0.1579527207670044, -0.5},
                         .objective = -1.8784234416561842,
                         .z_lower = {0.0, -0.10329151504824212}});
  p.solutions.push_back({.v = {0.1579527207670044, 0.5},
                         .objective = -1.8784234416561842,
                         .z_upper = {0.0, -0.10329151504824212}});
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-0.5, 0.5}, {-0.5, 0.5}};
  return p;
}

// Hsieh, Mertikopoulos, Cevher ICML 2021 Ex. 5.2 "Forsaken"; also Pethick et al. ICLR 2022
SmallProblem forsaken() {
  SmallProblem p{.name = "forsaken", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x", -1.5, 1.5);
  const Expression y = p.model.variable(kMax, "y", -1.5, 1.5);
  p.model.objective(pow(x, 6.0) / 6.0 - pow(x, 4.0) / 2.0 + square(x) / 4.0 + x * (y - 9.0 / 20.0) -
                    pow(y, 6.0) / 6.0 + pow(y, 4.0) / 2.0 - square(y) / 4.0);
  p.starts = {{0.5, 0.5}, {1.0, 1.0}};
  p.not_minmax = {{0.07802666873846009, 0.41193385136581984}};
  p.random_start_box = {{-1.5, 1.5}, {-1.5, 1.5}};
  return p;
}

// Pethick et al. code, problem "forsaken?" (box added here)
SmallProblem forsaken_variant() {
  SmallProblem p{.name = "forsaken_variant", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", -1.5, 1.5);
  const Expression y = p.model.variable(kMax, "y", -1.5, 1.5);
  p.model.objective(pow(x, 6.0) / 6.0 - pow(x, 4.0) / 2.0 + 5.0 * square(x) / 12.0 +
                    x * (y + 1.0 / 10.0) - pow(y, 6.0) / 6.0 + pow(y, 4.0) / 2.0 -
                    5.0 * square(y) / 12.0);
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {-0.04904980653019581, -0.05936089355348678},
                         .objective = -0.002455794532676756,
                         .global = true});
  p.random_start_box = {{-1.5, 1.5}, {-1.5, 1.5}};
  return p;
}

// Grimmer et al., A=10, with the plotting box [-4,4]^2 as constraint
SmallProblem grimmer_box10() {
  SmallProblem p{.name = "grimmer_box10", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x", -4.0, 4.0);
  const Expression y = p.model.variable(kMax, "y", -4.0, 4.0);
  p.model.objective(10.0 * x * y + (x - 3.0) * (x - 1.0) * (x + 1.0) * (x + 3.0) -
                    (y - 3.0) * (y - 1.0) * (y + 1.0) * (y + 3.0));
  p.starts = {{1.0, 1.0}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-4.0, 4.0}, {-4.0, 4.0}};
  return p;
}

// Rustem & Howe 2002 "Algorithms for worst-case design" ch. 5; Rustem, Zakovic, Parpas 2008;
// reprinted as f1 in Marzat, Walter, Piet-Lahanier JOGO 2013
SmallProblem rh1() {
  SmallProblem p{.name = "rh1", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1", -5.0, 5.0);
  const Expression x2 = p.model.variable(kMin, "x2", -5.0, 5.0);
  const Expression y1 = p.model.variable(kMax, "y1", -5.0, 5.0);
  const Expression y2 = p.model.variable(kMax, "y2", -5.0, 5.0);
  p.model.objective(5.0 * square(x1) + x1 * (-y1 + y2 + 5.0) + 5.0 * square(x2) +
                    x2 * (y1 - y2 + 3.0) - square(y1) - square(y2));
  p.starts = {{0.0, 0.0, 0.0, 0.0}};
  p.solutions.push_back(
      {.v = {-0.4833333333333332, -0.31666666666666665, 0.0833333333333333, -0.0833333333333333},
       .objective = -1.683333333333333,
       .global = true});
  p.random_start_box = {{-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0}};
  return p;
}

// Rustem & Howe 2002 "Algorithms for worst-case design" ch. 5; Rustem, Zakovic, Parpas 2008;
// reprinted as f3 in Marzat, Walter, Piet-Lahanier JOGO 2013
SmallProblem rh3() {
  SmallProblem p{.name = "rh3", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1", -5.0, 5.0);
  const Expression x2 = p.model.variable(kMin, "x2", -5.0, 5.0);
  const Expression y1 = p.model.variable(kMax, "y1", -3.0, 3.0);
  const Expression y2 = p.model.variable(kMax, "y2", -3.0, 3.0);
  p.model.objective(pow(x1, 4.0) * y2 + 2.0 * pow(x1, 3.0) * y1 - square(x2) * y2 * (y2 - 3.0) -
                    2.0 * x2 * square(y1 - 3.0));
  p.starts = {{-1.0, 1.0, 0.0, 0.0}};
  p.solutions.push_back(
      {.v = {-1.1806742778229231, 0.912825638181124, 2.0984859899580486, 2.6660435007877488},
       .objective = -2.4687753046373064,
       .global = true});
  p.random_start_box = {{-5.0, 5.0}, {-5.0, 5.0}, {-3.0, 3.0}, {-3.0, 3.0}};
  return p;
}

// Rustem & Howe 2002 "Algorithms for worst-case design" ch. 5; Rustem, Zakovic, Parpas 2008;
// reprinted as f5 in Marzat, Walter, Piet-Lahanier JOGO 2013
SmallProblem rh5() {
  SmallProblem p{.name = "rh5", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1", -5.0, 5.0);
  const Expression x2 = p.model.variable(kMin, "x2", -5.0, 5.0);
  const Expression x3 = p.model.variable(kMin, "x3", -5.0, 5.0);
  const Expression y1 = p.model.variable(kMax, "y1", -1.0, 1.0);
  const Expression y2 = p.model.variable(kMax, "y2", -1.0, 1.0);
  const Expression y3 = p.model.variable(kMax, "y3", -1.0, 1.0);
  p.model.objective(2.0 * square(x1) + 3.0 * square(x2) + square(x3) - square(y1) +
                    y1 * (1.0 - x1) - square(y2) - y2 * (x2 - 2.0) - square(y3) - y3 * (x3 - 1.0));
  p.starts = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  p.solutions.push_back({.v = {0.11111111111111112, 0.15384615384615385, 0.2, 0.4444444444444445,
                               0.9230769230769231, 0.4},
                         .objective = 1.3452991452991452,
                         .global = true});
  p.random_start_box = {{-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0},
                        {-1.0, 1.0}, {-1.0, 1.0}, {-1.0, 1.0}};
  return p;
}

// Rustem & Howe 2002 "Algorithms for worst-case design" ch. 5; Rustem, Zakovic, Parpas 2008;
// reprinted as f7 in Marzat, Walter, Piet-Lahanier JOGO 2013
SmallProblem rh7() {
  SmallProblem p{.name = "rh7", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1", -5.0, 5.0);
  const Expression x2 = p.model.variable(kMin, "x2", -5.0, 5.0);
  const Expression x3 = p.model.variable(kMin, "x3", -5.0, 5.0);
  const Expression x4 = p.model.variable(kMin, "x4", -5.0, 5.0);
  const Expression x5 = p.model.variable(kMin, "x5", -5.0, 5.0);
  const Expression y1 = p.model.variable(kMax, "y1", -3.0, 3.0);
  const Expression y2 = p.model.variable(kMax, "y2", -3.0, 3.0);
  const Expression y3 = p.model.variable(kMax, "y3", -3.0, 3.0);
  const Expression y4 = p.model.variable(kMax, "y4", -3.0, 3.0);
  const Expression y5 = p.model.variable(kMax, "y5", -3.0, 3.0);
  p.model.objective(2.0 * x1 * x5 + 3.0 * x2 * x4 + x3 * x5 + 5.0 * square(x4) -
                    x4 * (y4 - y5 - 5.0) + 5.0 * square(x5) + x5 * (y4 - y5 + 3.0) - square(y1) +
                    y1 * (square(x1) - 1.0) - square(y2) + y2 * (square(x2) - 1.0) - square(y3) +
                    y3 * (square(x3) - 1.0) - square(y4) - square(y5));
  p.starts = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
              {1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  p.solutions.push_back(
      {.v = {1.425208328800312, 1.6612294891063903, 1.2585294531408924, -0.9744126604271033,
             -0.7348507973789654, 0.515609390240889, 0.879841707738339, 0.2919481922115568,
             0.1197809315240689, -0.1197809315240689},
       .objective = -6.350915358243084,
       .global = true});
  p.solutions.push_back(
      {.v = {-0.85516550594322449, 1.6345118427788659, -0.93666625215569621, -0.91076577956383686,
             -0.11488804686560833, -0.13434597872243445, 0.83581448209218179, -0.061328166036300834,
             0.3979388663491143, -0.3979388663491143},
       .objective = -3.8097826909647377});
  p.random_start_box = {{-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0}, {-5.0, 5.0},
                        {-3.0, 3.0}, {-3.0, 3.0}, {-3.0, 3.0}, {-3.0, 3.0}, {-3.0, 3.0}};
  return p;
}

// Cramer, Sudhoff, Zivi IEEE TEC 2009 / Qiu et al. 2018 / Al-Dujaili et al. (code
// RobustDEProblem), fun 3
SmallProblem ea3() {
  SmallProblem p{.name = "ea3", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", 0.0, 10.0);
  const Expression y = p.model.variable(kMax, "y", 0.0, 10.0);
  p.model.objective(sin(x - y) / sqrt(square(x) + square(y)));
  p.starts = {{5.0, 5.0}, {9.0, 2.0}};
  p.solutions.push_back({.v = {10.0, 2.125683308598125},
                         .objective = 0.09779430278156873,
                         .z_upper = {0.01134557432317941, 0.0},
                         .global = true});
  p.solutions.push_back({.v = {8.380014234759651, 10.0},
                         .objective = -0.07655316802534964,
                         .z_upper = {0.0, -0.00826583231312787}});
  p.solutions.push_back({.v = {10.0, 8.380014234759651},
                         .objective = 0.07655316802534964,
                         .z_upper = {0.00826583231312787, 0.0}});
  p.solutions.push_back({.v = {2.1256833085981275, 10.0},
                         .objective = -0.09779430278156873,
                         .z_upper = {0.0, -0.011345574323179187}});
  p.not_minmax = {{0.0, 7.725251836937707}, {7.725251836937707, 0.0}};
  p.random_start_box = {{0.0, 10.0}, {0.0, 10.0}};
  return p;
}

// Cramer, Sudhoff, Zivi IEEE TEC 2009 / Qiu et al. 2018 / Al-Dujaili et al. (code
// RobustDEProblem), f5 of Cramer et al. (Rosenbrock)
SmallProblem ea5() {
  SmallProblem p{.name = "ea5", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x", -0.5, 0.5);
  const Expression y = p.model.variable(kMax, "y", 0.0, 10.0);
  p.model.objective(square(1.0 - x) + 100.0 * square(-square(x) + y));
  p.starts = {{0.0, 5.0}};
  p.solutions.push_back(
      {.v = {0.5, 10.0}, .objective = 9506.5, .z_upper = {1951.0, -1950.0}, .global = true});
  p.solutions.push_back({.v = {-0.5, 10.0},
                         .objective = 9508.5,
                         .z_lower = {1947.0, 0.0},
                         .z_upper = {0.0, -1950.0}});
  p.solutions.push_back({.v = {0.16126202313958898, 0.0},
                         .objective = 0.7711096853441531,
                         .z_lower = {0.0, -5.201088021414667}});
  p.not_minmax = {{-0.0005002501375875635, 10.0}, {0.5, 0.25}};
  p.random_start_box = {{-0.5, 0.5}, {0.0, 10.0}};
  return p;
}

// Cramer, Sudhoff, Zivi IEEE TEC 2009 / Qiu et al. 2018 / Al-Dujaili et al. (code
// RobustDEProblem), fun 6 (Lagrangian of HS-type problem)
SmallProblem ea6() {
  SmallProblem p{.name = "ea6", .expectation = Expectation::Degenerate};
  const Expression x1 = p.model.variable(kMin, "x1", -1.0, 3.0);
  const Expression x2 = p.model.variable(kMin, "x2", -1.0, 3.0);
  const Expression y1 = p.model.variable(kMax, "y1", 0.0, 10.0);
  const Expression y2 = p.model.variable(kMax, "y2", 0.0, 10.0);
  p.model.objective(y1 * (square(x1) - x2) + y2 * (x1 + x2 - 2.0) + square(x1 - 2.0) +
                    square(x2 - 1.0));
  p.starts = {{0.0, 0.0, 1.0, 1.0}};
  p.solutions.push_back(
      {.v = {1.0, 1.0, 0.6666666666666666, 0.6666666666666666}, .objective = 1.0});
  p.random_start_box = {{-1.0, 3.0}, {-1.0, 3.0}, {0.0, 10.0}, {0.0, 10.0}};
  return p;
}

// strict complementarity fails on both sides (analytic)
SmallProblem weak_active() {
  SmallProblem p{.name = "weak_active", .expectation = Expectation::Degenerate};
  const Expression x = p.model.variable(kMin, "x", 0.0);
  const Expression y = p.model.variable(kMax, "y", 0.0);
  p.model.objective(square(x) / 2.0 + x * y - square(y) / 2.0);
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0});
  p.random_start_box = {{0.0, 3.0}, {0.0, 6.0}};
  return p;
}

// cvxgrp/dsp tests/test_pathology.py test_lagrangian
SmallProblem dsp_lagr() {
  SmallProblem p{.name = "dsp_lagr", .expectation = Expectation::Degenerate};
  const Expression x = p.model.variable(kMin, "x", -10.0);
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(y * (x - 1.0) + exp(x));
  p.starts = {{0.0, 0.0}};
  p.solutions.push_back({.v = {1.0, -2.718281828459045}, .objective = 2.718281828459045});
  p.random_start_box = {{-3.0, 3.0}, {-40.0, 40.0}};
  return p;
}

}  // namespace

std::vector<SmallProblem> bounded_problems() {
  return {tc5(),
          jin_none(),
          kbeam_rot(),
          kbeam_f13(),
          kbeam_weapons(),
          forsaken(),
          forsaken_variant(),
          grimmer_box10(),
          rh1(),
          rh3(),
          rh5(),
          rh7(),
          ea3(),
          ea5(),
          ea6(),
          weak_active(),
          dsp_lagr()};
}

}  // namespace ipminmax::testing
