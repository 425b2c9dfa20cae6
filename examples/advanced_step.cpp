// Model predictive control that answers at once: the next solve is done before the measurement
// comes.
//
// While the players walk from one time step to the next, the pursuit (chauffeur_tnlp.hpp) is solved
// for the states that they are expected in. When the states are measured, they are elsewhere (wind
// blows the evader about); instead of another solve, the solution at hand is corrected by its
// sensitivities: one back substitution. The program applies the corrected controls and compares
// them, step by step, with those of a solve for the measured states and with those not corrected.
//
//   advanced_step [gusts [steps]]      size of the gusts (0.02), time steps (40)
#include <IpOptionsList.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ipminmax/adapter/minmax_application.hpp>
#include <stdexcept>

#include "chauffeur_tnlp.hpp"

namespace {

using chauffeur::Control;
using chauffeur::State;
using Clock = std::chrono::steady_clock;

double distance(const Control& a, const Control& b) {
  return std::max({std::abs(a.u - b.u), std::abs(a.dx - b.dx), std::abs(a.dy - b.dy)});
}

double milliseconds_since(Clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}

/// A game with its solver, warm started from one time step to the next.
class Pursuit {
 public:
  Pursuit(const chauffeur::Parameters& parameters, const State& start)
      : model_(new chauffeur::ChauffeurTNLP(parameters, start, {0.01, 0.002, 0.001})),
        app_(new ipminmax::MinMaxApplication(false)) {
    if (app_->Initialize("") != Ipopt::Solve_Succeeded) throw std::runtime_error("bad options");
    require(app_->OptimizeTNLP(Ipopt::GetRawPtr(model_)));
    ipminmax::warm_start(*app_->Options(), 1e-5);
  }

  /// Solves for these states, from the given point.
  void solve(const State& state, const ipminmax::PrimalDual& start) {
    model_->set_state(state);
    model_->set_start(start);
    require(app_->ReOptimizeTNLP(Ipopt::GetRawPtr(model_)));
  }

  [[nodiscard]] const ipminmax::Result& result() const { return app_->LastResult(); }
  [[nodiscard]] bool certified() const {
    return result().certificate.kind == ipminmax::PointKind::LocalMinmax;
  }
  [[nodiscard]] const chauffeur::ChauffeurTNLP& model() const { return *model_; }
  void update(ipminmax::Sensitivity& sensitivity) const {
    if (const auto error = app_->UpdateSensitivity(sensitivity); !error.empty()) {
      throw std::runtime_error(error);
    }
  }

 private:
  static void require(Ipopt::ApplicationReturnStatus status) {
    if (status != Ipopt::Solve_Succeeded) throw std::runtime_error("a solve failed");
  }
  Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model_;
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> app_;
};

struct Tally {
  double old_error = 0.0, new_error = 0.0, solve_ms = 0.0, predict_ms = 0.0;
  int certified = 0, changes = 0;
};

int run(double gusts, int steps) {
  chauffeur::Parameters parameters;
  parameters.d_max = 0.03;
  parameters.gamma_d = 400.0;
  State state;
  Pursuit ahead(parameters, state), check(parameters, state);
  ipminmax::Sensitivity sensitivity;
  Tally tally;
  std::printf(
      "step  distance   error of controls: as solved  corrected  changes of the active set\n");
  for (int k = 1; k <= steps; ++k) {
    ahead.update(sensitivity);  // of the solution for the expected states

    State measured = ahead.model().state();
    measured.ex += gusts * std::sin(2.3 * k);
    measured.ey += gusts * std::cos(1.7 * k);
    const auto measured_at = Clock::now();
    const ipminmax::Prediction corrected =
        sensitivity.predict(ahead.model().state_change(measured));
    tally.predict_ms += milliseconds_since(measured_at);
    const Control control = chauffeur::ChauffeurTNLP::first_control(corrected.v);

    const auto solve_at = Clock::now();  // what it would have been
    check.solve(measured, {ahead.result().v, ahead.result().lambda, ahead.result().z_lower,
                           ahead.result().z_upper});
    tally.solve_ms += milliseconds_since(solve_at);
    const Control exact = chauffeur::ChauffeurTNLP::first_control(check.result().v);
    const double old_error =
        distance(chauffeur::ChauffeurTNLP::first_control(ahead.result().v), exact);
    const double new_error = distance(control, exact);
    tally.old_error += old_error;
    tally.new_error += new_error;
    tally.changes += static_cast<int>(corrected.changes.size());
    tally.certified += ahead.certified() && check.certified() ? 1 : 0;
    std::printf("%4d  %8.4f %29.2e  %9.2e", k, std::sqrt(chauffeur::squared_distance(measured)),
                old_error, new_error);
    for (const auto& change : corrected.changes) std::printf("  %s", change.text.c_str());
    std::printf("\n");

    // The players act; the pursuit is solved for the states they are expected in next.
    const Control applied = chauffeur::saturate(control, parameters);
    const State next = chauffeur::advance(measured, applied, parameters.speed);
    ahead.solve(next, ahead.model().horizon_shift().next(ahead.result()));
  }
  std::printf(
      "\nmean error of the first controls: %.2e as solved, %.2e corrected (%.0f times less)\n",
      tally.old_error / steps, tally.new_error / steps, tally.old_error / tally.new_error);
  std::printf("after the measurement: %.3f ms for a prediction, %.3f ms for a warm solve\n",
              tally.predict_ms / steps, tally.solve_ms / steps);
  std::printf("%d changes of the active set on the way; %d of %d steps certified\n", tally.changes,
              tally.certified, steps);
  return tally.new_error < 0.2 * tally.old_error ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? std::atof(argv[1]) : 0.02, argc > 2 ? std::atoi(argv[2]) : 40);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "advanced_step: %s\n", error.what());
    return 2;
  }
}
