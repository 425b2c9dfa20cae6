#include "nl_check.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "adapter/ipopt/concat.hpp"
#include "linalg/numbers.hpp"
#include "nl_formulas.hpp"

namespace ipminmax {
namespace {

/// Keys and values of a file. A text file holds one key, its values and a comment a line; a binary
/// one a byte for each key and 2, 4 or 8 bytes for each value.
class Cursor {
 public:
  Cursor(const std::string& text, const std::string& name) : text_(text), name_(name) {}

  void make_binary(bool swapped) {
    binary_ = true;
    swapped_ = swapped;
  }
  [[nodiscard]] bool binary() const { return binary_; }
  [[nodiscard]] std::size_t place() const { return at_; }
  [[nodiscard]] std::size_t left() const { return text_.size() - at_; }
  [[noreturn]] void fail(const auto&... what) const {
    throw std::runtime_error(
        concat("cannot read ", name_, ", ",
               binary_ ? concat("byte ", at_ + 1, ": ") : concat("line ", line_, ": "), what...));
  }

  // What follows is read and passed; key gives none at the end of the file.
  [[nodiscard]] std::optional<char> key() {
    if (left() == 0) return std::nullopt;
    return text_[at_++];
  }
  int integer() { return binary_ ? bytes<std::int32_t>() : digits<int>("an integer"); }
  int short_integer() { return binary_ ? bytes<std::int16_t>() : digits<int>("an integer"); }
  double number() { return binary_ ? bytes<double>() : digits<double>("a number"); }
  std::string word() {
    constexpr int kLongest = 126;
    std::string word;
    if (binary_) {
      const int length = integer();
      if (length < 1 || length > kLongest || left() < at(length))
        fail("a name of ", length, " characters");
      word = text_.substr(at_, at(length));
      at_ += word.size();
    } else {
      skip_blanks();
      while (left() > 0 && text_[at_] > ' ') word += text_[at_++];
      if (word.empty() || word.size() > kLongest) fail("a name is missing or too long");
    }
    return word;
  }
  /// A string constant, whose length comes first.
  void skip_string() {
    const int length = integer();
    if (length < 0 || left() < at(length) + (binary_ ? 0 : 2))
      fail("a string of ", length, " characters");
    if (!binary_ && text_[at_++] != ':') fail("a string without \":\" after its length");
    const char* begin = text_.data() + at_;
    line_ += static_cast<int>(std::count(begin, begin + length, '\n'));
    at_ += at(length);
    if (binary_) return;
    if (text_[at_] != '\n') fail("a string longer than its length");
    ++at_;
    ++line_;
  }
  /// To the next key, over a comment. Nothing in binary files.
  void end_line() {
    if (!binary_) line();
  }
  /// The next line, of the header.
  std::string line() {
    const std::size_t end = text_.find_first_of("\r\n", at_);
    if (end == std::string::npos) fail("the file ends within a line");
    std::string line = text_.substr(at_, end - at_);
    at_ = end + 1;
    if (text_[end] == '\r' && left() > 0 && text_[at_] == '\n') ++at_;
    ++line_;
    return line;
  }

 private:
  template <class Value>
  Value bytes() {
    std::array<char, sizeof(Value)> raw;
    if (left() < raw.size()) fail("the file ends within a value");
    std::copy_n(text_.data() + at_, raw.size(), raw.begin());
    if (swapped_) std::ranges::reverse(raw);
    at_ += raw.size();
    return std::bit_cast<Value>(raw);
  }
  template <class Value>
  Value digits(const char* what) {
    constexpr bool is_real = std::is_same_v<Value, double>;
    skip_blanks();
    const char* begin = text_.data() + at_;
    if (is_real && left() > 0 && *begin == '+') ++begin;
    Value value{};
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error == std::errc::invalid_argument) fail(what, " is missing");
    // Of numbers out of range the library makes infinity or zero.
    if (!is_real && error != std::errc{}) fail(what, " out of range");
    at_ = static_cast<std::size_t>(end - text_.data());
    return value;
  }
  void skip_blanks() {
    while (left() > 0 && text_[at_] == ' ') ++at_;
  }

  const std::string& text_;
  const std::string& name_;
  std::size_t at_ = 0;
  int line_ = 1;
  bool binary_ = false, swapped_ = false;
};

// --- Operations
// -----------------------------------------------------------------------------------

/// What follows each operation, by its number in D. M. Gay, "Writing .nl files": 1, 2 or 3
/// operands, a list (l), a list of at least three (L), a piecewise linear function (p), a choice of
/// strings (s); -: there is no such operation.
constexpr std::string_view kForms =
    "2222222----ll1111---22222---222---13-11111111111211111L----lll22ps2222LL32ll";

// --- The file
// -------------------------------------------------------------------------------------

class Checker {
 public:
  Checker(const std::string& text, const std::string& name) : cursor_(text, name), name_(name) {}
  [[nodiscard]] NlFacts check() {
    header();
    while (const auto key = cursor_.key()) {
      const std::size_t begin = cursor_.place() - 1;
      segment(*key);
      if (*key == 'b') facts_.bounds = {begin, cursor_.place()};
      if (*key == 'k' || *key == 'K') facts_.columns = {begin, cursor_.place()};
    }
    require_complete();
    facts_.variables = n_;
    facts_.binary = cursor_.binary();
    return std::move(facts_);
  }
  NlFormulas formulas;  ///< those of the file

 private:
  enum class Operand : std::uint8_t { Value, ValueOrString, Reference };
  using Marks = std::vector<std::uint8_t>;

  void header() {
    const std::string format = cursor_.left() > 0 ? cursor_.line() : "";
    if (format.empty() || (format[0] != 'g' && format[0] != 'b'))
      cursor_.fail("no .nl file: it begins with neither g nor b");
    std::istringstream options(format.substr(1));
    int number = 0;
    if (options >> number && (number < 0 || number > 9)) cursor_.fail("wrong number of options");
    const int bytes = static_cast<int>(std::min<std::size_t>(cursor_.left(), 1 << 30));
    const auto sizes = counts(3, 6, bytes);
    n_ = sizes[0];
    m_ = sizes[1];
    objectives_ = sizes[2];
    const auto at_most = [&](const std::vector<int>& values, std::size_t first, std::size_t last,
                             int limit) {
      for (std::size_t i = first; i < last; ++i)
        if (values[i] > limit) cursor_.fail("wrong counts in the header");
    };
    at_most(sizes, 3, 5, m_);  // ranges, equations
    if (sizes[5] > 0) refuse("logical constraints are not supported");
    const auto nonlinear = counts(2, 6, bytes);
    if (nonlinear[2] > 0 || nonlinear[3] > 0)
      refuse("complementarity constraints are not supported");
    at_most(nonlinear, 0, 1, m_);
    at_most(nonlinear, 1, 2, objectives_);
    at_most(counts(2, 2, bytes), 0, 2, m_);  // network constraints
    at_most(counts(2, 3, bytes), 0, 3, n_);  // nonlinear variables
    const auto numbers = counts(2, 4, bytes);
    at_most(numbers, 0, 1, n_);
    functions_ = numbers[1];
    if (numbers[2] > 2) cursor_.fail("numbers in a format of another machine");
    at_most(counts(2, 5, bytes), 0, 5, n_);  // discrete variables
    const auto entries = counts(2, 2, bytes);
    jacobian_entries_ = entries[0];
    gradient_entries_ = entries[1];
    counts(2, 2, 1 << 30);  // lengths of names
    long long defined = 0;
    for (const int part : counts(5, 5, bytes)) defined += part;
    if (defined > bytes) cursor_.fail("wrong counts in the header");
    defined_ = static_cast<int>(defined);
    if (format[0] == 'b') cursor_.make_binary(numbers[2] == 2);
    constraint_seen_ = row_seen_ = marks(m_);
    objective_seen_ = gradient_seen_ = marks(objectives_);
    defined_seen_ = marks(defined_);
    function_seen_ = marks(functions_);
    place_seen_ = marks(jacobian_entries_);
    formulas.constraints.resize(at(m_));
    formulas.objectives.resize(at(objectives_));
    column_.assign(at(n_), 0);
    column_read_ = column_;
    listed_in_ = column_;
  }
  /// Integers of a line of the header. Each thing that is counted takes a byte of the file or more.
  std::vector<int> counts(std::size_t least, std::size_t most, int largest) {
    std::istringstream line(cursor_.line());
    std::vector<int> values;
    for (long long value = 0; values.size() < most && line >> value;) {
      if (value < 0 || value > largest) cursor_.fail("wrong counts in the header");
      values.push_back(static_cast<int>(value));
    }
    if (values.size() < least) cursor_.fail("the header lacks counts");
    values.resize(most, 0);
    return values;
  }
  void segment(char key) {
    const auto formula = [&](Marks& seen, int size, const char* what) {
      const int i = index(size, what);
      mark(seen, i, what);
      if (key == 'O') cursor_.integer();
      cursor_.end_line();
      expression((key == 'O' ? formulas.objectives : formulas.constraints)[at(i)]);
    };
    switch (key) {
      case 'C':
        return formula(constraint_seen_, m_, "constraint");
      case 'O':
        return formula(objective_seen_, objectives_, "objective");
      case 'V':
        return defined_variable();
      case 'F':
        return function();
      case 'S':
        return suffix();
      case 'x':
        return start_values(n_);
      case 'd':
        return start_values(m_);
      case 'r':
        has_rows_ = true;
        return bounds(m_, true);
      case 'b':
        has_bounds_ = true;
        return bounds(n_, false);
      case 'k':
      case 'K':
        return column_counts(key == 'k');
      case 'J':
      case 'G':
        return linear_terms(key == 'J');
      default:
        cursor_.fail("a part that begins with no known letter");
    }
  }
  void defined_variable() {
    const int variable = cursor_.integer();
    if (variable < n_ || variable - n_ >= defined_)
      cursor_.fail("a defined variable that the header does not count");
    const int linear = count(0, n_, "linear terms");
    cursor_.integer();
    NlFormulas::Formula formula;
    for_lines(linear, [&](int) {
      const int read = index(n_, "variable");
      add_linear(formula, read, cursor_.number());
    });
    expression(formula);
    formulas.defined.emplace_back(variable, std::move(formula));
    mark(defined_seen_, variable - n_, "defined variable");
  }
  void function() {
    mark(function_seen_, index(functions_, "function"), "function");
    cursor_.integer();
    cursor_.integer();
    cursor_.word();
    cursor_.end_line();
  }
  void suffix() {
    const int kind = cursor_.integer();
    if (kind < 0 || kind > 7) cursor_.fail("suffix of unknown kind ", kind);
    const int size = std::array{n_, m_, objectives_, 1}[at(kind & 3)];
    const int entries = count(1, size, "values of a suffix");
    const std::string name = cursor_.word().c_str();
    const bool constraint_players = name == "player" && (kind & 3) == 1;
    if (name != "player" && (kind & 3) == 0) facts_.other_suffixes.push_back(name);
    for_lines(entries, [&](int) {
      const int item = index(size, "suffix of item");
      const double value = (kind & 4) != 0 ? cursor_.number() : cursor_.integer();
      if (constraint_players && value == 0.0) facts_.listed_as_min.push_back(item);
    });
  }
  void start_values(int size) {
    for_lines(count(0, size, "start values"), [&](int) {
      index(size, "start value");
      cursor_.number();
    });
  }
  void bounds(int size, bool rows) {
    for_lines(size, [&](int i) {
      const char kind = cursor_.key().value_or('\0');
      const int numbers = kind == '0' ? 2 : kind == '3' ? 0 : 1;
      if (kind == '5' && rows) {
        cursor_.integer();
        cursor_.integer();
      } else if ('0' <= kind && kind <= '4') {
        for (int j = 0; j < numbers; ++j)
          if (std::isnan(cursor_.number())) cursor_.fail("a bound is not a number");
      } else {
        cursor_.fail("no bounds of ", rows ? "constraint " : "variable ", i);
      }
    });
  }
  /// k: entries of the Jacobian up to each column but the last; K: in each.
  void column_counts(bool cumulative) {
    if (has_columns_ || jacobian_read_ > 0) cursor_.fail("column counts twice or too late");
    has_columns_ = true;
    const int columns = cursor_.integer();
    if (columns != n_ - 1 && !(n_ == 0 && columns == 0))
      cursor_.fail("column counts of another number of variables");
    int before = 0;
    for_lines(n_ - 1, [&](int i) {
      const int count = cursor_.integer(), least = cumulative ? before : 0;
      if (count < least || count > jacobian_entries_ - before + least)
        cursor_.fail("wrong column counts");
      column_[at(i)] = count - least;
      before += count - least;
    });
    if (n_ > 0) column_.back() = jacobian_entries_ - before;
  }
  /// A row of the Jacobian, or the gradient of an objective.
  void linear_terms(bool of_row) {
    const int i = of_row ? index(m_, "constraint") : index(objectives_, "objective");
    mark(of_row ? row_seen_ : gradient_seen_, i, of_row ? "row of the Jacobian" : "gradient");
    const char* const list = of_row ? "a row" : "a gradient";
    const int entries = count(1, n_, of_row ? "entries in a row" : "entries in a gradient");
    ++lists_;
    for_lines(entries, [&](int) {
      const int variable = index(n_, "variable");
      if (of_row && !has_columns_) mark(place_seen_, index(jacobian_entries_, "place"), "place");
      add_linear((of_row ? formulas.constraints : formulas.objectives)[at(i)], variable,
                 cursor_.number());
      if (std::exchange(listed_in_[at(variable)], lists_) == lists_)
        cursor_.fail("variable ", variable, " twice in ", list);
      if (of_row && ++column_read_[at(variable)] > column_[at(variable)] && has_columns_)
        cursor_.fail("more entries of variable ", variable, " than its column count");
    });
    (of_row ? jacobian_read_ : gradient_read_) += entries;
  }
  /// A tree in prefix order, without recursion: trees may be deep.
  void expression(NlFormulas::Formula& formula) {
    std::vector<Operand> pending = {Operand::Value};  // the next one last
    formula.begin = formulas.nodes.size();
    while (!pending.empty()) {
      const Operand kind = pending.back();
      pending.pop_back();
      operand(kind, pending);
    }
    formula.end = formulas.nodes.size();
  }
  /// The number that follows this key; none where the key is of something else.
  std::optional<double> constant(std::optional<char> key) {
    if (key == 'n') return cursor_.number();
    if (key == 'l') return cursor_.integer();
    if (key == 's' && cursor_.binary()) return cursor_.short_integer();
    return std::nullopt;
  }
  void operand(Operand kind, std::vector<Operand>& pending) {
    const auto key = cursor_.key();
    if (kind == Operand::Reference && key != 'v') cursor_.fail("a variable is missing");
    if (const auto value = constant(key)) {
      record(Node::kNumber, 0, *value);
      return cursor_.end_line();
    }
    switch (key.value_or('\0')) {
      case 'v': {
        const int variable = index(n_ + defined_, "variable");
        if (variable >= n_ && defined_seen_[at(variable - n_)] == 0)
          cursor_.fail("variable ", variable, " before its definition");
        record(Node::kVariable, variable);
        return cursor_.end_line();
      }
      case 'h':
        if (kind != Operand::ValueOrString) cursor_.fail("a string where a number is expected");
        record(Node::kFunction, 0);
        return cursor_.skip_string();
      case 'f': {
        const int function = index(functions_, "function");
        if (function_seen_[at(function)] == 0)
          cursor_.fail("function ", function, " before its declaration");
        const int arguments = count(0, 1 << 30, "arguments of a function");
        record(Node::kFunction, arguments);
        pending.insert(pending.end(), at(arguments), Operand::ValueOrString);
        return cursor_.end_line();
      }
      case 'o':
        return operation(pending);
      default:
        break;
    }
    cursor_.fail("a formula ends too early");
  }
  void operation(std::vector<Operand>& pending) {
    const int number = cursor_.integer();
    cursor_.end_line();
    const auto list = [&](int least) {
      const int operands = count(least, 1 << 30, "operands");
      cursor_.end_line();
      return operands;
    };
    const auto take = [&](int operands, Operand kind) {
      record(number, operands);
      pending.insert(pending.end(), at(operands), kind);
    };
    const bool is_known = 0 <= number && at(number) < kForms.size();
    switch (const char form = is_known ? kForms[at(number)] : '-') {
      case '1':
      case '2':
      case '3':
        return take(form - '0', Operand::Value);
      case 'l': {
        constexpr int kNumberOfStrings = 61;
        return take(list(1), number == kNumberOfStrings ? Operand::ValueOrString : Operand::Value);
      }
      case 'L':
        return take(list(3), Operand::Value);
      case 'p':
        record(number, 1);
        return pieces(pending);
      case 's':
        take(2, Operand::ValueOrString);
        return pending.push_back(Operand::Value);
      default:
        break;
    }
    constexpr std::array kSteps = {"div", "precision", "round", "trunc"};
    constexpr int kFirstStep = 55, kLastStep = 58;
    if (kFirstStep <= number && number <= kLastStep)  // the library crashes on their derivatives
      refuse("operation ", kSteps[at(number - kFirstStep)], " has no derivatives");
    cursor_.fail("unknown operation o", number);
  }
  /// Slopes and breakpoints in turn, then the variable.
  void pieces(std::vector<Operand>& pending) {
    for_lines(2 * count(2, 1 << 29, "slopes") - 1, [&](int) {
      if (!constant(cursor_.key())) cursor_.fail("a slope or breakpoint is missing");
    });
    pending.push_back(Operand::Reference);
  }
  void require_complete() {
    if (!has_bounds_ && n_ > 0) cursor_.fail("the file ends without bounds of variables");
    if (m_ > 0 && !has_rows_) cursor_.fail("the file ends without bounds of constraints");
    require_all(constraint_seen_, "constraint");
    require_all(objective_seen_, "objective");
    require_all(defined_seen_, "defined variable");
    const auto require_entries = [&](int counted, int read, const char* of) {
      if (read != counted)
        cursor_.fail("the header counts ", counted, " nonzeros of ", of, ", the file holds ", read);
    };
    require_entries(jacobian_entries_, jacobian_read_, "the Jacobian");
    require_entries(gradient_entries_, gradient_read_, "the objectives");
  }

  [[noreturn]] void refuse(const auto&... why) const {
    throw std::runtime_error(concat("cannot solve ", name_, ": ", why...));
  }
  /// An index below size.
  int index(int size, const char* of) {
    const int value = cursor_.integer();
    if (value < 0 || value >= size) cursor_.fail(of, " ", value, ", but the header counts ", size);
    return value;
  }
  /// A count in [least, most], and not of more things than bytes are left.
  int count(int least, int most, const char* of) {
    const int value = cursor_.integer();
    if (value < least || value > most || at(std::max(value, 0)) > cursor_.left())
      cursor_.fail(value, " ", of);
    return value;
  }
  /// The rest of this line, then so many lines.
  template <class Read>
  void for_lines(int lines, const Read& read) {
    cursor_.end_line();
    for (int i = 0; i < lines; ++i) {
      read(i);
      cursor_.end_line();
    }
  }
  void mark(Marks& marks, int place, const char* what) {
    if (marks[at(place)]++ != 0) cursor_.fail(what, " ", place, " twice");
  }
  void require_all(const Marks& marks, const char* what) const {
    const auto missing = std::ranges::find(marks, 0);
    if (missing != marks.end())
      cursor_.fail("the file ends without ", what, " ", missing - marks.begin());
  }
  static Marks marks(int size) { return Marks(at(size), 0); }

  using Node = NlFormulas::Node;
  void record(int operation, int operands, double number = 0.0) {
    formulas.nodes.push_back({operation, operands, number});
  }
  static void add_linear(NlFormulas::Formula& formula, int variable, double factor) {
    if (factor != 0.0) formula.linear.emplace_back(variable, factor);
  }

  Cursor cursor_;
  const std::string& name_;
  NlFacts facts_;
  int n_ = 0, m_ = 0, objectives_ = 0, defined_ = 0, functions_ = 0;
  int jacobian_entries_ = 0, gradient_entries_ = 0;  ///< the header's
  int jacobian_read_ = 0, gradient_read_ = 0;
  bool has_bounds_ = false, has_rows_ = false, has_columns_ = false;
  Marks constraint_seen_, objective_seen_, defined_seen_, function_seen_, row_seen_, gradient_seen_,
      place_seen_;
  std::vector<int> column_, column_read_;  ///< entries of each column: as segment k says, as read
  std::vector<int> listed_in_;             ///< last row or gradient that lists the variable
  int lists_ = 0;
};

std::string content_of(const std::string& file) {
  std::ifstream input(file, std::ios::binary);
  if (!input) throw std::runtime_error("cannot open " + file + ": " + std::strerror(errno));
  std::string text{std::istreambuf_iterator<char>(input), {}};
  if (input.bad()) throw std::runtime_error("cannot read " + file);
  return text;
}

}  // namespace

NlFacts check_nl_text(const std::string& text, const std::string& name) {
  return Checker(text, name).check();
}

NlFacts check_nl_file(const std::string& file) { return check_nl_text(content_of(file), file); }

NlFormulas read_nl_formulas(const std::string& file) {
  const std::string text = content_of(file);
  Checker checker(text, file);
  static_cast<void>(checker.check());
  return std::move(checker.formulas);
}

std::string with_a_fixed_variable(const std::string& file, const NlFacts& facts) {
  std::string text = content_of(file);
  std::array parts = {facts.bounds, facts.columns};
  std::ranges::sort(parts, std::greater{}, &NlFacts::Part::begin);  // the last one first
  for (const NlFacts::Part& part : parts) text.erase(part.begin, part.end - part.begin);
  const std::size_t count = text.find_first_of("0123456789", text.find_first_of("\r\n"));
  text.replace(count, text.find_first_not_of("0123456789", count) - count, "1");
  if (facts.binary) return text + "b4" + std::string(sizeof(double), '\0');
  return text + (text.ends_with('\n') ? "" : "\n") + "b\n4 0\n";
}

}  // namespace ipminmax
