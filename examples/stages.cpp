// Six games of control against disturbance by stages (stage_models.hpp), each beside its nominal
// problem without disturbance solved by Ipopt; and the least price of the evader's speed for which
// the pursuit has an answer, as a curve.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <ipminmax/adapter/find_price.hpp>
#include <ipminmax/adapter/problem_tnlp.hpp>
#include <ipminmax/adapter/stages.hpp>
#include <string>

#include "command_line.hpp"
#include "report.hpp"
#include "stage_models.hpp"

namespace {

int certified = 0, solved = 0;

template <class Model>
void play(const char* name, std::size_t stages) {
  ipminmax::Horizon horizon = Model::horizon(stages);
  ipminmax::StageGame game(Model{}, horizon);
  const ipminmax::StageAnswer plan = game.solve();
  ++solved;
  if (plan.certified()) ++certified;
  double strongest = 0.0;
  for (const auto& w : plan.disturbances)
    for (const double value : w) strongest = std::max(strongest, std::abs(value));
  const ipminmax::Result& r = plan.result;
  std::printf("%-12s %7zu %9zu %12.6g %-4s %5d %9.4f %9.4f %8.3f", name, stages, r.v.size(),
              r.objective, plan.certified() ? "yes" : "no", r.iterations, r.seconds,
              r.timing.evaluations, strongest);
  horizon.disturbance_lower.assign(Model::disturbances, 0.0);
  horizon.disturbance_upper.assign(Model::disturbances, 0.0);
  ipminmax::StageGame calm(Model{}, horizon);
  const ipminmax::IpoptAnswer nominal = ipminmax::solve_with_ipopt(calm);
  std::printf(" %12.6g %5d %9.4f\n", nominal.objective, nominal.iterations, nominal.seconds);
}

int run(int argc, char** argv) {
  int largest = 100;
  double tolerance = 0.02;
  bool without_curve = false;
  std::string output = ".";
  CommandLine command_line("stages: six games by stages, and the price of the evader's speed");
  command_line.add("--largest", largest, "stages, of 10, 100, 1000, ... (100)");
  command_line.add("--tolerance", tolerance, "of the least price (0.02)");
  command_line.add_flag("--no-curve", without_curve, "without the search for the least price");
  command_line.add("--output", output, "folder for price_curve.svg and price_curve.csv (.)");
  if (!command_line.parse(argc, argv)) return 0;
  if (largest < 10) throw std::invalid_argument("--largest: at least 10");
  std::printf("%-12s %7s %9s %12s %-4s %5s %9s %9s %8s %12s %5s %9s\n", "game", "stages",
              "variables", "value", "cert", "iter", "seconds", "functions", "max |w|", "nominal",
              "iter", "Ipopt s");
  for (std::size_t stages = 10; stages <= static_cast<std::size_t>(largest); stages *= 10) {
    play<stage_models::Pursuit>("pursuit", stages);
    play<stage_models::Quadrotor>("quadrotor", stages);
    play<stage_models::VanDerPol>("Van der Pol", stages);
    play<stage_models::CartPole>("cart-pole", stages);
    play<stage_models::RobotArm>("robot arm", stages);
    play<stage_models::RaceCar>("race car", stages);
  }
  std::printf("%d of %d games certified\n", certified, solved);
  if (without_curve) return certified == solved ? 0 : 1;

  ipminmax::StageGame pursuit(stage_models::Pursuit{}, stage_models::Pursuit::horizon(20));
  const ipminmax::PriceCurve curve =
      ipminmax::find_price(pursuit, [&](double price) { pursuit.model().price = price; },
                           {.from = 50.0, .tolerance = tolerance});
  std::printf("\npursuit: %s\n%s", curve.message.c_str(), curve.table().c_str());
  std::filesystem::create_directories(output);
  for (const char* name : {"price_curve.svg", "price_curve.csv"}) {
    const std::string file = (std::filesystem::path(output) / name).string();
    ipminmax::write_price_curve(curve, file);
    std::printf("wrote %s\n", file.c_str());
  }
  return certified == solved && curve.least > 0.0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("stages", [&] { return run(argc, argv); });
}
