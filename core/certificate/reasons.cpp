#include "core/certificate/reasons.hpp"

#include <cmath>
#include <cstdio>

#include "core/certificate/parameters.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

using namespace parameters::certificate;

constexpr std::size_t kMostNames = 4;  ///< in a sentence

Player player_of(bool max) { return max ? Player::Max : Player::Min; }
std::string in_brackets(Player player) { return player == Player::Min ? " (Min)" : " (Max)"; }
std::string and_more(std::size_t named) {
  return named > kMostNames ? " and " + std::to_string(named - kMostNames) + " more" : "";
}

}  // namespace

void Reasons::add(CertificateReason reason) {
  const auto same = [&](const CertificateReason& other) { return other.kind == reason.kind; };
  constexpr int kMostOfAKind = 16;
  if (std::ranges::count_if(reasons_, same) < kMostOfAKind) reasons_.push_back(std::move(reason));
}

std::string Reasons::name_of_row(Index constraint) const {
  const Index row = canonical_.model_constraint(constraint);
  return row >= 0 ? canonical_.constraint_name(row) : "the equation of a fixed variable";
}

void Reasons::add_about(Kind kind, Index i, const std::string& before, const std::string& after) {
  const auto slack_of = canonical_.slack_of_constraint();
  const auto row = std::ranges::find(slack_of, i);
  if (row != slack_of.end())
    return add_about_row(kind, static_cast<Index>(row - slack_of.begin()), before, after);
  const Player player = player_of(canonical_.owned_by_max(i));
  const Index variable = canonical_.model_variable(i);
  add({kind,
       player,
       before + canonical_.variable_name(variable) + in_brackets(player) + after,
       {variable},
       {}});
}

void Reasons::add_about_row(Kind kind, Index j, const std::string& before,
                            const std::string& after) {
  const Player player = player_of(canonical_.max_constraints().contains(j));
  CertificateReason reason{kind, player, before + name_of_row(j) + in_brackets(player) + after};
  if (const Index row = canonical_.model_constraint(j); row >= 0) reason.constraints = {row};
  add(std::move(reason));
}

void Reasons::add_weakly_active(const ActiveBounds& set) {
  for (const Index i : each_variable(canonical_)) {
    if (set[i] != BoundClass::WeaklyActive) continue;
    const std::string side = set.side_of(i) < 0 ? "lower" : "upper";
    add_about(Kind::WeaklyActive, i, "weakly active: the " + side + " bound of ",
              " has both distance and multiplier near zero");
  }
}

void Reasons::add_dependences(const Dependences& dependences) {
  for (const Dependence& dependence : dependences.found) {
    const Player player = player_of(canonical_.max_constraints().contains(dependence.row));
    CertificateReason reason{dependence.vanishing ? Kind::VanishingGradient : Kind::Dependent,
                             player};
    std::string others;
    std::size_t named = 0;
    const double largest = dependence.weights.cwiseAbs().maxCoeff();
    for (const Index j : indices(dependence.weights)) {
      if (std::abs(dependence.weights[j]) < kZero * largest) continue;
      if (canonical_.model_constraint(j) >= 0)
        reason.constraints.push_back(canonical_.model_constraint(j));
      if (j != dependence.row && ++named <= kMostNames)
        others += (named == 1 ? "" : ", ") + name_of_row(j);
    }
    others = named == 0 ? "active bounds" : others + and_more(named);
    const std::string row = name_of_row(dependence.row) + in_brackets(player);
    if (dependence.vanishing) {
      reason.text = "the gradient of active constraint " + row + " is zero";
    } else if (dependence.identical) {
      reason.text = "redundant: " + row + " follows from " + others;
    } else {
      reason.text = "dependent: the gradient of active constraint " + row +
                    " is a combination of those of " + others + ", at this point";
    }
    add(std::move(reason));
  }
  if (!dependences.complete)
    add(Kind::Dependent, "more active constraints have (nearly) dependent gradients");
}

void Reasons::add_relaxed(const Iterate& iterate, const VariableScaling& scaling,
                          const SolverOptions& options) {
  // Not beside the start, which was pushed off its bounds.
  const double others = std::max(longest(canonical_, iterate.v, scaling), 1.0);
  constexpr double kCounts = 1e-3;  // of a bound's size
  double most = kCounts;
  Index variable = -1;
  for_each_bound(canonical_, iterate.v, [&](Index i, int side, double distance) {
    const double relaxed = relaxation_of(canonical_, i, side, options);
    if (!(relaxed > 0.0) || distance > 2.0 * relaxed) return;
    double size = std::abs(side < 0 ? canonical_.lower()[i] : canonical_.upper()[i]);
    if (size <= 2.0 * relaxed) size = scaling.variable[i] * others;
    if (relaxed > most * size) most = relaxed / size, variable = i;
  });
  if (variable < 0) return;
  add_about(Kind::Relaxed, variable, "relaxed: bounds were moved by bound_relax_factor, that of ",
            " by " + number_text(most, 2) + " of its size");
}

void Reasons::add_direction(Kind kind, Player player, const Vector& step, const char* before) {
  const IndexRange own = player == Player::Min ? canonical_.x() : canonical_.y();
  std::vector<std::pair<double, Index>> entries;
  double largest = 0.0;
  for (const Index i : indices(own)) {
    entries.emplace_back(step[i] / canonical_.variable_scale(i), i);
    largest = std::max(largest, std::abs(entries.back().first));
  }
  if (!(largest > 0.0)) return;
  std::ranges::stable_sort(
      entries, [](const auto& a, const auto& b) { return std::abs(a.first) > std::abs(b.first); });
  CertificateReason reason{kind, player, before};
  for (const auto& [value, i] : entries) {
    constexpr double kNamed = 1e-3;  // share of the largest entry
    if (std::abs(value) < kNamed * largest) break;
    const Index variable = canonical_.model_variable(i);
    if (reason.variables.size() < kMostNames) {
      char size[32];
      std::snprintf(size, sizeof size, "%s %+.3g ", reason.variables.empty() ? "" : ",",
                    value / largest);
      reason.text += size + canonical_.variable_name(variable);
    }
    reason.variables.push_back(variable);
  }
  reason.text += and_more(reason.variables.size());
  add(std::move(reason));
}

}  // namespace ipminmax
