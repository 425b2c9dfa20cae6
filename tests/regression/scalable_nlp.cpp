#include <regression/scalable_nlp.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <regression/element_problem.hpp>

namespace ipminmax::testing {
namespace {

using Pointer = std::unique_ptr<Problem>;

// --- Chains --------------------------------------------------------------------------------------

/// n variables numbered from 0, starts repeated in turn.
std::unique_ptr<ElementProblem> chain_of(Index n, const std::vector<double>& starts) {
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < n; ++i) {
    p->add_variable(starts[static_cast<std::size_t>(i) % starts.size()]);
  }
  return p;
}

void add_rosenbrock(ElementProblem& p, double weight, Index i, Index j) {
  p.add_term<SquaredValley>(kObjective, weight, {i, j});
  p.add_term<Ridge<Square, 1>>(kObjective, 1.0, {i}, {{1.0}, -1.0});
}

/// sin(x_i - x_j) sin(x_i + x_j), written (cos 2 x_j - cos 2 x_i) / 2
void add_product_of_sines(ElementProblem& p, Index row, Index i, Index j) {
  p.add_term<Ridge<Cosine, 1>>(row, 0.5, {j}, {{2.0}, 0.0});
  p.add_term<Ridge<Cosine, 1>>(row, -0.5, {i}, {{2.0}, 0.0});
}

// Problem 5.1: chained Rosenbrock function with trigonometric-exponential constraints.
Pointer luksan_vlcek_1(Index n, double lower) {
  auto p = chain_of(n, {-1.2, 1.0});
  for (Index i = 0; i + 1 < n; ++i) add_rosenbrock(*p, 100.0, i, i + 1);
  for (Index k = 0; k + 2 < n; ++k) {
    const Index row = p->add_row(8.0 + lower, 8.0);
    p->add_term<Ridge<Cube, 1>>(row, 3.0, {k + 1}, {{1.0}, 0.0});
    p->add_linear(row, k + 2, 2.0);
    add_product_of_sines(*p, row, k + 1, k + 2);
    p->add_linear(row, k + 1, 4.0);
    p->add_term<TimesExponential>(row, -1.0, {k, k + 1});
  }
  p->finish();
  return p;
}

// Problem 5.2: chained Wood function with Broyden banded constraints.
Pointer luksan_vlcek_2(Index n) {
  n += n % 2;
  auto p = chain_of(n, {-2.0, 1.0});
  for (Index i = 0; i + 3 < n; i += 2) {
    add_rosenbrock(*p, 100.0, i, i + 1);
    add_rosenbrock(*p, 90.0, i + 2, i + 3);
    p->add_term<Ridge<Square, 2>>(kObjective, 10.0, {i + 1, i + 3}, {{1.0, 1.0}, -2.0});
    p->add_term<Ridge<Square, 2>>(kObjective, 0.1, {i + 1, i + 3}, {{1.0, -1.0}, 0.0});
  }
  for (Index k = 0; k + 7 < n; ++k) {
    const Index row = p->add_row(-1.0, -1.0);
    p->add_linear(row, k + 5, 2.0);
    p->add_term<Ridge<Cube, 1>>(row, 5.0, {k + 5}, {{1.0}, 0.0});
    for (Index i = std::max<Index>(0, k - 5); i <= k + 1; ++i) {
      p->add_linear(row, i, 1.0);
      p->add_term<Ridge<Square, 1>>(row, 1.0, {i}, {{1.0}, 0.0});
    }
  }
  p->finish();
  return p;
}

// Problem 5.3: chained Powell singular function with two constraints.
Pointer luksan_vlcek_3(Index n) {
  n += (4 - n % 4) % 4;
  auto p = chain_of(n, {3.0, -1.0, 0.0, 1.0});
  for (Index i = 0; i + 3 < n; i += 2) {
    p->add_term<Ridge<Square, 2>>(kObjective, 1.0, {i, i + 1}, {{1.0, 10.0}, 0.0});
    p->add_term<Ridge<Square, 2>>(kObjective, 5.0, {i + 2, i + 3}, {{1.0, -1.0}, 0.0});
    p->add_term<Ridge<FourthPower, 2>>(kObjective, 1.0, {i + 1, i + 2}, {{1.0, -2.0}, 0.0});
    p->add_term<Ridge<FourthPower, 2>>(kObjective, 10.0, {i, i + 3}, {{1.0, -1.0}, 0.0});
  }
  const Index first = p->add_row(5.0, 5.0);
  p->add_term<Ridge<Cube, 1>>(first, 3.0, {0}, {{1.0}, 0.0});
  p->add_linear(first, 1, 2.0);
  add_product_of_sines(*p, first, 0, 1);
  const Index last = p->add_row(3.0, 3.0);
  p->add_linear(last, n - 1, 4.0);
  p->add_term<TimesExponential>(last, -1.0, {n - 2, n - 1});
  p->finish();
  return p;
}

// Bounds only, many of them active. They keep iterates out of the valley that takes Newton's method
// a number of iterations proportional to n.
Pointer chained_rosenbrock(Index n) {
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < n; ++i) {
    p->add_variable(0.7, 0.5, i % 3 == 2 ? 0.9 : 10.0);
  }
  for (Index i = 0; i + 1 < n; ++i) add_rosenbrock(*p, 100.0, i, i + 1);
  p->finish();
  return p;
}

// A chain of links of equal length between two fixed points hangs at the least potential energy.
Pointer hanging_chain(Index n) {
  const Index links = n / 2;
  const double length = 1.0 / links;
  constexpr double kSpan = 0.6;
  auto p = std::make_unique<ElementProblem>();
  std::vector<Index> x, y;
  for (Index k = 0; k <= links; ++k) {
    const double s = static_cast<double>(k) / links;
    const double depth = -1.3 * s * (1.0 - s);
    const bool fixed = k == 0 || k == links;
    x.push_back(
        p->add_variable(kSpan * s, fixed ? kSpan * s : -kAbsent, fixed ? kSpan * s : kAbsent));
    y.push_back(p->add_variable(depth, fixed ? 0.0 : -kAbsent, fixed ? 0.0 : kAbsent));
  }
  for (std::size_t k = 1; k < x.size(); ++k) {
    p->add_linear(kObjective, y[k - 1], 0.5 * length);
    p->add_linear(kObjective, y[k], 0.5 * length);
    const Index row = p->add_row(1.0, 1.0);
    const double scale = 1.0 / length;
    p->add_term<Ridge<Square, 2>>(row, 1.0, {x[k], x[k - 1]}, {{scale, -scale}, 0.0});
    p->add_term<Ridge<Square, 2>>(row, 1.0, {y[k], y[k - 1]}, {{scale, -scale}, 0.0});
  }
  p->finish();
  return p;
}

// --- Control of ordinary differential equations --------------------------------------------------

// The van der Pol oscillator, trapezoidal collocation:
// x1' = (1 - x2^2) x1 - x2 + u, x2' = x1, least integral of x1^2 + x2^2 + u^2.
Pointer van_der_pol(Index n) {
  const Index steps = std::max<Index>(1, n / 3 - 1);
  const double h = 5.0 / steps;
  auto p = std::make_unique<ElementProblem>();
  std::vector<Index> x1, x2, u;
  for (Index k = 0; k <= steps; ++k) {
    const bool first = k == 0;
    x1.push_back(p->add_variable(0.0, first ? 0.0 : -kAbsent, first ? 0.0 : kAbsent));
    x2.push_back(p->add_variable(1.0, first ? 1.0 : -0.25, first ? 1.0 : kAbsent));
    u.push_back(p->add_variable(0.0, -0.3, 0.75));
  }
  for (std::size_t k = 0; k < u.size(); ++k) {
    const double weight = k == 0 || k + 1 == u.size() ? 0.5 * h : h;
    for (const Index variable : {x1[k], x2[k], u[k]}) {
      p->add_term<Ridge<Square, 1>>(kObjective, weight, {variable}, {{1.0}, 0.0});
    }
  }
  for (std::size_t k = 1; k < u.size(); ++k) {
    const Index row1 = p->add_row(0.0, 0.0);
    const Index row2 = p->add_row(0.0, 0.0);
    p->add_linear(row1, x1[k], 1.0);
    p->add_linear(row1, x1[k - 1], -1.0);
    p->add_linear(row2, x2[k], 1.0);
    p->add_linear(row2, x2[k - 1], -1.0);
    for (const std::size_t end : {k - 1, k}) {
      p->add_linear(row1, x1[end], -0.5 * h);
      p->add_term<TimesSquare>(row1, 0.5 * h, {x1[end], x2[end]});
      p->add_linear(row1, x2[end], 0.5 * h);
      p->add_linear(row1, u[end], -0.5 * h);
      p->add_linear(row2, x1[end], -0.5 * h);
    }
  }
  p->finish();
  return p;
}

// --- Grids ---------------------------------------------------------------------------------------

/// Variables on a square grid of side x side points; point (i, j) is at ((i + 1) h, (j + 1) h).
struct Grid {
  Index side;
  double h;
  std::vector<Index> variables;

  explicit Grid(Index side_length) : side(side_length), h(1.0 / (side_length + 1)) {}
  [[nodiscard]] double position(Index i) const { return (i + 1) * h; }
  [[nodiscard]] Index operator()(Index i, Index j) const {
    return variables[static_cast<std::size_t>(i * side + j)];
  }
};

/// How far the target x (x - 1) + y (y - 1) of the elliptic control problems bends.
double bend(double x, double y) { return x * (x - 1.0) + y * (y - 1.0); }

// -Laplace y - y + y^3 = u, y = 0 on the boundary; y follows a target, y and u have bounds.
Pointer distributed_control(Index n) {
  Grid y(std::max<Index>(2, static_cast<Index>(std::sqrt(n / 2))));
  Grid u(y.side);
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < y.side * y.side; ++i) {
    y.variables.push_back(p->add_variable(0.0, -kAbsent, 0.371));
    u.variables.push_back(p->add_variable(0.0, -5.0, 5.0));
  }
  const double area = y.h * y.h;
  for (Index i = 0; i < y.side; ++i) {
    for (Index j = 0; j < y.side; ++j) {
      const double target = 1.0 + 2.0 * bend(y.position(i), y.position(j));
      p->add_term<Ridge<Square, 1>>(kObjective, 0.5 * area, {y(i, j)}, {{1.0}, -target});
      p->add_term<Ridge<Square, 1>>(kObjective, 0.5e-3 * area, {u(i, j)}, {{1.0}, 0.0});
      const Index row = p->add_row(0.0, 0.0);
      p->add_linear(row, y(i, j), 4.0 - area);
      if (i > 0) p->add_linear(row, y(i - 1, j), -1.0);
      if (j > 0) p->add_linear(row, y(i, j - 1), -1.0);
      if (i + 1 < y.side) p->add_linear(row, y(i + 1, j), -1.0);
      if (j + 1 < y.side) p->add_linear(row, y(i, j + 1), -1.0);
      p->add_term<Ridge<Cube, 1>>(row, area, {y(i, j)}, {{1.0}, 0.0});
      p->add_linear(row, u(i, j), -area);
    }
  }
  p->finish();
  return p;
}

// -Laplace y = 0, normal derivative u - y^2 on the boundary; bounds on y and u.
Pointer boundary_control(Index n) {
  constexpr double kLargest = 2.071;
  const Index side = std::max<Index>(2, static_cast<Index>(std::sqrt(n + 16.0)) - 4);
  Grid y(side);
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < side * side; ++i) {
    y.variables.push_back(p->add_variable(0.0, -kAbsent, kLargest));
  }
  // Points of the four sides and their controls; side s of point i lies beside grid point (a, b).
  std::vector<Index> edge, control;
  for (Index i = 0; i < 4 * side; ++i) {
    edge.push_back(p->add_variable(0.0, -kAbsent, kLargest));
    control.push_back(p->add_variable(4.0, 3.7, 4.5));
  }
  const auto edge_of = [&](Index s, Index i) {
    return edge[static_cast<std::size_t>(s * side + i)];
  };

  for (Index i = 0; i < side; ++i) {
    for (Index j = 0; j < side; ++j) {
      const double target = 2.0 - 2.0 * bend(y.position(i), y.position(j));
      p->add_term<Ridge<Square, 1>>(kObjective, 0.5 * y.h * y.h, {y(i, j)}, {{1.0}, -target});
      const Index row = p->add_row(0.0, 0.0);
      p->add_linear(row, y(i, j), 4.0);
      p->add_linear(row, i > 0 ? y(i - 1, j) : edge_of(0, j), -1.0);
      p->add_linear(row, i + 1 < side ? y(i + 1, j) : edge_of(1, j), -1.0);
      p->add_linear(row, j > 0 ? y(i, j - 1) : edge_of(2, i), -1.0);
      p->add_linear(row, j + 1 < side ? y(i, j + 1) : edge_of(3, i), -1.0);
    }
  }
  for (Index s = 0; s < 4; ++s) {
    for (Index i = 0; i < side; ++i) {
      const Index u = control[static_cast<std::size_t>(s * side + i)];
      const Index inner = s == 0   ? y(0, i)
                          : s == 1 ? y(side - 1, i)
                          : s == 2 ? y(i, 0)
                                   : y(i, side - 1);
      p->add_term<Ridge<Square, 1>>(kObjective, 0.005 * y.h, {u}, {{1.0}, 0.0});
      const Index row = p->add_row(0.0, 0.0);
      p->add_linear(row, edge_of(s, i), 1.0);
      p->add_linear(row, inner, -1.0);
      p->add_linear(row, u, -y.h);
      p->add_term<Ridge<Square, 1>>(row, y.h, {edge_of(s, i)}, {{1.0}, 0.0});
    }
  }
  p->finish();
  return p;
}

// Stress in a twisted bar that yields: a convex quadratic between two obstacles.
Pointer elastic_plastic_torsion(Index n) {
  Grid v(std::max<Index>(2, static_cast<Index>(std::sqrt(n))));
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < v.side; ++i) {
    for (Index j = 0; j < v.side; ++j) {
      const double distance = v.h * (1 + std::min({i, j, v.side - 1 - i, v.side - 1 - j}));
      v.variables.push_back(p->add_variable(0.0, -distance, distance));
    }
  }
  const auto add_to_boundary = [&](Index point) {
    p->add_term<Ridge<Square, 1>>(kObjective, 0.5, {point}, {{1.0}, 0.0});
  };
  const auto add_between = [&](Index a, Index b) {
    p->add_term<Ridge<Square, 2>>(kObjective, 0.5, {a, b}, {{1.0, -1.0}, 0.0});
  };
  for (Index i = 0; i < v.side; ++i) {
    add_to_boundary(v(0, i));
    add_to_boundary(v(v.side - 1, i));
    add_to_boundary(v(i, 0));
    add_to_boundary(v(i, v.side - 1));
    for (Index j = 0; j < v.side; ++j) {
      if (i > 0) add_between(v(i, j), v(i - 1, j));
      if (j > 0) add_between(v(i, j), v(i, j - 1));
      p->add_linear(kObjective, v(i, j), -5.0 * v.h * v.h);
    }
  }
  p->finish();
  return p;
}

// A soap film over a block. The boundary values are fixed variables.
Pointer minimal_surface(Index n) {
  Grid v(std::max<Index>(4, static_cast<Index>(std::sqrt(n))));
  const double h = 1.0 / (v.side - 1);
  auto p = std::make_unique<ElementProblem>();
  for (Index i = 0; i < v.side; ++i) {
    for (Index j = 0; j < v.side; ++j) {
      const double a = i * h;
      const double b = j * h;
      const bool boundary = i == 0 || j == 0 || i == v.side - 1 || j == v.side - 1;
      const bool block = std::abs(a - 0.5) <= 0.25 && std::abs(b - 0.5) <= 0.25;
      const double height = 1.0 - (2.0 * a - 1.0) * (2.0 * a - 1.0);
      const double lower = boundary ? height : block ? 1.0 : 0.0;
      v.variables.push_back(p->add_variable(lower, lower, boundary ? height : kAbsent));
    }
  }
  for (Index i = 0; i + 1 < v.side; ++i) {
    for (Index j = 0; j + 1 < v.side; ++j) {
      p->add_term<TriangleArea>(kObjective, 0.5 * h * h, {v(i, j), v(i + 1, j), v(i, j + 1)}, {h});
      p->add_term<TriangleArea>(kObjective, 0.5 * h * h,
                                {v(i + 1, j + 1), v(i, j + 1), v(i + 1, j)}, {h});
    }
  }
  p->finish();
  return p;
}

// --- Networks ------------------------------------------------------------------------------------

// Cheapest generation in an alternating-current network: a ring with chords, a generator at every
// fourth bus, balance of active and reactive power at every bus.
Pointer power_network(Index n) {
  struct Bus {
    Index voltage, angle, active_row, reactive_row;
  };
  const Index buses = std::max<Index>(12, 2 * n / 5);
  constexpr double kR = 0.01, kX = 0.1;
  constexpr double kG = kR / (kR * kR + kX * kX);
  constexpr double kB = -kX / (kR * kR + kX * kX);
  auto p = std::make_unique<ElementProblem>();
  std::vector<Bus> bus;
  for (Index i = 0; i < buses; ++i) {
    const double demand = 0.2 + 0.1 * (i % 5);
    const double limit = i == 0 ? 0.0 : kAbsent;  // the first bus gives the angle zero
    bus.push_back({p->add_variable(1.0, 0.94, 1.06), p->add_variable(0.0, -limit, limit),
                   p->add_row(demand, demand), p->add_row(0.3 * demand, 0.3 * demand)});
    if (i % 4 != 0) continue;
    const Index active = p->add_variable(1.0, 0.0, 4.0);
    const Index reactive = p->add_variable(0.0, -2.0, 2.0);
    p->add_linear(kObjective, active, 1.0 + 0.5 * (i % 3));
    p->add_term<Ridge<Square, 1>>(kObjective, 0.5 + 0.1 * (i % 7), {active}, {{1.0}, 0.0});
    p->add_linear(bus.back().active_row, active, 1.0);
    p->add_linear(bus.back().reactive_row, reactive, 1.0);
  }
  // P = g Vi^2 - Vi Vj (g cos + b sin), Q = -b Vi^2 - Vi Vj (g sin - b cos) leave bus i to bus j.
  const auto add_flow = [&](const Bus& i, const Bus& j) {
    p->add_term<Ridge<Square, 1>>(i.active_row, -kG, {i.voltage}, {{1.0}, 0.0});
    p->add_term<LineFlow>(i.active_row, 1.0, {i.voltage, j.voltage, i.angle, j.angle}, {kG, kB});
    p->add_term<Ridge<Square, 1>>(i.reactive_row, kB, {i.voltage}, {{1.0}, 0.0});
    p->add_term<LineFlow>(i.reactive_row, 1.0, {i.voltage, j.voltage, i.angle, j.angle}, {-kB, kG});
  };
  for (Index i = 0; i < buses; ++i) {
    for (const Index step : {1, 7}) {
      const Bus& from = bus[static_cast<std::size_t>(i)];
      const Bus& to = bus[static_cast<std::size_t>((i + step) % buses)];
      add_flow(from, to);
      add_flow(to, from);
    }
  }
  p->finish();
  return p;
}

// Transport with an entropy term. The sums over rows and columns are dependent equations.
Pointer entropy_transport(Index n) {
  const Index side = std::max<Index>(2, static_cast<Index>(std::sqrt(n)));
  const auto share = [side](Index i) { return (1.0 + 0.5 * std::sin(i)) / side; };
  double total = 0.0;
  for (Index i = 0; i < side; ++i) total += share(i);
  auto p = std::make_unique<ElementProblem>();
  std::vector<Index> supply, demand;
  for (Index i = 0; i < side; ++i) {
    supply.push_back(p->add_row(share(i), share(i)));
    demand.push_back(p->add_row(total / side, total / side));
  }
  for (Index i = 0; i < side; ++i) {
    for (Index j = 0; j < side; ++j) {
      const Index x = p->add_variable(1.0 / (side * side), 0.0);
      const double distance = static_cast<double>(i - j) / side;
      p->add_linear(kObjective, x, distance * distance);
      p->add_term<Ridge<Entropy, 1>>(kObjective, 0.1, {x}, {{1.0}, 0.0});
      p->add_linear(supply[static_cast<std::size_t>(i)], x, 1.0);
      p->add_linear(demand[static_cast<std::size_t>(j)], x, 1.0);
    }
  }
  p->finish();
  return p;
}

}  // namespace

const std::vector<ScalableNlp>& scalable_nlps() {
  static const std::vector<ScalableNlp> families = {
      {"luksan_vlcek_1", [](Index n) { return luksan_vlcek_1(n, 0.0); }},
      {"luksan_vlcek_1_inequalities", [](Index n) { return luksan_vlcek_1(n, -1.0); }},
      {"luksan_vlcek_2", luksan_vlcek_2},
      {"luksan_vlcek_3", luksan_vlcek_3},
      {"chained_rosenbrock", chained_rosenbrock},
      {"hanging_chain", hanging_chain},
      {"van_der_pol", van_der_pol},
      {"distributed_control", distributed_control},
      {"boundary_control", boundary_control},
      {"elastic_plastic_torsion", elastic_plastic_torsion},
      {"minimal_surface", minimal_surface},
      {"power_network", power_network},
      {"entropy_transport", entropy_transport},
  };
  return families;
}

const ScalableNlp& scalable_nlp(const std::string& name) {
  const auto& families = scalable_nlps();
  const auto found = std::ranges::find(families, name, &ScalableNlp::name);
  if (found == families.end()) throw std::out_of_range("no family " + name);
  return *found;
}

}  // namespace ipminmax::testing
