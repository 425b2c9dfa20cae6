#pragma once

#include <iosfwd>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <IpIpoptApplication.hpp>

#include "../core/gap.hpp"
#include "../core/result.hpp"
#include "../core/robust.hpp"
#include "../core/sensitivity.hpp"
#include "../core/violations.hpp"
#include "../core/worst_case.hpp"
#include "minmax_statistics.hpp"
#include "minmax_tnlp.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Ipopt's IpoptApplication with a player split: porting a program is changing this type's name.
///
/// The model's methods are called in Ipopt's order, finalize_metadata and finalize_solution
/// included; ip_data and ip_cq are null, so the get_curr_* methods of Ipopt 3.14's TNLP return
/// false; those of an ObservableTNLP (minmax_tnlp.hpp), and GetCurrentIterate and
/// GetCurrentViolations here, answer. As in Ipopt, finalize_solution is not called when the solve
/// stops before its first iterate (invalid option, invalid problem, too few degrees of freedom).
///
/// A solve inside a function of the model that it solves is refused (Invalid_Problem_Definition);
/// an application that the model releases then lives until its solve ends.
///
/// Exceptions of the model end the solve as in Ipopt: Unrecoverable_Exception for Ipopt's own
/// types, else NonIpopt_Exception_Thrown, or the exception passes through after
/// RethrowNonIpoptException(true).
class MinMaxApplication : public Ipopt::ReferencedObject {
 public:
  /// create_empty: no console either; options and journalist are there in any case.
  explicit MinMaxApplication(bool create_console_out = true, bool create_empty = false);
  /// Options that others have made: every option of register_options must be registered.
  MinMaxApplication(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry,
                    const Ipopt::SmartPtr<Ipopt::OptionsList>& options,
                    const Ipopt::SmartPtr<Ipopt::Journalist>& journalist);
  ~MinMaxApplication() override;

  MinMaxApplication(const MinMaxApplication&) = delete;
  MinMaxApplication& operator=(const MinMaxApplication&) = delete;

  /// Another application with the same options, registry and journalist, and no model.
  [[nodiscard]] Ipopt::SmartPtr<MinMaxApplication> clone() const;

  /// Registers all options: the solver's, the application's and those that only Ipopt has.
  static void RegisterAllIpoptOptions(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry);
  static void RegisterOptions(const Ipopt::SmartPtr<Ipopt::RegisteredOptions>& registry);

  /// Reads ipminmax.opt when present, or the file named by option_file_name, which must be there.
  /// Each Initialize returns Invalid_Option when an option is unknown or has a bad value or the
  /// file cannot be read, and says which. allow_clobber: whether later Set calls may change what a
  /// file sets.
  Ipopt::ApplicationReturnStatus Initialize(bool allow_clobber = false);
  /// Reads the given options file; "" reads none.
  Ipopt::ApplicationReturnStatus Initialize(const std::string& options_file,
                                            bool allow_clobber = false);
  Ipopt::ApplicationReturnStatus Initialize(const char* options_file, bool allow_clobber = false);
  /// Reads options from the stream.
  Ipopt::ApplicationReturnStatus Initialize(std::istream& options, bool allow_clobber = false);

  Ipopt::SmartPtr<Ipopt::OptionsList> Options();
  Ipopt::SmartPtr<const Ipopt::OptionsList> Options() const;
  Ipopt::SmartPtr<Ipopt::Journalist> Jnlst();
  Ipopt::SmartPtr<Ipopt::RegisteredOptions> RegOptions();

  /// A MinMaxTNLP, or a plain TNLP: then a minimization, or split by the integer metadata "player".
  ///
  /// With minmax_starts above 1 it is solved from that many starting points, the model's first, and
  /// the best point is the answer: the certified one with the smallest local minmax value, or else
  /// what core/multistart.hpp calls better. intermediate_callback counts iterations from 0 in each
  /// start and stops all of them; finalize_solution is called once. Iterations, evaluations and
  /// times are those of all starts.
  Ipopt::ApplicationReturnStatus OptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);
  /// OptimizeTNLP with the starts (minmax_starts) on all MPI ranks, each of which has to call this
  /// with the same model and options (core/multistart.hpp, multistart_over_ranks); one thread per
  /// rank. Only rank 0 prints, and writes minmax_points_file; all ranks get the same answer. The
  /// model is called by another thread than this one. Invalid_Option where MPI cannot be used.
  Ipopt::ApplicationReturnStatus OptimizeTNLPOverRanks(const Ipopt::SmartPtr<Ipopt::TNLP>& model);
  /// The model of the last OptimizeTNLP again, with other numbers. Orderings, symbolic
  /// factorizations, scaling, the last shifts and the arrays are kept (core/solver.hpp,
  /// RepeatedSolver; with minmax_starts above 1 nothing is), so that a usual solve allocates
  /// nothing (docs/solving_again.md). Where the structure has changed after all, it is analyzed
  /// anew.
  /// Throws INVALID_WARMSTART when it is another model or nothing was solved before.
  Ipopt::ApplicationReturnStatus ReOptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);

  /// Refused (Invalid_Problem_Definition): only a TNLP says which variables are whose.
  Ipopt::ApplicationReturnStatus OptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp);
  Ipopt::ApplicationReturnStatus OptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp,
                                             Ipopt::SmartPtr<Ipopt::AlgorithmBuilder>& builder);
  Ipopt::ApplicationReturnStatus ReOptimizeNLP(const Ipopt::SmartPtr<Ipopt::NLP>& nlp);

  /// Inside intermediate_callback: the iterate, as LastResult() would hold it if the callback
  /// stopped the solve now: v, lambda, z_lower, z_upper, constraints in the model's order and
  /// units, error (inf_du split by player), mu, counts. Evaluates objective and constraints, with
  /// fixed variables their derivatives, once per callback. Inside finalize_solution: the answer.
  /// scaled: v, lambda, z_lower, z_upper and constraints in the units in which the solve works
  /// (nlp_scaling_method, obj_scaling_factor). False, and nothing is touched, anywhere else; with
  /// scaled also where the answer is one of several solves, or robust constraints make the solve
  /// work on a larger problem.
  bool GetCurrentIterate(Result& iterate, bool scaled = false) const;
  /// Inside the same: by how much the iterate misses the first-order conditions, entry by entry.
  /// Evaluates gradient and Jacobian. False where these are undefined or not finite, and where
  /// GetCurrentIterate is.
  bool GetCurrentViolations(Violations& violations, bool scaled = false) const;

  /// Answer of the last solve, with the certificate; after a failed Initialize its status and
  /// message only.
  [[nodiscard]] const Result& LastResult() const;
  /// Worst cases of the last answer's robust constraints, and of f with minmax_epigraph; empty
  /// where there are none.
  [[nodiscard]] const std::vector<RobustWorstCase>& LastWorstCases() const;
  /// Certified points of the last multistart (minmax_starts), the best first; empty after any other
  /// solve.
  [[nodiscard]] const std::vector<DistinctPoint>& LastPoints() const;
  /// The worst case over all of y at the x of v (n values), looked for from so many starting points
  /// of y with the options of this application, beginning with that of v; see check_worst_case of
  /// core/worst_case.hpp. Returns why it cannot be done, empty when it was. model as for
  /// OptimizeTNLP; its exceptions pass through.
  [[nodiscard]] std::string CheckWorstCase(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                           std::span<const double> v, Index starts,
                                           WorstCaseCheck& check) const;
  /// The duality gap at v in the same way; see core/gap.hpp.
  [[nodiscard]] std::string FindGap(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                    std::span<const double> v, DualityGap& gap) const;
  /// Makes sensitivity that of the last answer; returns why that has no derivatives, empty when it
  /// has. Bounds and functions of the model must be those of the solve. Calls the model as a solve
  /// does before its start, then gradient, Jacobian and Hessian once; its exceptions pass through.
  [[nodiscard]] std::string UpdateSensitivity(Sensitivity& sensitivity) const;
  /// Statistics of the last solve; null when it stopped before its first iterate.
  [[nodiscard]] Ipopt::SmartPtr<MinMaxStatistics> Statistics() const;

  /// Adds an output file; false when it cannot be opened. append: what it holds stays.
  bool OpenOutputFile(const std::string& file_name, Ipopt::EJournalLevel print_level,
                      bool append = false);
  /// Prints the banner now instead of before the first solve.
  void PrintCopyrightMessage();
  /// Whether exceptions of the model that are not Ipopt's pass through OptimizeTNLP (default no);
  /// bad_alloc never does, as in Ipopt. Returns what was set before.
  bool RethrowNonIpoptException(bool dorethrow);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
