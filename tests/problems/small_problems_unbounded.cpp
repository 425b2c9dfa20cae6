// Problems without bounds and constraints.
#include <problems/small_problem_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Sec 5.1 f1 (attributed
// there to Adolphs et al. 2019, but with -y^2 instead of +y^2, see adolphs)
SmallProblem paper_f1() {
  SmallProblem p{.name = "paper_f1", .expectation = Expectation::Local};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(2.0 * square(x) + 4.0 * x * y - pow(y, 4.0) / 4.0 + 4.0 * pow(y, 3.0) / 3.0 -
                    square(y));
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0});
  p.random_start_box = {{-8.0, 8.0}, {-12.0, 12.0}};
  return p;
}

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Sec 5.1 f2 (from Wang,
// Zhang, Ba ICLR 2020). Far from the origin f tends to 0, a supremum that is not attained.
SmallProblem paper_f2() {
  SmallProblem p{.name = "paper_f2", .expectation = Expectation::Local};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(
      (4.0 * square(x) - square(y - 3.0 * x + 0.05 * pow(x, 3.0)) - 0.1 * pow(y, 4.0)) *
      exp(-0.01 * (square(x) + square(y))));
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0});
  p.not_minmax = {
      {-8.101257694831943, 0.620661927843785},   {1.1056659651872092, -13.836793022264821},
      {10.06002630054121, 13.11326318422271},    {8.101257694831943, -0.6206619278437852},
      {-11.387239165735545, 13.399203277074836}, {-1.1056659651872083, 13.836793022264825},
      {-10.06002630054121, -13.11326318422271},  {11.387239165735544, -13.399203277074836}};
  p.random_start_box = {{-10.0, 10.0}, {-10.0, 10.0}};
  return p;
}

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Sec 5.1 f3 (from
// Mertikopoulos et al. ICLR 2019, Fig. 1)
SmallProblem paper_f3() {
  SmallProblem p{.name = "paper_f3", .expectation = Expectation::Local};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective((x - 1.0 / 2.0) * (y - 1.0 / 2.0) +
                    exp(-square(x - 1.0 / 4.0) - square(y - 3.0 / 4.0)));
  p.starts = {{0.0, 0.0}, {1.0, 1.0}};
  p.solutions.push_back(
      {.v = {-0.2002813140368569, 0.049718685963143175}, .objective = 0.8153235902799727});
  p.solutions.push_back(
      {.v = {0.9502813140368568, 1.200281314036857}, .objective = 0.8153235902799727});
  p.not_minmax = {{0.3341214478529358, 0.6658785521470643}};
  p.random_start_box = {{-3.0, 3.0}, {-3.0, 3.0}};
  return p;
}

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Sec 5.1 f4. The inner
// maximum is unbounded except at x = 0, where every y is one.
SmallProblem paper_f4() {
  SmallProblem p{.name = "paper_f4", .expectation = Expectation::Degenerate};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(x * y);
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-10.0, 10.0}, {-10.0, 10.0}};
  return p;
}

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Example 2
SmallProblem paper_ex2() {
  SmallProblem p{.name = "paper_ex2", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(3.0 * square(x) / 2.0 - 4.0 * x * y + square(y));
  p.starts = {{1.0, 1.0}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-4.0, 4.0}, {-4.0, 4.0}};
  return p;
}

// Chinchilla, Yang, Hespanha, MCSS 2023 (doi 10.1007/s00498-023-00371-4), Example 3
SmallProblem paper_ex3() {
  SmallProblem p{.name = "paper_ex3", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(-0.25 * square(x) + x * y - 0.5 * square(y));
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-4.0, 4.0}, {-4.0, 4.0}};
  return p;
}

// TensCalc (github hespanha/tenscalc @f127cb5) examples/minmaxTest.m, case 1
SmallProblem tc1() {
  SmallProblem p{.name = "tc1", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(square(x) - 2.0 * square(y));
  p.starts = {{0.1, 0.1}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-3.0, 3.0}, {-3.0, 3.0}};
  return p;
}

// Adolphs, Daneshmand, Lucchi, Hofmann AISTATS 2019 (arXiv 1805.05751), toy example
SmallProblem adolphs() {
  SmallProblem p{.name = "adolphs", .expectation = Expectation::Local};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(2.0 * square(x) + 4.0 * x * y - pow(y, 4.0) / 4.0 + 4.0 * pow(y, 3.0) / 3.0 +
                    square(y));
  p.starts = {{1.0, 1.0}, {-3.0, -1.0}};
  p.solutions.push_back(
      {.v = {-3.414213562373095, 3.414213562373095}, .objective = 7.437902832994919});
  p.not_minmax = {{0.0, 0.0}, {-0.5857864376269049, 0.5857864376269049}};
  p.random_start_box = {{-10.0, 6.0}, {-12.0, 14.0}};
  return p;
}

// Wang, Zhang, Ba ICLR 2020 "Follow-the-Ridge" (github gd-zhang/Follow-the-Ridge quadratic.py),
// function 2
SmallProblem ftr_g2() {
  SmallProblem p{.name = "ftr_g2", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(3.0 * square(x) + 4.0 * x * y + square(y));
  p.starts = {{6.0, 5.0}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-6.0, 6.0}, {-6.0, 6.0}};
  return p;
}

// Jin, Netrapalli, Jordan ICML 2020 (arXiv 1902.00618), Fig. 1 left
SmallProblem jin_nash() {
  SmallProblem p{.name = "jin_nash", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(square(x) - square(y));
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// Jin, Netrapalli, Jordan ICML 2020 (arXiv 1902.00618), Fig. 1 right (unconstrained version)
SmallProblem jin_cos() {
  SmallProblem p{.name = "jin_cos", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(x * y / 5.0 - cos(y));
  p.starts = {{0.5, 1.0}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-3.0, 3.0}, {-6.283185307179586, 6.283185307179586}};
  return p;
}

// Grimmer, Lu, Worah, Mirrokni Math. Prog. 2023 (arXiv 2006.08667)
// (x+3)(x+1)(x-1)(x-3)+Axy-(y+3)(y+1)(y-1)(y-3), A=1
SmallProblem grimmer_A1() {
  SmallProblem p{.name = "grimmer_A1", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(x * y + (x - 3.0) * (x - 1.0) * (x + 1.0) * (x + 3.0) -
                    (y - 3.0) * (y - 1.0) * (y + 1.0) * (y + 3.0));
  p.starts = {{1.0, 1.0}, {2.0, 2.0}};
  p.solutions.push_back(
      {.v = {-2.288613626774319, 2.1764929132657}, .objective = -4.993730325745252});
  p.solutions.push_back({.v = {-2.1764929132657, -2.288613626774319},
                         .objective = 4.993730325745252,
                         .global = true});
  p.solutions.push_back(
      {.v = {2.1764929132657, 2.288613626774319}, .objective = 4.993730325745249, .global = true});
  p.solutions.push_back(
      {.v = {2.288613626774319, -2.1764929132657}, .objective = -4.9937303257452506});
  p.not_minmax = {{0.0, 0.0},
                  {-2.238868367337053, 0.11222610919301965},
                  {-0.11222610919301952, -2.238868367337053},
                  {0.11222610919301955, 2.238868367337053},
                  {2.238868367337053, -0.11222610919301962}};
  p.random_start_box = {{-4.0, 4.0}, {-4.0, 4.0}};
  return p;
}

// Grimmer et al. as above, A=11 (unconstrained)
SmallProblem grimmer_A11() {
  SmallProblem p{.name = "grimmer_A11", .expectation = Expectation::None};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective(11.0 * x * y + (x - 3.0) * (x - 1.0) * (x + 1.0) * (x + 3.0) -
                    (y - 3.0) * (y - 1.0) * (y + 1.0) * (y + 3.0));
  p.starts = {{1.0, 1.0}, {2.0, 2.0}};
  p.not_minmax = {{0.0, 0.0}};
  p.random_start_box = {{-12.0, 12.0}, {-12.0, 12.0}};
  return p;
}

// Daskalakis & Panageas NeurIPS 2018
SmallProblem dp1() {
  SmallProblem p{.name = "dp1", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective((-square(x)) / 8.0 + 3.0 * x * y / 5.0 - square(y) / 2.0);
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-4.0, 4.0}, {-6.0, 6.0}};
  return p;
}

// Daskalakis & Panageas NeurIPS 2018, phase portrait example
SmallProblem dp_poly() {
  SmallProblem p{.name = "dp_poly", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective((square(x) * pow(y, 4.0) - square(y) + 1.0) *
                    (pow(x, 4.0) * square(y) + square(x) + 1.0));
  p.starts = {{0.5, 0.5}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = 1.0, .global = true});
  p.random_start_box = {{-0.2, 0.2}, {-1.0, 1.0}};
  return p;
}

// Dirac-GAN with gradient penalty -(gamma/2) y^2, gamma=0.1
SmallProblem dirac_gan_reg() {
  SmallProblem p{.name = "dirac_gan_reg", .expectation = Expectation::Global};
  const Expression x = p.model.variable(kMin, "x");
  const Expression y = p.model.variable(kMax, "y");
  p.model.objective((-square(y)) / 20.0 - log(1.0 + exp((-x) * y)) - std::log(2.0));
  p.starts = {{1.0, 1.0}};
  p.solutions.push_back({.v = {0.0, 0.0}, .objective = -1.3862943611198906, .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-6.0, 6.0}};
  return p;
}

// Fenchel lifting y'r(x)-|y|^2/2 of Freudenstein-Roth (More-Garbow-Hillstrom 2)
SmallProblem nls_freudenstein() {
  SmallProblem p{.name = "nls_freudenstein", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  p.model.objective((-square(y1)) / 2.0 + y1 * (x1 + x2 * (x2 * (5.0 - x2) - 2.0) - 13.0) -
                    square(y2) / 2.0 + y2 * (x1 + x2 * (x2 * (x2 + 1.0) - 14.0) - 29.0));
  p.starts = {{0.5, -2.0, 0.0, 0.0}};
  p.solutions.push_back({.v = {5.0, 4.0, 0.0, 0.0}, .objective = 0.0, .global = true});
  p.solutions.push_back(
      {.v = {11.412778986902095, -0.8968052532744764, 4.948952095102557, -4.948952095102557},
       .objective = 24.492126839620028});
  p.not_minmax = {{23.920554346431242, 2.23013858660781, 20.23623309008262, -20.23623309008262}};
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// Fenchel lifting y'r(x)-|y|^2/2 of Jennrich-Sampson (MGH 6), nonzero residual
SmallProblem nls_jennrich() {
  SmallProblem p{.name = "nls_jennrich", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  Expression f = 0.0;
  for (int i = 1; i <= 10; ++i) {
    const Expression yi = p.model.variable(kMax, "y" + std::to_string(i));
    const Expression residual = 2.0 + 2.0 * i - (exp(i * x1) + exp(i * x2));
    f += yi * residual - square(yi) / 2.0;
  }
  p.model.objective(f);
  p.starts = {{0.3, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  p.solutions.push_back(
      {.v = {0.25782521367036404, 0.25782521367036404, 1.4117747886742649, 2.6505451277289263,
             3.665428227695094, 4.390576029309785, 4.740773729022333, 4.605743775368752,
             3.842774598877842, 2.2671813585230045, -0.3600389265431344, -4.348183026626155},
       .objective = 62.181091177807424,
       .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0},
                        {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0},
                        {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

// Fenchel lifting y'r(x)-|y|^2/2 of Wood (MGH 14)
SmallProblem nls_wood() {
  SmallProblem p{.name = "nls_wood", .expectation = Expectation::Global};
  const Expression x1 = p.model.variable(kMin, "x1");
  const Expression x2 = p.model.variable(kMin, "x2");
  const Expression x3 = p.model.variable(kMin, "x3");
  const Expression x4 = p.model.variable(kMin, "x4");
  const Expression y1 = p.model.variable(kMax, "y1");
  const Expression y2 = p.model.variable(kMax, "y2");
  const Expression y3 = p.model.variable(kMax, "y3");
  const Expression y4 = p.model.variable(kMax, "y4");
  const Expression y5 = p.model.variable(kMax, "y5");
  const Expression y6 = p.model.variable(kMax, "y6");
  p.model.objective((-square(y1)) / 2.0 + y1 * (-10.0 * square(x1) + 10.0 * x2) - square(y2) / 2.0 +
                    y2 * (1.0 - x1) - square(y3) / 2.0 +
                    3.0 * std::sqrt(10.0) * y3 * (-square(x3) + x4) - square(y4) / 2.0 +
                    y4 * (1.0 - x3) - square(y5) / 2.0 + std::sqrt(10.0) * y5 * (x2 + x4 - 2.0) -
                    square(y6) / 2.0 + std::sqrt(10.0) * y6 * (x2 - x4) / 10.0);
  p.starts = {{-3.0, -1.0, -3.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  p.solutions.push_back(
      {.v = {1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, .objective = 0.0, .global = true});
  p.random_start_box = {{-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0},
                        {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}, {-2.0, 2.0}};
  return p;
}

}  // namespace

std::vector<SmallProblem> unbounded_problems() {
  return {paper_f1(),         paper_f2(),     paper_f3(), paper_f4(),
          paper_ex2(),        paper_ex3(),    tc1(),      adolphs(),
          ftr_g2(),           jin_nash(),     jin_cos(),  grimmer_A1(),
          grimmer_A11(),      dp1(),          dp_poly(),  dirac_gan_reg(),
          nls_freudenstein(), nls_jennrich(), nls_wood()};
}

}  // namespace ipminmax::testing
