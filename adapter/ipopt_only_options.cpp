#include <pthread.h>

#include <IpIpoptApplication.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <mutex>
#include <optional>

#include "adapter/application_options.hpp"
#include "adapter/ipopt_only_options.hpp"
#include "core/options.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// What Ipopt registers about an option. Plain values: Ipopt's own objects count references without
/// locks, and this table is shared by all threads.
struct IpoptOption {
  std::string name;
  Ipopt::RegisteredOptionType type = Ipopt::OT_Unknown;
  std::optional<double> lower, upper;
  bool lower_strict = false;
  bool upper_strict = false;
  double default_number = 0.0;
  std::string default_string;
  std::vector<std::string> values;  ///< of a string option
};

IpoptOption read_option(const Ipopt::RegisteredOption& option) {
  IpoptOption result;
  result.name = option.Name();
  result.type = option.Type();
  if (result.type == Ipopt::OT_String) {
    result.default_string = option.DefaultString();
    for (const auto& entry : option.GetValidStrings()) result.values.push_back(entry.value_);
    return result;
  }
  const bool number = result.type == Ipopt::OT_Number;
  if (option.HasLower()) result.lower = number ? option.LowerNumber() : option.LowerInteger();
  if (option.HasUpper()) result.upper = number ? option.UpperNumber() : option.UpperInteger();
  result.lower_strict = number && option.HasLower() && option.LowerStrict();
  result.upper_strict = number && option.HasUpper() && option.UpperStrict();
  result.default_number = number ? option.DefaultNumber() : option.DefaultInteger();
  return result;
}

bool is_own_option(std::string_view name) {
  const auto table = option_table();
  const auto& application = application_option_table();
  return std::ranges::find(table, name, &OptionInfo::name) != table.end() ||
         std::ranges::find(application, name, &ApplicationOption::name) != application.end();
}

/// Options of the linked Ipopt, in alphabetical order.
struct IpoptOptions {
  std::vector<IpoptOption> all;
  std::vector<IpoptOption> not_ours;
};
IpoptOptions read_options() {
  const Ipopt::SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions();
  Ipopt::IpoptApplication::RegisterAllIpoptOptions(registry);
  IpoptOptions options;
  for (const auto& entry : registry->RegisteredOptionsList()) {
    options.all.push_back(read_option(*entry.second));
    if (!is_own_option(options.all.back().name)) options.not_ours.push_back(options.all.back());
  }
  return options;
}

/// A fork waits until the table is made: the child would wait for ever for the thread that makes it.
std::mutex table_is_made;

/// When the library is loaded; the smaller tables are made then.
[[maybe_unused]] const bool loaded = [] {
  pthread_atfork([] { table_is_made.lock(); }, [] { table_is_made.unlock(); },
                 [] { table_is_made.unlock(); });
  static_cast<void>(application_option_table());
  static_cast<void>(refused_ipopt_option_advice());
  static_cast<void>(ignored_ipopt_option_advice());
  return true;
}();

const IpoptOptions& ipopt_options() {
  const std::lock_guard lock(table_is_made);
  static const IpoptOptions options = read_options();
  return options;
}

void register_number(Ipopt::RegisteredOptions& registry, const IpoptOption& o) {
  const std::string text = "Ipopt only";
  if (o.lower && o.upper) {
    registry.AddBoundedNumberOption(o.name, text, *o.lower, o.lower_strict, *o.upper,
                                    o.upper_strict, o.default_number);
  } else if (o.lower) {
    registry.AddLowerBoundedNumberOption(o.name, text, *o.lower, o.lower_strict, o.default_number);
  } else if (o.upper) {
    registry.AddUpperBoundedNumberOption(o.name, text, *o.upper, o.upper_strict, o.default_number);
  } else {
    registry.AddNumberOption(o.name, text, o.default_number);
  }
}

void register_integer(Ipopt::RegisteredOptions& registry, const IpoptOption& o) {
  const std::string text = "Ipopt only";
  const auto integer = [](double value) { return static_cast<Ipopt::Index>(value); };
  const Ipopt::Index value = integer(o.default_number);
  if (o.lower && o.upper) {
    registry.AddBoundedIntegerOption(o.name, text, integer(*o.lower), integer(*o.upper), value);
  } else if (o.lower) {
    registry.AddLowerBoundedIntegerOption(o.name, text, integer(*o.lower), value);
  } else if (o.upper) {
    registry.AddUpperBoundedIntegerOption(o.name, text, integer(*o.upper), value);
  } else {
    registry.AddIntegerOption(o.name, text, value);
  }
}

/// Fewest digits that read back as the same number.
std::string text_of(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

/// The value, if it was set.
std::optional<std::string> set_value(const Ipopt::OptionsList& list, const IpoptOption& option) {
  if (option.type == Ipopt::OT_Number) {
    double value = 0.0;
    if (!list.GetNumericValue(option.name, value, "")) return std::nullopt;
    return text_of(value);
  }
  if (option.type == Ipopt::OT_Integer) {
    Ipopt::Index value = 0;
    if (!list.GetIntegerValue(option.name, value, "")) return std::nullopt;
    return text_of(value);
  }
  std::string value;
  if (!list.GetStringValue(option.name, value, "")) return std::nullopt;
  return value;
}

bool is_default(const IpoptOption& option, const std::string& value) {
  return value ==
         (option.type == Ipopt::OT_String ? option.default_string : text_of(option.default_number));
}

bool matches(std::string_view pattern, std::string_view name) {
  if (!pattern.ends_with('*')) return pattern == name;
  return name.starts_with(pattern.substr(0, pattern.size() - 1));
}

std::optional<std::string_view> find_advice(const std::vector<IpoptOptionAdvice>& table,
                                            std::string_view name) {
  for (const IpoptOptionAdvice& row : table) {
    if (matches(row.name, name)) return row.advice;
  }
  return std::nullopt;
}

}  // namespace

const std::vector<IpoptOptionAdvice>& refused_ipopt_option_advice() {
  static const std::vector<IpoptOptionAdvice> table = {
      {"jacobian_approximation", "first derivatives are needed: implement eval_jac_g"},
      {"gradient_approximation", "first derivatives are needed: implement eval_grad_f"},
      {"nlp_scaling_obj_target_gradient",
       "gradients are only scaled down, see nlp_scaling_max_gradient; other factors come from "
       "obj_scaling_factor or nlp_scaling_method user-scaling"},
      {"nlp_scaling_constr_target_gradient",
       "gradients are only scaled down, see nlp_scaling_max_gradient; other factors come from "
       "nlp_scaling_method user-scaling"},
      {"warm_start_entire_iterate",
       "a warm start takes the model's point and multipliers, see warm_start_init_point"},
      {"skip_finalize_solution_call", "finalize_solution is always called"},
  };
  return table;
}

const std::vector<IpoptOptionAdvice>& ignored_ipopt_option_advice() {
  static const std::string_view barrier =
      "not a setting of the adaptive strategy here, see mu_strategy, mu_oracle and "
      "adaptive_mu_globalization";
  static const std::string_view other_solver =
      "it belongs to a linear solver that is not built in, see linear_solver";
  static const std::string_view restoration = "the feasibility restoration has no settings";
  static const std::string_view constant =
      "functions are evaluated anew at every point, constant or not";
  static const std::string_view output = "see print_level, file_print_level and sb";
  static const std::vector<IpoptOptionAdvice> table = {
      {"mu_*", barrier},
      {"adaptive_mu_*", barrier},
      {"fixed_mu_oracle", barrier},
      {"quality_function_*", barrier},
      {"sigma_*", barrier},
      {"warm_start_target_mu", "see mu_init and mu_target"},
      {"warm_start_same_structure", "ReOptimizeTNLP does that"},
      {"accept_every_trial_step", "see minmax_globalization none"},
      {"ma27_*", other_solver},
      {"ma28_*", other_solver},
      {"ma57_*", other_solver},
      {"ma77_*", other_solver},
      {"ma86_*", other_solver},
      {"ma97_*", other_solver},
      {"pardiso*", other_solver},
      {"wsmp_*", other_solver},
      {"spral_*", other_solver},
      {"hsllib", other_solver},
      {"mumps_*", "see minmax_ordering, mumps_pivtol and mumps_pivtolmax"},
      {"linear_s*", "matrices are scaled by the linear solver itself"},
      {"limited_memory_*", "second derivatives that are missing come from differences"},
      {"hessian_approximation_space", "second derivatives that are missing come from differences"},
      {"findiff_perturbation", "first derivatives are not approximated"},
      {"check_derivatives_for_naninf", "values that are used are always checked"},
      {"jac_c_constant", constant},
      {"jac_d_constant", constant},
      {"hessian_constant", constant},
      {"grad_f_constant", constant},
      {"resto_*", restoration},
      {"max_resto_iter", restoration},
      {"start_with_resto", restoration},
      {"expect_infeasible_problem*", restoration},
      {"evaluate_orig_obj_at_resto_trial", restoration},
      {"required_infeasibility_reduction", restoration},
      {"dependency_*", "dependent equality constraints are regularized, not removed"},
      {"inf_pr_output", "inf_pr is the violation of the model's constraints (original)"},
      {"print_options_latex_mode", "see print_options_documentation"},
      {"print_*", output},
      {"suppress_all_output", output},
  };
  return table;
}

void register_ipopt_only_options(Ipopt::RegisteredOptions& registry) {
  registry.SetRegisteringCategory("Ipopt only");
  for (const IpoptOption& option : ipopt_options().not_ours) {
    if (option.type == Ipopt::OT_Number) {
      register_number(registry, option);
    } else if (option.type == Ipopt::OT_Integer) {
      register_integer(registry, option);
    } else {
      registry.AddStringOption(option.name, "Ipopt only", option.default_string, option.values,
                               std::vector<std::string>(option.values.size()));
    }
  }
}

std::vector<std::string> ipopt_only_linear_solvers() {
  const auto& options = ipopt_options().all;
  const auto found = std::ranges::find(options, std::string("linear_solver"), &IpoptOption::name);
  if (found == options.end()) return {};
  const auto table = option_table();
  const auto own = std::ranges::find(table, "linear_solver", &OptionInfo::name);
  const auto& names = std::get<OptionInfo::Choice>(own->kind).names;
  std::vector<std::string> result;
  for (const std::string& value : found->values) {
    if (std::ranges::find(names, value) == names.end()) result.push_back(value);
  }
  return result;
}

std::string refused_ipopt_option(const Ipopt::OptionsList& list) {
  for (const IpoptOption& option : ipopt_options().not_ours) {
    const auto advice = find_advice(refused_ipopt_option_advice(), option.name);
    if (!advice) continue;
    const auto value = set_value(list, option);
    if (!value || is_default(option, *value)) continue;
    return option.name + " = " + *value +
           " is an option of Ipopt that is not available: " + std::string(*advice);
  }
  return {};
}

std::vector<std::string> ignored_ipopt_options(const Ipopt::OptionsList& list) {
  std::vector<std::string> messages;
  const auto add = [&](const std::string& name, const std::string& value, std::string_view reason) {
    messages.push_back(name + " = " + value + " has no effect: " + std::string(reason));
  };
  for (const IpoptOption& option : ipopt_options().not_ours) {
    const auto value = set_value(list, option);
    if (!value || is_default(option, *value)) continue;
    add(option.name, *value,
        find_advice(ignored_ipopt_option_advice(), option.name)
            .value_or("it steers Ipopt's own algorithm"));
  }
  std::string hessian;
  if (list.GetStringValue("hessian_approximation", hessian, "") && hessian == "limited-memory") {
    messages.push_back(
        "hessian_approximation = limited-memory means finite-difference-values: a quasi-Newton "
        "matrix "
        "has no inertia to certify with, so second derivatives are differences of first ones");
  }
  std::string solver;
  if (list.GetStringValue("linear_solver", solver, "")) {
    const auto others = ipopt_only_linear_solvers();
    if (std::ranges::find(others, solver) != others.end()) {
      add("linear_solver", solver, "it is not built in, auto is used");
    }
  }
  return messages;
}

std::vector<std::pair<std::string, std::string>> set_ipopt_only_options(
    const Ipopt::OptionsList& list) {
  std::vector<std::pair<std::string, std::string>> result;
  for (const IpoptOption& option : ipopt_options().not_ours) {
    if (auto value = set_value(list, option)) result.emplace_back(option.name, std::move(*value));
  }
  return result;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
