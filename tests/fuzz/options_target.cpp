#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <vector>

#include <IpJournalist.hpp>

#include <assignments.hpp>
#include <fuzz/targets.hpp>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/player_lists.hpp"

namespace ipminmax::testing {
namespace {

void read_file(const std::string& bytes) {
  static const Ipopt::SmartPtr<Ipopt::RegisteredOptions> registry = [] {
    Ipopt::SmartPtr<Ipopt::RegisteredOptions> all = new Ipopt::RegisteredOptions;
    register_options(*all);
    return all;
  }();
  const Ipopt::SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist;
  const Ipopt::SmartPtr<Ipopt::OptionsList> list =
      new Ipopt::OptionsList(Ipopt::GetRawPtr(registry), journalist);
  std::istringstream input(bytes);
  if (!read_options(input, "fuzz.opt", *registry, *list).empty()) return;
  SolverOptions options;
  static_cast<void>(solver_options(*list, options));
}

void read_assignments(const std::string& bytes) {
  Assignments assignments;
  try {
    assignments.add_environment(bytes);
    std::istringstream lines(bytes);
    for (std::string line; std::getline(lines, line);) assignments.add_argument(line);
    assignments.rename("maxit", "max_iter");
    static_cast<void>(assignments.take("minmax_max_variables"));
    static_cast<void>(assignments.take_integer("objno", -1, 0, 9));
    static_cast<void>(assignments.take_flag("halt_on_ampl_error"));
    std::ostringstream report;
    assignments.report_overridden(report);
  } catch (const std::invalid_argument&) {  // refused
  }
}

void read_players(const std::string& bytes) {
  static const std::vector<std::string> names = {"x[1]", "x[2]", "wind", "a b", ""};
  std::vector<Index> indices;
  const ListedItems items{"variable", static_cast<Index>(names.size()), &names};
  if (!read_index_list(bytes, items, indices).empty()) return;
  for (const Index i : indices)
    if (i < 0 || i >= items.count) std::abort();
}

}  // namespace

void fuzz_options(const std::string& bytes) {
  read_file(bytes);
  read_assignments(bytes);
  read_players(bytes);
}

}  // namespace ipminmax::testing
