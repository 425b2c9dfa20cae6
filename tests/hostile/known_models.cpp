#include <hostile/known_models.hpp>

#include <cmath>
#include <utility>

#include <problems/closed_form_games.hpp>
#include <support/autodiff_problem.hpp>
#include <support/dice.hpp>
#include <support/function_problem.hpp>

namespace ipminmax::testing {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

VectorXd point(std::initializer_list<double> values) {
  return VectorXd::Map(values.begin(), std::ssize(values));
}

/// One variable after the other, Min's first.
class Builder {
 public:
  Expression x(double start, double lower = -kNoBound, double upper = kNoBound) {
    ++min_;
    return variable(kMin, start, lower, upper);
  }
  Expression y(double start, double lower = -kNoBound, double upper = kNoBound) {
    return variable(kMax, start, lower, upper);
  }
  /// g <= upper for every y.
  Builder& robust(const Expression& g, double upper) {
    model_.constraint(g, -kNoBound, upper, kMin);
    return *this;
  }
  Builder& row(const Expression& g, double lower, double upper, Player owner) {
    model_.constraint(g, lower, upper, owner);
    return *this;
  }
  [[nodiscard]] KnownModel minimize(std::string name, const Expression& f,
                                    std::optional<VectorXd> answer = {}) {
    model_.objective(f);
    KnownModel known{.name = std::move(name)};
    known.problem = std::make_shared<AutodiffProblem>(model_, start_);
    known.x = min_;
    known.answer = std::move(answer);
    return known;
  }

 private:
  Expression variable(Player player, double start, double lower, double upper) {
    start_.push_back(start);
    return model_.variable(player, "v" + std::to_string(start_.size() - 1), lower, upper);
  }

  Model model_;
  std::vector<double> start_;
  Eigen::Index min_ = 0;
};

// Answers written with their digits are those of the grids in the header's judge, refined by hand.

KnownModel saddle(KnownModel known) {
  known.saddle = true;
  return known;
}
KnownModel wide(KnownModel known) {
  known.wide = true;
  return known;
}

Expression two_wells(const Expression& y) { return square(square(y) - 1.0); }

void add_robust(std::vector<KnownModel>& all) {
  {
    Builder m;
    const auto x0 = m.x(1.0), x1 = m.x(0.0), y = m.y(-0.9, -2.0, 2.0);
    m.robust(0.2 * y - two_wells(y) - x1, 0.0);
    all.push_back(wide(m.minimize("two worst cases", x1 + square(x0 - 2.0), point({2, .2024404}))));
  }
  {
    Builder m;
    const auto a = m.x(0.0), b = m.x(0.0), y = m.y(0.1, -1.0, 1.0);
    m.robust(0.5 * a * (square(y) + y) + 0.5 * b * (square(y) - y), 1.0);
    all.push_back(m.minimize("interpolated row", square(a - 3.0) + square(b - 2.0), point({1, 1})));
  }
  {
    Builder m;
    const auto x = m.x(0.5), y = m.y(-0.9, -2.0, 2.0);
    m.robust(0.03 * y - two_wells(y) - x, 0.0);
    all.push_back(wide(m.minimize("nearly equal worst cases", x, point({.03005624}))));
  }
  {
    Builder m;
    const auto x = m.x(0.0), y = m.y(0.4, 0.0, 3.0);
    m.robust(y * sin(3.0 * y) / 3.0 - x, 0.0);
    all.push_back(m.minimize("wave in a row", x, point({.8797})));
  }
  {
    Builder m;
    const auto x = m.x(0.5, 0.0, 10.0), y = m.y(-0.3, -1.0, 1.0);
    m.robust(x * (square(y) + 0.2 * y), 1.0);
    all.push_back(
        m.minimize("row and f read y", square(x - 3.0) + x * y - square(y), point({1.0 / 1.2})));
  }
  {
    Builder m;
    const auto x = m.x(0.5), y = m.y(0.1);
    m.robust(2.0 * x * y - square(y), 4.0);
    all.push_back(m.minimize("disturbance without bounds", -x, point({2})));
  }
  {
    Builder m;
    const auto x = m.x(0.0), y = m.y(0.0, -1.0, 1.0);
    m.robust(x + y, 3.0);
    all.push_back(m.minimize("worst case at a bound", 0.1 * square(x) - x, point({2})));
  }
  {
    Builder m;
    const auto x = m.x(3.0), y = m.y(0.5);
    m.row(x + square(y) + y, 0.0, kNoBound, kMin);
    all.push_back(m.minimize("row with a lower bound", x, point({.25})));
  }
  {
    Builder m;  // 3 y^2 + .05 y is 3.05 at 1, so that x <= -1.05
    const auto x = m.x(0.0), y = m.y(-0.9, -1.0, 1.0);
    m.robust(x + 3.0 * square(y) + 0.05 * y, 2.0);
    all.push_back(m.minimize("convex row", -x, point({-1.05})));
  }
  {
    Builder m;  // (x - .3) y <= t: |x - .3|
    const auto x = m.x(1.0), t = m.x(1.0), y = m.y(0.2, -1.0, 1.0);
    m.robust((x - 0.3) * y - t, 0.0);
    all.push_back(m.minimize("epigraph of a modulus", t, point({.3, 0})));
  }
  {
    Builder m;  // two rows, each with a disturbance of its own
    const auto a = m.x(0.0, -3.0, 3.0), b = m.x(0.0, -3.0, 3.0);
    const auto y = m.y(0.1, -1.0, 1.0), w = m.y(0.2, -1.0, 1.0);
    m.robust(a + 0.5 * a * y, 1.0).robust(b + w - 0.5 * square(w), 2.0);
    all.push_back(
        m.minimize("two rows", square(a - 2.0) + square(b - 2.0), point({2.0 / 3.0, 1.5})));
  }
  {
    Builder m;  // both rows read one disturbance: a + y - y^2, b - y - y^2 / 2
    const auto a = m.x(0.0, -3.0, 3.0), b = m.x(0.0, -3.0, 3.0), y = m.y(0.1, -1.0, 1.0);
    m.robust(a + y - square(y), 1.0).robust(b - y - 0.5 * square(y), 1.0);
    all.push_back(
        m.minimize("two rows, one y", square(a - 2.0) + square(b - 2.0), point({.75, .5})));
  }
  {
    Builder m;  // two-sided: .5 <= x + .3 sin y <= 2
    const auto x = m.x(1.0), y = m.y(0.1, -3.0, 3.0);
    m.row(x + 0.3 * sin(y), 0.5, 2.0, kMin);
    all.push_back(m.minimize("two-sided row", square(x - 3.0), point({1.7})));
  }
  {
    Builder m;  // over a disc of two y: x + |(.6, .8)| <= 2
    const auto x = m.x(0.0), y = m.y(0.1, -2.0, 2.0), w = m.y(0.1, -2.0, 2.0);
    m.robust(x + 0.6 * y + 0.8 * w, 2.0).row(square(y) + square(w), -kNoBound, 1.0, kMax);
    all.push_back(m.minimize("disc", square(x - 4.0), point({1})));
  }
  {
    Builder m;  // an inactive row
    const auto x = m.x(0.0), y = m.y(0.0, -5.0, 5.0), w = m.y(0.0, -1.0, 1.0);
    m.robust(x + w - 0.5 * square(w), 10.0);
    all.push_back(m.minimize("inactive row", square(x - 1.0) + x * y - square(y), point({.8})));
  }
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    // x'x / 2 - t'x in a box with two rows of waves, over one y.
    Dice dice(seed);
    Builder m;
    const auto a = m.x(0.0, -3.0, 3.0), b = m.x(0.0, -3.0, 3.0), y = m.y(0.0, -1.0, 1.0);
    for (int r = 0; r < 2; ++r) {
      const auto any = [&](double reach) { return dice.between(-reach, reach); };
      m.robust(any(1) * a + any(1) * b + (any(0.3) + any(1) * a + any(1) * b) * y +
                   any(1) * square(y) + any(0.4) * sin(4.0 * y + any(3) + a),
               dice.between(0.5, 1.5));
    }
    const double s = dice.between(-2, 2), t = dice.between(-2, 2);
    all.push_back(m.minimize("random robust " + std::to_string(seed),
                             0.5 * square(a) + 0.5 * square(b) - s * a - t * b));
  }
}

void add_games(std::vector<KnownModel>& all) {
  {
    Builder m;
    const auto x = m.x(0.3, -2.0, 2.0), y = m.y(0.1, -1.0, 1.0);
    KnownModel known = m.minimize("max at both ends", square(x - y), point({0}));
    known.phi = [](const VectorXd& v) { return std::pow(std::abs(v[0]) + 1.0, 2.0); };
    all.push_back(known);
  }
  {
    Builder m;
    const auto x = m.x(1.0, -5.0, 5.0), y = m.y(-1.0, -2.0, 2.0);
    all.push_back(wide(
        m.minimize("two branches", 0.5 * square(x - 1.0) + 0.1 * x * y - two_wells(y) + 0.3 * y)));
  }
  {
    Builder m;
    const auto x = m.x(1.0, -2.0, 2.0), y = m.y(-1.0, -2.0, 2.0);
    all.push_back(wide(m.minimize("kink", square(x - 0.3) - 4.0 * two_wells(y) + 3.0 * x * y)));
  }
  for (const double slope : {0.5, -0.3}) {
    // |x - y| - slope x on [0, 1]^2: phi = max(x, 1 - x) - slope x.
    KnownModel known{.name = "modulus, slope " + std::to_string(slope)};
    auto problem = std::make_shared<FunctionProblem>(
        std::vector<Player>{kMin, kMax}, point({.5, .1}),
        [slope](const VectorXd& v) { return std::abs(v[0] - v[1]) - slope * v[0]; },
        [slope](const VectorXd& v) {
          const double sign = v[0] > v[1] ? 1.0 : -1.0;
          return point({sign - slope, -sign});
        },
        [](const VectorXd&) { return MatrixXd::Zero(2, 2); });
    problem->mutable_structure().variable_lower = {0.0, 0.0};
    problem->mutable_structure().variable_upper = {1.0, 1.0};
    known.problem = problem;
    known.x = 1;
    known.answer = point({0.5});
    known.smooth = false;
    known.phi = [slope](const VectorXd& v) { return std::max(v[0], 1.0 - v[0]) - slope * v[0]; };
    all.push_back(known);
  }
  for (const int columns : {3, 2}) {
    // p'Aq on simplices: each p is as good.
    Builder m;
    const auto p = m.x(0.6, 0.0), r = m.x(0.4, 0.0), q0 = m.y(0.3, 0.0), q1 = m.y(0.3, 0.0);
    Expression f = p * (2.0 * q0) + r * (2.0 * q0 - q1), sum = q0 + q1;
    if (columns == 3) {
      const auto q2 = m.y(0.4, 0.0);
      f += 2.0 * p * q2 + 2.0 * r * q2;
      sum += q2;
    }
    m.row(p + r, 1.0, 1.0, kMin).row(sum, 1.0, 1.0, kMax);
    KnownModel known = m.minimize("integer matrix " + std::to_string(columns), f);
    known.phi = [](const VectorXd& v) { return 2.0 * (v[0] + v[1]); };
    known.allowed = [](const VectorXd& v) {
      return v.minCoeff() >= -1e-7 && std::abs(v.sum() - 1.0) < 1e-7;
    };
    known.directions = [](const VectorXd&) { return MatrixXd(point({1, -1})); };
    all.push_back(known);
  }
  {
    Builder m;  // an eigenvalue: phi = 1 + |x|
    const auto a = m.x(-3.0), b = m.x(1.0), y = m.y(1.0), w = m.y(0.0);
    m.row(square(y) + square(w), 1.0, 1.0, kMax);
    KnownModel known =
        m.minimize("largest eigenvalue",
                   (1.0 + a) * square(y) + 2.0 * b * y * w + (1.0 - a) * square(w), point({0, 0}));
    known.phi = [](const VectorXd& v) { return 1.0 + v.norm(); };
    all.push_back(known);
  }
  {
    Builder m;
    const auto x = m.x(0.0), y = m.y(0.3);
    all.push_back(
        saddle(m.minimize("quadratic saddle", square(x - 1.0) + x * y - square(y), point({.8}))));
  }
  {
    Builder m;  // y at its bound 1: (x - 1)^2 + x - 1
    const auto x = m.x(0.0, -2.0, 2.0), y = m.y(0.3, -1.0, 1.0);
    all.push_back(saddle(m.minimize("saddle at a bound",
                                    square(x - 1.0) + x * y - 0.1 * square(y - 3.0), point({.5}))));
  }
  {
    Builder m;  // exp and log
    const auto x = m.x(0.5, 0.1, 4.0), y = m.y(0.5, 0.1, 4.0);
    all.push_back(
        saddle(m.minimize("exponential saddle", exp(0.5 * x) - 2.0 * log(x) + 0.3 * x * y -
                                                    0.5 * exp(0.5 * y) + log(y))));
  }
  {
    Builder m;  // two of each
    const auto a = m.x(0.0, -3.0, 3.0), b = m.x(0.0, -3.0, 3.0);
    const auto y = m.y(0.3, -3.0, 3.0), w = m.y(0.1, -3.0, 3.0);
    all.push_back(wide(saddle(
        m.minimize("saddle of four", square(a - 1.0) + square(b) + 0.5 * a * b + a * y - b * w +
                                         0.4 * b * y - square(y) - 2.0 * square(w) + 0.3 * y))));
  }
  {
    Builder m;  // concave in x: -x^2 + 4 x y - y^2, phi = 3 x^2
    const auto x = m.x(1.0, -2.0, 2.0), y = m.y(0.3, -5.0, 5.0);
    all.push_back(
        wide(m.minimize("not convex in x", 4.0 * x * y - square(x) - square(y), point({0}))));
  }
  {
    Builder m;  // coupled: y <= 1 - x / 2; at y = 1 - x / 2: x^2 + 1 - x / 2
    const auto x = m.x(1.0, -1.0, 1.0), y = m.y(0.0, -4.0, 4.0);
    m.row(y + 0.5 * x, -kNoBound, 1.0, kMax);
    all.push_back(wide(m.minimize("coupled row of Max", square(x) + y, point({.25}))));
  }
  {
    Builder m;  // a row of Min alone
    const auto a = m.x(1.0, -3.0, 3.0), b = m.x(1.0, -3.0, 3.0), y = m.y(0.3, -2.0, 2.0);
    m.row(a + b, 1.0, 2.0, kMin);
    all.push_back(wide(m.minimize("row of Min", square(a) + 2.0 * square(b) + a * y - square(y),
                                  point({16.0 / 26.0, 10.0 / 26.0}))));
  }
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    Dice dice(seed);
    const auto any = [&](double reach) { return dice.between(-reach, reach); };
    Builder m;
    std::vector<Expression> v;
    const std::size_t min = seed == 7 ? 2 : 1, max = seed == 8 ? 2 : 1;
    for (std::size_t i = 0; i < min; ++i) v.push_back(m.x(any(2), -3.0, 3.0));
    for (std::size_t j = 0; j < max; ++j) v.push_back(m.y(any(2), -3.0, 3.0));
    Expression f = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      f += (i < min ? 0.5 : -0.5) * dice.between(0.3, 1.5) * square(v[i]);
      for (std::size_t j = min; i < min && j < v.size(); ++j) f += any(1) * v[i] * v[j];
    }
    for (int k = 0; k < 4; ++k) {
      Expression phase = any(3);
      for (const Expression& each : v) phase += any(2) * each;
      f += any(1) * sin(phase);
    }
    all.push_back(m.minimize("random game " + std::to_string(seed), f));
  }
  struct Family {
    const char* name;
    ClosedForm (*game)(std::uint64_t seed);
    std::uint64_t seed;
  };
  for (const auto& [name, game, seed] : {Family{"bilinear", bilinear_game, 3},
                                         {"bilinear", bilinear_game, 8},
                                         {"finite maximum", finite_maximum, 2},
                                         {"finite maximum", finite_maximum, 7},
                                         {"matrix game", matrix_game, 1},
                                         {"matrix game", matrix_game, 4},
                                         {"Lagrangian", lagrangian, 5},
                                         {"ridge", ridge, 2}}) {
    ClosedForm made = game(seed);
    KnownModel known{.name = name + (" " + std::to_string(seed))};
    known.problem = std::move(made.problem);
    known.x = made.x;
    known.phi = made.phi;
    known.allowed = made.allowed;
    known.directions = made.suspects;
    all.push_back(known);
  }
}

void add_minimizations(std::vector<KnownModel>& all) {
  {
    Builder m;
    const auto a = m.x(-1.2, -3.0, 3.0), b = m.x(1.0, -3.0, 3.0);
    all.push_back(
        m.minimize("Rosenbrock", 100.0 * square(b - square(a)) + square(1.0 - a), point({1, 1})));
  }
  {
    Builder m;
    const auto a = m.x(0.5), b = m.x(0.5);
    m.row(square(a) - b, -kNoBound, 0.0, kMin).row(a + b, -kNoBound, 2.0, kMin);
    all.push_back(m.minimize("two active rows", square(a - 2.0) + square(b - 1.0), point({1, 1})));
  }
  {
    Builder m;
    const auto a = m.x(1e-6, 0.0), b = m.x(1.0);
    m.row(a + square(b), 2.0, 2.0, kMin);
    all.push_back(m.minimize("reciprocal", a + 1.0 / a, point({1})));  // b = 1 or -1
  }
  {
    Builder m;
    const auto a = m.x(0.0, 0.0, 5.0), b = m.x(2.0, 0.0, 5.0);
    m.row(a - b, -1.0, 1.0, kMin);
    all.push_back(
        m.minimize("two-sided, minimized", square(a - 4.0) + square(b - 1.0) + a * b * 0.1, {}));
  }
}

}  // namespace

std::vector<KnownModel> known_models() {
  std::vector<KnownModel> all;
  add_robust(all);
  add_games(all);
  add_minimizations(all);
  return all;
}

}  // namespace ipminmax::testing
