#include <pthread.h>

#include <IpIpoptApplication.hpp>
#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/option_registry.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Options of the linked Ipopt, in alphabetical order. Plain values: Ipopt's own objects count
/// references without locks, and this table is shared by all threads.
struct IpoptOptions {
  std::vector<OptionInfo> not_ours;
  std::vector<std::string_view> linear_solvers;  ///< not ours
  std::deque<std::string> texts;
};

/// For ever in the table.
std::string_view keep(const std::string& text, IpoptOptions& options) {
  return options.texts.emplace_back(text);
}

OptionInfo::Choice choice_of(const RegisteredOption& option, IpoptOptions& options) {
  OptionInfo::Choice choice{};
  for (const auto& entry : option.GetValidStrings()) {
    if (entry.value_ == option.DefaultString()) choice.by_default = choice.names.size();
    choice.names.push_back(keep(entry.value_, options));
  }
  choice.texts.resize(choice.names.size());
  return choice;
}

OptionInfo info_of(const RegisteredOption& option, IpoptOptions& options) {
  OptionInfo info{.name = keep(option.Name(), options),
                  .category = "Ipopt only",
                  .text = "Ipopt only",
                  .kind = {}};
  if (option.Type() == Ipopt::OT_Number) {
    info.kind = number_of(option);
  } else if (option.Type() == Ipopt::OT_Integer) {
    info.kind = integer_of(option);
  } else if (option.IsValidStringSetting("any text at all")) {
    info.kind = OptionInfo::Name{keep(option.DefaultString(), options)};
  } else {
    info.kind = choice_of(option, options);
  }
  return info;
}

bool is_own_option(std::string_view name) {
  const auto table = option_table();
  const auto& application = application_option_table();
  return std::ranges::find(table, name, &OptionInfo::name) != table.end() ||
         std::ranges::find(application, name, &OptionInfo::name) != application.end();
}

IpoptOptions read_options() {
  const Ipopt::SmartPtr<RegisteredOptions> registry = new RegisteredOptions();
  Ipopt::IpoptApplication::RegisterAllIpoptOptions(registry);
  IpoptOptions options;
  for (const auto& entry : registry->RegisteredOptionsList()) {
    OptionInfo info = info_of(*entry.second, options);
    if (info.name == "linear_solver")
      options.linear_solvers = std::get<OptionInfo::Choice>(info.kind).names;
    if (!is_own_option(info.name)) options.not_ours.push_back(std::move(info));
  }
  const auto ours = std::ranges::find(option_table(), "linear_solver", &OptionInfo::name);
  for (const auto name : std::get<OptionInfo::Choice>(ours->kind).names)
    std::erase(options.linear_solvers, name);
  return options;
}

/// A fork waits until the table is made: the child would wait for ever for the thread that makes
/// it.
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

bool matches(std::string_view pattern, std::string_view name) {
  if (!pattern.ends_with('*')) return pattern == name;
  return name.starts_with(pattern.substr(0, pattern.size() - 1));
}

std::optional<std::string_view> find_advice(const std::vector<IpoptOptionAdvice>& table,
                                            std::string_view name) {
  for (const IpoptOptionAdvice& row : table) {
    const auto is_meant = [&](std::string_view pattern) { return matches(pattern, name); };
    if (std::ranges::any_of(row.names, is_meant)) return row.advice;
  }
  return std::nullopt;
}

/// Those that only Ipopt has and that were set to another value than its default, by name.
std::vector<std::pair<std::string_view, std::string>> changed_options(const OptionsList& list) {
  std::vector<std::pair<std::string_view, std::string>> changed;
  for (const OptionInfo& option : ipopt_only_options()) {
    if (!may_be_set(list, option.name)) continue;
    const auto value = value_of(option, list);
    if (value && *value != default_of(option)) changed.emplace_back(option.name, *value);
  }
  return changed;
}

}  // namespace

const std::vector<IpoptOptionAdvice>& refused_ipopt_option_advice() {
  static const std::vector<IpoptOptionAdvice> table = {
      {{"jacobian_approximation"}, "first derivatives are needed: implement eval_jac_g"},
      {{"gradient_approximation"}, "first derivatives are needed: implement eval_grad_f"},
      {{"nlp_scaling_obj_target_gradient"},
       "gradients are only scaled down, see nlp_scaling_max_gradient; other factors come from "
       "obj_scaling_factor or nlp_scaling_method user-scaling"},
      {{"nlp_scaling_constr_target_gradient"},
       "gradients are only scaled down, see nlp_scaling_max_gradient; other factors come from "
       "nlp_scaling_method user-scaling"},
      {{"warm_start_entire_iterate"},
       "a warm start takes the model's point and multipliers, see warm_start_init_point"},
      {{"skip_finalize_solution_call"}, "finalize_solution is always called"},
  };
  return table;
}

const std::vector<IpoptOptionAdvice>& ignored_ipopt_option_advice() {
  static const std::string_view other_solver =
      "it belongs to a linear solver that is not built in, see linear_solver";
  static const std::vector<IpoptOptionAdvice> table = {
      {{"mu_*", "adaptive_mu_*", "fixed_mu_oracle", "quality_function_*", "sigma_*"},
       "not a setting of the adaptive strategy here, see mu_strategy, mu_oracle and "
       "adaptive_mu_globalization"},
      {{"warm_start_target_mu"}, "see mu_init and mu_target"},
      {{"warm_start_same_structure"}, "ReOptimizeTNLP does that"},
      {{"accept_every_trial_step"}, "see minmax_globalization none"},
      {{"ma27_*", "ma28_*"}, other_solver},
      {{"ma57_*"},
       "MA57's pivot threshold grows from 1e-8 to 1e-4, and it orders as minmax_ordering says"},
      {{"ma77_*", "ma86_*"}, other_solver},
      {{"ma97_*"},
       "MA97's pivot threshold grows from 1e-8 to 1e-4, and it orders as minmax_ordering says"},
      {{"pardiso_*", "pardisomkl_*"}, "Pardiso matches, orders and pivots as by Ipopt's defaults"},
      {{"wsmp_*"}, other_solver},
      {{"spral_*"},
       "SPRAL's pivot threshold grows from 1e-8 to 1e-4, and it orders as minmax_ordering says"},
      {{"mumps_*"}, "see minmax_ordering, mumps_pivtol and mumps_pivtolmax"},
      {{"linear_s*"}, "matrices are scaled by the linear solver itself"},
      {{"limited_memory_*"}, "quasi-Newton matrices of minimizations are BFGS of six pairs"},
      {{"hessian_approximation_space"},
       "second derivatives that are missing come from differences"},
      {{"findiff_perturbation"}, "first derivatives are not approximated"},
      {{"check_derivatives_for_naninf"}, "values that are used are always checked"},
      {{"jac_c_constant", "jac_d_constant", "hessian_constant", "grad_f_constant"},
       "functions are evaluated anew at every point, constant or not"},
      {{"resto_*", "max_resto_iter", "start_with_resto", "expect_infeasible_problem*",
        "evaluate_orig_obj_at_resto_trial", "required_infeasibility_reduction"},
       "the feasibility restoration has no settings"},
      {{"dependency_*"}, "dependent equality constraints are regularized, not removed"},
      {{"inf_pr_output"}, "inf_pr is the violation of the model's constraints (original)"},
      {{"print_options_latex_mode"}, "see print_options_documentation"},
      {{"print_*", "suppress_all_output"}, "see print_level, file_print_level and sb"},
  };
  return table;
}

const std::vector<OptionInfo>& ipopt_only_options() { return ipopt_options().not_ours; }

std::vector<std::string_view> ipopt_only_linear_solvers() { return ipopt_options().linear_solvers; }

bool is_ipopt_only_linear_solver(std::string_view name) {
  const auto others = ipopt_only_linear_solvers();
  return std::ranges::find(others, name) != others.end();
}

std::string refused_ipopt_option(const OptionsList& list) {
  for (const auto& [name, value] : changed_options(list)) {
    if (const auto advice = find_advice(refused_ipopt_option_advice(), name)) {
      return concat(name, " = ", value, " is an option of Ipopt that is not available: ", *advice);
    }
  }
  return {};
}

std::vector<std::string> ignored_ipopt_options(const OptionsList& list) {
  std::vector<std::string> messages;
  const auto add = [&](std::string_view name, const std::string& value, std::string_view reason) {
    messages.push_back(concat(name, " = ", value, " has no effect: ", reason));
  };
  for (const auto& [name, value] : changed_options(list)) {
    add(name, value,
        find_advice(ignored_ipopt_option_advice(), name)
            .value_or("it steers Ipopt's own algorithm"));
  }
  std::string hessian, solver;
  read_option(list, "hessian_approximation", hessian);
  if (hessian == "limited-memory") {
    messages.push_back(
        "hessian_approximation = limited-memory: minimizations are solved with quasi-Newton "
        "matrices, which have no inertia to certify with: nothing is certified; with Max variables "
        "it means finite-difference-values");
  }
  if (read_option(list, "linear_solver", solver) && is_ipopt_only_linear_solver(solver))
    add("linear_solver", solver, "it is not built in, auto is used");
  return messages;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
