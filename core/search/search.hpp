#pragma once

#include <optional>
#include <string>

#include "core/certificate/certificate.hpp"
#include "core/method/barrier.hpp"
#include "core/method/step_method.hpp"
#include "core/search/first_order_test.hpp"
#include "core/search/observation.hpp"
#include "core/search/outcome.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {

/// What a solve is for.
enum class Purpose : std::uint8_t {
  Solution,
  Restoration  ///< of another solve's feasibility: any first-order point will do
};

/// What searches work with, kept from one to the next.
struct SearchArrays {
  Point point;
  Point next;  ///< room for a step's end, which the point of an outcome takes
  BestPoint best;
  CertificateArrays certificate;
};

/// One search from one starting point: the main loop.
class Search : MethodContext {
 public:
  /// The start's point, evaluated and measured, becomes the search's; arrays.best, of the solve, is
  /// shown every point.
  Search(const MethodContext& context, Purpose purpose, BarrierUpdate& barrier,
         Observation& observation, Start& start, SearchArrays& arrays);

  /// Iterates until the search ends. kept: a first-order point with an undecided test that was left
  /// for a better one.
  [[nodiscard]] SearchOutcome run(StepMethod& method, std::optional<SearchOutcome>& kept);

  /// The search as it stands, ended so.
  [[nodiscard]] SearchOutcome ended(Status status, std::string message = {}) const;

 private:
  /// Of a point that passed the first-order test.
  struct Verdict {
    Status status;
    std::string message{};
    Finding test;  ///< the second-order one's result
  };
  [[nodiscard]] Verdict judge(Status first_order);
  [[nodiscard]] Index factorizations_for_test() const;
  [[nodiscard]] SearchOutcome ended(Verdict&& verdict) const;
  [[nodiscard]] bool leave(const Verdict& verdict, StepMethod& method,
                           std::optional<SearchOutcome>& kept);
  [[nodiscard]] SearchOutcome given_up(Status status, std::string message = {});
  [[nodiscard]] bool restores_again();
  [[nodiscard]] std::optional<Status> limit_reached();
  void make_step(StepMethod& method);
  [[nodiscard]] SearchOutcome after_failed_step();
  void zero_multipliers_of_feasibility(double tolerance);
  void measure_point();

  Purpose purpose_;
  BarrierUpdate& barrier_;
  Observation& observation_;
  FirstOrderTest test_;
  SearchArrays& arrays_;
  StepReport step_;  ///< that led to arrays_.point, or failed there
  std::optional<Index> last_iteration_;
  Index runaway_iterations_ = 0;      ///< in a row
  Index met_at_ = -1;                 ///< the first iteration that met the tolerances
  int restored_when_acceptable_ = 0;  ///< restorations that began at an acceptable point
};

}  // namespace ipminmax
