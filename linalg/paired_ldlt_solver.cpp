#include "linalg/paired_ldlt_solver.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <numeric>
#include <tuple>
#include <utility>

#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Diagonal over the largest other entry of a row below which it is no pivot of its own, as in
/// Bunch and Kaufman's pivoting.
constexpr double kWeak = 0.64;
/// Coupling over the largest of a row that is worth a pair, and rows looked at for one.
constexpr double kStrong = 0.1;
constexpr std::size_t kMostVisits = 1000;
/// Rows that may be eliminated last, whatever they fill.
constexpr std::ptrdiff_t kMostLast = 8;

/// Partners of rows; itself: none.
class Pairing {
 public:
  explicit Pairing(const SymmetricMatrix& matrix);
  [[nodiscard]] Array<Index> take_partners() { return std::move(partner_); }
  /// Weak rows without a partner.
  [[nodiscard]] Array<bool> left() const {
    Array<bool> left(weak_.size());
    for (std::size_t i = 0; i < left.size(); ++i) {
      left[i] = weak_[i] && is_free(static_cast<Index>(i));
    }
    return left;
  }

 private:
  void make_greedily();
  void complete();
  [[nodiscard]] bool extend_from(Index root);
  void flip(Index root, Index last);
  [[nodiscard]] bool is_free(Index i) const { return partner_[i] == i; }

  const SymmetricMatrix& matrix_;
  Array<double> largest_;  ///< entry of each row beside the diagonal
  Array<bool> weak_;       ///< its diagonal is no pivot of its own
  Array<Index> partner_;
  Lists neighbors_;  ///< strongly coupled rows of each row
  Array<Index> seen_, from_, queue_;
};

Pairing::Pairing(const SymmetricMatrix& matrix)
    : matrix_(matrix),
      largest_(at(matrix.dimension()), 0.0),
      weak_(largest_.size()),
      partner_(largest_.size()) {
  std::iota(partner_.begin(), partner_.end(), 0);
  matrix.for_each_below([&](Index i, Index j, Index p) {
    const double size = std::abs(matrix.values()[at(p)]);
    largest_[i] = std::max(largest_[i], size);
    largest_[j] = std::max(largest_[j], size);
  });
  for (Index i = 0; i < matrix.dimension(); ++i) {
    const double diagonal = matrix.values()[at(matrix.diagonal_position(i))];
    weak_[i] = std::abs(diagonal) < kWeak * largest_[i];
  }
  make_greedily();
  complete();
}

/// By the largest couplings, relative to the largest of their rows, first of two weak rows.
void Pairing::make_greedily() {
  struct Candidate {
    double strength;
    Index i, j;
  };
  Array<Candidate> candidates;
  matrix_.for_each_below([&](Index i, Index j, Index p) {
    const int weak = (weak_[i] ? 1 : 0) + (weak_[j] ? 1 : 0);
    const double size = std::abs(matrix_.values()[at(p)]);
    if (weak == 0 || size == 0.0) return;
    candidates.push_back({weak * (size / largest_[i]) * (size / largest_[j]), i, j});
  });
  std::ranges::stable_sort(candidates, std::greater<>(), &Candidate::strength);
  for (const auto& [strength, i, j] : candidates) {
    if (!is_free(i) || !is_free(j)) continue;
    partner_[i] = j;
    partner_[j] = i;
  }
}

/// Weak rows without a partner find one where others can change theirs.
void Pairing::complete() {
  const Index n = matrix_.dimension();
  const auto is_left = [&](Index i) { return weak_[i] && is_free(i); };
  Array<Index> left;
  for (Index i = 0; i < n; ++i) {
    if (is_left(i)) left.push_back(i);
  }
  if (left.empty()) return;
  neighbors_ = collect(n, [&](auto&& add) {
    matrix_.for_each_below([&](Index i, Index j, Index p) {
      const double size = std::abs(matrix_.values()[at(p)]);
      if (size >= kStrong * largest_[i]) add(i, j);
      if (size >= kStrong * largest_[j]) add(j, i);
    });
  });
  seen_.assign(at(n), -1);
  from_.assign(at(n), -1);
  for (const Index root : left) {
    if (is_left(root)) static_cast<void>(extend_from(root));
  }
}

/// Breadth first along couplings and pairs in turn, to a row that is free or whose partner needs
/// none.
bool Pairing::extend_from(Index root) {
  queue_.assign(1, root);
  seen_[root] = root;
  for (std::size_t k = 0; k < queue_.size() && k < kMostVisits; ++k) {
    const Index i = queue_[k];
    for (const Index j : neighbors_[i]) {
      const Index partner = partner_[j];
      if (seen_[j] == root || seen_[partner] == root) continue;
      seen_[j] = seen_[partner] = root;
      from_[j] = i;
      if (is_free(j) || !weak_[partner]) {
        flip(root, j);
        return true;
      }
      queue_.push_back(partner);
    }
  }
  return false;
}

void Pairing::flip(Index root, Index last) {
  partner_[partner_[last]] = partner_[last];
  for (Index j = last;;) {
    const Index i = from_[j];
    const Index before = std::exchange(partner_[i], j);
    partner_[j] = i;
    if (i == root) return;
    j = before;
  }
}

/// Nodes that wait for a pivot go to the end, where there are few of them, else right behind the
/// last of their neighbors.
void postpone(std::span<const Triplet> edges, const Array<bool>& waits, Array<Index>& position) {
  const auto waiting = std::ranges::count(waits, true);
  if (waiting == 0) return;
  Array<Index> last = position;
  if (waiting <= kMostLast) {
    for (std::size_t k = 0; k < waits.size(); ++k) {
      if (waits[k]) last[k] = static_cast<Index>(waits.size());
    }
  }
  for (const Triplet& edge : edges) {
    for (const auto& [one, other] :
         {std::pair(edge.row, edge.col), std::pair(edge.col, edge.row)}) {
      if (waits[one]) last[one] = std::max(last[one], position[other]);
    }
  }
  Array<Index> order(position.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, std::less<>(),
                    [&](Index k) { return std::tuple(last[k], waits[k], position[k]); });
  for (std::size_t k = 0; k < order.size(); ++k) position[order[k]] = static_cast<Index>(k);
}

/// a b - c d without cancellation of rounding errors (Kahan).
double difference_of_products(double a, double b, double c, double d) {
  const double product = c * d;
  return std::fma(a, b, -product) + std::fma(-c, d, product);
}

}  // namespace

PairedLdltSolver::PairedLdltSolver(Ordering ordering, double gamma)
    : ordering_(ordering == Ordering::Pord ? Ordering::Best : ordering), gamma_(gamma) {}

Analysis PairedLdltSolver::analyze(const SymmetricMatrix& matrix,
                                   std::span<const std::int8_t> /*signs*/) {
  factorized_ = false;
  Analysis analysis{.ok = false};
  try {
    Pairing pairing(matrix);
    Array<bool> left = pairing.left();
    Array<Index> partner = pairing.take_partners();
    if (partner != partner_ || left != left_) {
      ++pairs_;
      partner_ = std::move(partner);
      left_ = std::move(left);
      order(matrix);
      build_pattern(matrix);
      pattern_ = {};
      tree_ = elimination_tree(rows_);
      ends_.resize(at(nodes_));
      inverse_.resize(at(nodes_));
      row_.assign(at(nodes_), Block{});
      permuted_.resize(2 * at(nodes_));
    }
  } catch (const std::bad_alloc&) {
    partner_.clear();
    return analysis;
  }
  analysis.ok = true;
  analysis.factor_entries = 4 * static_cast<std::int64_t>(tree_.entries());
  const Array<Index>& starts = tree_.column_starts;
  for (std::size_t node = 0; node + 1 < starts.size(); ++node) {  // two columns each
    const double below = 2.0 * (starts[node + 1] - starts[node]);
    analysis.flops += 2.0 * below * (below + 2.0);
  }
  return analysis;
}

std::unique_ptr<SymmetricSolver> PairedLdltSolver::same_analysis(
    const SymmetricMatrix& /*matrix*/, std::span<const std::int8_t> /*signs*/) const {
  return nullptr;
}

/// Nodes, and a fill-reducing order of their graph.
void PairedLdltSolver::order(const SymmetricMatrix& matrix) {
  const Index n = matrix.dimension();
  Array<Index> node(n);
  nodes_ = 0;
  for (Index i = 0; i < n; ++i) {
    const Index partner = partner_[i];
    node[i] = partner < i ? node[partner] : nodes_++;
  }
  Array<Triplet> edges;
  matrix.for_each_below([&](Index i, Index j, Index) {
    if (node[i] != node[j]) edges.push_back({node[i], node[j]});
  });
  Array<Index> position = choose_ordering(SymmetricMatrix(nodes_, edges), ordering_).new_index;
  Array<bool> waits(nodes_, false);
  for (Index i = 0; i < n; ++i) {
    if (left_[i]) waits[node[i]] = true;
  }
  postpone(edges, waits, position);
  place_.resize(at(n));
  single_.assign(at(nodes_), false);
  for (Index i = 0; i < n; ++i) {
    const Index k = position[node[i]];
    place_[i] = 2 * k + (partner_[i] < i ? 1 : 0);
    if (partner_[i] == i) single_[k] = true;
  }
}

void PairedLdltSolver::build_pattern(const SymmetricMatrix& matrix) {
  std::vector<std::pair<Index, Index>> places;  // (row, column) of the nodes of each entry
  matrix.for_each_below([&](Index i, Index j, Index) {
    const auto [first, last] = std::minmax({place_[i] / 2, place_[j] / 2});
    if (first != last) places.emplace_back(last, first);
  });
  sort_each_once(places);
  rows_ = collect(nodes_, [&](auto&& add) {
    for (const auto& [row, column] : places) add(row, column);
  });
  row_blocks_.resize(places.size());
  diagonal_.resize(at(nodes_));

  const auto target = [&](Index i, Index j) -> double* {
    const auto [first, last] = std::minmax({place_[i], place_[j]});
    const std::size_t inside = at(2 * (last % 2) + first % 2);
    const Index row = last / 2, column = first / 2;
    if (row == column) return &diagonal_[row][inside];
    const auto columns = rows_[row];
    const auto found = std::ranges::lower_bound(columns, column) - columns.begin();
    return &row_blocks_[rows_.starts[row] + static_cast<Index>(found)][inside];
  };
  entry_.clear();
  matrix.for_each_entry([&](Index i, Index j, Index) { entry_.push_back(target(i, j)); });
}

void PairedLdltSolver::load_values(const SymmetricMatrix& matrix) {
  std::ranges::fill(row_blocks_, Block{});
  for (std::size_t k = 0; k < diagonal_.size(); ++k) {
    diagonal_[k] = {0.0, 0.0, 0.0, single_[k] ? 1.0 : 0.0};
  }
  for (std::size_t p = 0; p < entry_.size(); ++p) *entry_[p] = matrix.values()[p];
  for (Index i = 0; i < matrix.dimension(); ++i) {
    *entry_[at(matrix.diagonal_position(i))] += gamma_;
  }
}

/// One row of L; returns the pivot, [0], [2] = [1] and [3] of it.
PairedLdltSolver::Block PairedLdltSolver::eliminate_row(Index node) {
  for (Index p = rows_.starts[node]; p < rows_.starts[node + 1]; ++p) {
    row_[rows_.items[p]] = row_blocks_[p];
  }
  Block pivot = diagonal_[node];
  for (Index r = pattern_.row_starts[node]; r < pattern_.row_starts[node + 1]; ++r) {
    const std::size_t i = at(pattern_.columns[r]);
    const Block y = row_[i];
    row_[i] = {};
    for (Index p = tree_.column_starts[i]; p < ends_[i]; ++p) {
      const Block& l = blocks_[p];
      Block& target = row_[pattern_.rows[p]];
      target[0] -= y[0] * l[0] + y[1] * l[1];
      target[1] -= y[0] * l[2] + y[1] * l[3];
      target[2] -= y[2] * l[0] + y[3] * l[1];
      target[3] -= y[2] * l[2] + y[3] * l[3];
    }
    const Block& d = inverse_[i];
    const Block l = {y[0] * d[0] + y[1] * d[2], y[0] * d[1] + y[1] * d[3],
                     y[2] * d[0] + y[3] * d[2], y[2] * d[1] + y[3] * d[3]};
    pivot[0] -= l[0] * y[0] + l[1] * y[1];
    pivot[2] -= l[2] * y[0] + l[3] * y[1];
    pivot[3] -= l[2] * y[2] + l[3] * y[3];
    blocks_[ends_[i]++] = l;
  }
  return pivot;
}

/// False: it is singular or not finite.
bool PairedLdltSolver::take_pivot(Index node, const Block& pivot, Factorization& result) {
  const double a = pivot[0], b = pivot[2], c = pivot[3];
  const double determinant = difference_of_products(a, c, b, b);
  if (!std::isfinite(determinant) || determinant == 0.0) return false;
  inverse_[node] = {c / determinant, -b / determinant, -b / determinant, a / determinant};
  Inertia& inertia = result.inertia;
  if (single_[node]) {
    ++(a > 0.0 ? inertia.positive : inertia.negative);
    result.smallest_pivot = std::min(result.smallest_pivot, std::abs(a));
    return true;
  }
  const double half = 0.5 * (a + c);
  const double size = std::abs(half) + std::hypot(0.5 * (a - c), b);  // the larger |eigenvalue|
  if (determinant < 0.0) {
    ++inertia.positive;
    ++inertia.negative;
  } else {
    (half > 0.0 ? inertia.positive : inertia.negative) += 2;
  }
  result.smallest_pivot = std::min(result.smallest_pivot, std::abs(determinant) / size);
  return true;
}

/// Room for the columns of L, made by the first factorization: what an analysis predicts may be too
/// much to be tried.
bool PairedLdltSolver::make_room() {
  if (!pattern_.row_starts.empty()) return true;
  try {
    blocks_ = {};  // before the new ones
    FactorPattern pattern = factor_pattern(rows_, tree_);
    blocks_.resize(at(tree_.entries()));
    pattern_ = std::move(pattern);
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

Factorization PairedLdltSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  if (!make_room()) return {.status = FactorizationStatus::OutOfMemory};
  Factorization result{.smallest_pivot = kInfinity,
                       .trust = {.pivoted = false, .perturbation = gamma_}};
  load_values(matrix);
  for (Index k = 0; k < nodes_; ++k) {
    ends_[k] = tree_.column_starts[k];
    if (!take_pivot(k, eliminate_row(k), result)) return {.trust = result.trust};
  }
  result.status = FactorizationStatus::Ok;
  factorized_ = true;
  return result;
}

void PairedLdltSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::ranges::fill(rhs, kNaN);
    return;
  }
  const std::size_t n = place_.size();
  for (std::size_t c = 0; c < at(columns) && n > 0; ++c) solve_one(rhs.subspan(c * n, n));
}

void PairedLdltSolver::solve_one(std::span<double> rhs) {
  Array<double>& x = permuted_;
  std::ranges::fill(x, 0.0);
  for (std::size_t i = 0; i < rhs.size(); ++i) x[place_[i]] = rhs[i];
  for (std::size_t j = 0; j < at(nodes_); ++j) {
    const double x0 = x[2 * j], x1 = x[2 * j + 1];
    for (Index p = tree_.column_starts[j]; p < ends_[j]; ++p) {
      const Block& l = blocks_[p];
      const std::size_t i = 2 * at(pattern_.rows[p]);
      x[i] -= l[0] * x0 + l[1] * x1;
      x[i + 1] -= l[2] * x0 + l[3] * x1;
    }
  }
  for (std::size_t j = at(nodes_); j-- > 0;) {
    const Block& d = inverse_[j];
    double x0 = d[0] * x[2 * j] + d[1] * x[2 * j + 1];
    double x1 = d[2] * x[2 * j] + d[3] * x[2 * j + 1];
    for (Index p = tree_.column_starts[j]; p < ends_[j]; ++p) {
      const Block& l = blocks_[p];
      const std::size_t i = 2 * at(pattern_.rows[p]);
      x0 -= l[0] * x[i] + l[2] * x[i + 1];
      x1 -= l[1] * x[i] + l[3] * x[i + 1];
    }
    x[2 * j] = x0;
    x[2 * j + 1] = x1;
  }
  for (std::size_t i = 0; i < rhs.size(); ++i) rhs[i] = x[place_[i]];
}

double PairedLdltSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  return 16.0 * static_cast<double>(blocks_.size()) * b.columns();
}

}  // namespace ipminmax
