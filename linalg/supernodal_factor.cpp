#include "linalg/supernodal_factor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

constexpr std::size_t kTogether = 4;  // columns
// Loaded and stored wherever doubles are.
typedef double Two
    __attribute__((vector_size(2 * sizeof(double)), aligned(alignof(double)), may_alias));

/// Share of a panel that zeros may be, for the sake of fewer and wider panels.
double most_zeros(Index width) {
  constexpr Index kNarrow = 8, kWide = 32;
  return width <= kNarrow ? 0.4 : width <= kWide ? 0.15 : 0.05;
}

std::size_t triangle(std::size_t rows) { return rows * (rows + 1) / 2; }

/// Rows j, ..., j + count - 1 of L D, by its first columns: four numbers a column, zero for rows
/// that are none.
void pack(const double* panel, std::size_t width, const double* pivots, std::size_t j,
          std::size_t count, std::size_t columns, double* packed) {
  for (std::size_t k = 0; k < columns; ++k) {
    for (std::size_t c = 0; c < kTogether; ++c) {
      packed[kTogether * k + c] = c < count ? panel[(j + c) * width + k] * pivots[k] : 0.0;
    }
  }
}

/// target(r)_c -= sum over k of l_rk packed_kc for rows r and count columns c.
template <std::size_t... r, class Target>
void subtract_products(std::index_sequence<r...>, const double* l, std::size_t width,
                       const double* packed, std::size_t columns, std::size_t count,
                       Target&& target) {
  Two left[] = {((void)r, Two{})...}, right[] = {((void)r, Two{})...};
  for (std::size_t k = 0; k < columns; ++k) {
    const Two a = *reinterpret_cast<const Two*>(packed + kTogether * k);
    const Two b = *reinterpret_cast<const Two*>(packed + kTogether * k + 2);
    ((left[r] += l[r * width + k] * a, right[r] += l[r * width + k] * b), ...);
  }
  const auto subtract = [&](double* t, const Two& a, const Two& b) {
    const double sums[] = {a[0], a[1], b[0], b[1]};
    for (std::size_t c = 0; c < count; ++c) t[c] -= sums[c];
  };
  (subtract(target(r), left[r], right[r]), ...);
}
constexpr std::make_index_sequence<1> kOneRow;
constexpr std::make_index_sequence<kTogether> kFourRows;

}  // namespace

SupernodalFactor::SupernodalFactor(const Lists& lower, std::span<const Index> places,
                                   std::span<const Index> diagonal_places,
                                   const EliminationTree& tree, int threads)
    : diagonal_places_(diagonal_places.begin(), diagonal_places.end()),
      pivots_(diagonal_places.size()) {
  find_supernodes(tree);
  const auto of_entries = [&](auto&& item) {
    return collect(children_.size(), [&](auto&& add) {
      for (Index i = 0; i < lower.size(); ++i) {
        for (Index p = lower.starts[i]; p < lower.starts[i + 1]; ++p) {
          add(supernode_of_[lower.items[p]], item(i, p));
        }
      }
    });
  };
  entries_ = of_entries([&](Index, Index p) { return places[at(p)]; });
  targets_ = of_entries([&](Index, Index p) { return lower.items[p]; }).items;
  const Lists entry_rows = of_entries([](Index i, Index) { return i; });
  find_rows(entry_rows);
  place_entries(entry_rows);
  divide(threads);
  place_updates();
  packed_.resize(packed_size_ * parts_.starts.size());
  broken_.resize(parts_.starts.size());
}

/// A column joins the one before it where no row is new to this. Then the supernode takes in its
/// last child while few zeros come with it.
void SupernodalFactor::find_supernodes(const EliminationTree& tree) {
  const Index n = tree.dimension();
  const auto below = [&](Index j) { return tree.column_starts[j + 1] - tree.column_starts[j]; };
  for (Index j = 0; j < n;) {
    Supernode s{.first = j};
    while (++j < n && tree.parent[j - 1] == j && below(j) == below(j - 1) - 1) continue;
    const double last_below = below(j - 1);
    while (!supernodes_.empty()) {
      const Index parent = tree.parent[s.first - 1];
      if (parent < 0 || parent >= j) break;
      const Supernode& child = supernodes_.back();
      const double width = j - child.first;
      const double more = child.width * (j - s.first + last_below - below(s.first - 1));
      const double zeros = child.zeros + s.zeros + more;
      if (zeros > most_zeros(j - child.first) * width * (0.5 * (width + 1) + last_below)) break;
      s.zeros = zeros;
      s.first = child.first;
      supernodes_.pop_back();
    }
    s.width = j - s.first;
    s.height = s.width + below(j - 1);
    supernodes_.push_back(s);
  }
  supernode_of_.resize(at(n));
  std::int64_t entries = 0, rows = 0;
  for (std::size_t k = 0; k < supernodes_.size(); ++k) {
    Supernode& s = supernodes_[k];
    std::fill_n(supernode_of_.begin() + s.first, s.width, static_cast<Index>(k));
    s.panel = static_cast<Index>(entries);
    s.rows = static_cast<Index>(rows);
    entries += std::int64_t{s.width} * s.height;
    rows += s.height - s.width;
    if (entries > std::numeric_limits<Index>::max()) throw std::bad_alloc();
    packed_size_ = std::max(packed_size_, kTogether * at(s.width));
  }
  panels_.resize(static_cast<std::size_t>(entries));
  rows_.resize(static_cast<std::size_t>(rows));
  for (const Supernode& s : supernodes_) {
    const Index parent = tree.parent[s.first + s.width - 1];
    parents_.push_back(parent < 0 ? -1 : supernode_of_[parent]);
  }
  const Index count = static_cast<Index>(parents_.size());
  children_ = collect(count, [&](auto&& add) {
    for (Index k = 0; k < count; ++k) {
      if (parents_[k] >= 0) add(parents_[k], k);
    }
  });
}

/// Below each panel: rows of the matrix and of the children's panels.
void SupernodalFactor::find_rows(const Lists& entry_rows) {
  Array<Index> mark(pivots_.size(), -1);
  for (Index k = 0; k < children_.size(); ++k) {
    const Supernode& s = supernodes_[k];
    const auto begin = rows_.begin() + s.rows;
    auto end = begin;
    const auto add = [&](std::span<const Index> rows) {
      for (const Index i : rows) {
        if (i < s.first + s.width || mark[i] == k) continue;
        mark[i] = k;
        *end++ = i;
      }
    };
    add(entry_rows[k]);
    for (const Index c : children_[k]) add(rows_below(supernodes_[c]));
    std::sort(begin, end);
  }
}

/// targets_: on entry the columns of the entries.
void SupernodalFactor::place_entries(const Lists& entry_rows) {
  in_parent_.resize(rows_.size());
  Array<Index> place(pivots_.size());
  for (Index k = 0; k < children_.size(); ++k) {
    const Supernode& s = supernodes_[k];
    std::iota(place.begin() + s.first, place.begin() + s.first + s.width, 0);
    Index i = s.width;
    for (const Index row : rows_below(s)) place[row] = i++;
    for (const Index c : children_[k]) {
      Index r = supernodes_[c].rows;
      for (const Index row : rows_below(supernodes_[c])) in_parent_[r++] = place[row];
    }
    for (Index e = entries_.starts[k]; e < entries_.starts[k + 1]; ++e) {
      targets_[e] = s.panel + place[entry_rows.items[e]] * s.width + (targets_[e] - s.first);
    }
  }
}

/// Costs are nanoseconds of a usual machine.
void SupernodalFactor::divide(int threads) {
  constexpr double kSupernode = 50.0, kEntry = 1.0, kUpdate = 0.15;
  Array<double> costs(supernodes_.size(), kSupernode);
  for (std::size_t k = 0; k < costs.size(); ++k) {
    for (Index c = 1; c <= supernodes_[k].width; ++c) {
      const double below = supernodes_[k].height - c;
      costs[k] += below * (kEntry + kUpdate * 0.5 * (below + 1.0));
    }
  }
  parts_ = parts_for_threads(parents_, costs, threads);
}

/// A stack for each part: the children's update matrices are its top.
void SupernodalFactor::place_updates() {
  std::size_t size = 0;
  Array<Index> part(children_.size(), parts_.count());
  const auto place = [&](std::span<const Index> supernodes) {
    std::size_t top = size;
    for (const Index k : supernodes) {
      Supernode& s = supernodes_[k];
      s.made = s.update = top;
      size = std::max(size, s.made + s.update_size());
      for (const Index c : children_[k]) {
        if (part[c] == part[k]) s.update = std::min(s.update, supernodes_[c].update);
      }
      top = s.update + s.update_size();
    }
  };
  for (int p = 0; p < parts_.count(); ++p) {
    for (const Index k : parts_.part(p)) part[k] = p;
    place(parts_.part(p));
  }
  place(parts_.rest());
  updates_.resize(size);
}

bool SupernodalFactor::factorize(std::span<const double> values, std::span<const double> weights,
                                 double gamma) {
  const auto run = [&](std::span<const Index> supernodes, int p) {
    return eliminate(supernodes, values, weights, gamma, packed_.data() + at(p) * packed_size_);
  };
  workers_.run(parts_.count(), [&](int p) { broken_[p] = run(parts_.part(p), p) ? 0 : 1; });
  return std::ranges::count(broken_, 1) == 0 && run(parts_.rest(), parts_.count());
}

bool SupernodalFactor::eliminate(std::span<const Index> supernodes, std::span<const double> values,
                                 std::span<const double> weights, double gamma, double* packed) {
  for (const Index k : supernodes) {
    const Supernode& s = supernodes_[k];
    double* const panel = &panels_[s.panel];
    std::fill_n(panel, s.width * s.height, 0.0);
    for (Index e = entries_.starts[k]; e < entries_.starts[k + 1]; ++e) {
      panels_[targets_[e]] += values[at(entries_.items[e])];
    }
    for (Index i = 0; i < s.width; ++i) {
      const std::size_t row = at(s.first + i);
      panel[i * s.width + i] = values[at(diagonal_places_[row])] + gamma * weights[row];
    }
    double* const update = updates_.data() + s.made;
    std::fill_n(update, s.update_size(), 0.0);
    for (const Index c : children_[k]) add_update(supernodes_[c], s);
    if (!eliminate_columns(s, packed)) return false;
    make_update(s, packed);
    if (s.update != s.made) {
      std::copy_n(update, s.update_size(), updates_.data() + s.update);
    }
  }
  return true;
}

void SupernodalFactor::add_update(const Supernode& child, const Supernode& parent) {
  const std::size_t width = at(parent.width), below = child.below();
  const Index* const to = in_parent_.data() + child.rows;
  const auto in_columns =
      static_cast<std::size_t>(std::lower_bound(to, to + below, parent.width) - to);
  const double* from = updates_.data() + child.update;
  for (std::size_t i = 0; i < below; ++i) {
    const std::size_t row = at(to[i]);
    double* const panel = panels_.data() + at(parent.panel) + row * width;
    const std::size_t split = std::min(i + 1, in_columns);
    for (std::size_t j = 0; j < split; ++j) panel[to[j]] += from[j];
    if (split <= i) {
      double* const update = updates_.data() + parent.made + triangle(row - width);
      for (std::size_t j = split; j <= i; ++j) update[at(to[j]) - width] += from[j];
    }
    from += i + 1;
  }
}

/// Four columns at a time: what those before leave of them, then each other's.
bool SupernodalFactor::eliminate_columns(const Supernode& s, double* packed) {
  double* const panel = &panels_[s.panel];
  double* const pivots = &pivots_[s.first];
  const std::size_t width = at(s.width), height = at(s.height);
  for (std::size_t j = 0; j < width; j += kTogether) {
    const std::size_t count = std::min(kTogether, width - j);
    if (j > 0) {
      pack(panel, width, pivots, j, count, j, packed);
      std::size_t i = j;
      for (; i + kTogether <= height; i += kTogether) {
        subtract_products(kFourRows, panel + i * width, width, packed, j, count,
                          [&](std::size_t r) { return panel + (i + r) * width + j; });
      }
      for (; i < height; ++i) {
        subtract_products(kOneRow, panel + i * width, width, packed, j, count,
                          [&](std::size_t) { return panel + i * width + j; });
      }
    }
    double products[kTogether][kTogether];  // entries of L D in the block on the diagonal
    double inverse[kTogether];
    for (std::size_t i = j; i < height; ++i) {
      double* const l = panel + i * width + j;
      const std::size_t before = std::min(count, i - j);
      double own = before < count ? l[before] : 0.0;
      double y[kTogether];
      for (std::size_t m = 0; m < before; ++m) {
        y[m] = l[m];
        for (std::size_t q = 0; q < m; ++q) y[m] -= l[q] * products[m][q];
        l[m] = y[m] * inverse[m];
        own -= l[m] * y[m];
      }
      if (before == count) continue;
      std::copy_n(y, before, products[before]);
      pivots[j + before] = own;
      inverse[before] = 1.0 / own;
      if (!std::isfinite(own) || !std::isfinite(inverse[before])) return false;
    }
  }
  return true;
}

void SupernodalFactor::make_update(const Supernode& s, double* packed) {
  const double* const panel = &panels_[s.panel];
  double* const update = updates_.data() + s.made;
  const std::size_t width = at(s.width), height = at(s.height);
  for (std::size_t j = width; j < height; j += kTogether) {
    const std::size_t count = std::min(kTogether, height - j);
    pack(panel, width, &pivots_[s.first], j, count, width, packed);
    const auto target = [&](std::size_t i) { return update + triangle(i - width) + (j - width); };
    std::size_t i = j;
    for (; i < j + count; ++i) {
      subtract_products(kOneRow, panel + i * width, width, packed, width, i - j + 1,
                        [&](std::size_t) { return target(i); });
    }
    for (; i + kTogether <= height; i += kTogether) {
      subtract_products(kFourRows, panel + i * width, width, packed, width, kTogether,
                        [&](std::size_t r) { return target(i + r); });
    }
    for (; i < height; ++i) {
      subtract_products(kOneRow, panel + i * width, width, packed, width, kTogether,
                        [&](std::size_t) { return target(i); });
    }
  }
}

void SupernodalFactor::solve(std::span<double> x) const {
  for (const Supernode& s : supernodes_) {
    double* const own = x.data() + s.first;
    const double* l = &panels_[s.panel];
    const Index rows = s.rows - s.width;
    for (Index i = 0; i < s.height; ++i, l += s.width) {
      double sum = 0.0;
      for (Index k = 0, end = std::min(i, s.width); k < end; ++k) sum += l[k] * own[k];
      (i < s.width ? own[i] : x[at(rows_[rows + i])]) -= sum;
    }
  }
  for (std::size_t k = supernodes_.size(); k-- > 0;) {
    const Supernode& s = supernodes_[k];
    const Index width = s.width;
    double* const own = x.data() + s.first;
    const double* l = &panels_[s.panel] + s.height * width;
    const Index rows = s.rows - width;
    for (Index c = 0; c < width; ++c) own[c] /= pivots_[s.first + c];
    for (Index i = s.height; --i > 0;) {
      l -= width;
      if (i >= width + 1) {  // two rows together
        const double x_i = x[at(rows_[rows + i])], x_j = x[at(rows_[rows + --i])];
        l -= width;
        for (Index c = 0; c < width; ++c) own[c] -= l[c] * x_j + l[width + c] * x_i;
      } else {
        const double x_i = i < width ? own[i] : x[at(rows_[rows + i])];
        for (Index c = 0, end = std::min(i, width); c < end; ++c) own[c] -= l[c] * x_i;
      }
    }
  }
}

}  // namespace ipminmax
