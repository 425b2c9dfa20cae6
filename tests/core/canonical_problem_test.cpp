#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "core/model/canonical_problem.hpp"

namespace ipminmax {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// A model whose functions have the same values everywhere, given entry by entry.
class FixedValues final : public Problem {
 public:
  ProblemStructure shape;
  std::vector<double> v, lambda, z_lower, z_upper;  ///< what the model starts from
  double f = 0.0;
  std::vector<double> gradient_values, g, jacobian_values, hessian_values;
  std::optional<UserScaling> scaling;
  bool has_start = true;
  std::string undefined;    ///< name of the function that is undefined
  std::vector<bool> new_v;  ///< as passed, call by call
  double sigma = 0.0;       ///< as last passed to hessian
  std::vector<double> hessian_lambda;

  const ProblemStructure& structure() const override { return shape; }
  bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v, start.v.begin());
    if (start.needs_multipliers) {
      std::ranges::copy(lambda, start.lambda.begin());
      std::ranges::copy(z_lower, start.z_lower.begin());
      std::ranges::copy(z_upper, start.z_upper.begin());
    }
    return has_start;
  }
  bool user_scaling(UserScaling& out) override {
    if (scaling) out = *scaling;
    return scaling.has_value();
  }
  bool objective(std::span<const double>, bool fresh, double& value) override {
    new_v.push_back(fresh);
    value = f;
    return undefined != "objective";
  }
  bool gradient(std::span<const double>, bool fresh, std::span<double> out) override {
    new_v.push_back(fresh);
    std::ranges::copy(gradient_values, out.begin());
    return undefined != "gradient";
  }
  bool constraints(std::span<const double>, bool fresh, std::span<double> out) override {
    new_v.push_back(fresh);
    std::ranges::copy(g, out.begin());
    return undefined != "constraints";
  }
  bool jacobian(std::span<const double>, bool fresh, std::span<double> out) override {
    new_v.push_back(fresh);
    std::ranges::copy(jacobian_values, out.begin());
    return undefined != "jacobian";
  }
  bool hessian(std::span<const double>, bool fresh, double objective_factor,
               std::span<const double> multipliers, bool, std::span<double> out) override {
    new_v.push_back(fresh);
    sigma = objective_factor;
    hessian_lambda.assign(multipliers.begin(), multipliers.end());
    std::ranges::copy(hessian_values, out.begin());
    return undefined != "hessian";
  }
};

/// Variables y0, x0, fixed (Min), y1, x1, fixed (Max); constraints Max inequality, Min equality,
/// free row, Min inequality, Max equality.
FixedValues mixed_model() {
  FixedValues model;
  model.shape = {
      .variable_players = {kMax, kMin, kMin, kMax, kMin, kMax},
      .constraint_players = {kMax, kMin, kMin, kMin, kMax},
      .variable_lower = {-1.0, -kInf, 7.0, -kInf, 0.0, -3.0},
      .variable_upper = {kInf, 4.0, 7.0, kInf, 2.0, -3.0},
      .constraint_lower = {-kInf, 5.0, -kInf, 1.0, -2.0},
      .constraint_upper = {10.0, 5.0, kInf, 3.0, -2.0},
      .jacobian = {{0, 0}, {0, 1}, {1, 4}, {1, 2}, {2, 1}, {3, 1}, {4, 3}, {4, 5}, {3, 4}},
      .hessian = {{0, 0}, {1, 0}, {3, 2}, {4, 3}, {4, 4}, {1, 4}, {5, 5}},
      .variable_names = {"y0", "x0", "fixed", "y1", "x1", "fixed_y"},
      .constraint_names = {"cap", "balance", "free", "band", "link"}};
  model.v = {1.0, 2.0, 0.0, 3.0, 1.0, 0.0};
  model.lambda.assign(5, 0.0);
  model.z_lower.assign(6, 0.0);
  model.z_upper.assign(6, 0.0);
  model.f = 12.0;
  model.gradient_values = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  model.g = {9.0, 6.0, 100.0, 2.5, -1.0};
  model.jacobian_values = {11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0};
  model.hessian_values = {21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0};
  return model;
}

SolverOptions plain_options() {
  SolverOptions options;
  options.nlp_scaling_method = Scaling::None;
  options.bound_relax_factor = 0.0;
  return options;
}

/// The canonical form of a model with its evaluations.
struct Canonical {
  FixedValues model;
  SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem problem;
  std::string error;
  Evaluation evaluation;

  Canonical(FixedValues from, const SolverOptions& with)
      : model(std::move(from)), options(with), problem(model, options, counts, timing) {
    error = problem.build();
    if (!error.empty()) return;
    evaluation.c.setZero(problem.constraints());
    evaluation.gradient.setZero(problem.variables());
    evaluation.jacobian.assign(problem.jacobian().size(), 0.0);
    evaluation.hessian.assign(problem.hessian().size(), 0.0);
  }
  Canonical(const Canonical&) = delete;
  Canonical& operator=(const Canonical&) = delete;

  Eigen::VectorXd zero() const { return Eigen::VectorXd::Zero(problem.variables()); }
  Eigen::VectorXd no_lambda() const { return Eigen::VectorXd::Zero(problem.constraints()); }

  Eigen::MatrixXd jacobian() {
    EXPECT_TRUE(problem.first_derivatives(zero(), evaluation));
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(problem.constraints(), problem.variables());
    for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
      dense(problem.jacobian()[k].row, problem.jacobian()[k].col) += evaluation.jacobian[k];
    }
    return dense;
  }
  /// Lower triangle, as stored.
  Eigen::MatrixXd hessian() {
    EXPECT_TRUE(problem.second_derivatives(zero(), no_lambda(), evaluation));
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(problem.variables(), problem.variables());
    for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
      dense(problem.hessian()[k].row, problem.hessian()[k].col) += evaluation.hessian[k];
    }
    return dense;
  }
};

// Canonical order of mixed_model: x0 x1 | s_band | y0 y1 | s_cap;  balance band | cap link.

TEST(CanonicalOrder, IsMinThenMaxEachWithItsSlacks) {
  Canonical c(mixed_model(), plain_options());
  ASSERT_EQ(c.error, "");
  EXPECT_EQ(c.problem.variables(), 6);
  EXPECT_EQ(c.problem.constraints(), 4);
  const auto is = [](IndexRange range, Index begin, Index end) {
    return range.begin == begin && range.end == end;
  };
  EXPECT_TRUE(is(c.problem.x(), 0, 2));
  EXPECT_TRUE(is(c.problem.x_slacks(), 2, 3));
  EXPECT_TRUE(is(c.problem.y(), 3, 5));
  EXPECT_TRUE(is(c.problem.y_slacks(), 5, 6));
  EXPECT_TRUE(is(c.problem.min_constraints(), 0, 2));
  EXPECT_TRUE(is(c.problem.max_constraints(), 2, 4));
  EXPECT_EQ(c.problem.max_size(), 3);
  EXPECT_TRUE(c.problem.has_max_bounds());
  const auto slacks = c.problem.slack_of_constraint();
  EXPECT_EQ(std::vector<Index>(slacks.begin(), slacks.end()), (std::vector<Index>{-1, 2, 5, -1}));
  for (Index i = 0; i < 6; ++i) {
    EXPECT_EQ(c.problem.owned_by_max(i), i >= 3);
    EXPECT_EQ(c.problem.sign(i), i >= 3 ? -1.0 : 1.0);
  }
}

TEST(CanonicalOrder, PutsDerivativesInTheirPlaces) {
  Canonical c(mixed_model(), plain_options());
  const Eigen::MatrixXd jacobian = c.jacobian();
  EXPECT_TRUE(jacobian.isApprox(Eigen::MatrixXd{
      {0, 13, 0, 0, 0, 0}, {16, 19, 0, 0, 0, 0}, {12, 0, 0, 11, 0, 0}, {0, 0, 0, 0, 17, 0}}))
      << jacobian;
  EXPECT_TRUE(c.evaluation.gradient.isApprox(Eigen::VectorXd{{2, 5, 0, 1, 4, 0}}));
  // (1,0) is x0 y0, (4,3) is x1 y1, (1,4) lies above the diagonal; entries of fixed variables go.
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(6, 6);
  hessian(3, 3) = 21;
  hessian(3, 0) = 22;
  hessian(4, 1) = 24;
  hessian(1, 1) = 25;
  hessian(1, 0) = 26;
  EXPECT_TRUE(c.hessian().isApprox(hessian)) << c.hessian();
}

TEST(CanonicalOrder, SubtractsSlacksAndRightHandSides) {
  Canonical c(mixed_model(), plain_options());
  Eigen::VectorXd v = c.zero();
  v[2] = 0.5;   // slack of band
  v[5] = -4.0;  // slack of cap
  ASSERT_TRUE(c.problem.constraints(v, c.evaluation.c));
  EXPECT_TRUE(c.evaluation.c.isApprox(Eigen::VectorXd{{6.0 - 5.0, 2.5 - 0.5, 9.0 + 4.0, 1.0}}))
      << c.evaluation.c.transpose();
}

TEST(CanonicalOrder, GivesTheModelItsOwnOrderAndTheFixedValues) {
  Canonical c(mixed_model(), plain_options());
  const auto point = c.problem.model_point(Eigen::VectorXd{{1.5, 1.75, 0, -0.5, -0.25, 0}});
  EXPECT_EQ(std::vector<double>(point.begin(), point.end()),
            (std::vector<double>{-0.5, 1.5, 7.0, -0.25, 1.75, -3.0}));
}

TEST(CanonicalOrder, PassesMultipliersInTheModelsOrder) {
  Canonical c(mixed_model(), plain_options());
  const Eigen::VectorXd lambda{{1.0, 2.0, 3.0, 4.0}};
  ASSERT_TRUE(c.problem.second_derivatives(c.zero(), lambda, c.evaluation));
  EXPECT_EQ(c.model.hessian_lambda, (std::vector<double>{3.0, 1.0, 0.0, 2.0, 4.0}));
  EXPECT_EQ(c.model.sigma, 1.0);
}

TEST(CanonicalOrder, AddsDuplicatesAndMirrorsEntriesAboveTheDiagonal) {
  FixedValues model;
  model.shape = {.variable_players = {kMin, kMin},
                 .constraint_players = {kMin},
                 .variable_lower = {-kInf, -kInf},
                 .variable_upper = {kInf, kInf},
                 .constraint_lower = {0.0},
                 .constraint_upper = {0.0},
                 .jacobian = {{0, 1}, {0, 0}, {0, 1}},
                 .hessian = {{0, 1}, {1, 0}, {1, 1}, {1, 1}},
                 .variable_names = {},
                 .constraint_names = {}};
  model.v = {0.0, 0.0};
  model.gradient_values = {0.0, 0.0};
  model.g = {0.0};
  model.jacobian_values = {1.0, 2.0, 4.0};
  model.hessian_values = {8.0, 16.0, 32.0, 64.0};
  Canonical c(std::move(model), plain_options());
  ASSERT_EQ(c.error, "");
  EXPECT_TRUE(c.jacobian().isApprox(Eigen::MatrixXd{{2.0, 5.0}}));
  EXPECT_TRUE(c.hessian().isApprox(Eigen::MatrixXd{{0.0, 0.0}, {24.0, 96.0}}));
}

TEST(CanonicalOrder, AllVariablesFixedLeavesOnlySlacks) {
  FixedValues model = mixed_model();
  model.shape.variable_lower = model.shape.variable_upper = {1, 2, 3, 4, 5, 6};
  model.shape.constraint_lower[1] = 4.0;  // no equalities
  model.shape.constraint_lower[4] = -3.0;
  Canonical c(std::move(model), plain_options());
  ASSERT_EQ(c.error, "");
  EXPECT_EQ(c.problem.x().size() + c.problem.y().size(), 0);
  EXPECT_EQ(c.problem.variables(), 4);
  EXPECT_EQ(c.problem.jacobian().size(), 0U);
  EXPECT_EQ(c.problem.hessian().size(), 0U);
}

TEST(CanonicalBounds, AreTheModelsAndTheSlacks) {
  Canonical c(mixed_model(), plain_options());
  EXPECT_EQ(c.problem.lower(), (Eigen::VectorXd{{-kInf, 0.0, 1.0, -1.0, -kInf, -kInf}}));
  EXPECT_EQ(c.problem.upper(), (Eigen::VectorXd{{4.0, 2.0, 3.0, kInf, kInf, 10.0}}));
  const auto list = [](std::span<const Index> s) { return std::vector<Index>(s.begin(), s.end()); };
  EXPECT_EQ(list(c.problem.lower_bounded()), (std::vector<Index>{1, 2, 3}));
  EXPECT_EQ(list(c.problem.upper_bounded()), (std::vector<Index>{0, 1, 2, 5}));
}

TEST(CanonicalBounds, AreRelaxedRelativeToTheirSize) {
  SolverOptions options = plain_options();
  options.bound_relax_factor = 1e-2;
  options.constr_viol_tol = 1.0;
  Canonical c(mixed_model(), options);
  EXPECT_DOUBLE_EQ(c.problem.lower()[1], -0.01);  // 0
  EXPECT_DOUBLE_EQ(c.problem.lower()[3], -1.01);  // -1
  EXPECT_DOUBLE_EQ(c.problem.upper()[0], 4.04);   // 4
  EXPECT_DOUBLE_EQ(c.problem.lower()[2], 0.99);   // slack, 1
  EXPECT_DOUBLE_EQ(c.problem.upper()[5], 10.1);   // slack, 10
  EXPECT_EQ(c.problem.lower()[0], -kInf);
}

TEST(CanonicalBounds, AreRelaxedByALittleOfTheIntervalBetweenThem) {
  FixedValues model = mixed_model();
  model.shape.variable_upper[4] = 1e-3;  // 0 below
  SolverOptions options = plain_options();
  options.bound_relax_factor = 1e-4;
  Canonical c(std::move(model), options);
  EXPECT_DOUBLE_EQ(c.problem.lower()[1], -1e-5);
  EXPECT_DOUBLE_EQ(c.problem.upper()[1], 1e-3 + 1e-5);
}

TEST(CanonicalBounds, AreRelaxedByAtMostConstrViolTol) {
  SolverOptions options = plain_options();
  options.bound_relax_factor = 1e-2;
  options.constr_viol_tol = 0.02;
  Canonical c(mixed_model(), options);
  EXPECT_DOUBLE_EQ(c.problem.lower()[1], -0.01);  // 0
  EXPECT_DOUBLE_EQ(c.problem.upper()[0], 4.02);   // 4
  EXPECT_LE(c.problem.upper()[0] - 4.0, 0.02);
  EXPECT_DOUBLE_EQ(c.problem.upper()[5], 10.02);  // slack, 10
}

TEST(CanonicalBounds, BeyondTheInfinityOptionsAreAbsent) {
  FixedValues model = mixed_model();
  model.shape.variable_lower[0] = -1e19;
  model.shape.variable_lower[4] = -9e18;
  model.shape.variable_upper[4] = 1e19;
  model.shape.constraint_upper[0] = 2e19;  // cap is now a free row
  Canonical c(std::move(model), plain_options());
  ASSERT_EQ(c.error, "");
  EXPECT_EQ(c.problem.y_slacks().size(), 0);
  EXPECT_EQ(c.problem.lower()[3], -kInf);
  EXPECT_EQ(c.problem.lower()[1], -9e18);
  EXPECT_EQ(c.problem.upper()[1], kInf);
  EXPECT_FALSE(c.problem.has_max_bounds());
}

TEST(CanonicalScaling, GradientBasedBringsLargeGradientsDown) {
  FixedValues model = mixed_model();
  model.gradient_values = {1.0, 2.0, 1e9, -400.0, 5.0, 1e9};  // 1e9: fixed variables do not count
  model.jacobian_values = {11.0, -200.0, 13.0, 1e9, 15.0, 16.0, 1e12, 18.0, 100.0};
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::GradientBased;
  Canonical c(std::move(model), options);
  ASSERT_EQ(c.error, "");
  EXPECT_DOUBLE_EQ(c.problem.objective_scale(), 0.25);
  EXPECT_DOUBLE_EQ(c.problem.constraint_scale(0), 1.0);   // balance: 13
  EXPECT_DOUBLE_EQ(c.problem.constraint_scale(1), 1.0);   // band: exactly 100
  EXPECT_DOUBLE_EQ(c.problem.constraint_scale(2), 0.5);   // cap
  EXPECT_DOUBLE_EQ(c.problem.constraint_scale(3), 1e-8);  // link: nlp_scaling_min_value
  EXPECT_DOUBLE_EQ(c.problem.upper()[5], 5.0) << "slacks are measured as their constraints";
  double f = 0.0;
  ASSERT_TRUE(c.problem.objective(c.zero(), f));
  EXPECT_DOUBLE_EQ(f, 3.0);
  EXPECT_DOUBLE_EQ(c.problem.unscaled_objective(f), 12.0);
  EXPECT_DOUBLE_EQ(c.jacobian()(2, 0), -100.0);
  EXPECT_DOUBLE_EQ(c.evaluation.gradient[4], -100.0);
  ASSERT_TRUE(c.problem.constraints(c.zero(), c.evaluation.c));
  EXPECT_DOUBLE_EQ(c.evaluation.c[2], 4.5);
  EXPECT_DOUBLE_EQ(c.evaluation.c[3], 1e-8);
}

TEST(CanonicalScaling, GradientBasedFactorsStayInTheRangeOfOthers) {
  FixedValues model = mixed_model();
  model.gradient_values = {1.0, 2.0, 1e9, -400.0, 5.0, 1e9};
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::GradientBased;
  options.nlp_scaling_max_gradient = 1e-300;
  options.nlp_scaling_min_value = 0.0;
  Canonical c(std::move(model), options);
  ASSERT_EQ(c.error, "");
  EXPECT_DOUBLE_EQ(c.problem.objective_scale(), 1e-20);
  EXPECT_DOUBLE_EQ(c.problem.constraint_scale(0), 1e-20);
}

TEST(CanonicalScaling, TheHessianGetsTheScaledMultipliers) {
  FixedValues model = mixed_model();
  model.jacobian_values[1] = 200.0;
  model.gradient_values[0] = 400.0;
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::GradientBased;
  Canonical c(std::move(model), options);
  const Eigen::VectorXd lambda{{1.0, 2.0, 3.0, 4.0}};
  ASSERT_TRUE(c.problem.second_derivatives(c.zero(), lambda, c.evaluation, 2.0));
  EXPECT_DOUBLE_EQ(c.model.sigma, 0.5);
  EXPECT_EQ(c.model.hessian_lambda, (std::vector<double>{1.5, 1.0, 0.0, 2.0, 4.0}));
}

TEST(CanonicalScaling, UserFactorsScaleEverything) {
  FixedValues model = mixed_model();
  model.scaling = UserScaling{.objective = 3.0,
                              .variables = {2.0, 4.0, 9.0, 5.0, 10.0, 9.0},
                              .constraints = {0.5, 2.0, 1.0, 4.0, 0.25}};
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::User;
  options.obj_scaling_factor = 2.0;
  Canonical c(std::move(model), options);
  ASSERT_EQ(c.error, "");
  EXPECT_DOUBLE_EQ(c.problem.objective_scale(), 6.0);
  EXPECT_DOUBLE_EQ(c.problem.variable_scale(1), 10.0);
  EXPECT_DOUBLE_EQ(c.problem.starting_point().v[4], 15.0);
  EXPECT_DOUBLE_EQ(c.problem.upper()[0], 16.0);
  EXPECT_DOUBLE_EQ(c.problem.lower()[3], -2.0);
  EXPECT_DOUBLE_EQ(c.problem.upper()[2], 12.0);
  EXPECT_DOUBLE_EQ(c.problem.upper()[5], 5.0);
  const Eigen::MatrixXd jacobian = c.jacobian();
  EXPECT_DOUBLE_EQ(jacobian(1, 1), 4.0 * 19.0 / 10.0);
  EXPECT_DOUBLE_EQ(jacobian(2, 3), 0.5 * 11.0 / 2.0);
  EXPECT_DOUBLE_EQ(c.evaluation.gradient[1], 6.0 * 5.0 / 10.0);
  const Eigen::MatrixXd hessian = c.hessian();
  EXPECT_DOUBLE_EQ(c.model.sigma, 6.0);
  EXPECT_DOUBLE_EQ(hessian(1, 0), 26.0 / 40.0);
  EXPECT_DOUBLE_EQ(hessian(3, 3), 21.0 / 4.0);
  ASSERT_TRUE(c.problem.constraints(c.zero(), c.evaluation.c));
  EXPECT_TRUE(c.evaluation.c.isApprox(Eigen::VectorXd{{2.0, 10.0, 4.5, 0.25}}));
  const auto point = c.problem.model_point(Eigen::VectorXd{{4, 10, 0, 2, 5, 0}});
  EXPECT_EQ(std::vector<double>(point.begin(), point.end()),
            (std::vector<double>{1.0, 1.0, 7.0, 1.0, 1.0, -3.0}));
}

TEST(CanonicalScaling, UserFactorsHaveToBePositiveNumbers) {
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::User;
  const auto error = [&](const UserScaling& scaling) {
    FixedValues model = mixed_model();
    model.scaling = scaling;
    return Canonical(std::move(model), options).error;
  };
  EXPECT_NE(error({.objective = kNaN, .variables = {}, .constraints = {}}).find("objective"),
            std::string::npos);
  EXPECT_NE(error({.objective = 0.0, .variables = {}, .constraints = {}}).find("objective"),
            std::string::npos);
  EXPECT_NE(error({.objective = 1.0, .variables = {1, 0, 1, 1, 1, 1}, .constraints = {}})
                .find("variable 1 (x0)"),
            std::string::npos);
  EXPECT_NE(error({.objective = 1.0, .variables = {}, .constraints = {1, 1, 1, -1, 1}})
                .find("constraint 3 (band)"),
            std::string::npos);
}

TEST(CanonicalStart, IsPushedInsideAsWaechterAndBieglerDo) {
  // One variable; p = min(kappa1 max(1, |bound|), kappa2 (upper - lower)).
  const auto start = [](double value, double lower, double upper, bool warm = false) {
    FixedValues model;
    model.shape = {.variable_players = {kMax},
                   .constraint_players = {},
                   .variable_lower = {lower},
                   .variable_upper = {upper},
                   .constraint_lower = {},
                   .constraint_upper = {},
                   .jacobian = {},
                   .hessian = {},
                   .variable_names = {},
                   .constraint_names = {}};
    model.v = {value};
    model.gradient_values = {0.0};
    SolverOptions options = plain_options();
    options.bound_push = 0.1;
    options.bound_frac = 0.2;
    options.warm_start_bound_push = 0.01;
    options.warm_start_bound_frac = 0.02;
    options.warm_start_init_point = warm;
    model.z_lower = model.z_upper = {0.0};
    Canonical c(std::move(model), options);
    EXPECT_EQ(c.error, "");
    return c.problem.starting_point().v[0];
  };
  EXPECT_DOUBLE_EQ(start(-7.0, -kInf, kInf), -7.0);
  EXPECT_DOUBLE_EQ(start(5.0, 1.0, kInf), 5.0);
  EXPECT_DOUBLE_EQ(start(1.0, 1.0, kInf), 1.1);
  EXPECT_DOUBLE_EQ(start(-50.0, 20.0, kInf), 22.0) << "relative to the size of the bound";
  EXPECT_DOUBLE_EQ(start(50.0, -kInf, -20.0), -22.0);
  EXPECT_DOUBLE_EQ(start(-1.0, 0.0, 10.0), 0.1);
  EXPECT_DOUBLE_EQ(start(-1.0, 0.0, 0.25), 0.05) << "a fraction of a narrow interval";
  EXPECT_DOUBLE_EQ(start(9.0, 0.0, 0.25), 0.2);
  EXPECT_DOUBLE_EQ(start(0.12, 0.0, 0.25), 0.12);
  EXPECT_DOUBLE_EQ(start(1.0, 1.0, kInf, true), 1.01);
  EXPECT_DOUBLE_EQ(start(9.0, 0.0, 0.25, true), 0.245);
}

TEST(CanonicalStart, StaysTheSameWhateverIsEvaluated) {
  Canonical c(mixed_model(), plain_options());
  const Eigen::VectorXd start = c.problem.starting_point().v;
  double f = 0.0;
  ASSERT_TRUE(c.problem.objective(Eigen::VectorXd::Constant(6, 0.5), f));
  EXPECT_EQ(c.problem.starting_point().v, start);
}

TEST(CanonicalStart, SlacksStartAtTheirConstraintPushedInside) {
  FixedValues model = mixed_model();
  SolverOptions options = plain_options();
  options.slack_bound_push = 0.1;
  options.slack_bound_frac = 0.25;
  options.warm_start_slack_bound_push = 0.01;
  for (const bool warm : {false, true}) {
    options.warm_start_init_point = warm;
    Canonical c(model, options);
    Iterate start = c.problem.starting_point();
    EXPECT_EQ(start.v[2], 0.0);
    EXPECT_EQ(start.v[5], 0.0);
    // band in [1, 3] at 2.5 stays; cap <= 10 at 9.7 is pushed below 10.
    c.problem.start_slacks(start, Eigen::VectorXd{{0.0, 2.5, 9.7, 0.0}});
    EXPECT_DOUBLE_EQ(start.v[2], 2.5);
    EXPECT_DOUBLE_EQ(start.v[5], warm ? 9.7 : 9.0);
    c.problem.start_slacks(start, Eigen::VectorXd{{0.0, -2.5, 99.0, 0.0}});
    EXPECT_DOUBLE_EQ(start.v[2], warm ? 1.002 : 1.1);
    EXPECT_DOUBLE_EQ(start.v[5], warm ? 9.9 : 9.0);
  }
}

TEST(CanonicalStart, ColdStartIgnoresTheModelsMultipliers) {
  FixedValues model = mixed_model();
  model.lambda.assign(5, 1.0);
  Canonical c(std::move(model), plain_options());
  EXPECT_TRUE(c.problem.starting_point().lambda.isZero());
}

TEST(CanonicalStart, WarmStartTurnsTheModelsSignsIntoPositiveMultipliers) {
  FixedValues model = mixed_model();
  model.z_lower = {-5.0, 0.0, 9.0, 0.0, 6.0, 9.0};  // y0 is Max: <= 0
  model.z_upper = {0.0, 7.0, 9.0, 0.0, 0.0, 9.0};
  model.lambda = {-3.0, 1e9, 9.0, -2.0, -4.0};
  SolverOptions options = plain_options();
  options.warm_start_init_point = true;
  options.warm_start_mult_init_max = 1e3;
  Canonical c(std::move(model), options);
  const Iterate start = c.problem.starting_point();
  EXPECT_TRUE(start.lambda.isApprox(Eigen::VectorXd{{1e3, -2.0, -3.0, -4.0}}))
      << start.lambda.transpose();
  // Slacks: -lambda + sign (z_upper - z_lower) = 0. band (Min) at -2 holds its lower bound,
  // cap (Max) at -3 its upper bound.
  EXPECT_TRUE(start.z_lower.isApprox(Eigen::VectorXd{{0.0, 6.0, 2.0, 5.0, 0.0, 0.0}}))
      << start.z_lower.transpose();
  EXPECT_TRUE(start.z_upper.isApprox(Eigen::VectorXd{{7.0, 0.0, 0.0, 0.0, 0.0, 3.0}}))
      << start.z_upper.transpose();
}

TEST(CanonicalStart, WarmStartOfARestoredPointGivesThePointBack) {
  FixedValues model = mixed_model();
  model.scaling = UserScaling{.objective = -3.0,
                              .variables = {2.0, 4.0, 9.0, 5.0, 10.0, 9.0},
                              .constraints = {0.5, 2.0, 1.0, 4.0, 0.25}};
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::User;
  options.warm_start_init_point = true;
  Canonical first(model, options);
  ASSERT_EQ(first.error, "");
  Iterate iterate = first.problem.starting_point();
  iterate.lambda << 0.3, 0.7, -0.2, 1.1;
  iterate.z_lower << 0.0, 0.4, 0.0, 0.6, 0.0, 0.0;
  iterate.z_upper << 0.8, 0.9, 0.7, 0.0, 0.0, 0.2;
  Result result;
  first.problem.restore(iterate, result);
  model.v = result.v;
  model.lambda = result.lambda;
  model.z_lower = result.z_lower;
  model.z_upper = result.z_upper;
  Canonical second(model, options);
  const Iterate again = second.problem.starting_point();
  EXPECT_TRUE(again.v.isApprox(iterate.v)) << again.v.transpose();
  EXPECT_TRUE(again.lambda.isApprox(iterate.lambda)) << again.lambda.transpose();
  EXPECT_TRUE(again.z_lower.isApprox(iterate.z_lower)) << again.z_lower.transpose();
  EXPECT_TRUE(again.z_upper.isApprox(iterate.z_upper)) << again.z_upper.transpose();
}

/// grad f + J' lambda - z_lower + z_upper in the model's units.
Eigen::VectorXd model_stationarity(const FixedValues& model, const Result& result) {
  Eigen::VectorXd residual(6);
  for (std::size_t i = 0; i < 6; ++i) {
    residual[static_cast<Index>(i)] =
        model.gradient_values[i] - result.z_lower[i] + result.z_upper[i];
  }
  for (std::size_t k = 0; k < model.shape.jacobian.size(); ++k) {
    const auto [row, col] = model.shape.jacobian[k];
    residual[col] += model.jacobian_values[k] * result.lambda[static_cast<std::size_t>(row)];
  }
  return residual;
}

class Restore : public ::testing::TestWithParam<double> {};  // the objective's factor

TEST_P(Restore, MultipliersHaveTheSignsOfTheStationarityCondition) {
  FixedValues model = mixed_model();
  model.scaling = UserScaling{.objective = GetParam(),
                              .variables = {2.0, 4.0, 9.0, 5.0, 10.0, 9.0},
                              .constraints = {0.5, 2.0, 1.0, 4.0, 0.25}};
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::User;
  Canonical c(std::move(model), options);
  ASSERT_EQ(c.error, "");
  Iterate iterate = c.problem.starting_point();
  iterate.lambda << 0.3, 0.7, -0.2, 1.1;
  iterate.z_lower << 0.0, 0.4, 0.5, 0.6, 0.0, 0.0;
  iterate.z_upper << 0.8, 0.9, 0.1, 0.0, 0.0, 0.2;
  // The canonical condition grad f + J' lambda + sign (z_upper - z_lower).
  const Eigen::MatrixXd jacobian = c.jacobian();
  const Eigen::VectorXd sign{{1, 1, 1, -1, -1, -1}};
  const Eigen::VectorXd canonical = c.evaluation.gradient + jacobian.transpose() * iterate.lambda +
                                    sign.cwiseProduct(iterate.z_upper - iterate.z_lower);
  Result result;
  c.problem.restore(iterate, result);
  const Eigen::VectorXd found = model_stationarity(c.model, result);
  const double scale = c.problem.objective_scale();
  EXPECT_NEAR(found[1], canonical[0] * 4.0 / scale, 1e-12);   // x0
  EXPECT_NEAR(found[4], canonical[1] * 10.0 / scale, 1e-12);  // x1
  EXPECT_NEAR(found[0], canonical[3] * 2.0 / scale, 1e-12);   // y0
  EXPECT_NEAR(found[3], canonical[4] * 5.0 / scale, 1e-12);   // y1
  EXPECT_NEAR(found[2], 0.0, 1e-12) << "fixed Min variable";
  EXPECT_NEAR(found[5], 0.0, 1e-12) << "fixed Max variable";
  // With a positive factor Min multipliers are >= 0 and Max ones <= 0.
  if (GetParam() > 0.0) {
    for (const std::size_t i : {1U, 2U, 4U}) {
      EXPECT_GE(result.z_lower[i], 0.0) << i;
      EXPECT_GE(result.z_upper[i], 0.0) << i;
    }
    for (const std::size_t i : {0U, 3U, 5U}) {
      EXPECT_LE(result.z_lower[i], 0.0) << i;
      EXPECT_LE(result.z_upper[i], 0.0) << i;
    }
  }
  for (const std::size_t i : {2U, 5U}) {
    EXPECT_EQ(result.z_lower[i] * result.z_upper[i], 0.0) << "one side of a fixed variable";
    EXPECT_NE(result.z_lower[i] + result.z_upper[i], 0.0);
  }
  EXPECT_EQ(result.lambda[2], 0.0) << "free row";
}

INSTANTIATE_TEST_SUITE_P(ObjectiveFactors, Restore, ::testing::Values(1.0, 3.0, -1.0, -0.5));

TEST(RestoredPoint, HasTheModelsValuesInTheModelsUnits) {
  FixedValues model = mixed_model();
  model.gradient_values[0] = 400.0;
  SolverOptions options;
  options.obj_scaling_factor = -2.0;
  Canonical c(std::move(model), options);
  ASSERT_EQ(c.error, "");
  EXPECT_DOUBLE_EQ(c.problem.objective_scale(), -0.5);
  const Iterate iterate = c.problem.starting_point();
  double f = 0.0;
  ASSERT_TRUE(c.problem.objective(c.zero(), f));
  EXPECT_DOUBLE_EQ(f, -6.0);
  Result result;
  c.problem.restore(iterate, result);
  EXPECT_EQ(result.objective, 12.0);
  EXPECT_EQ(result.constraints, c.model.g);
  EXPECT_EQ(result.v, (std::vector<double>{1.0, 2.0, 7.0, 3.0, 1.0, -3.0}));
}

TEST(RestoredPoint, LiesInTheOriginalBoundsWhenAsked) {
  for (const bool honor : {false, true}) {
    SolverOptions options = plain_options();
    options.bound_relax_factor = 1e-2;
    options.honor_original_bounds = honor;
    Canonical c(mixed_model(), options);
    Iterate iterate = c.problem.starting_point();
    iterate.v[0] = 4.02;    // x0 <= 4
    iterate.v[3] = -1.005;  // y0 >= -1
    Result result;
    c.problem.restore(iterate, result);
    EXPECT_EQ(result.v[1], honor ? 4.0 : 4.02);
    EXPECT_EQ(result.v[0], honor ? -1.0 : -1.005);
  }
}

TEST(RestoredPoint, IsKeptWhereTheModelIsUndefined) {
  FixedValues model = mixed_model();
  Canonical c(std::move(model), plain_options());
  c.model.undefined = "objective";
  Result result;
  c.problem.restore(c.problem.starting_point(), result);
  EXPECT_TRUE(std::isnan(result.objective));
  EXPECT_EQ(result.v.size(), 6U);
}

TEST(CanonicalEvaluation, NamesTheUndefinedFunction) {
  Canonical c(mixed_model(), plain_options());
  double f = 0.0;
  c.model.undefined = "objective";
  EXPECT_FALSE(c.problem.objective(c.zero(), f));
  EXPECT_EQ(c.problem.evaluation_error(), "the objective is undefined");
  EXPECT_EQ(c.problem.evaluation_status(), Status::EvaluationFailed);
  c.model.undefined = "constraints";
  EXPECT_FALSE(c.problem.constraints(c.zero(), c.evaluation.c));
  EXPECT_EQ(c.problem.evaluation_error(), "the vector of constraints is undefined");
  c.model.undefined = "gradient";
  EXPECT_FALSE(c.problem.first_derivatives(c.zero(), c.evaluation));
  EXPECT_EQ(c.problem.evaluation_error(), "the gradient of the objective is undefined");
  c.model.undefined = "jacobian";
  EXPECT_FALSE(c.problem.first_derivatives(c.zero(), c.evaluation));
  EXPECT_EQ(c.problem.evaluation_error(), "the Jacobian of the constraints is undefined");
  c.model.undefined = "hessian";
  EXPECT_FALSE(c.problem.second_derivatives(c.zero(), c.no_lambda(), c.evaluation));
  EXPECT_EQ(c.problem.evaluation_error(), "the Hessian of the Lagrangian is undefined");
}

TEST(CanonicalEvaluation, NamesTheEntryThatIsNotANumber) {
  Canonical c(mixed_model(), plain_options());
  const auto expect_named = [&](bool defined, std::vector<std::string> parts) {
    EXPECT_FALSE(defined) << parts[0];
    EXPECT_EQ(c.problem.evaluation_status(), Status::InvalidNumber);
    for (const std::string& part : parts) {
      EXPECT_NE(c.problem.evaluation_error().find(part), std::string::npos)
          << c.problem.evaluation_error();
    }
  };
  double f = 0.0;
  c.model.f = kNaN;
  expect_named(c.problem.objective(c.zero(), f), {"objective"});
  c.model.g[3] = kInf;
  expect_named(c.problem.constraints(c.zero(), c.evaluation.c), {"constraint 3 (band)"});
  c.model.jacobian_values[6] = kNaN;
  expect_named(c.problem.first_derivatives(c.zero(), c.evaluation),
               {"Jacobian", "constraint 4 (link)", "variable 3 (y1)"});
  c.model.gradient_values[4] = -kInf;
  expect_named(c.problem.first_derivatives(c.zero(), c.evaluation),
               {"gradient", "variable 4 (x1)"});
  c.model.hessian_values[1] = kNaN;
  expect_named(c.problem.second_derivatives(c.zero(), c.no_lambda(), c.evaluation),
               {"Hessian", "variable 0 (y0)", "variable 1 (x0)"});
}

TEST(CanonicalEvaluation, IgnoresNumbersThatNobodyReads) {
  Canonical c(mixed_model(), plain_options());
  c.model.g[2] = kNaN;                // free row
  c.model.gradient_values[2] = kNaN;  // fixed variable
  c.model.jacobian_values[4] = kNaN;  // of the free row
  c.model.hessian_values[6] = kNaN;   // of a fixed variable
  EXPECT_TRUE(c.problem.constraints(c.zero(), c.evaluation.c));
  EXPECT_TRUE(c.problem.first_derivatives(c.zero(), c.evaluation));
  EXPECT_TRUE(c.problem.second_derivatives(c.zero(), c.no_lambda(), c.evaluation));
}

TEST(CanonicalEvaluation, TellsTheModelWhetherThePointIsNew) {
  Canonical c(mixed_model(), plain_options());
  c.model.new_v.clear();
  double f = 0.0;
  Eigen::VectorXd v = Eigen::VectorXd::Constant(6, 0.5);
  ASSERT_TRUE(c.problem.objective(v, f));                     // new
  ASSERT_TRUE(c.problem.constraints(v, c.evaluation.c));      // old
  ASSERT_TRUE(c.problem.first_derivatives(v, c.evaluation));  // old, old
  v[2] = 0.75;                                                // a slack: the model does not see it
  ASSERT_TRUE(c.problem.constraints(v, c.evaluation.c));      // old
  v[4] = 0.75;
  ASSERT_TRUE(c.problem.constraints(v, c.evaluation.c));                      // new
  ASSERT_TRUE(c.problem.second_derivatives(v, c.no_lambda(), c.evaluation));  // old
  EXPECT_EQ(c.model.new_v, (std::vector<bool>{true, false, false, false, false, true, false}));
}

TEST(CanonicalEvaluation, CountsTheModelsCalls) {
  SolverOptions options = plain_options();
  options.nlp_scaling_method = Scaling::GradientBased;
  Canonical c(mixed_model(), options);
  double f = 0.0;
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(c.problem.objective(c.zero(), f));
  }
  ASSERT_TRUE(c.problem.constraints(c.zero(), c.evaluation.c));
  ASSERT_TRUE(c.problem.first_derivatives(c.zero(), c.evaluation));
  ASSERT_TRUE(c.problem.second_derivatives(c.zero(), c.no_lambda(), c.evaluation));
  EXPECT_EQ(c.counts.objective, 3);
  EXPECT_EQ(c.counts.constraints, 1);
  EXPECT_EQ(c.counts.gradient, 2) << "one for the scaling";
  EXPECT_EQ(c.counts.jacobian, 2) << "one for the scaling";
  EXPECT_EQ(c.counts.hessian, 1);
}

}  // namespace
}  // namespace ipminmax
