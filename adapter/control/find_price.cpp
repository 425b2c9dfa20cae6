#include "adapter/control/find_price.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "adapter/control/horizon_shift.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/log.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/robust.hpp"
#include "core/search/outcome.hpp"
#include "core/solver.hpp"

namespace ipminmax {

using log::format;

namespace {

void check(const PriceSearch& s) {
  const auto need = [](bool condition, const char* what) {
    if (!condition) throw std::invalid_argument(std::string("find_price: ") + what);
  };
  need(s.least > 0.0 && s.least <= s.from && s.from <= s.most && std::isfinite(s.most),
       "0 < least <= from <= most");
  need(s.ratio > 0.0 && s.ratio < 1.0, "ratio in (0, 1)");
  need(s.tolerance > 0.0 && s.mu > 0.0, "tolerance and mu above 0");
}

class Continuation {
 public:
  Continuation(Problem& problem, const std::function<void(double)>& set_price,
               const PriceSearch& search, const SolverOptions& options)
      : problem_(problem),
        from_(problem, nullptr),
        set_price_(set_price),
        search_(search),
        cold_(options) {
    cold_.minmax_max_restarts = 0;
    warm_ = cold_;
    warm_start(warm_, search.mu);
  }

  PriceCurve run() {
    double price = search_.from;
    while (!certifies(price) && !stopped_ && price < search_.most)
      price = std::min(price / search_.ratio, search_.most);
    if (best_) descend(price);
    return answer();
  }

 private:
  void descend(double price) {
    while (!stopped_ && price > search_.least) {
      const double next = refused_ == 0.0 ? std::max(price * search_.ratio, search_.least)
                                          : std::sqrt(price * refused_);
      if (refused_ > 0.0 && price <= (1.0 + search_.tolerance) * refused_) break;
      (certifies(next) ? price : refused_) = next;
    }
  }

  bool certifies(double price) {
    set_price_(price);
    PricePoint point{.price = price, .message = {}};
    if (best_ && attempt(&*best_, warm_, point)) return true;
    if (!stopped_ && attempt(nullptr, cold_, point)) return true;
    curve_.points.push_back(std::move(point));
    return false;
  }
  /// A solve, whose answer the point gets.
  bool attempt(const Result* start, const SolverOptions& options, PricePoint& point) {
    from_.set(start);
    Result result = has_robust_constraints(problem_.structure())
                        ? solve_robust(from_, start != nullptr ? cold_ : options).result
                        : solver_.solve(from_, options);
    point.certified =
        is_success(result.status) && result.certificate.kind == PointKind::LocalMinmax;
    point.status = result.status;
    point.message = result.message;
    point.iterations += result.iterations;
    point.seconds += result.seconds;
    stopped_ = stopped_ || stopped_from_outside(result.status) ||
               result.status == Status::InvalidOption || result.status == Status::InvalidProblem;
    if (!point.certified) return false;
    point.value = result.objective;
    curve_.least = point.price;
    best_ = std::move(result);
    curve_.points.push_back(point);
    return true;
  }

  PriceCurve answer() {
    std::ranges::stable_sort(curve_.points, std::greater<>(), &PricePoint::price);
    curve_.refused = best_ ? refused_ : 0.0;
    if (!best_) {
      curve_.message = "no local minmax was certified at any price tried: " +
                       (curve_.points.empty() ? std::string() : curve_.points.back().message);
      return std::move(curve_);
    }
    set_price_(curve_.least);
    if (stopped_) {
      curve_.message = format("stopped; certified down to price %.6g so far", curve_.least);
    } else if (refused_ > 0.0) {
      curve_.message =
          format("certified down to price %.6g; at %.6g no local minmax was found from there",
                 curve_.least, refused_);
    } else {
      curve_.message = format(
          "certified down to %.6g, the least price tried: bounds, not the price, hold "
          "the disturbance back",
          curve_.least);
    }
    curve_.result = std::move(*best_);
    return std::move(curve_);
  }

  Problem& problem_;
  AtResult from_;
  const std::function<void(double)>& set_price_;
  const PriceSearch& search_;
  SolverOptions cold_, warm_;
  RepeatedSolver solver_;
  PriceCurve curve_;
  std::optional<Result> best_;  ///< at the least certified price
  double refused_ = 0.0;        ///< below it; 0: none
  bool stopped_ = false;
};

/// Where a share of a range lies in the picture.
struct Axis {
  double low = 0.0, high = 1.0, begin = 0.0, end = 1.0;
  [[nodiscard]] double at(double value) const {
    return begin + (end - begin) * (value - low) / (high - low);
  }
};

Axis axis_of(std::vector<double> values, double begin, double end) {
  if (values.empty()) values = {0.0};
  const auto [low, high] = std::ranges::minmax(values);
  const double margin = high > low ? 0.05 * (high - low) : std::max(0.5, 0.05 * std::abs(low));
  return {low - margin, high + margin, begin, end};
}

}  // namespace

PriceCurve find_price(Problem& problem, const std::function<void(double)>& set_price,
                      const PriceSearch& search, const SolverOptions& options) {
  check(search);
  return Continuation(problem, set_price, search, options).run();
}

std::string PriceCurve::table() const {
  std::string text = "price,value,certified,iterations,seconds,status\n";
  for (const PricePoint& p : points) {
    text += concat(format("%.10g,", p.price), p.certified ? format("%.10g,1,", p.value) : ",0,",
                   format("%d,%.4g,", p.iterations, p.seconds), name_of(p.status), "\n");
  }
  return text;
}

std::string PriceCurve::picture() const {
  std::vector<double> prices, found;
  for (const PricePoint& p : points) {
    prices.push_back(std::log10(p.price));
    if (p.certified) found.push_back(p.value);
  }
  const Axis x = axis_of(prices, 70.0, 570.0), y = axis_of(found, 300.0, 40.0);
  const auto text = [](double at_x, double at_y, const std::string& words) {
    return format("<text x='%.1f' y='%.1f'>%s</text>\n", at_x, at_y, words.c_str());
  };
  std::string out =
      "<svg xmlns='http://www.w3.org/2000/svg' width='600' height='360' "
      "font-family='sans-serif' font-size='12' text-anchor='middle'>\n"
      "<rect width='100%' height='100%' fill='white'/>\n"
      "<rect x='70' y='40' width='500' height='260' fill='none' stroke='#888888'/>\n";
  for (int tick = static_cast<int>(std::ceil(x.low)); tick <= x.high; ++tick) {
    out += format("<path stroke='#dddddd' d='M%.1f 40v260'/>\n", x.at(tick)) +
           text(x.at(tick), 316.0, format("%.4g", std::pow(10.0, tick)));
  }
  for (const double share : {0.1, 0.5, 0.9}) {
    const double value = y.low + share * (y.high - y.low);
    out += format("<path stroke='#dddddd' d='M70 %.1fh500'/>\n", y.at(value)) +
           text(36.0, y.at(value) + 4.0, format("%.4g", value));
  }
  std::string line, marks;
  for (const PricePoint& p : points) {
    const double place = x.at(std::log10(p.price)), height = y.at(p.value);
    if (p.certified) {
      line += format("%.1f,%.1f ", place, height);
      marks += format("<circle r='3' fill='#3050c0' cx='%.1f' cy='%.1f'/>\n", place, height);
    } else {
      marks += format("<path stroke='#c03030' d='M%.1f 286l8 8m-8 0l8 -8' />\n", place);
    }
  }
  return out + "<polyline fill='none' stroke='#3050c0' points='" + line + "'/>\n" + marks +
         text(320.0, 24.0, "value of the game; crosses: no local minmax found") +
         text(320.0, 344.0, "price of the disturbance") + "</svg>\n";
}

void write_price_curve(const PriceCurve& curve, const std::string& file_name) {
  std::ofstream file(file_name);
  file << (file_name.ends_with(".svg") ? curve.picture() : curve.table());
  if (!file.flush()) throw std::runtime_error("cannot write " + file_name);
}

}  // namespace ipminmax
