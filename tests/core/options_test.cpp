#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "core/options.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const OptionInfo& row(std::string_view name) {
  for (const OptionInfo& info : option_table()) {
    if (info.name == name) return info;
  }
  throw std::out_of_range("no option " + std::string(name));
}

/// Those of users and those for studies.
std::vector<OptionInfo> every_setting() {
  std::vector<OptionInfo> all(option_table().begin(), option_table().end());
  all.insert(all.end(), unregistered_settings().begin(), unregistered_settings().end());
  return all;
}

/// Number of members of an aggregate: the most initializers it takes.
struct Anything {
  template <class T>
  operator T() const;  // NOLINT: conversion is the point
};
template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires { T{(static_cast<void>(I), Anything{})...}; };
}
template <class T, std::size_t Count = 1>
constexpr std::size_t member_count() {
  if constexpr (takes<T>(std::make_index_sequence<Count + 1>{})) {
    return member_count<T, Count + 1>();
  } else {
    return Count;
  }
}

/// Sets an option to another allowed value than it has.
void change(const OptionInfo& info, SolverOptions& options) {
  if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
    double& value = options.*(number->member);
    const double other = std::isfinite(number->upper) ? 0.5 * (value + number->upper)
                         : value == 0.0               ? 1.0
                                                      : value + std::abs(value);
    value = other;
  } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
    ++(options.*(integer->member));
  } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
    options.*(flag->member) = !(options.*(flag->member));
  } else {
    const auto& choice = std::get<OptionInfo::Choice>(info.kind);
    choice.set(options, (choice.get(options) + 1) % choice.names.size());
  }
}

/// First byte of SolverOptions that an option changes, -1 when it changes none.
std::ptrdiff_t place(const OptionInfo& info) {
  static_assert(std::is_trivially_copyable_v<SolverOptions>);
  const SolverOptions before;
  SolverOptions after;
  std::memcpy(static_cast<void*>(&after), &before, sizeof before);
  change(info, after);
  const auto* a = reinterpret_cast<const unsigned char*>(&before);
  const auto* b = reinterpret_cast<const unsigned char*>(&after);
  const auto* differs = std::mismatch(a, a + sizeof before, b).first;
  return differs == a + sizeof before ? -1 : differs - a;
}

TEST(OptionTable, NamesAreUniqueAndPlain) {
  std::set<std::string_view> names;
  for (const OptionInfo& info : option_table()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_TRUE(std::ranges::all_of(info.name, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    })) << info.name;
    EXPECT_FALSE(info.category.empty()) << info.name;
    EXPECT_TRUE(info.text.size() > 1 && info.text.back() == '.') << info.name;
  }
}

TEST(OptionTable, HasEveryMemberOnce) {
  EXPECT_EQ(every_setting().size(), member_count<SolverOptions>());
  std::set<std::ptrdiff_t> places;
  for (const OptionInfo& info : every_setting()) {
    const std::ptrdiff_t where = place(info);
    EXPECT_GE(where, 0) << info.name;
    EXPECT_TRUE(places.insert(where).second) << info.name;
  }
}

/// What users have to read about: settings for studies are none of it.
TEST(OptionTable, HasFewOptionsOfItsOwn) {
  const auto own = std::ranges::count_if(
      option_table(), [](const OptionInfo& info) { return info.name.starts_with("minmax_"); });
  EXPECT_LE(own, 22);
}

TEST(OptionTable, FollowsTheOrderOfTheStruct) {
  std::ptrdiff_t last = -1;
  for (const OptionInfo& info : option_table()) {
    const std::ptrdiff_t where = place(info);
    EXPECT_GT(where, last) << info.name;
    last = where;
  }
}

TEST(OptionTable, ChangedValuesOfEveryOptionAreAllowed) {
  for (const OptionInfo& info : every_setting()) {
    SolverOptions options;
    change(info, options);
    if (info.name.starts_with("minmax_prescribed_delta")) {  // the two go together
      options.minmax_prescribed_delta_x = options.minmax_prescribed_delta_y = 1.0;
      options.minmax_globalization = Globalization::None;
    }
    EXPECT_EQ(check(options), "") << info.name;
  }
}

TEST(OptionTable, ChoicesGiveBackWhatWasSet) {
  int choices = 0;
  for (const OptionInfo& info : every_setting()) {
    const auto* choice = std::get_if<OptionInfo::Choice>(&info.kind);
    if (choice == nullptr) continue;
    ++choices;
    EXPECT_GE(choice->names.size(), 2U) << info.name;
    EXPECT_EQ(choice->names.size(), choice->texts.size()) << info.name;
    EXPECT_EQ(std::set(choice->names.begin(), choice->names.end()).size(), choice->names.size());
    for (std::size_t i = 0; i < choice->names.size(); ++i) {
      SolverOptions options;
      choice->set(options, i);
      EXPECT_EQ(choice->get(options), i) << info.name;
      EXPECT_EQ(check(options), "") << info.name;
    }
  }
  EXPECT_GT(choices, 0);
}

TEST(OptionTable, ChoicesMeanWhatTheyAreCalled) {
  const auto set = [](std::string_view option, std::string_view value) {
    const auto& choice = std::get<OptionInfo::Choice>(row(option).kind);
    const auto found = std::ranges::find(choice.names, value);
    SolverOptions options;
    choice.set(options, static_cast<std::size_t>(found - choice.names.begin()));
    return options;
  };
  EXPECT_EQ(set("minmax_globalization", "none").minmax_globalization, Globalization::None);
  EXPECT_EQ(set("minmax_globalization", "filter").minmax_globalization, Globalization::Filter);
  EXPECT_EQ(set("minmax_barrier_rule", "ipopt").minmax_barrier_rule, BarrierRule::Ipopt);
  EXPECT_EQ(set("minmax_barrier_rule", "paper").minmax_barrier_rule, BarrierRule::Paper);
  EXPECT_EQ(set("nlp_scaling_method", "none").nlp_scaling_method, Scaling::None);
  EXPECT_EQ(set("nlp_scaling_method", "gradient-based").nlp_scaling_method, Scaling::GradientBased);
  EXPECT_EQ(set("nlp_scaling_method", "user-scaling").nlp_scaling_method, Scaling::User);
  EXPECT_EQ(set("hessian_approximation", "exact").hessian_approximation,
            HessianApproximation::Exact);
  EXPECT_EQ(set("hessian_approximation", "finite-difference-values").hessian_approximation,
            HessianApproximation::FiniteDifferenceValues);
  EXPECT_EQ(set("derivative_test", "none").derivative_test, DerivativeTest::None);
  EXPECT_EQ(set("derivative_test", "first-order").derivative_test, DerivativeTest::FirstOrder);
  EXPECT_EQ(set("derivative_test", "second-order").derivative_test, DerivativeTest::SecondOrder);
  EXPECT_EQ(set("derivative_test", "only-second-order").derivative_test,
            DerivativeTest::OnlySecondOrder);
  EXPECT_EQ(set("bound_mult_init_method", "constant").bound_mult_init_method,
            BoundMultiplierInit::Constant);
  EXPECT_EQ(set("bound_mult_init_method", "mu-based").bound_mult_init_method,
            BoundMultiplierInit::MuBased);
  EXPECT_EQ(set("linear_solver", "auto").linear_solver, LinearSolver::Auto);
  EXPECT_EQ(set("linear_solver", "mumps").linear_solver, LinearSolver::Mumps);
  EXPECT_EQ(set("linear_solver", "ldlt").linear_solver, LinearSolver::Ldlt);
  EXPECT_EQ(set("linear_solver", "lapack").linear_solver, LinearSolver::Lapack);
  EXPECT_EQ(set("minmax_ordering", "best").minmax_ordering, Ordering::Best);
  EXPECT_EQ(set("minmax_ordering", "amd").minmax_ordering, Ordering::Amd);
  EXPECT_EQ(set("minmax_ordering", "pord").minmax_ordering, Ordering::Pord);
  EXPECT_EQ(set("minmax_ordering", "metis").minmax_ordering, Ordering::Metis);
}

TEST(OptionTable, TheHessianIsExactUnlessSetOtherwise) {
  const auto& choice = std::get<OptionInfo::Choice>(row("hessian_approximation").kind);
  EXPECT_EQ(choice.names[choice.get(SolverOptions{})], "exact");
}

TEST(OptionTable, ReadsTheDefaultsOfTheStruct) {
  // Ipopt's documented defaults of the options that carry its names.
  const std::map<std::string_view, double> ipopt = {{"tol", 1e-8},
                                                    {"derivative_test_tol", 1e-4},
                                                    {"derivative_test_perturbation", 1e-8},
                                                    {"point_perturbation_radius", 10.0},
                                                    {"dual_inf_tol", 1.0},
                                                    {"constr_viol_tol", 1e-4},
                                                    {"compl_inf_tol", 1e-4},
                                                    {"acceptable_tol", 1e-6},
                                                    {"acceptable_dual_inf_tol", 1e10},
                                                    {"acceptable_constr_viol_tol", 1e-2},
                                                    {"acceptable_compl_inf_tol", 1e-2},
                                                    {"acceptable_obj_change_tol", 1e20},
                                                    {"diverging_iterates_tol", 1e20},
                                                    {"s_max", 100.0},
                                                    {"nlp_lower_bound_inf", -1e19},
                                                    {"nlp_upper_bound_inf", 1e19},
                                                    {"bound_relax_factor", 1e-8},
                                                    {"nlp_scaling_max_gradient", 100.0},
                                                    {"nlp_scaling_min_value", 1e-8},
                                                    {"obj_scaling_factor", 1.0},
                                                    {"bound_push", 1e-2},
                                                    {"bound_frac", 1e-2},
                                                    {"slack_bound_push", 1e-2},
                                                    {"slack_bound_frac", 1e-2},
                                                    {"bound_mult_init_val", 1.0},
                                                    {"constr_mult_init_max", 1e3},
                                                    {"warm_start_bound_push", 1e-3},
                                                    {"warm_start_bound_frac", 1e-3},
                                                    {"warm_start_slack_bound_push", 1e-3},
                                                    {"warm_start_slack_bound_frac", 1e-3},
                                                    {"warm_start_mult_bound_push", 1e-3},
                                                    {"warm_start_mult_init_max", 1e6},
                                                    {"mu_init", 0.1},
                                                    {"mu_target", 0.0},
                                                    {"mu_linear_decrease_factor", 0.2},
                                                    {"mu_superlinear_decrease_power", 1.5},
                                                    {"barrier_tol_factor", 10.0},
                                                    {"tau_min", 0.99},
                                                    {"kappa_sigma", 1e10},
                                                    {"first_hessian_perturbation", 1e-4},
                                                    {"min_hessian_perturbation", 1e-20},
                                                    {"max_hessian_perturbation", 1e20},
                                                    {"perturb_inc_fact_first", 100.0},
                                                    {"perturb_inc_fact", 8.0},
                                                    {"perturb_dec_fact", 1.0 / 3.0},
                                                    {"jacobian_regularization_value", 1e-8},
                                                    {"jacobian_regularization_exponent", 0.25},
                                                    {"residual_ratio_max", 1e-10},
                                                    {"residual_ratio_singular", 1e-5}};
  const SolverOptions defaults{};
  EXPECT_EQ(check(defaults), "");
  for (const auto& [name, value] : ipopt) {
    const auto& number = std::get<OptionInfo::Number>(row(name).kind);
    EXPECT_DOUBLE_EQ(defaults.*(number.member), value) << name;
  }
  EXPECT_EQ(defaults.*(std::get<OptionInfo::Integer>(row("max_iter").kind).member), 3000);
  EXPECT_EQ(defaults.*(std::get<OptionInfo::Integer>(row("acceptable_iter").kind).member), 15);
  EXPECT_FALSE(defaults.*(std::get<OptionInfo::Flag>(row("honor_original_bounds").kind).member));
  EXPECT_FALSE(defaults.*(std::get<OptionInfo::Flag>(row("warm_start_init_point").kind).member));
}

TEST(Check, NamesTheOptionTheValueAndTheInterval) {
  SolverOptions options;
  options.tol = kNaN;
  EXPECT_EQ(check(options), "tol = nan is not in (0, inf)");
  options.tol = -1.5;
  EXPECT_EQ(check(options), "tol = -1.5 is not in (0, inf)");
  options = {};
  options.bound_frac = 0.75;
  EXPECT_EQ(check(options), "bound_frac = 0.75 is not in (0, 0.5]");
  options = {};
  options.mu_linear_decrease_factor = 1.0;
  EXPECT_EQ(check(options), "mu_linear_decrease_factor = 1 is not in (0, 1)");
  options = {};
  options.mumps_pivtol = 2.0;
  EXPECT_EQ(check(options), "mumps_pivtol = 2 is not in [0, 1]");
  options = {};
  options.max_iter = -1;
  EXPECT_EQ(check(options), "max_iter = -1 is not in [0, 2147483647]");
}

TEST(Check, RefusesNaNOfEveryNumber) {
  for (const OptionInfo& info : every_setting()) {
    const auto* number = std::get_if<OptionInfo::Number>(&info.kind);
    if (number == nullptr) continue;
    SolverOptions options;
    options.*(number->member) = kNaN;
    EXPECT_EQ(check(options).find(std::string(info.name) + " = nan is not in "), 0U) << info.name;
  }
}

TEST(Check, AllowsExactlyTheIntervalOfEveryNumber) {
  for (const OptionInfo& info : every_setting()) {
    const auto* number = std::get_if<OptionInfo::Number>(&info.kind);
    // The two bounds have to stay in order; their interplay is tested below.
    if (number == nullptr || info.name.ends_with("_bound_inf")) continue;
    const auto allowed = [&](double value) {
      SolverOptions options;
      options.*(number->member) = value;
      if (info.name.starts_with("minmax_prescribed_delta") &&
          value >= 0.0) {  // goes with the other
        double& x = options.minmax_prescribed_delta_x;
        double& y = options.minmax_prescribed_delta_y;
        (number->member == &SolverOptions::minmax_prescribed_delta_x ? y : x) = 1.0;
        options.minmax_globalization = Globalization::None;
      }
      return check(options).empty();
    };
    EXPECT_LT(number->lower, number->upper) << info.name;
    EXPECT_EQ(allowed(number->lower), !number->lower_strict) << info.name;
    EXPECT_EQ(allowed(number->upper), !number->upper_strict) << info.name;
    EXPECT_TRUE(allowed(std::nextafter(number->lower, number->upper))) << info.name;
    EXPECT_TRUE(allowed(std::nextafter(number->upper, number->lower))) << info.name;
    if (std::isfinite(number->lower)) {
      EXPECT_FALSE(allowed(std::nextafter(number->lower, -kInfinity))) << info.name;
    }
    if (std::isfinite(number->upper)) {
      EXPECT_FALSE(allowed(std::nextafter(number->upper, kInfinity))) << info.name;
    }
  }
}

TEST(Check, RefusesIntegersBelowTheirBound) {
  int integers = 0;
  for (const OptionInfo& info : option_table()) {
    const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind);
    if (integer == nullptr) continue;
    ++integers;
    SolverOptions options;
    options.*(integer->member) = integer->lower;
    EXPECT_EQ(check(options), "") << info.name;
    options.*(integer->member) = integer->lower - 1;
    EXPECT_EQ(check(options).find(std::string(info.name) + " = "), 0U) << info.name;
  }
  EXPECT_GT(integers, 0);
}

TEST(Check, RefusesWhatIsNoChoice) {
  SolverOptions options;
  options.linear_solver = static_cast<LinearSolver>(77);
  EXPECT_EQ(check(options), "linear_solver is not one of its choices");
}

TEST(Check, RefusesInfinitiesInTheWrongOrder) {
  SolverOptions options;
  options.nlp_lower_bound_inf = 1.0;
  options.nlp_upper_bound_inf = 1.0;
  EXPECT_NE(check(options).find("nlp_lower_bound_inf"), std::string::npos);
}

TEST(Check, RefusesAnObjectiveFactorOfInsaneSize) {
  SolverOptions options;
  for (const double factor : {5e-324, 1e-21, 1e21, 1e300, -1e300}) {
    options.obj_scaling_factor = factor;
    EXPECT_NE(check(options).find("obj_scaling_factor"), std::string::npos) << factor;
  }
  for (const double factor : {1e-20, -1.0, 1e20}) {
    options.obj_scaling_factor = factor;
    EXPECT_EQ(check(options), "") << factor;
  }
}

TEST(Check, RefusesAnObjectiveScaledAway) {
  SolverOptions options;
  options.obj_scaling_factor = 0.0;
  EXPECT_NE(check(options).find("obj_scaling_factor = 0"), std::string::npos);
  options.obj_scaling_factor = -2.0;
  EXPECT_EQ(check(options), "");
}

}  // namespace
}  // namespace ipminmax
