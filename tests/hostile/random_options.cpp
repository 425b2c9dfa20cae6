#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <variant>

#include <hostile/random_options.hpp>
#include <support/dice.hpp>

namespace ipminmax::testing {
namespace {

double random_number(Dice& dice, const OptionInfo::Number& range, double by_default, bool wrong) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const bool bounded = std::isfinite(range.lower) && std::isfinite(range.upper);
  if (wrong && dice.chance(0.1)) {
    return dice.one_of({std::numeric_limits<double>::quiet_NaN(), range.lower - 1.0,
                        range.upper + 1.0, kInfinity, -kInfinity});
  }
  double value = by_default;
  switch (dice.below(5)) {
    case 0:
      value = range.lower;
      break;
    case 1:
      value = range.upper;
      break;
    case 2:
      value = bounded ? dice.between(range.lower, range.upper) : dice.between(-10.0, 10.0);
      break;
    default:
      value *= std::pow(10.0, dice.between(-3.0, 3.0));
  }
  value = std::clamp(value, range.lower, range.upper);
  if (value == range.lower && range.lower_strict) {
    value = range.lower == 0.0 ? dice.one_of({5e-324, 1e-300, 1e-12})
                               : std::nextafter(range.lower, kInfinity);
  }
  if (value == range.upper && range.upper_strict) value = std::nextafter(range.upper, -kInfinity);
  // Larger ones overflow when multipliers are taken back to the model's units.
  return std::abs(value) <= 1e100 ? value : by_default;
}

/// Limits of the work, and what is no option of one solve.
void keep_small(SolverOptions& o) {
  o.max_iter = std::min(o.max_iter, 150);
  o.minmax_max_restarts = std::min(o.minmax_max_restarts, 5);
  o.minmax_epigraph = false;  // the answer is that of another problem
  o.minmax_starts = std::min(o.minmax_starts, 3);
  o.minmax_worst_case_starts = std::min(o.minmax_worst_case_starts, 3);
  // Slower growth means thousands of factorizations, see ShiftsGrow.
  o.perturb_inc_fact = std::max(o.perturb_inc_fact, 1.5);
  o.perturb_inc_fact_first = std::max(o.perturb_inc_fact_first, 1.5);
  o.perturb_dec_fact = std::min(o.perturb_dec_fact, 0.7);
  o.max_refinement_steps = std::min(o.max_refinement_steps, 20);
  o.derivative_test = DerivativeTest::None;
  o.mu_target = 0.0;                        // above, errors are those of the barrier problem
  o.max_cpu_time = o.max_wall_time = 1e20;  // the same end twice
}

}  // namespace

SolverOptions random_table_options(std::uint64_t seed, bool wrong) {
  Dice dice(seed);
  SolverOptions options;
  const double share = dice.one_of({0.02, 0.06, 0.2});
  for (const OptionInfo& info : option_table()) {
    if (!dice.chance(share)) continue;
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      double& value = options.*number->member;
      value = random_number(dice, *number, value, wrong);
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      int& value = options.*integer->member;
      value = dice.one_of({integer->lower, std::min(integer->upper, integer->lower + 1), value,
                           std::min(integer->upper, 3)});
      value = std::max(value, integer->lower);
      if (wrong && dice.chance(0.05)) value = integer->lower - 1;
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      options.*flag->member = dice.chance(0.5);
    } else if (const auto* choice = std::get_if<OptionInfo::Choice>(&info.kind)) {
      const auto k = static_cast<std::size_t>(dice.below(static_cast<int>(choice->names.size())));
      if (choice->names[k].find("mpi") == std::string_view::npos) choice->set(options, k);
    }
  }
  keep_small(options);
  return options;
}

}  // namespace ipminmax::testing
