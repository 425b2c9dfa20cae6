#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <support/autodiff_problem.hpp>

namespace ipminmax::testing {

/// Writes a Model as an .nl file, text (g) or binary (b, little endian), with suffix player.
///
/// All variables and rows are declared nonlinear, and the linear parts are zero. Formulas become
/// trees: operations used twice are written twice.
class NlWriter {
 public:
  enum class Format : std::uint8_t { Text, Binary };
  enum class Sense : std::uint8_t { Minimize, MaximizeNegative };

  NlWriter(const Model& model, std::vector<double> start, Format format,
           Sense sense = Sense::Minimize)
      : model_(model),
        structure_(AutodiffProblem(model).structure()),
        start_(std::move(start)),
        binary_(format == Format::Binary),
        negative_(sense == Sense::MaximizeNegative) {}

  [[nodiscard]] std::string write() {
    const int n = size(structure_.variable_players), m = size(model_.constraints_);
    header(n, m);
    suffix_player(0, structure_.variable_players);
    if (m > 0) suffix_player(1, structure_.constraint_players);
    for (int i = 0; i < m; ++i) {
      key('C', {i});
      expression(model_.constraints_[static_cast<std::size_t>(i)]);
    }
    key('O', {0, negative_ ? 1 : 0});
    if (negative_) operation(16);
    expression(model_.objective_);
    if (!start_.empty()) {
      key('x', {n});
      for (int i = 0; i < n; ++i) pair(i, start_[static_cast<std::size_t>(i)]);
    }
    if (m > 0) bounds('r', structure_.constraint_lower, structure_.constraint_upper);
    bounds('b', structure_.variable_lower, structure_.variable_upper);
    linear_parts(n, m);
    return std::move(text_);
  }

 private:
  template <class Vector>
  static int size(const Vector& values) {
    return static_cast<int>(values.size());
  }

  void header(int n, int m) {
    const int entries = size(structure_.jacobian);
    const auto line = [&](std::initializer_list<int> numbers) {
      for (const int number : numbers) text_ += " " + std::to_string(number);
      text_ += "\n";
    };
    text_ = binary_ ? "b3 1 1 0\n" : "g3 1 1 0\n";
    int ranges = 0, equations = 0;
    for (std::size_t i = 0; i < structure_.constraint_lower.size(); ++i) {
      const char kind = bound_kind(structure_.constraint_lower[i], structure_.constraint_upper[i]);
      ranges += kind == '0';
      equations += kind == '4';
    }
    line({n, m, 1, ranges, equations});
    line({m, 1});
    line({0, 0});
    line({n, n, n});
    line({0, 0, binary_ ? 1 : 0, 1});
    line({0, 0, 0, 0, 0});
    line({entries, n});
    line({0, 0});
    line({0, 0, 0, 0, 0});
  }

  void suffix_player(int kind, const std::vector<Player>& players) {
    std::vector<int> max;
    for (int i = 0; i < size(players); ++i)
      if (players[static_cast<std::size_t>(i)] == Player::Max) max.push_back(i);
    if (max.empty()) return;
    constexpr std::string_view kName = "player";
    if (binary_) {
      key('S', {kind, size(max), size(kName)});
      text_ += kName;
    } else {
      text_ += "S" + std::to_string(kind) + " " + std::to_string(size(max)) + " player\n";
    }
    for (const int i : max)
      binary_ ? (raw(i), raw(1)) : (text_ += std::to_string(i) + " 1\n", void());
  }

  void linear_parts(int n, int m) {
    key('k', {n - 1});
    std::vector<int> column(static_cast<std::size_t>(n), 0);
    std::vector<std::vector<int>> rows(static_cast<std::size_t>(m));
    for (const Triplet& entry : structure_.jacobian) {
      ++column[static_cast<std::size_t>(entry.col)];
      rows[static_cast<std::size_t>(entry.row)].push_back(static_cast<int>(entry.col));
    }
    for (int j = 0, sum = 0; j + 1 < n; ++j) {
      sum += column[static_cast<std::size_t>(j)];
      binary_ ? raw(sum) : (text_ += std::to_string(sum) + "\n", void());
    }
    for (int i = 0; i < m; ++i) {
      const std::vector<int>& row = rows[static_cast<std::size_t>(i)];
      if (row.empty()) continue;
      key('J', {i, size(row)});
      for (const int j : row) pair(j, 0.0);
    }
    key('G', {0, n});
    for (int j = 0; j < n; ++j) pair(j, 0.0);
  }

  void expression(const Expression& e) {
    e.is_constant() ? number(e.constant()) : node(e.position());
  }

  void node(std::size_t position) {
    using Kind = Operation::Kind;
    const Operation& op = (*model_.tape_)[position];
    switch (op.kind) {
      case Kind::Variable:
        text_ += 'v';
        integer(static_cast<int>(op.a));
        return;
      case Kind::Shift:
        return both(
            0, [&] { node(op.a); }, [&] { number(op.c); });
      case Kind::Scale:
        return both(
            2, [&] { number(op.c); }, [&] { node(op.a); });
      case Kind::Reciprocal:
        return both(
            3, [&] { number(op.c); }, [&] { node(op.a); });
      case Kind::Power:
        return both(
            5, [&] { node(op.a); }, [&] { number(op.c); });
      case Kind::Add:
        return both(
            0, [&] { node(op.a); }, [&] { node(op.b); });
      case Kind::Multiply:
        return both(
            2, [&] { node(op.a); }, [&] { node(op.b); });
      case Kind::Exp:
        operation(44);
        return node(op.a);
      case Kind::Log:
        operation(43);
        return node(op.a);
      case Kind::Sin:
        operation(41);
        return node(op.a);
      case Kind::Cos:
        operation(46);
        return node(op.a);
    }
  }

  template <class First, class Second>
  void both(int code, First first, Second second) {
    operation(code);
    first();
    second();
  }

  void operation(int code) {
    text_ += 'o';
    integer(code);
  }
  void number(double value) {
    text_ += 'n';
    real(value);
  }

  static bool finite(double bound) { return std::abs(bound) < 1e19; }
  static char bound_kind(double lower, double upper) {
    if (lower == upper) return '4';
    if (finite(lower)) return finite(upper) ? '0' : '2';
    return finite(upper) ? '1' : '3';
  }
  void bounds(char segment, const std::vector<double>& lower, const std::vector<double>& upper) {
    text_ += segment;
    if (!binary_) text_ += '\n';
    for (std::size_t i = 0; i < lower.size(); ++i) {
      const char kind = bound_kind(lower[i], upper[i]);
      text_ += kind;
      std::vector<double> values;
      if (kind != '1' && kind != '3') values.push_back(lower[i]);
      if (kind == '0' || kind == '1') values.push_back(upper[i]);
      for (const double value : values)
        binary_ ? raw(value) : (text_ += " " + digits(value), void());
      if (!binary_) text_ += '\n';
    }
  }

  void key(char letter, std::initializer_list<int> numbers) {
    text_ += letter;
    bool first = true;
    for (const int value : numbers) {
      if (binary_) {
        raw(value);
      } else {
        text_ += (first ? "" : " ") + std::to_string(value);
      }
      first = false;
    }
    if (!binary_) text_ += '\n';
  }
  void pair(int index, double value) {
    if (binary_) {
      raw(index);
      raw(value);
    } else {
      text_ += std::to_string(index) + " " + digits(value) + "\n";
    }
  }
  void integer(int value) {
    binary_ ? raw(value) : (text_ += std::to_string(value) + "\n", void());
  }
  void real(double value) { binary_ ? raw(value) : (text_ += digits(value) + "\n", void()); }

  static std::string digits(double value) {
    std::array<char, 32> buffer;
    std::snprintf(buffer.data(), buffer.size(), "%.17g", value);
    return buffer.data();
  }
  template <class Value>
  void raw(Value value) {
    std::array<char, sizeof value> bytes;
    std::memcpy(bytes.data(), &value, sizeof value);
    text_.append(bytes.data(), bytes.size());
  }

  Model model_;
  ProblemStructure structure_;
  std::vector<double> start_;
  bool binary_;
  bool negative_;
  std::string text_;
};

}  // namespace ipminmax::testing
