#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <problems/semi_infinite_programs.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using X = SemiInfinite::Variables;
using Point = SemiInfinite::Point;

std::vector<Expression> add_x(const SemiInfinite& p, Model& model) {
  std::vector<Expression> x;
  for (std::size_t i = 0; i < p.start.size(); ++i) {
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i),
                               p.x_lower.empty() ? -kNoBound : p.x_lower[i],
                               p.x_upper.empty() ? kNoBound : p.x_upper[i]));
  }
  return x;
}

Expression power(const Expression& t, int k) {
  Expression product = 1.0 * t;
  for (int i = 1; i < k; ++i) product = product * t;
  return product;
}

/// x_0 + x_1 t + ... + x_{terms-1} t^{terms-1}
Expression polynomial(X x, const Expression& t, std::size_t terms) {
  Expression sum = 1.0 * x[0];
  for (std::size_t k = 1; k < terms; ++k) sum = sum + x[k] * power(t, static_cast<int>(k));
  return sum;
}
Expression polynomial(X x, const Expression& t) { return polynomial(x, t, x.size()); }

/// min x_n with |target(t) - polynomial of degree n - 1| <= x_n: best approximation.
SemiInfinite chebyshev(std::string name, std::size_t terms, Expression (*target)(const Expression&),
                       Point interval, double exact) {
  SemiInfinite p;
  p.name = std::move(name);
  p.start.assign(terms + 1, 0.0);
  p.start.back() = 3.0;
  p.objective = [](X x) { return 1.0 * x.back(); };
  p.rows = {[=](X x, X t) { return target(t[0]) - polynomial(x, t[0], terms) - x.back(); },
            [=](X x, X t) { return polynomial(x, t[0], terms) - target(t[0]) - x.back(); }};
  p.lower = {interval[0]};
  p.upper = {interval[1]};
  p.optimum = exact;
  return p;
}

Expression exponential(const Expression& t) { return exp(t); }
Expression cube(const Expression& t) { return power(t, 3); }
Expression fourth_power(const Expression& t) { return power(t, 4); }
Expression reciprocal(const Expression& t) { return 1.0 / (t + 1.25); }

Expression integral(X x) {  // of the polynomial over [0, 1]
  Expression sum = 1.0 * x[0];
  for (std::size_t k = 1; k < x.size(); ++k)
    sum = sum + x[k] * (1.0 / (static_cast<double>(k) + 1));
  return sum;
}

/// Symmetric low-pass filter of least ripple x_n: the amplitude sum of x_k cos(k w) is near 1 for w
/// in
/// [0, 0.3 pi] and near 0 in [0.5 pi, pi]. In c = cos w the ends 0 and pi are bounds with a slope.
SemiInfinite low_pass_filter(std::size_t taps) {
  SemiInfinite p;
  p.name = "low_pass_filter";
  p.start.assign(taps + 1, 0.0);
  p.start.back() = 2.0;
  p.objective = [](X x) { return 1.0 * x.back(); };
  const auto amplitude = [taps](X x, const Expression& c) {
    Expression before = 1.0 + 0.0 * c, now = 1.0 * c;  // Chebyshev's polynomials
    Expression sum = x[0] + x[1] * now;
    for (std::size_t k = 2; k < taps; ++k) {
      const Expression next = 2.0 * c * now - before;
      sum = sum + x[k] * next;
      before = now;
      now = next;
    }
    return sum;
  };
  const auto between = [](double a, double b, X t) { return a + (b - a) * t[0]; };
  const double pass = std::cos(0.3 * std::numbers::pi), stop = std::cos(0.5 * std::numbers::pi);
  for (const double sign : {1.0, -1.0}) {
    p.rows.push_back(
        [=](X x, X t) { return sign * (amplitude(x, between(pass, 1.0, t)) - 1.0) - x.back(); });
    p.rows.push_back(
        [=](X x, X t) { return sign * amplitude(x, between(-1.0, stop, t)) - x.back(); });
  }
  return p;
}

/// PID controller of Teo, Rehbock and Jennings (1993), a frequency-domain stability margin.
SemiInfinite controller() {
  SemiInfinite p;
  p.name = "controller_design";
  p.start = {50.0, 50.0, 50.0};
  p.objective = [](X x) {
    const Expression above = x[1] * (122.0 + 17.0 * x[0] + 6.0 * x[2] - 5.0 * x[1] + x[0] * x[2]) +
                             180.0 * x[2] - 36.0 * x[0] + 1224.0;
    const Expression below = x[1] * (408.0 + 56.0 * x[0] - 50.0 * x[1] + 60.0 * x[2] +
                                     10.0 * x[0] * x[2] - 2.0 * square(x[0]));
    return above / below;
  };
  p.rows = {[](X x, X t) {
    // T = 1 + (x_0 + x_1 / s + x_2 s) / ((s + 3)(s^2 + 2 s + 2)), s = i w; Im T - 3.33 (Re T)^2 +
    // 1.
    const Expression w = t[0];
    const Expression a = 6.0 - 5.0 * square(w), b = 8.0 * w - power(w, 3);  // of the denominator
    const Expression c = 1.0 * x[0], d = x[2] * w - x[1] / w;               // of the controller
    const Expression size = square(a) + square(b);
    const Expression re = 1.0 + (c * a + d * b) / size, im = (d * a - c * b) / size;
    return im - 3.33 * square(re) + 1.0;
  }};
  p.lower = {1e-6};
  p.upper = {30.0};
  p.x_lower = {0.0, 0.1, 0.0};
  p.x_upper = {100.0, 100.0, 100.0};
  p.optimum = 0.1746;
  p.tolerance = 1e-3;
  return p;
}

/// Of Watson (1983) and Coope and Watson (1985), with the values published there.
void add_watson(std::vector<SemiInfinite>& list) {
  list.push_back(
      {"watson_1", {0.8, 0.9}, [](X x) { return 1.21 * exp(x[0]) + exp(x[1]); }, {[](X x, X t) {
         return t[0] - exp(x[0] + x[1]);
       }}});
  list.back().optimum = 2.2;
  list.push_back({"tangent_by_six_terms", {2.0, 0.0, 0.0, 0.0, 0.0, 0.0}, integral, {[](X x, X t) {
                    return sin(t[0]) / cos(t[0]) - polynomial(x, t[0]);
                  }}});
  list.back().optimum = 0.616085;
  list.back().weakly_active = true;  // the row changes by 1e-5 near its six worst cases
  list.push_back({"watson_7",
                  {1.0, 1.0, 1.0},
                  [](X x) { return square(x[0]) + square(x[1]) + square(x[2]); },
                  {[](X x, X t) {
                    return x[0] * (t[0] + square(t[1]) + 1.0) +
                           x[1] * (t[0] * t[1] - square(t[1])) +
                           x[2] * (t[0] * t[1] + square(t[1]) + t[1]) + 1.0;
                  }}});
  list.back().lower = {0.0, 0.0};
  list.back().upper = {1.0, 1.0};
  list.back().optimum = 1.0;
  list.back().weakly_active = true;
  // All t with |t_0| = |t_1| are worst ones at the only answer, (3, 0, 0, 0, 0, 0).
  list.push_back({"watson_9",
                  {-1.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                  [](X x) { return -4.0 * x[0] - (2.0 / 3.0) * (x[3] + x[5]); },
                  {[](X x, X t) {
                    return x[0] + x[1] * t[0] + x[2] * t[1] + x[3] * square(t[0]) +
                           x[4] * t[0] * t[1] + x[5] * square(t[1]) - 3.0 -
                           square(t[0] - t[1]) * square(t[0] + t[1]);
                  }}});
  list.back().lower = {-1.0, -1.0};
  list.back().upper = {1.0, 1.0};
  list.back().optimum = -12.0;
}

/// min x_n with |error(x, t)| <= x_n for every t in an interval; published values.
SemiInfinite least_error(std::string name, Point start,
                         Expression (*error)(const std::vector<Expression>& x, const Expression& t),
                         Point interval, double published) {
  SemiInfinite p;
  p.name = std::move(name);
  p.start = std::move(start);
  p.objective = [](X x) { return 1.0 * x.back(); };
  p.rows = {[=](X x, X t) { return error(x, t[0]) - x.back(); },
            [=](X x, X t) { return -error(x, t[0]) - x.back(); }};
  p.lower = {interval[0]};
  p.upper = {interval[1]};
  p.optimum = published;
  return p;
}

/// Oettershagen's approximations and Powell's linear program over a circle.
void add_oettershagen(std::vector<SemiInfinite>& list) {
  list.push_back(least_error(
      "oet_1", {0.0, 0.0, 5.0},
      [](X x, const Expression& t) { return square(t) - x[0] * t - x[1] * exp(t); }, {0.0, 2.0},
      0.538243));
  list.back().tolerance = 1e-5;  // of the published digits
  list.push_back(least_error(
      "oet_2", {1.0, -1.0, 2.0},
      [](X x, const Expression& t) { return 1.0 / (1.0 + t) - x[0] * exp(x[1] * t); }, {-0.5, 0.5},
      0.0871597));
  list.push_back(least_error(
      "oet_3", {0.0, 0.0, 0.0, 2.0},
      [](X x, const Expression& t) { return sin(t) - polynomial(x, t, 3); }, {0.0, 1.0},
      0.00450532));
  list.push_back({"powell_circle", {0.8, 0.5}, [](X x) { return 1.0 * x[1]; }, {[](X x, X t) {
                    return -1.0 - x[0] * cos(t[0]) - x[1] * sin(t[0]);
                  }}});
  list.back().upper = {2.0 * std::numbers::pi};
  list.back().optimum = -1.0;
}

}  // namespace

std::vector<SemiInfinite> semi_infinite_programs() {
  constexpr double kPi = std::numbers::pi;
  const double e = std::numbers::e;
  const double slope = std::sinh(1.0);  // of the best line through exp on [-1, 1]
  std::vector<SemiInfinite> list;
  list.push_back({"coope_watson_1",
                  {-0.5, -0.5},
                  [](X x) { return (1.0 / 3.0) * square(x[0]) + square(x[1]) + 0.5 * x[0]; },
                  {[](X x, X t) {
                    return square(1.0 - square(x[0]) * square(t[0])) - x[0] * square(t[0]) -
                           square(x[1]) + x[1];
                  }}});
  list.back().optimum = 0.194466;
  list.back().weakly_active = true;
  list.push_back({"coope_watson_2",
                  {1.0, 1.0, 1.0},
                  [](X x) { return square(x[0]) + square(x[1]) + square(x[2]); },
                  {[](X x, X t) {
                    return x[0] + x[1] * exp(x[2] * t[0]) + exp(2.0 * t[0]) - 2.0 * sin(4.0 * t[0]);
                  }}});
  list.back().optimum = 5.334687;
  list.push_back({"coope_watson_3",
                  {1.0, 0.5, 0.0},
                  [](X x) { return exp(x[0]) + exp(x[1]) + exp(x[2]); },
                  {[](X x, X t) { return 1.0 / (1.0 + square(t[0])) - polynomial(x, t[0]); }}});
  list.back().optimum = 4.301183;
  list.push_back({"two_polynomials",
                  {1.0, 1.0},
                  [](X x) {
                    return square(x[0] - 2.0 * x[1] + 5.0 * square(x[1]) - x[1] * square(x[1]) -
                                  13.0) +
                           square(x[0] - 14.0 * x[1] + square(x[1]) + x[1] * square(x[1]) - 29.0);
                  },
                  {[](X x, X t) {
                    return square(x[0]) + 2.0 * x[1] * square(t[0]) + exp(x[0] + x[1]) - exp(t[0]);
                  }}});
  list.back().optimum = 97.158852;
  list.push_back({"tangent_from_above", {2.0, 0.0, 0.0}, integral, {[](X x, X t) {
                    return sin(t[0]) / cos(t[0]) - polynomial(x, t[0]);
                  }}});
  list.back().optimum = 0.649042;
  list.push_back({"exponential_from_above", {3.0, 0.0, 0.0}, integral, {[](X x, X t) {
                    return exp(t[0]) - polynomial(x, t[0]);
                  }}});
  list.push_back({"chord_above_exponential", {3.0, 0.0}, integral, {[](X x, X t) {
                    return exp(t[0]) - polynomial(x, t[0]);
                  }}});
  list.back().optimum = 0.5 * (1.0 + e);
  list.push_back({"tangent_above_sine", {2.0, 0.0}, integral, {[](X x, X t) {
                    return sin(t[0]) - polynomial(x, t[0]);
                  }}});
  list.back().optimum = std::sin(0.5);
  list.push_back({"disc_from_tangents",  // all half planes of the unit disc
                  {0.0, 0.0},
                  [](X x) { return -x[0] - 2.0 * x[1]; },
                  {[](X x, X t) { return x[0] * cos(t[0]) + x[1] * sin(t[0]) - 1.0; }}});
  list.back().lower = {-kPi};
  list.back().upper = {kPi};
  list.back().optimum = -std::sqrt(5.0);
  list.push_back(
      {"disc_in_ellipse",  // largest radius x_2, centre (x_0, x_1); not centred at the start
       {0.3, 0.1, 0.2},
       [](X x) { return -1.0 * x[2]; },
       {[](X x, X t) {
         return 0.25 * square(x[0] + x[2] * cos(t[0])) + square(x[1] + x[2] * sin(t[0])) - 1.0;
       }}});
  list.back().lower = {-kPi};
  list.back().upper = {kPi};
  list.back().optimum = -1.0;
  list.push_back(
      {"disc_around_a_curve",  // least circle radius^2 x_2 around (cos 3t, t)
       {0.0, 0.0, 4.0},
       [](X x) { return 1.0 * x[2]; },
       {[](X x, X t) { return square(cos(3.0 * t[0]) - x[0]) + square(t[0] - x[1]) - x[2]; }}});
  list.back().lower = {-1.0};
  list.push_back(
      {"disc_around_an_ellipse", {0.5, -0.3, 9.0}, [](X x) { return 1.0 * x[2]; }, {[](X x, X t) {
         return square(2.0 * cos(t[0]) - x[0]) + square(sin(t[0]) - x[1]) - x[2];
       }}});
  list.back().lower = {-1.0};
  list.back().upper = {5.0};
  list.back().optimum = 4.0;
  list.push_back(
      {"disc_around_a_deltoid", {0.5, -0.3, 20.0}, [](X x) { return 1.0 * x[2]; }, {[](X x, X t) {
         return square(2.0 * cos(t[0]) + cos(2.0 * t[0]) - x[0]) +
                square(2.0 * sin(t[0]) - sin(2.0 * t[0]) - x[1]) - x[2];
       }}});
  list.back().lower = {-1.0};
  list.back().upper = {5.0};
  list.back().optimum = 9.0;
  list.push_back({"plane_above_a_cap",  // over the unit square, touching in its interior
                  {3.0, 0.0, 0.0},
                  [](X x) { return x[0] + 0.5 * x[1] + 0.5 * x[2]; },
                  {[](X x, X t) {
                    return sin(t[0] + 0.5 * t[1]) * cos(t[1]) - x[0] - x[1] * t[0] - x[2] * t[1];
                  }}});
  list.back().lower = {0.0, 0.0};
  list.back().upper = {1.0, 1.0};
  list.push_back({"surface_from_above",  // six terms over the unit square
                  {9.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                  [](X x) {
                    return x[0] + 0.5 * x[1] + 0.5 * x[2] + (1.0 / 3.0) * x[3] + 0.25 * x[4] +
                           (1.0 / 3.0) * x[5];
                  },
                  {[](X x, X t) {
                    return exp(square(t[0]) + square(t[1])) - x[0] - x[1] * t[0] - x[2] * t[1] -
                           x[3] * square(t[0]) - x[4] * t[0] * t[1] - x[5] * square(t[1]);
                  }}});
  list.back().lower = {0.0, 0.0};
  list.back().upper = {1.0, 1.0};
  list.push_back(chebyshev("chebyshev_line_for_exp", 2, exponential, {-1.0, 1.0},
                           0.5 * (std::cosh(1.0) - slope * (1.0 - std::log(slope)))));
  list.push_back(chebyshev("chebyshev_cube", 3, cube, {-1.0, 1.0}, 0.25));
  list.push_back(chebyshev("chebyshev_fourth_power", 4, fourth_power, {0.0, 1.0}, 1.0 / 128.0));
  // E_n(1 / (t + a)) = (a - sqrt(a^2 - 1))^n / (a^2 - 1), degree n = 2, a = 1.25.
  list.push_back(chebyshev("chebyshev_reciprocal", 3, reciprocal, {-1.0, 1.0}, 0.25 / 0.5625));
  list.push_back(
      chebyshev("chebyshev_reciprocal_cubic", 4, reciprocal, {-1.0, 1.0}, 0.125 / 0.5625));
  add_watson(list);
  add_oettershagen(list);
  list.push_back(low_pass_filter(6));
  list.push_back(controller());
  return list;
}

Model model_of(const SemiInfinite& p) {
  Model model;
  const std::vector<Expression> x = add_x(p, model);
  std::vector<Expression> t;
  for (std::size_t i = 0; i < p.lower.size(); ++i) {
    t.push_back(model.variable(Player::Max, "t" + std::to_string(i), p.lower[i], p.upper[i]));
  }
  model.objective(p.objective(x));
  for (const auto& row : p.rows) model.constraint(row(x, t), -kNoBound, 0.0, Player::Min);
  return model;
}

std::vector<double> start_of(const SemiInfinite& p) {
  std::vector<double> start = p.start;
  for (std::size_t i = 0; i < p.lower.size(); ++i) start.push_back(0.5 * (p.lower[i] + p.upper[i]));
  return start;
}

SemiInfiniteRows::SemiInfiniteRows(const SemiInfinite& p)
    : program_(p), problem_(model_of(p)), g_(p.rows.size()) {}

const std::vector<double>& SemiInfiniteRows::at(const Point& x, const Point& t) {
  v_.assign(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(program_.start.size()));
  v_.insert(v_.end(), t.begin(), t.end());
  if (!problem_.constraints(v_, true, g_)) throw std::domain_error("a row is undefined");
  return g_;
}

std::pair<double, Point> SemiInfiniteRows::largest(const Point& x, std::size_t row) {
  const SemiInfinite& p = program_;
  const std::size_t dimensions = p.lower.size();
  const int points = dimensions == 1 ? 2000 : 80;
  std::vector<std::pair<double, Point>> grid;
  Point step(dimensions);
  for (std::size_t i = 0; i < dimensions; ++i) step[i] = (p.upper[i] - p.lower[i]) / points;
  for (int a = 0; a <= points; ++a) {
    for (int b = 0; b <= (dimensions == 1 ? 0 : points); ++b) {
      Point t = {p.lower[0] + a * step[0]};
      if (dimensions == 2) t.push_back(p.lower[1] + b * step[1]);
      grid.emplace_back(at(x, t)[row], t);
    }
  }
  std::ranges::sort(grid, std::greater{}, &std::pair<double, Point>::first);
  std::pair<double, Point> best = grid.front();
  for (std::size_t k = 0; k < std::min<std::size_t>(20, grid.size()); ++k) {
    refine(x, row, step, grid[k]);
    if (grid[k].first > best.first) best = grid[k];
  }
  return best;
}

void SemiInfiniteRows::refine(const Point& x, std::size_t row, Point step,
                              std::pair<double, Point>& found) {
  for (int round = 0; round < 30; ++round) {
    const Point centre = found.second;
    for (int k = 0; k < (centre.size() == 1 ? 5 : 25); ++k) {
      Point t = centre;
      for (std::size_t i = 0; i < t.size(); ++i) {
        const int along = i == 0 ? k % 5 - 2 : k / 5 - 2;
        t[i] = std::clamp(t[i] + 0.5 * along * step[i], program_.lower[i], program_.upper[i]);
      }
      const double value = at(x, t)[row];
      if (value > found.first) found = {value, t};
    }
    for (double& s : step) s *= 0.5;
  }
}

namespace {

/// Of every row at a coarse grid, which keeps x bounded, but where it is far from violated.
std::vector<std::pair<std::size_t, Point>> first_cuts(const SemiInfinite& p, const Point& x,
                                                      SemiInfiniteRows& rows) {
  constexpr double kFar = -1e3;
  std::vector<std::pair<std::size_t, Point>> cuts;
  const bool plane = p.lower.size() == 2;
  const int points = plane ? 4 : 16;
  for (std::size_t row = 0; row < p.rows.size(); ++row) {
    for (int a = 0; a <= points; ++a) {
      for (int b = 0; b <= (plane ? points : 0); ++b) {
        Point t = {p.lower[0] + (p.upper[0] - p.lower[0]) * a / points};
        if (plane) t.push_back(p.lower[1] + (p.upper[1] - p.lower[1]) * b / points);
        if (rows.at(x, t)[row] > kFar) cuts.emplace_back(row, t);
      }
    }
  }
  return cuts;
}

}  // namespace

double cutting_plane_bound(const SemiInfinite& p, std::vector<double> x) {
  x.resize(p.start.size());
  SemiInfiniteRows rows(p);
  std::vector<std::pair<std::size_t, Point>> cuts = first_cuts(p, x, rows);
  double value = std::nan("");
  for (int round = 0; round < 60; ++round) {
    bool any = round == 0;
    for (std::size_t row = 0; row < p.rows.size(); ++row) {
      const auto [worst, t] = rows.largest(x, row);
      if (worst <= 1e-9) continue;
      cuts.emplace_back(row, t);
      any = true;
    }
    if (!any) return value;
    Model model;
    const std::vector<Expression> own = add_x(p, model);
    model.objective(p.objective(own));
    for (const auto& [row, t] : cuts) {
      const std::vector<Expression> fixed(t.begin(), t.end());
      model.constraint(p.rows[row](own, fixed), -kNoBound, 0.0, Player::Min);
    }
    AutodiffProblem problem(model, x);
    SolverOptions options;
    options.bound_relax_factor = 0.0;
    const Result result = solve(problem, options);
    if (!is_success(result.status)) return std::nan("");
    x = result.v;
    value = result.objective;
  }
  return std::nan("");
}

}  // namespace ipminmax::testing
