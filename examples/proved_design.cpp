// The largest gain x of an amplifier on a beam whose response stays below 1 at every frequency w:
//
//   max x   subject to   x^2 |G(w)|^2 <= 1   for every w in [0, 3]
//
//   |G(w)|^2 = 1 / ((1 - w^2)^2 + (0.3 w)^2) + a / ((p^2 - w^2)^2 + (2 z p w)^2)
//
// Its second mode, at p = 2.41, is damped so little (z = 1e-4) that a search from eight starts sees
// nothing of its peak, which is 0.0005 wide. The design that it calls safe is refuted by a proof
// over all w; designed anew with the frequency that the proof has found, it is proved.

#include <cmath>
#include <cstdio>
#include <ipminmax/core/proof.hpp>
#include <ipminmax/core/solver.hpp>
#include <span>
#include <vector>

namespace {

using ipminmax::Player;

struct Beam {
  /// |G(w)|^2
  template <class T>
  static T response(const T& w) {
    constexpr double kSecond = 2.41, kDamping = 1e-4, kShare = 4e-5;
    constexpr double kWidth = 4.0 * kDamping * kDamping * kSecond * kSecond;
    const T s = square(w);
    return 1.0 / (square(1.0 - s) + 0.09 * s) +
           kShare / (square(kSecond * kSecond - s) + kWidth * s);
  }
  template <class T>
  T objective(std::span<const T> v) const {
    return -v[0];
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = square(v[0]) * response(v[1]);
  }
};

/// Designs, proves, says both; the proof.
ipminmax::WorstCaseProof design(ipminmax::ProvableProblem<Beam>& beam) {
  const ipminmax::Result found = ipminmax::solve(beam, {.minmax_worst_case_starts = 8});
  std::printf("gain %.6f: %s\n", found.v[0], found.message.c_str());
  const ipminmax::WorstCaseProof proof =
      ipminmax::prove_worst_case(beam, found.v, {}, {.constraint = 0});
  std::printf("  largest response in [%.8f, %.8f], at w = %.6f: %s\n", proof.seen, proof.proved,
              proof.v[1], proof.message.c_str());
  return proof;
}

}  // namespace

int main() {
  ipminmax::ProvableProblem beam(Beam{}, {.players = {Player::Min, Player::Max},
                                          .start = {0.1, 1.5},
                                          .lower = {0.0, 0.0},
                                          .upper = {10.0, 3.0},
                                          .constraint_lower = {-2e19},
                                          .constraint_upper = {1.0},
                                          .constraint_players = {Player::Min}});
  const auto refuted = design(beam);
  beam.set_start({0.1, refuted.v[1]});
  const auto proved = design(beam);
  const bool as_told = refuted.seen > 2.0 && proved.complete && proved.proved < 1.0 + 1e-5;
  std::puts(as_told ? "refuted, then proved" : "NOT as told above");
  return as_told ? 0 : 1;
}
