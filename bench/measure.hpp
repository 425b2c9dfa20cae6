#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

/// Timing, statistics and tables of the benchmark programs.
namespace bench {

/// Wall seconds since construction.
class Clock {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// CPU seconds of the process since construction: for limits, which a busy machine must not change.
class CpuClock {
 public:
  [[nodiscard]] double seconds() const {
    return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC;
  }

 private:
  std::clock_t start_ = std::clock();
};

/// Median and quartiles, by linear interpolation; NaN when there are no values.
struct Spread {
  double lower = 0.0, median = 0.0, upper = 0.0;
};
[[nodiscard]] Spread spread(std::vector<double> values);

/// spread(a[k] / b[k]).
[[nodiscard]] Spread spread_of_ratios(std::span<const double> a, std::span<const double> b);

[[nodiscard]] double geometric_mean(std::span<const double> values);

/// Least-squares exponent p of y ~ x^p; NaN for fewer than two points.
[[nodiscard]] double fitted_exponent(std::span<const double> x, std::span<const double> y);

/// How often something is repeated: at least min_rounds, at most max_rounds, no new round after
/// `seconds`.
struct Effort {
  double seconds = 2.0;
  int min_rounds = 3;
  int max_rounds = 31;
  bool warm_up = true;  ///< an untimed round first; of no use to child processes
};

/// Calls the contestants in turn, round after round, so that a change of the machine's speed meets
/// all of them; every second round goes backwards. A contestant returns the seconds it took.
/// result[contestant][round].
[[nodiscard]] std::vector<std::vector<double>> alternate(
    const Effort& effort, std::span<const std::function<double()>> contestants);

/// A table that is printed in aligned columns and written as CSV. Numbers in the CSV have all
/// digits, times are in seconds and spreads take three columns.
class Table {
 public:
  explicit Table(std::vector<std::string> columns);

  Table& row();                                 ///< begins a row
  Table& text(const std::string& value);        ///< left-aligned
  Table& integer(std::int64_t value);           ///< right-aligned
  Table& number(double value, int digits = 3);  ///< significant digits
  Table& time(double seconds);                  ///< as s, ms or us
  Table& percent(double share);                 ///< of 1
  Table& time(const Spread& seconds);           ///< median [quartiles]
  Table& number(const Spread& value, int digits = 3);
  Table& none();  ///< not available

  void print() const;
  /// Throws std::runtime_error when the file cannot be written.
  void write_csv(const std::filesystem::path& file) const;

 private:
  struct Cell {
    std::string shown;
    std::vector<std::string> csv;
    bool left = false;
  };
  void add(Cell cell);

  std::vector<std::string> columns_;
  std::vector<bool> spreads_;  ///< columns that hold a Spread
  std::vector<std::vector<Cell>> rows_;
};

/// What every program takes.
struct Settings {
  double seconds = 20.0;      ///< about, for the whole program
  std::filesystem::path csv;  ///< empty: none written
};

/// Prints the table under its title and writes it to <csv>/<name>.csv when asked for.
void publish(const Table& table, const std::string& title, const std::string& name,
             const Settings& settings);

/// One line per BLAS, LAPACK, MUMPS and Ipopt library that the process has loaded.
[[nodiscard]] std::vector<std::string> loaded_numerical_libraries();
/// Those lines, the CPU and the BLAS threads.
void print_environment();

}  // namespace bench
