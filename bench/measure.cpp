#include "measure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

namespace bench {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class... Arguments>
std::string format(const char* pattern, Arguments... arguments) {
  std::array<char, 128> buffer{};
  std::snprintf(buffer.data(), buffer.size(), pattern, arguments...);
  return buffer.data();
}

std::string full(double value) { return std::isfinite(value) ? format("%.17g", value) : "nan"; }

std::string short_number(double value, int digits) {
  return std::isfinite(value) ? format("%.*g", digits, value) : "-";
}

struct Unit {
  double factor;
  const char* name;
};

Unit unit_of(double seconds) {
  if (seconds < 1e-3) return {1e6, "us"};
  return seconds < 1.0 ? Unit{1e3, "ms"} : Unit{1.0, "s"};
}

}  // namespace

Spread spread(std::vector<double> values) {
  if (values.empty()) return {kNaN, kNaN, kNaN};
  std::ranges::sort(values);
  const auto quantile = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], place - static_cast<double>(below));
  };
  return {quantile(0.25), quantile(0.5), quantile(0.75)};
}

Spread spread_of_ratios(std::span<const double> a, std::span<const double> b) {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) ratios.push_back(a[k] / b[k]);
  return spread(std::move(ratios));
}

double geometric_mean(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += std::log(value);
  return values.empty() ? kNaN : std::exp(sum / static_cast<double>(values.size()));
}

double fitted_exponent(std::span<const double> x, std::span<const double> y) {
  const std::size_t n = std::min(x.size(), y.size());
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double u = std::log(x[k]), v = std::log(y[k]);
    sx += u;
    sy += v;
    sxx += u * u;
    sxy += u * v;
  }
  const auto count = static_cast<double>(n);
  return n < 2 ? kNaN : (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

std::vector<std::vector<double>> alternate(const Effort& effort,
                                           std::span<const std::function<double()>> contestants) {
  std::vector<std::vector<double>> times(contestants.size());
  if (effort.warm_up) {
    for (const auto& contestant : contestants) (void)contestant();
  }
  const Clock clock;
  for (int round = 0; round < effort.max_rounds; ++round) {
    if (round >= effort.min_rounds && clock.seconds() >= effort.seconds) break;
    for (std::size_t k = 0; k < contestants.size(); ++k) {
      const std::size_t turn = round % 2 == 0 ? k : contestants.size() - 1 - k;
      times[turn].push_back(contestants[turn]());
    }
  }
  return times;
}

Table::Table(std::vector<std::string> columns)
    : columns_(std::move(columns)), spreads_(columns_.size(), false) {}

void Table::add(Cell cell) {
  if (rows_.empty() || rows_.back().size() == columns_.size()) {
    throw std::logic_error("a table row has more cells than columns");
  }
  if (cell.csv.size() == 3) spreads_[rows_.back().size()] = true;
  rows_.back().push_back(std::move(cell));
}

Table& Table::row() {
  rows_.emplace_back();
  return *this;
}

Table& Table::text(const std::string& value) {
  add({value, {'"' + value + '"'}, true});
  return *this;
}

Table& Table::integer(std::int64_t value) {
  add({std::to_string(value), {std::to_string(value)}});
  return *this;
}

Table& Table::number(double value, int digits) {
  add({short_number(value, digits), {full(value)}});
  return *this;
}

Table& Table::percent(double share) {
  add({std::isfinite(share) ? format("%.0f %%", 100.0 * share) : "-", {full(share)}});
  return *this;
}

Table& Table::time(double seconds) {
  const Unit unit = unit_of(seconds);
  add({std::isfinite(seconds) ? short_number(seconds * unit.factor, 3) + " " + unit.name : "-",
       {full(seconds)}});
  return *this;
}

Table& Table::time(const Spread& seconds) {
  const Unit unit = unit_of(seconds.median);
  const auto shown = [&](double value) { return short_number(value * unit.factor, 3); };
  add({std::isfinite(seconds.median) ? shown(seconds.median) + " [" + shown(seconds.lower) + ", " +
                                           shown(seconds.upper) + "] " + unit.name
                                     : "-",
       {full(seconds.lower), full(seconds.median), full(seconds.upper)}});
  return *this;
}

Table& Table::number(const Spread& value, int digits) {
  const auto shown = [&](double v) { return short_number(v, digits); };
  add({std::isfinite(value.median)
           ? shown(value.median) + " [" + shown(value.lower) + ", " + shown(value.upper) + "]"
           : "-",
       {full(value.lower), full(value.median), full(value.upper)}});
  return *this;
}

Table& Table::none() {
  add({"-", {""}});
  return *this;
}

void Table::print() const {
  std::vector<std::size_t> widths;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    std::size_t width = columns_[k].size();
    for (const auto& row : rows_) {
      if (k < row.size()) width = std::max(width, row[k].shown.size());
    }
    widths.push_back(width);
  }
  const auto put = [&](std::size_t k, const std::string& value, bool left) {
    const int width = static_cast<int>(widths[k]);
    std::printf(left ? "%s%-*s" : "%s%*s", k == 0 ? "" : "  ", width, value.c_str());
  };
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const bool left = !rows_.empty() && k < rows_.front().size() && rows_.front()[k].left;
    put(k, columns_[k], left);
  }
  std::printf("\n");
  for (const auto& row : rows_) {
    for (std::size_t k = 0; k < row.size(); ++k) put(k, row[k].shown, row[k].left);
    std::printf("\n");
  }
}

void Table::write_csv(const std::filesystem::path& file) const {
  std::ofstream out(file);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    if (k > 0) out << ',';
    if (spreads_[k]) {
      out << '"' << columns_[k] << " q1\",\"" << columns_[k] << "\",\"" << columns_[k] << " q3\"";
    } else {
      out << '"' << columns_[k] << '"';
    }
  }
  out << '\n';
  for (const auto& row : rows_) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k > 0) out << ',';
      const std::vector<std::string>& values = row[k].csv;
      if (spreads_[k] && values.size() != 3) {  // only the median is known
        out << ',' << values.front() << ',';
      } else {
        for (std::size_t i = 0; i < values.size(); ++i) out << (i > 0 ? "," : "") << values[i];
      }
    }
    out << '\n';
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

void publish(const Table& table, const std::string& title, const std::string& name,
             const Settings& settings) {
  std::printf("\n%s\n\n", title.c_str());
  table.print();
  std::fflush(stdout);
  if (settings.csv.empty()) return;
  std::filesystem::create_directories(settings.csv);
  table.write_csv(settings.csv / (name + ".csv"));
}

std::vector<std::string> loaded_numerical_libraries() {
  std::ifstream maps("/proc/self/maps");
  std::set<std::string> libraries;
  for (std::string line; std::getline(maps, line);) {
    const std::size_t path = line.find('/');
    if (path == std::string::npos) continue;
    for (const char* name : {"libopenblas", "libblas", "liblapack", "libdmumps", "libipopt"}) {
      if (line.find(name, path) != std::string::npos) libraries.insert(line.substr(path));
    }
  }
  return {libraries.begin(), libraries.end()};
}

void print_environment() {
  std::ifstream cpu_info("/proc/cpuinfo");
  for (std::string line; std::getline(cpu_info, line);) {
    if (!line.starts_with("model name")) continue;
    std::printf("%s\n", line.substr(line.find(':') + 2).c_str());
    break;
  }
  for (const std::string& library : loaded_numerical_libraries()) {
    std::printf("  %s\n", library.c_str());
  }
  const char* threads = std::getenv("OPENBLAS_NUM_THREADS");
  std::printf("  OPENBLAS_NUM_THREADS %s\n", threads != nullptr ? threads : "not set");
}

}  // namespace bench
