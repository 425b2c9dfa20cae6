#pragma once

#include <algorithm>
#include <cstdint>
#include <iosfwd>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adapter/ipopt/option_registry.hpp"

namespace ipminmax {

constexpr const char* kEnvironment = "ipminmax_options";

/// Where options come from, later ones win.
enum class Source : std::uint8_t { File, Environment, CommandLine };

/// The options that were given, with their texts.
class Assignments {
 public:
  void add(const std::string& name, const std::string& value, Source source) {
    given_[name].push_back({source, value});
  }
  /// An argument name=value, the value perhaps in quotes.
  void add_argument(const std::string& text);
  /// Assignments separated by blanks: name=value or name value, a value with blanks in quotes.
  void add_environment(const std::string& text);
  void name_file(std::string name) { file_ = std::move(name); }

  /// The text that counts, none when the option was not given.
  [[nodiscard]] std::optional<std::string> value(const std::string& name) const {
    const auto found = given_.find(name);
    return found == given_.end() ? std::nullopt : std::optional(winner(found->second).value);
  }
  /// Takes a text out of the assignments, empty when not given.
  std::string take(const std::string& name) {
    std::string text = value(name).value_or("");
    given_.erase(name);
    return text;
  }
  /// Takes an integer in [lower, upper] out of the assignments; missing: the value when not given.
  int take_integer(const std::string& name, int missing, int lower, int upper);
  /// Takes yes or no out of the assignments; no when not given.
  bool take_flag(const std::string& name);
  /// Gives an option its name: what was assigned to alias was assigned to name.
  void rename(const std::string& alias, const std::string& name) {
    const auto given = given_.extract(alias);
    if (!given.empty()) std::ranges::move(given.mapped(), std::back_inserter(given_[name]));
  }

  /// Says which values are overridden by another one.
  void report_overridden(std::ostream& out) const;

  /// Calls visit(name, value, place) for each option.
  template <class Visit>
  void for_each(Visit visit) const {
    for (const auto& [name, all] : given_) {
      visit(name, winner(all).value, place(winner(all).source));
    }
  }

 private:
  struct Given {
    Source source;
    std::string value;
  };
  static const Given& winner(const std::vector<Given>& all) {
    // The last of the highest.
    return *std::ranges::max_element(all.rbegin(), all.rend(), {}, &Given::source);
  }
  [[nodiscard]] std::string place(Source source) const {
    if (source == Source::File) return file_;
    return source == Source::Environment ? kEnvironment : "the command line";
  }

  std::map<std::string, std::vector<Given>> given_;
  std::string file_;
};

/// Adds what the options file sets: ipminmax.opt when there is one, or the one that
/// option_file_name names, which must be there.
void add_file(RegisteredOptions& registry, Assignments& assignments);

}  // namespace ipminmax
