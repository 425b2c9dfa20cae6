// The Hock-Schittkowski problems from starts around the published ones, ours against Ipopt.

#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <regression/hock_schittkowski.hpp>

#include "adapter/ipopt/cross_check.hpp"

namespace ipminmax::testing {
namespace {

constexpr unsigned kDraws = 8;

TEST(PerturbedStartsTable, AreSolvedAsOftenAsByIpopt) {
  int runs = 0, ours_total = 0, ipopt_total = 0, both_total = 0, refuted_total = 0;
  int same = 0, better = 0, worse = 0;
  double log_iterations = 0.0;
  std::printf("%-22s %6s %5s %5s %8s\n", "problem", "Ipopt", "ours", "both", "refuted");
  for (const MinimizationProblem& known : hock_schittkowski()) {
    unsigned ours = 0, ipopt = 0, both = 0, refuted = 0;
    std::string failures;
    for (unsigned draw = 0; draw < kDraws; ++draw) {
      AutodiffProblem problem(known.model, perturbed_start(known, draw));
      const CrossCheck check = cross_check_with_ipopt(problem);
      const bool is_refuted = check.verdict == CrossCheckVerdict::IpoptRefuted;
      const bool ours_solved = is_success(check.ours.status);
      const bool ipopt_solved = check.ipopt.solved() && !is_refuted;
      ours += ours_solved;
      ipopt += ipopt_solved;
      refuted += is_refuted;
      if (ipopt_solved && !ours_solved) {
        failures += "  draw " + std::to_string(draw) + ": " +
                    std::string(name_of(check.ours.status)) + "\n";
      }
      if (!ours_solved || !ipopt_solved) continue;
      ++both;
      better += check.verdict == CrossCheckVerdict::OursBetter;
      worse += check.verdict == CrossCheckVerdict::IpoptBetter;
      if (check.verdict == CrossCheckVerdict::SameSolution ||
          check.verdict == CrossCheckVerdict::SameObjective) {
        ++same;
        log_iterations += std::log((1.0 + static_cast<double>(check.ours.iterations)) /
                                   (1.0 + static_cast<double>(check.ipopt.iterations)));
      }
    }
    runs += kDraws;
    ours_total += static_cast<int>(ours);
    ipopt_total += static_cast<int>(ipopt);
    both_total += static_cast<int>(both);
    refuted_total += static_cast<int>(refuted);
    if (ours != kDraws || ipopt != kDraws) {
      std::printf("%-22s %6u %5u %5u %8u\n%s", known.name.c_str(), ipopt, ours, both, refuted,
                  failures.c_str());
    }
    if (ipopt == kDraws) {
      EXPECT_EQ(ours, kDraws) << known.name;
    }
  }
  std::printf("the other problems: all %u by both\n", kDraws);
  std::printf(
      "%d runs; solved by Ipopt %d (and %d at points that the second-order test refutes), by this "
      "solver %d, by both %d, by either %d\n",
      runs, ipopt_total, refuted_total, ours_total, both_total,
      ours_total + ipopt_total - both_total);
  std::printf("of those solved by both: same objective %d, ours better %d, Ipopt's better %d\n",
              same, better, worse);
  std::printf("geometric mean of iterations, ours / Ipopt's, at the same objective: %.3f\n",
              std::exp(log_iterations / same));
  EXPECT_GE(ours_total, ipopt_total);
  EXPECT_LE(log_iterations / same, std::log(1.1));
}

}  // namespace
}  // namespace ipminmax::testing
