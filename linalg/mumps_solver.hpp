#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Multifrontal LDL' with threshold pivoting (MUMPS, SYM = 2). Null pivots are counted as zero
/// eigenvalues. Calls are serialized over all threads of the process.
class MumpsSolver final : public SymmetricSolver {
 public:
  enum class Processes : std::uint8_t {
    This,  ///< the sequential MUMPS
    Ranks  ///< the parallel one on all MPI ranks, of which this process is the first
  };
  explicit MumpsSolver(const SymmetricSolverOptions& options,
                       Processes processes = Processes::This);
  ~MumpsSolver() override;

  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  /// METIS's ordering of the matrix that is analyzed next, 0-based: not to be computed again.
  void know_metis_order(std::vector<Index> new_index) { metis_order_ = std::move(new_index); }
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void stop_when(std::function<bool()> stop) override { stop_ = std::move(stop); }
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;
  [[nodiscard]] bool increase_quality() override;
  void reset_quality() override { pivot_tolerance_ = options_.mumps_pivot_tolerance; }

 private:
  struct Instance;  // hides the MUMPS structure
  void make_instance();
  void load_pattern();
  void take_pattern(const SymmetricMatrix& matrix);
  [[nodiscard]] std::vector<Index> current_order() const;
  [[nodiscard]] bool is_ill_conditioned_only(const SymmetricMatrix& matrix);
  Analysis analyze_with(Ordering ordering, const SymmetricMatrix& matrix);
  [[nodiscard]] Analysis prediction(int status, Ordering ordering) const;
  Analysis analyze_given(Ordering name, std::vector<Index> order);
  [[nodiscard]] int factorize_with_enough_memory(const std::function<bool()>& gives_up = {});
  [[nodiscard]] bool is_stopped() const { return stop_ && stop_(); }
  [[nodiscard]] double factorization_bytes(Index percent) const;
  [[nodiscard]] bool has_memory_for(double bytes) const;
  [[nodiscard]] Index affordable_percent() const;
  Analysis analyze_with_values(const SymmetricMatrix& matrix);
  [[nodiscard]] bool take_first_values(const SymmetricMatrix& matrix);
  [[nodiscard]] bool has_many_delays(const SymmetricMatrix& matrix) const;
  [[nodiscard]] int compare_with_others(const SymmetricMatrix& matrix, int status);

  SymmetricSolverOptions options_;
  Processes processes_;
  double pivot_tolerance_;
  Index memory_percent_;
  Index dimension_ = 0;
  std::vector<Index> rows_, columns_;  // 1-based
  std::vector<Index> metis_order_;     // 0-based, during an analysis only
  std::vector<Index> order_;           // the one given to MUMPS, 1-based; may be empty
  std::unique_ptr<Instance> instance_;
  Analysis analysis_;
  bool by_values_ = false;        // the analysis has read them
  bool has_seen_values_ = false;  // ... or was found better without
  int comparisons_ = 0;           // of that analysis with the other
  double expected_flops_ = 0.0;   // of a factorization, with delayed pivots; 0 before one had many
  std::function<bool()> stop_;
  bool factorized_ = false;
};

}  // namespace ipminmax
