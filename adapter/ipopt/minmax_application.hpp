#pragma once

#include <iosfwd>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <IpIpoptApplication.hpp>

#include "../../core/gap.hpp"
#include "../../core/result.hpp"
#include "../../core/robust.hpp"
#include "../../core/sensitivity.hpp"
#include "../../core/violations.hpp"
#include "../../core/worst_case.hpp"
#include "minmax_statistics.hpp"
#include "minmax_tnlp.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Takes the place of Ipopt's IpoptApplication and solves models of two players.
///
/// The model's methods are called in Ipopt's order, including finalize_metadata and
/// finalize_solution. ip_data and ip_cq are null, so the get_curr_* methods of Ipopt 3.14's TNLP
/// return false; use those of an ObservableTNLP (minmax_tnlp.hpp), GetCurrentIterate or
/// GetCurrentViolations. As in Ipopt, finalize_solution is not called if the solve is refused
/// (invalid option, invalid problem, too few degrees of freedom). If the solve ends because a
/// function is undefined at the starting point, it gets that point and NaN for everything else.
///
/// A function of the model must not call OptimizeTNLP of the application that is solving this
/// model; such a call returns Invalid_Problem_Definition. If the model releases the application
/// during a solve, the application lives until that solve ends.
///
/// An exception of the model ends the solve as in Ipopt: with Unrecoverable_Exception for Ipopt's
/// own types, else with NonIpopt_Exception_Thrown. After RethrowNonIpoptException(true) it passes
/// through.
class MinMaxApplication : public Ipopt::ReferencedObject {
 public:
  /// create_console_out: whether to print on the console. create_empty: never print there.
  explicit MinMaxApplication(bool create_console_out = true, bool create_empty = false);
  /// Uses existing options, in which every option of RegisterOptions must be registered.
  MinMaxApplication(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry,
                    const Ipopt::SmartPtr<Ipopt::OptionsList>& options,
                    const Ipopt::SmartPtr<Ipopt::Journalist>& journalist);
  ~MinMaxApplication() override;

  MinMaxApplication(const MinMaxApplication&) = delete;
  MinMaxApplication& operator=(const MinMaxApplication&) = delete;

  /// Returns another application with the same options, registry and journalist, and no model.
  [[nodiscard]] Ipopt::SmartPtr<MinMaxApplication> clone() const;

  /// Registers all options: the solver's, the application's and those that only Ipopt has.
  static void RegisterAllIpoptOptions(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry);
  /// Does the same; Ipopt has both names.
  static void RegisterOptions(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry);

  /// Reads the options file ipminmax.opt if it exists, or the file that option_file_name names,
  /// which must exist. Every Initialize returns Solve_Succeeded, or Invalid_Option (and prints why)
  /// if an option is unknown or has an invalid value or the file cannot be read. allow_clobber:
  /// whether later Set calls may change what a file sets.
  Ipopt::ApplicationReturnStatus Initialize(bool allow_clobber = false);
  /// Reads the given options file; "" reads none.
  Ipopt::ApplicationReturnStatus Initialize(const std::string& options_file,
                                            bool allow_clobber = false);
  Ipopt::ApplicationReturnStatus Initialize(const char* options_file, bool allow_clobber = false);
  /// Reads options from the stream.
  Ipopt::ApplicationReturnStatus Initialize(std::istream& options, bool allow_clobber = false);

  /// Return the options, the journalist (which prints) and the list of known options.
  Ipopt::SmartPtr<Ipopt::OptionsList> Options();
  Ipopt::SmartPtr<const Ipopt::OptionsList> Options() const;
  Ipopt::SmartPtr<Ipopt::Journalist> Jnlst();
  Ipopt::SmartPtr<Ipopt::RegisteredOptions> RegOptions();

  /// Solves a model: a MinMaxTNLP, or a plain TNLP. The integer metadata "player" of a plain TNLP's
  /// variables and, if wanted, constraints names owners (0 Min, 1 Max); without it all variables
  /// are Min's, unless minmax_max_variables lists some.
  ///
  /// With minmax_starts above 1 the model is solved from that many starting points, the model's own
  /// first, and the best point is the answer (better() of core/multistart.hpp).
  /// intermediate_callback counts iterations from 0 in each start and stops all of them;
  /// finalize_solution is called once. Iterations, evaluations and times are those of all starts.
  Ipopt::ApplicationReturnStatus OptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);
  /// Solves with the starts (minmax_starts) on all MPI ranks, one thread per rank. Each rank must
  /// call this with the same model and options (multistart_over_ranks of core/multistart.hpp). All
  /// ranks get the same answer; only rank 0 prints and writes minmax_points_file. Another thread
  /// than this one calls the model. Returns Invalid_Option if MPI cannot be used.
  Ipopt::ApplicationReturnStatus OptimizeTNLPOverRanks(const Ipopt::SmartPtr<Ipopt::TNLP>& model);
  /// Solves the model of the last OptimizeTNLP again, with other numbers. Orderings, symbolic
  /// factorizations, the arrays and, with warm_start_init_point, scaling and the last shifts are
  /// kept (RepeatedSolver of core/solver.hpp): most solves allocate no memory. With
  /// minmax_starts above 1 nothing is kept. A changed structure is analyzed again. Throws
  /// INVALID_WARMSTART if it is another model or nothing was solved before.
  Ipopt::ApplicationReturnStatus ReOptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);

  /// Return Invalid_Problem_Definition, since only a TNLP can name the owners of its variables.
  Ipopt::ApplicationReturnStatus OptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp);
  Ipopt::ApplicationReturnStatus OptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp,
                                             Ipopt::SmartPtr<Ipopt::AlgorithmBuilder>& builder);
  Ipopt::ApplicationReturnStatus ReOptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp);

  /// Writes the iterate: what LastResult() would hold if the callback stopped the solve now (v,
  /// lambda, z_lower, z_upper and constraints in the model's order and units, error, mu, counts).
  /// Call it inside intermediate_callback; inside finalize_solution it writes the answer. It
  /// evaluates objective and constraints once per callback, and their derivatives if variables are
  /// fixed. scaled: v, lambda, z_lower, z_upper and constraints in the units of the solve
  /// (nlp_scaling_method, obj_scaling_factor). Returns false and writes nothing outside these
  /// callbacks, and with scaled also if there are several solves or robust constraints.
  bool GetCurrentIterate(Result& iterate, bool scaled = false) const;
  /// Writes by how much the iterate violates the first-order conditions, entry by entry
  /// (core/violations.hpp). It evaluates gradient and Jacobian once. Returns false if these are
  /// undefined or not finite, or if GetCurrentIterate returns false.
  bool GetCurrentViolations(Violations& violations, bool scaled = false) const;

  /// Returns the answer of the last solve with its certificate; after a failed Initialize only
  /// status and message are set.
  [[nodiscard]] const Result& LastResult() const;
  /// Returns the worst cases of the last answer's robust constraints, and of f if minmax_epigraph
  /// was set.
  [[nodiscard]] const std::vector<RobustWorstCase>& LastWorstCases() const;
  /// Returns the certified points of the last solve with minmax_starts above 1, the best first;
  /// empty after any other solve.
  [[nodiscard]] const std::vector<DistinctPoint>& LastPoints() const;
  /// Searches for the worst case over all of y at the x of v (n values) from `starts` starting
  /// points of y, the first of them that of v, with this application's options; see
  /// check_worst_case of core/worst_case.hpp. Returns an empty text, or why it cannot be done.
  /// Exceptions of the model pass through.
  [[nodiscard]] std::string CheckWorstCase(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                           std::span<const double> v, Index starts,
                                           WorstCaseCheck& check) const;
  /// Computes the duality gap at v (n values) with this application's options; see core/gap.hpp.
  /// Returns an empty text, or why there is no gap.
  [[nodiscard]] std::string FindGap(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                    std::span<const double> v, DualityGap& gap) const;
  /// Prepares `sensitivity` for the last answer. Returns an empty text, or why that has no
  /// derivatives. Bounds and functions of the model must be those of the solve. Evaluates gradient,
  /// Jacobian and Hessian once; exceptions of the model pass through.
  [[nodiscard]] std::string UpdateSensitivity(Sensitivity& sensitivity) const;
  /// Returns the statistics of the last solve; null if it was refused or ended by an exception.
  [[nodiscard]] Ipopt::SmartPtr<MinMaxStatistics> Statistics() const;

  /// Adds an output file. Returns false if it cannot be opened. append: whether to keep its
  /// content.
  bool OpenOutputFile(const std::string& file_name, Ipopt::EJournalLevel print_level,
                      bool append = false);
  /// Prints the banner now instead of before the first solve.
  void PrintCopyrightMessage();
  /// Sets whether exceptions of the model that are not Ipopt's pass through OptimizeTNLP (default:
  /// no). std::bad_alloc never does, as in Ipopt. Returns the previous setting.
  bool RethrowNonIpoptException(bool dorethrow);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
