#include <problems/small_problems.hpp>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include <problems/small_problem_groups.hpp>

namespace ipminmax::testing {

const std::vector<SmallProblem>& small_problems() {
  static const std::vector<SmallProblem> problems = [] {
    std::vector<SmallProblem> all;
    for (auto group : {unbounded_problems(), bounded_problems(), constrained_problems()}) {
      std::ranges::move(group, std::back_inserter(all));
    }
    return all;
  }();
  return problems;
}

const SmallProblem& small_problem(const std::string& name) {
  const auto found = std::ranges::find(small_problems(), name, &SmallProblem::name);
  if (found == small_problems().end()) throw std::out_of_range("no problem " + name);
  return *found;
}

}  // namespace ipminmax::testing
