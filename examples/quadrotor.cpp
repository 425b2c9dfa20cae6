// A planar quadrotor returns home through wind. In every step a minmax problem over the next stages
// is solved: the thrusts prepare for the worst wind, which pays a price for its square. Then the
// first thrusts are applied while the wind blows as the last solve feared, and the next problem
// starts from the shifted solution. Draws quadrotor.svg.

#include <cstdio>
#include <filesystem>
#include <ipminmax/adapter/minmax_application.hpp>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "quadrotor_tnlp.hpp"
#include "report.hpp"
#include "svg_plot.hpp"

namespace {

using quadrotor::Quadrotor;
using quadrotor::State;

struct Flight {
  std::vector<State> states;
  std::vector<std::array<double, 2>> thrusts, winds;
  std::vector<svg::Point> plan;  ///< of the first solve
  int steps = 0, certified = 0, iterations = 0;
};

Flight fly(quadrotor::Settings settings, State now, int steps, bool calm) {
  Ipopt::SmartPtr<Quadrotor> model = new Quadrotor(settings, now);
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> app = new ipminmax::MinMaxApplication(false);
  if (app->Initialize("") != Ipopt::Solve_Succeeded) throw std::runtime_error("options");
  Flight flight;
  flight.states.push_back(now);
  for (; flight.steps < steps; ++flight.steps) {
    if (flight.steps == 0) {
      app->OptimizeTNLP(Ipopt::GetRawPtr(model));
    } else {
      app->ReOptimizeTNLP(Ipopt::GetRawPtr(model));
    }
    const ipminmax::Result& result = app->LastResult();
    if (result.v.empty()) throw std::runtime_error(result.message);
    flight.iterations += result.iterations;
    if (result.certificate.kind == ipminmax::PointKind::LocalMinmax) {
      ++flight.certified;
    } else {
      std::printf("step %d: %s\n", flight.steps, result.message.c_str());
    }
    const auto value = [&](Ipopt::Index i) { return result.v[static_cast<std::size_t>(i)]; };
    for (int k = 1; k <= settings.stages && flight.steps == 0; ++k)
      flight.plan.push_back({value(model->state(k, 0)), value(model->state(k, 1))});
    const std::array<double, 2> u{value(model->thrust(0, 0)), value(model->thrust(0, 1))};
    const std::array<double, 2> w =
        calm ? std::array<double, 2>{}
             : std::array<double, 2>{value(model->wind(0, 0)), value(model->wind(0, 1))};
    now = model->after(now, u.data(), w.data());
    flight.thrusts.push_back(u);
    flight.winds.push_back(w);
    flight.states.push_back(now);
    model->set_state(now);
    if (flight.steps == 0) ipminmax::warm_start(*app->Options(), 1e-3);
    model->set_start(model->horizon_shift().next(result));
  }
  return flight;
}

void draw(const Flight& flight, double step, const std::filesystem::path& file) {
  svg::Series path{.mark = svg::Mark::LineAndDots, .label = "flown"};
  for (const State& s : flight.states) path.points.push_back({s[0], s[1]});
  svg::Series plan{flight.plan, svg::Mark::Line, "#c09030", "first plan, worst wind"};
  svg::Series left{.color = "#3050c0", .label = "left"},
      right{.color = "#30a050", .label = "right"};
  svg::Series wind_x{.color = "#c03030", .label = "wind, sideways"},
      wind_z{.color = "#c09030", .label = "wind, upwards"};
  for (std::size_t k = 0; k < flight.thrusts.size(); ++k) {
    const double t = step * static_cast<double>(k);
    left.points.push_back({t, flight.thrusts[k][0]});
    right.points.push_back({t, flight.thrusts[k][1]});
    wind_x.points.push_back({t, flight.winds[k][0]});
    wind_z.points.push_back({t, flight.winds[k][1]});
  }
  const svg::Series start{.points = {path.points.front()},
                          .mark = svg::Mark::Circles,
                          .color = "#000000",
                          .label = "start",
                          .size = 5.0};
  svg::write(
      {{.title = "flight", .subtitle = "height over distance, m", .series = {path, plan, start}},
       {.title = "thrusts",
        .subtitle = "m/s^2 over s",
        .series = {left, right},
        .same_scale = false},
       {.title = "wind",
        .subtitle = "m/s^2 over s",
        .series = {wind_x, wind_z},
        .same_scale = false}},
      file);
}

int run(int argc, char** argv) {
  quadrotor::Settings settings;
  int steps = 60;
  double x = 3.0, z = -2.0;
  bool calm = false;
  std::string output = ".";
  CommandLine command_line("quadrotor: closed loop of a planar quadrotor under the worst wind");
  command_line.add("--stages", settings.stages, "stages that are looked ahead (20: 200 variables)");
  command_line.add("--steps", steps, "steps flown (60)");
  command_line.add("--price", settings.price, "of the wind's square (4)");
  command_line.add("--wind-max", settings.wind_max, "largest wind (2)");
  command_line.add("-x", x, "where it starts, sideways (3)");
  command_line.add("-z", z, "height there (-2)");
  command_line.add_flag("--calm", calm, "no wind blows, although it is prepared for");
  command_line.add("--output", output, "folder for the picture (.)");
  if (!command_line.parse(argc, argv)) return 0;
  if (settings.stages < 1 || steps < 1)
    throw std::invalid_argument("--stages and --steps: at least 1");
  const Flight flight = fly(settings, {x, z, 0.0, 0.0, 0.0, 0.0}, steps, calm);
  const State& last = flight.states.back();
  std::printf("%d of %d solves certified, %.1f iterations each; ends at (%.3f, %.3f)\n",
              flight.certified, flight.steps, static_cast<double>(flight.iterations) / flight.steps,
              last[0], last[1]);
  std::filesystem::create_directories(output);
  draw(flight, settings.step, std::filesystem::path(output) / "quadrotor.svg");
  return flight.certified == flight.steps ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("quadrotor", [&] { return run(argc, argv); });
}
