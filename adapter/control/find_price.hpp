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
  double value = std::numeric_limits<double>::quiet_NaN();  ///< f; NaN if not certified
  bool certified = false;
  Status status = Status::InternalError;
  std::string message;
  Index iterations = 0;
  double seconds = 0.0;
};

struct PriceCurve {
  /// Least price at which a local minmax was certified; NaN: none was.
  double least = std::numeric_limits<double>::quiet_NaN();
  /// Largest price below `least` at which no local minmax was certified; 0: no solve failed.
  double refused = 0.0;
  Result result;                   ///< the result at the price `least`
  std::vector<PricePoint> points;  ///< the largest price first
  std::string message;             ///< what was found, in a sentence

  /// Returns a line for each point: "price,value,certified,iterations,seconds,status".
  [[nodiscard]] std::string table() const;
  /// Returns a picture (SVG) of the value against the price; prices without a certificate are
  /// marked.
  [[nodiscard]] std::string picture() const;
};

/// Finds the least price of the disturbance at which a solve is certified. It lowers the price from
/// a large one, and each solve starts at the last solution. Then it bisects between the last price
/// with a certificate and the first one without. set_price puts a price into the problem and must
/// keep its structure; at the end the problem holds the price `least`, if there is one. If a solve
/// from the last solution fails, one from the problem's own start follows; neither makes restarts
/// (minmax_max_restarts). A stop by the user or a limit of time ends the search.
///
/// Certificates are local, and so is the least price. In linear-quadratic games without bounds it
/// is the square of the smallest gamma of H-infinity control. In other games there may be local
/// minmax points at smaller prices elsewhere.
///
/// Throws std::invalid_argument if the search is invalid; exceptions of the model pass through.
[[nodiscard]] PriceCurve find_price(Problem& problem,
                                    const std::function<void(double price)>& set_price,
                                    const PriceSearch& search = {},
                                    const SolverOptions& options = {});

/// Writes picture() to a file whose name ends in .svg, else table(). Throws std::runtime_error if
/// the file cannot be written.
void write_price_curve(const PriceCurve& curve, const std::string& file_name);

}  // namespace ipminmax
