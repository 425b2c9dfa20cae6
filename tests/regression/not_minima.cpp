#include <regression/not_minima.hpp>

#include <cmath>
#include <limits>

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;

struct Pair {
  Expression x0, x1;
};
Pair two_variables(Model& model, double lower = -kNoBound, double upper = kNoBound) {
  const Expression x0 = model.variable(kMin, "x0", lower, upper);
  return {x0, model.variable(kMin, "x1", lower, upper)};
}

// --- First-order points that are no minima -------------------------------------------------------

// The product is largest, not smallest, in the middle of the line.
NotMinimum product_on_line() {
  NotMinimum p{.name = "product_on_line", .start = {0.5, 0.5}, .point = {1.0, 1.0}};
  const auto [x0, x1] = two_variables(p.model, 0.0, 4.0);
  p.model.objective(x0 * x1);
  p.model.constraint(x0 + x1, 2.0, 2.0);
  return p;
}

NotMinimum saddle_in_box() {
  NotMinimum p{.name = "saddle_in_box", .start = {0.5, 0.0}, .point = {0.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model, -1.0, 1.0);
  p.model.objective(square(x0) - square(x1));
  return p;
}

NotMinimum maximum_at_start() {
  NotMinimum p{.name = "maximum_at_start", .start = {0.0, 0.0}, .point = {0.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model, -1.0, 1.0);
  p.model.objective(-square(x0) - square(x1));
  return p;
}

NotMinimum ridge_between_wells() {
  NotMinimum p{.name = "ridge_between_wells", .start = {0.0, 1.0}, .point = {0.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(square(x0) - 1.0) + 100.0 * square(x1));
  return p;
}

NotMinimum curved_ridge() {
  NotMinimum p{.name = "curved_ridge", .start = {0.0, 2.0}, .point = {0.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(pow(x1, 4.0) + 50.0 * square(x1) - square(x0) * exp(-square(x0)));
  return p;
}

NotMinimum far_side_of_circle() {
  NotMinimum p{.name = "far_side_of_circle", .start = {1.0, 0.0}, .point = {1.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0);
  p.model.constraint(square(x0) + square(x1), 1.0, 1.0);
  return p;
}

NotMinimum farthest_point_of_circle() {
  NotMinimum p{.name = "farthest_point_of_circle", .start = {-1.5, 0.0}, .point = {-1.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(x0 - 3.0) + square(x1));
  p.model.constraint(square(x0) + square(x1), 1.0, 1.0);
  return p;
}

NotMinimum top_of_cosine() {
  NotMinimum p{.name = "top_of_cosine", .start = {0.0}, .point = {0.0}};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(cos(x));
  return p;
}

// The quadratic form has least value -1 on the sphere, at (0, 0, 1) and its opposite.
NotMinimum middle_eigenvector() {
  NotMinimum p{.name = "middle_eigenvector", .start = {0.0, 1.0, 0.0}, .point = {0.0, 1.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  const Expression x2 = p.model.variable(kMin, "x2");
  p.model.objective(3.0 * square(x0) + square(x1) - square(x2));
  p.model.constraint(square(x0) + square(x1) + square(x2), 1.0, 1.0);
  return p;
}

NotMinimum concave_in_box() {
  NotMinimum p{
      .name = "concave_in_box", .start = {0.0, 0.0, 0.0, 0.0}, .point = {0.0, 0.0, 0.0, 0.0}};
  Expression sum;
  Expression squares;
  for (int i = 0; i < 4; ++i) {
    const Expression x = p.model.variable(kMin, "x" + std::to_string(i), -1.0, 1.0);
    sum += x;
    squares += square(x);
  }
  p.model.objective(square(sum) - 0.5 * squares);
  return p;
}

// Two points of a square, as far apart as possible, starting at the same place.
NotMinimum coincident_points() {
  NotMinimum p{
      .name = "coincident_points", .start = {0.5, 0.5, 0.5, 0.5}, .point = {0.5, 0.5, 0.5, 0.5}};
  const auto [x0, y0] = two_variables(p.model, 0.0, 1.0);
  const auto [x1, y1] = two_variables(p.model, 0.0, 1.0);
  p.model.objective(-square(x0 - x1) - square(y0 - y1));
  return p;
}

// The inequality is active with a positive multiplier; along it the objective falls both ways.
NotMinimum saddle_on_inequality() {
  NotMinimum p{.name = "saddle_on_inequality", .start = {0.0, 2.0}, .point = {0.0, 1.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x1 - square(x0) + 0.1 * pow(x0, 4.0));
  p.model.constraint(x1, 1.0, kNoBound);
  return p;
}

// Rows that bend the feasible set: the objective itself is convex.
NotMinimum top_of_parabola() {
  NotMinimum p{.name = "top_of_parabola", .start = {0.0, 0.5}, .point = {0.0, 0.0}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x1 + 0.25 * square(x0));
  p.model.constraint(x1 + square(x0) - 0.1 * pow(x0, 4.0), 0.0, kNoBound);
  return p;
}

NotMinimum inflection() {
  NotMinimum p{.name = "inflection", .start = {0.0}, .point = {0.0}, .second_order = false};
  const Expression x = p.model.variable(kMin, "x", -1.0, 1.0);
  p.model.objective(pow(x, 3.0));
  return p;
}

NotMinimum monkey_saddle() {
  NotMinimum p{
      .name = "monkey_saddle", .start = {0.0, 0.0}, .point = {0.0, 0.0}, .second_order = false};
  const auto [x0, x1] = two_variables(p.model, -1.0, 1.0);
  p.model.objective(pow(x0, 3.0) - 3.0 * x0 * square(x1));
  return p;
}

NotMinimum flat_top() {
  NotMinimum p{.name = "flat_top", .start = {0.0}, .point = {0.0}, .second_order = false};
  const Expression x = p.model.variable(kMin, "x", -1.0, 1.0);
  p.model.objective(-pow(x, 4.0));
  return p;
}

// --- Infeasible ----------------------------------------------------------------------------------

const std::vector<Status> kInfeasible = {Status::LocallyInfeasible};
const std::vector<Status> kUnbounded = {Status::OuterUnbounded, Status::DivergingIterates};

IllPosed box_below_row() {
  IllPosed p{.name = "box_below_row",
             .start = {0.5, 0.5},
             .verdicts = kInfeasible,
             .truth = Truth::Infeasible};
  const auto [x0, x1] = two_variables(p.model, 0.0, 1.0);
  p.model.objective(x0 + 2.0 * x1);
  p.model.constraint(x0 + x1, 3.0, kNoBound);
  return p;
}

IllPosed square_below_zero() {
  IllPosed p{.name = "square_below_zero",
             .start = {2.0, 1.0},
             .verdicts = kInfeasible,
             .truth = Truth::Infeasible};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0 + square(x1));
  p.model.constraint(square(x0) + 1.0, -kNoBound, 0.0);
  return p;
}

IllPosed circles_apart() {
  IllPosed p{.name = "circles_apart",
             .start = {0.5, 0.5},
             .verdicts = kInfeasible,
             .truth = Truth::Infeasible};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0 + x1);
  p.model.constraint(square(x0) + square(x1), -kNoBound, 1.0);
  p.model.constraint(square(x0 - 3.0) + square(x1), -kNoBound, 1.0);
  return p;
}

IllPosed contradicting_rows() {
  IllPosed p{.name = "contradicting_rows",
             .start = {0.0, 0.0, 0.0},
             .verdicts = kInfeasible,
             .truth = Truth::Infeasible};
  const auto [x0, x1] = two_variables(p.model);
  const Expression x2 = p.model.variable(kMin, "x2");
  p.model.objective(square(x0) + square(x1) + square(x2));
  p.model.constraint(x0 + x1 + x2, 1.0, 1.0);
  p.model.constraint(x0 + x1 + x2, 2.0, 2.0);
  return p;
}

IllPosed empty_row() {
  IllPosed p{.name = "empty_row",
             .start = {1.0},
             .verdicts = {Status::LocallyInfeasible, Status::InvalidProblem},
             .truth = Truth::Infeasible};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(square(x));
  p.model.constraint(0.0, 1.0, kNoBound);
  return p;
}

IllPosed crossed_bounds() {
  IllPosed p{.name = "crossed_bounds",
             .start = {0.0},
             .verdicts = {Status::InvalidProblem},
             .truth = Truth::Invalid};
  const Expression x = p.model.variable(kMin, "x", 1.0, -1.0);
  p.model.objective(square(x));
  return p;
}

IllPosed crossed_row() {
  IllPosed p{.name = "crossed_row",
             .start = {0.0},
             .verdicts = {Status::InvalidProblem},
             .truth = Truth::Invalid};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(square(x));
  p.model.constraint(exp(x), 3.0, 2.0);
  return p;
}

IllPosed bound_not_a_number() {
  IllPosed p{.name = "bound_not_a_number",
             .start = {0.0},
             .verdicts = {Status::InvalidProblem},
             .truth = Truth::Invalid};
  const Expression x = p.model.variable(kMin, "x", std::numeric_limits<double>::quiet_NaN(), 1.0);
  p.model.objective(square(x));
  return p;
}

// --- Unbounded -----------------------------------------------------------------------------------

IllPosed linear_without_bounds() {
  IllPosed p{.name = "linear_without_bounds",
             .start = {0.0, 0.0},
             .verdicts = kUnbounded,
             .truth = Truth::NoMinimum};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0 - 2.0 * x1);
  return p;
}

IllPosed concave_without_bounds() {
  IllPosed p{.name = "concave_without_bounds",
             .start = {1.0, 1.0},
             .verdicts = kUnbounded,
             .truth = Truth::NoMinimum};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(x0) - square(x1));
  return p;
}

IllPosed cubic_without_bounds() {
  IllPosed p{.name = "cubic_without_bounds",
             .start = {-1.0},
             .verdicts = kUnbounded,
             .truth = Truth::NoMinimum};
  p.verdicts.push_back(Status::InertiaCorrectionFailed);  // the curvature passes every shift first
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(pow(x, 3.0));
  return p;
}

IllPosed ray_in_cone() {
  IllPosed p{.name = "ray_in_cone",
             .start = {1.0, 1.0},
             .verdicts = kUnbounded,
             .truth = Truth::NoMinimum};
  const auto [x0, x1] = two_variables(p.model, 0.0);
  p.model.objective(-x0 - x1);
  p.model.constraint(x0 - x1, 0.0, 0.0);
  return p;
}

// --- Ill-posed -----------------------------------------------------------------------------------

// The infimum 0 is not attained: any answer is a matter of the tolerance, none is a minimum.
IllPosed infimum_at_infinity() {
  IllPosed p{
      .name = "infimum_at_infinity",
      .start = {0.0},
      .verdicts = {Status::Solved, Status::SolvedDegenerate, Status::SolvedToAcceptableLevel,
                   Status::OuterUnbounded, Status::DivergingIterates, Status::NotLocalMinmax},
      .truth = Truth::NoMinimum};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(exp(-x));
  return p;
}

IllPosed more_equations_than_variables() {
  IllPosed p{
      .name = "more_equations_than_variables",
      .start = {0.5},
      .verdicts = {Status::TooFewDegreesOfFreedom, Status::Solved, Status::SolvedDegenerate}};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(square(x));
  p.model.constraint(x, 1.0, 1.0);
  p.model.constraint(square(x), 1.0, 1.0);
  return p;
}

IllPosed undefined_at_start() {
  IllPosed p{.name = "undefined_at_start",
             .start = {-1.0},
             .verdicts = {Status::EvaluationFailed, Status::InvalidNumber},
             .truth = Truth::Invalid};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(x - log(x));
  return p;
}

// The slope is infinite at the start.
IllPosed vertical_at_start() {
  IllPosed p{.name = "vertical_at_start",
             .start = {0.0},
             .verdicts = {Status::EvaluationFailed, Status::InvalidNumber},
             .truth = Truth::Invalid};
  const Expression x = p.model.variable(kMin, "x");
  p.model.objective(square(x - 1.0) + sqrt(x));
  return p;
}

// Feasible only at 0, where no multiplier exists.
IllPosed equation_without_multiplier() {
  IllPosed p{.name = "equation_without_multiplier",
             .start = {1.0, 1.0},
             .verdicts = {Status::SolvedDegenerate, Status::SolvedToAcceptableLevel,
                          Status::LocallyInfeasible, Status::TinyStep, Status::MaxIterations,
                          Status::RestorationFailed, Status::NoLocalMinmaxFound,
                          Status::DivergingIterates}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0 + square(x1));
  p.model.constraint(square(x0), 0.0, 0.0);
  return p;
}

// The feasible set is a point without interior.
IllPosed disk_of_radius_zero() {
  IllPosed p{.name = "disk_of_radius_zero",
             .start = {1.0, 1.0},
             .verdicts = {Status::Solved, Status::SolvedDegenerate, Status::SolvedToAcceptableLevel,
                          Status::LocallyInfeasible, Status::TinyStep, Status::RestorationFailed,
                          Status::MaxIterations}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(x0 + x1);
  p.model.constraint(square(x0) + square(x1), -kNoBound, 0.0);
  return p;
}

// Everything is a minimum.
IllPosed constant_objective() {
  IllPosed p{.name = "constant_objective", .start = {1.0}, .verdicts = {Status::Solved}};
  p.model.variable(kMin, "x");
  p.model.objective(7.0);
  return p;
}

// A valley floor of minima.
IllPosed singular_quadratic() {
  IllPosed p{.name = "singular_quadratic", .start = {1.0, 2.0}, .verdicts = {Status::Solved}};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(x0 + x1));
  return p;
}

// Complementarity: the constraints qualify at no feasible point.
IllPosed complementarity() {
  IllPosed p{.name = "complementarity",
             .start = {1.0, 0.5},
             .verdicts = {Status::Solved, Status::SolvedDegenerate, Status::SolvedToAcceptableLevel,
                          Status::TinyStep, Status::RestorationFailed, Status::LocallyInfeasible,
                          Status::MaxIterations}};
  const auto [x0, x1] = two_variables(p.model, 0.0);
  p.model.objective(square(x0 - 1.0) + square(x1 - 2.0));
  p.model.constraint(x0 * x1, -kNoBound, 0.0);
  return p;
}

// --- Starts at which the violation is stationary, but no minimum ---------------------------------

const std::vector<Status> kSolved = {Status::Solved, Status::SolvedDegenerate};

IllPosed center_of_circle() {
  IllPosed p{.name = "center_of_circle", .start = {0.0, 0.0}, .verdicts = kSolved};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(x0) * square(x1));
  p.model.constraint(square(x0) + square(x1), 1.0, 1.0);
  return p;
}

IllPosed between_branches_of_hyperbola() {
  IllPosed p{.name = "between_branches_of_hyperbola", .start = {0.0, 0.0}, .verdicts = kSolved};
  const auto [x0, x1] = two_variables(p.model);
  p.model.objective(square(x0) + square(x1));
  p.model.constraint(x0 * x1, 1.0, 1.0);
  return p;
}

IllPosed center_of_forbidden_disk() {
  IllPosed p{.name = "center_of_forbidden_disk", .start = {0.0, 0.0}, .verdicts = kSolved};
  const auto [x0, x1] = two_variables(p.model, -3.0, 3.0);
  p.model.objective(square(x0) + square(x1));
  p.model.constraint(square(x0) + square(x1), 4.0, kNoBound);
  return p;
}

IllPosed saddle_of_violation() {
  IllPosed p{.name = "saddle_of_violation", .start = {0.0, 0.0}, .verdicts = kSolved};
  const auto [x0, x1] = two_variables(p.model, -3.0, 3.0);
  p.model.objective(square(x0) + square(x1));
  p.model.constraint(square(x0) - square(x1), 4.0, kNoBound);
  return p;
}

}  // namespace

const std::vector<NotMinimum>& not_minima() {
  static const std::vector<NotMinimum> models = {product_on_line(),
                                                 saddle_in_box(),
                                                 maximum_at_start(),
                                                 ridge_between_wells(),
                                                 curved_ridge(),
                                                 far_side_of_circle(),
                                                 farthest_point_of_circle(),
                                                 top_of_cosine(),
                                                 middle_eigenvector(),
                                                 concave_in_box(),
                                                 coincident_points(),
                                                 saddle_on_inequality(),
                                                 top_of_parabola(),
                                                 inflection(),
                                                 monkey_saddle(),
                                                 flat_top()};
  return models;
}

std::string_view describe(Truth truth) {
  switch (truth) {
    case Truth::HasSolution:
      return "has a solution";
    case Truth::Infeasible:
      return "infeasible";
    case Truth::NoMinimum:
      return "no minimum";
    case Truth::Invalid:
      return "invalid";
  }
  return "unknown";
}

const std::vector<IllPosed>& ill_posed() {
  static const std::vector<IllPosed> models = {box_below_row(),
                                               square_below_zero(),
                                               circles_apart(),
                                               contradicting_rows(),
                                               empty_row(),
                                               crossed_bounds(),
                                               crossed_row(),
                                               bound_not_a_number(),
                                               linear_without_bounds(),
                                               concave_without_bounds(),
                                               cubic_without_bounds(),
                                               ray_in_cone(),
                                               infimum_at_infinity(),
                                               more_equations_than_variables(),
                                               undefined_at_start(),
                                               vertical_at_start(),
                                               equation_without_multiplier(),
                                               disk_of_radius_zero(),
                                               constant_objective(),
                                               singular_quadratic(),
                                               complementarity(),
                                               center_of_circle(),
                                               between_branches_of_hyperbola(),
                                               center_of_forbidden_disk(),
                                               saddle_of_violation()};
  return models;
}

}  // namespace ipminmax::testing
