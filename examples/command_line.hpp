#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

/// The command line of an example: `--name value` options and `--name` flags, read from left to
/// right.
class CommandLine {
 public:
  explicit CommandLine(std::string synopsis) : synopsis_(std::move(synopsis)) {}

  /// An option whose value is handed to read; read throws std::invalid_argument on a bad one.
  void add(std::string name, std::string value, std::string text,
           std::function<void(const std::string&)> read) {
    options_.push_back({std::move(name), std::move(value), std::move(text), std::move(read)});
  }

  /// An option that sets a number.
  template <class T>
  requires std::is_arithmetic_v<T>
  void add(std::string name, T& target, std::string text) {
    add(std::move(name), std::is_integral_v<T> ? "N" : "X", std::move(text),
        [&target](const std::string& value) { target = number<T>(value); });
  }

  void add(std::string name, std::string& target, std::string text) {
    add(std::move(name), "TEXT", std::move(text),
        [&target](const std::string& value) { target = value; });
  }

  /// An option without value.
  void add_flag(std::string name, bool& target, std::string text) {
    add(std::move(name), "", std::move(text), [&target](const std::string&) { target = true; });
  }

  /// False when help was asked for and printed; throws std::invalid_argument on errors.
  [[nodiscard]] bool parse(int argc, char** argv) const {
    for (int i = 1; i < argc; ++i) {
      const std::string name = argv[i];
      if (name == "--help" || name == "-h") {
        print_help();
        return false;
      }
      const Option& option = find(name);
      std::string value;
      if (!option.value.empty()) {
        if (++i == argc) throw std::invalid_argument(name + " needs a value");
        value = argv[i];
      }
      try {
        option.read(value);
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(name + " " + value + ": " + error.what());
      }
    }
    return true;
  }

  /// The whole text as a finite number.
  template <class T>
  static T number(std::string_view text) {
    T result{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result);
    bool good = error == std::errc{} && end == text.data() + text.size();
    if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(result);
    if (!good)
      throw std::invalid_argument(std::is_integral_v<T> ? "not an integer" : "not a number");
    return result;
  }

 private:
  struct Option {
    std::string name, value, text;
    std::function<void(const std::string&)> read;
  };

  [[nodiscard]] const Option& find(const std::string& name) const {
    for (const Option& option : options_)
      if (option.name == name) return option;
    throw std::invalid_argument("unknown option " + name + "; --help lists them");
  }

  void print_help() const {
    std::printf("%s\n\n", synopsis_.c_str());
    for (const Option& option : options_)
      std::printf("  %-28s %s\n", (option.name + " " + option.value).c_str(), option.text.c_str());
  }

  std::string synopsis_;
  std::vector<Option> options_;
};
