#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "adapter/ipopt/problem_tnlp.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

/// (f1 - f2) / max(1, |f2|)
inline double relative_difference(double f1, double f2) {
  return (f1 - f2) / std::max(1.0, std::abs(f2));
}

/// Geometric mean of the ratios ours / Ipopt's of a count.
class RatioMean {
 public:
  void add(Index ours, Index ipopt) {
    sum_ += std::log((static_cast<double>(ours) + 1.0) / (static_cast<double>(ipopt) + 1.0));
    ++count_;
  }
  [[nodiscard]] double mean() const { return count_ == 0 ? 1.0 : std::exp(sum_ / count_); }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

/// Prints a line for each problem, and what they add up to.
struct EffortTable {
  int problems = 0, ipopt_solved = 0, ours_solved = 0, both_solved = 0;
  int same = 0, ours_better = 0, ipopt_better = 0;  ///< objectives to 1e-6, of those solved by both
  RatioMean iterations, evaluations, factorizations;  ///< at the same objective

  static void print_header() {
    std::printf("%-29s %7s %16s %5s %5s %5s   %-36s %16s %9s %5s %5s %5s\n", "problem", "Ipopt",
                "objective", "iter", "evals", "fact", "this solver", "objective", "rel.diff.",
                "iter", "evals", "fact");
  }

  void add(const std::string& name, const IpoptAnswer& ipopt, const Result& ours) {
    constexpr double kTolerance = 1e-6;
    const double difference = relative_difference(ours.objective, ipopt.objective);
    std::printf("%-29s %7d %16.9g %5d %5d %5d   %-36s %16.9g %9.1e %5d %5d %5d\n", name.c_str(),
                static_cast<int>(ipopt.status), ipopt.objective, static_cast<int>(ipopt.iterations),
                static_cast<int>(ipopt.counts.objective),
                static_cast<int>(ipopt.counts.factorizations_full),
                std::string(name_of(ours.status)).c_str(), ours.objective, difference,
                static_cast<int>(ours.iterations), static_cast<int>(ours.counts.objective),
                static_cast<int>(ours.factorizations));
    ++problems;
    ipopt_solved += ipopt.solved();
    ours_solved += is_success(ours.status);
    if (!ipopt.solved() || !is_success(ours.status)) return;
    ++both_solved;
    ours_better += difference < -kTolerance;
    ipopt_better += difference > kTolerance;
    if (std::abs(difference) > kTolerance) return;
    ++same;
    iterations.add(ours.iterations, ipopt.iterations);
    evaluations.add(ours.counts.objective, ipopt.counts.objective);
    factorizations.add(ours.factorizations, ipopt.counts.factorizations_full);
  }

  void print_summary() const {
    std::printf("%d problems; solved by Ipopt %d, by this solver %d, by both %d\n", problems,
                ipopt_solved, ours_solved, both_solved);
    std::printf(
        "objectives of those solved by both: same to 1e-6 %d, ours better %d, Ipopt's better %d\n",
        same, ours_better, ipopt_better);
    std::printf(
        "geometric means of ours / Ipopt's over %d with the same objective: iterations %.3f, "
        "objective evaluations %.3f, factorizations %.3f\n",
        same, iterations.mean(), evaluations.mean(), factorizations.mean());
  }
};

}  // namespace ipminmax::testing
