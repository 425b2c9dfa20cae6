#include "solution_file.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "core/model/indices.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string_view>
#include <type_traits>

namespace ipminmax {
namespace {

constexpr int kRealSuffix = 4;     ///< kind of a real suffix of variables
constexpr int kProblemSuffix = 3;  ///< kind of an integer suffix of the problem
const std::string kDetailedResult = "minmax_result";

int nonzeros(const std::vector<double>& values) {
  return static_cast<int>(values.size()) - static_cast<int>(std::ranges::count(values, 0.0));
}

/// AMPL's code for an option 3 in second place: a tolerance follows, and the count is two higher.
std::vector<int> counted(const SolutionFile& file) {
  std::vector<int> options = file.options;
  if (!options.empty() && file.bound_tolerance) options[0] += 2;
  return options;
}

/// Bytes of values, one after the other.
class Bytes {
 public:
  Bytes& add(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  template <class Value>
  requires std::is_arithmetic_v<Value> Bytes& add(Value value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  template <class Value>
  Bytes& add(const std::vector<Value>& values) {
    for (const Value& value : values) add(value);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  /// Fortran's unformatted record: its length before and behind.
  Bytes& add_record(const Bytes& record) {
    const auto length = static_cast<std::int32_t>(record.bytes_.size());
    return add(length).add(record.bytes_).add(length);
  }

 private:
  std::string bytes_;
};

}  // namespace

std::string SolutionFile::text() const {
  std::ostringstream out;
  std::istringstream lines(message);
  for (std::string line; std::getline(lines, line);) out << (line.empty() ? " " : line) << '\n';
  out << "\n";  // an empty line ends the message
  if (!options.empty()) {
    out << "Options\n";
    for (const int option : counted(*this)) out << option << '\n';
    out << constraints << '\n' << duals.size() << '\n';
    out << variables << '\n' << primals.size() << '\n';
    if (bound_tolerance) out << text_of(*bound_tolerance) << '\n';
  }
  for (const std::vector<double>* values : {&duals, &primals})
    for (const double value : *values) out << text_of(value) << '\n';
  if (!has_status) return out.str();
  out << "objno " << objective << ' ' << solve_result << '\n';
  for (const Suffix& suffix : variable_suffixes) {
    out << "suffix " << kRealSuffix << ' ' << nonzeros(suffix.values) << ' '
        << suffix.name.size() + 1 << " 0 0\n"
        << suffix.name << '\n';
    for (const auto i : indices(suffix.values))
      if (suffix.values[i] != 0.0) out << i << ' ' << text_of(suffix.values[i]) << '\n';
  }
  if (detailed_result != 0) {
    out << "suffix " << kProblemSuffix << " 1 " << kDetailedResult.size() + 1 << " 0 0\n"
        << kDetailedResult << "\n0 " << detailed_result << '\n';
  }
  return out.str();
}

std::string SolutionFile::binary() const {
  Bytes out;
  out.add_record(Bytes().add("binary"));
  if (!message.empty()) out.add_record(Bytes().add(message));
  out.add_record({});
  if (!options.empty()) {
    Bytes record;
    record.add("Options").add(counted(*this)).add(constraints);
    record.add(static_cast<std::int32_t>(duals.size())).add(variables);
    record.add(static_cast<std::int32_t>(primals.size()));
    if (bound_tolerance) record.add(*bound_tolerance);
    out.add_record(record);
  }
  out.add_record(Bytes().add(duals)).add_record(Bytes().add(primals));
  if (!has_status) return out.bytes();
  out.add_record(Bytes().add(objective).add(solve_result));
  const auto heading = [](int kind, int entries, const std::string& name) {
    const std::string_view with_end(name.c_str(), name.size() + 1);
    Bytes record;
    record.add("\nSuffix\n").add(kind).add(entries);
    return record.add(static_cast<std::int32_t>(with_end.size())).add(0).add(with_end);
  };
  for (const Suffix& suffix : variable_suffixes) {
    Bytes record = heading(kRealSuffix, nonzeros(suffix.values), suffix.name);
    for (const auto i : indices(suffix.values))
      if (suffix.values[i] != 0.0) record.add(static_cast<std::int32_t>(i)).add(suffix.values[i]);
    out.add_record(record);
  }
  if (detailed_result != 0)
    out.add_record(heading(kProblemSuffix, 1, kDetailedResult).add(0).add(detailed_result));
  return out.bytes();
}

}  // namespace ipminmax
