#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>

#include "core/answer.hpp"
#include "core/model/indices.hpp"
#include "core/model/status_table.hpp"
#include "core/model/structure_check.hpp"
#include "core/worst_case.hpp"

// What a result says, in words: written here alone.
namespace ipminmax {
namespace {

std::string number(double value) { return number_text(value, 8); }

/// Unless that was done.
std::string over_branches(const Result& result) {
  if (result.over_y.branches > 0) return {};
  return "\nminmax_epigraph yes, with minmax_worst_case_starts, minimizes the largest of the "
         "maxima";
}

/// Whether f was seen to vary with y.
bool varies(const WorstCase& found) {
  return found.competing != 1 || found.branches.size() < 2 ||
         found.branches.front() != found.branches.back();
}

/// "(a, b, c, ...)"
std::string list(const std::vector<double>& values) {
  constexpr std::size_t kMostSaid = 6;
  std::string text = "(";
  for (std::size_t i = 0; i < std::min(kMostSaid, values.size()); ++i) {
    text += (i > 0 ? ", " : "") + number(values[i]);
  }
  return text + (values.size() > kMostSaid ? ", ...)" : ")");
}

std::string count(Index number, const char* what) {
  return std::to_string(number) + " " + what + (number == 1 ? "" : "s");
}

}  // namespace

std::string describe_worst_case(const Result& result) {
  const WorstCase& found = result.worst_case;
  if (found.starts == 0 && !found.higher) return {};
  if (found.starts == 0) {
    return "value " + number(result.objective) +
           " is a local worst case only: the y of another start, y = " + list(found.y) +
           ", gives " + number(found.value) +
           " at this x\nminmax_worst_case_starts N searches for others" + over_branches(result);
  }
  const std::string searched = " in " + count(found.starts, "maximization") + " over y";
  std::string text;
  if (found.unbounded) {
    text = "at this x the maximization over y is unbounded, seen" + searched;
  } else if (found.higher) {
    text = "value " + number(result.objective) +
           " is a local worst case only: another y, y = " + list(found.y) + ", gives " +
           number(found.value) + " at this x (largest" + searched + ")";
  } else if (found.stated_concave) {
    text = found.v.empty() ? "no maximum over y was found at this x"
                           : "no other y can be worse: the model states that f is concave in y";
  } else if (found.single_branch) {
    text = "one maximum over y at this x" + searched +
           ", with K_yy of the right inertia at every iterate: f looks concave in y here";
  } else if (found.v.empty()) {
    text = "no maximum over y was found at this x" + searched;
  } else if (!varies(found)) {
    return "f has the same value at every y seen" + searched;
  } else {
    text = "no higher maximum over y was found at this x" + searched + " (" +
           std::to_string(found.maxima) + " distinct)";
  }
  if (found.unbounded) return text;
  if (found.branches.size() > 1) {
    text += "; values at the maxima: " + list(found.branches);
  }
  if (found.competing > 1) {
    text += "; " + std::to_string(found.competing) +
            " of them share the largest: the worst case may have a kink at this x, where "
            "minmax_epigraph yes goes on";
  } else if (found.higher) {
    text += over_branches(result);
  }
  return text;
}

namespace {

std::string what_it_is(const Result& result) {
  const Certificate& c = result.certificate;
  std::string text(name_of(c.kind));
  if (c.kind == PointKind::FirstOrderPoint) {
    text += ", second-order test " + std::string(name_of(c.second_order));
  }
  if (result.over_y.branches > 1 && c.kind == PointKind::LocalMinmax) {
    text += ": x minimizes the largest of " + count(result.over_y.branches, "local worst case");
  }
  if (!c.proof.empty()) text += "; " + c.proof;
  return text;
}

std::string looked_over_y(const Result& result) {
  const SearchOverY& y = result.over_y;
  const std::string of_objective = describe_worst_case(result);
  if (y.functions == 0 && of_objective.empty()) {
    return y.finished ? "worst cases not searched (set minmax_worst_case_starts)"
                      : "cut short before any y was looked at";
  }
  std::string text;
  if (std::isfinite(y.largest_violation)) {
    const Index rows = y.functions - (result.worst_case.starts > 0 ? 1 : 0);
    text = "robust constraints maximized over y: " + count(rows, "bound") + ", at least " +
           count(y.asked, "start") + " each; largest violation " + number(y.largest_violation);
    if (y.age > 0)
      text +=
          "; far from a limit only the last worst case was followed, the oldest full search was " +
          count(y.age, "solve") + " ago";
  }
  const bool tells_f = text.empty() || varies(result.worst_case);
  if (!of_objective.empty() && tells_f) text += (text.empty() ? "" : "; ") + of_objective;
  for (const WorstCaseProof& proof : y.proofs) {
    if (proof.constraint < 0 && !tells_f) continue;
    text += "; " + (proof.constraint < 0 ? "f" : "constraint " + std::to_string(proof.constraint)) +
            (proof.least ? ", its least value, " : " ") + proof.message;
  }
  return text + (y.finished ? "" : "; cut short, or a function could not be maximized");
}

}  // namespace

std::array<std::string, 4> statements(const Result& result) {
  const SearchOverX& x = result.over_x;
  std::string why = result.message.empty() ? std::string(name_of(result.status)) : result.message;
  if (const auto advice = row_of(result.status).advice; !advice.empty())
    why.append("\n").append(advice);
  return {why, what_it_is(result), looked_over_y(result),
          x.made == x.asked
              ? count(x.made, "start")
              : std::to_string(x.made) + " of " + std::to_string(x.asked) + " starts"};
}

std::string points_as_csv(const MultistartResult& result) {
  std::ostringstream text;
  text << std::setprecision(std::numeric_limits<double>::max_digits10)
       << "rank,value,found,first_start,margin,status";
  const std::size_t n = result.points.empty() ? 0 : result.points.front().result.v.size();
  for (std::size_t i = 0; i < n; ++i) text << ",v_" << i;
  text << '\n';
  for (const auto k : indices(result.points)) {
    const DistinctPoint& point = result.points[k];
    text << k + 1 << ',' << point.result.objective << ',' << point.found << ',' << point.first_start
         << ',' << point.result.certificate.margin << ',' << name_of(point.result.status);
    for (const double value : point.result.v) text << ',' << value;
    text << '\n';
  }
  return text.str();
}

}  // namespace ipminmax
