#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "../../core/options.hpp"
#include "../../core/problem.hpp"
#include "../../core/result.hpp"

namespace IPMINMAX_API ipminmax {

/// Where find_price looks.
struct PriceSearch {
  double from = 100.0;      ///< the first price; larger ones follow where no local minmax is found
  double most = 1e8;        ///< no larger price is tried
  double least = 1e-4;      ///< no smaller price is tried
  double ratio = 0.5;       ///< of a price to the one before, in (0, 1)
  double tolerance = 1e-3;  ///< relative distance of the answer to a price without local minmax
  double mu = 1e-3;         ///< barrier parameter at the start of solves from the last solution
};

/// One solve.
struct PricePoint {
  double price = 0.0;
  double value = std::numeric_limits<double>::quiet_NaN();  ///< f; NaN where nothing is certified
  bool certified = false;
  Status status = Status::InternalError;
  std::string message;
  Index iterations = 0;
  double seconds = 0.0;
};

struct PriceCurve {
  /// Least price at which a local minmax was certified; NaN: none was.
  double least = std::numeric_limits<double>::quiet_NaN();
  /// Largest price below it at which none was found; 0: none failed.
  double refused = 0.0;
  Result result;                   ///< at least
  std::vector<PricePoint> points;  ///< the largest price first
  std::string message;             ///< what was found, in a sentence

  /// "price,value,certified,iterations,seconds,status", a line per point.
  [[nodiscard]] std::string table() const;
  /// The value against the price as SVG; prices without local minmax are marked.
  [[nodiscard]] std::string picture() const;
};

/// The least price of the disturbance for which a local minmax is certified, by continuation: from
/// a large price downwards, each solve started at the last solution, then by bisection between the
/// last price with and the first without. set_price puts a price into the problem, which keeps its
/// structure; at the end it holds the price `least`, if there is one. Each price gets a solve from
/// the last solution and, where that fails, one from the problem's own start, neither with new
/// starts elsewhere (minmax_max_restarts). A stop by the user or by a time limit ends the search.
///
/// What is certified is local, and so is the answer: in linear-quadratic games without bounds it is
/// the square of the smallest gamma of H-infinity control; in others there may be local minmax
/// points at smaller prices elsewhere.
///
/// Throws std::invalid_argument for a search that cannot be; exceptions of the model pass through.
[[nodiscard]] PriceCurve find_price(Problem& problem,
                                    const std::function<void(double price)>& set_price,
                                    const PriceSearch& search = {},
                                    const SolverOptions& options = {});

/// picture() where the name ends in .svg, else table(). Throws std::runtime_error when the file
/// cannot be written.
void write_price_curve(const PriceCurve& curve, const std::string& file_name);

}  // namespace ipminmax
