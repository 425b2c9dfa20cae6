#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

/// Pictures of curves and points as SVG files, panels side by side; needs no other program.
namespace svg {

using Point = std::array<double, 2>;

enum class Mark { Line, LineAndDots, Dots, Circles, Squares };

/// Points that are drawn alike. A label appears in the panel's legend.
struct Series {
  std::vector<Point> points{};
  Mark mark = Mark::Line;
  std::string color = "#3050c0";
  std::string label{};
  double size = 2.0;  ///< of dots, circles and squares in pixels
};

/// Half width 0: the window holds all points.
struct Panel {
  std::string title{}, subtitle{};
  std::vector<Series> series{};
  bool same_scale = true;  ///< on both axes
  bool downwards = false;  ///< y grows downwards, as the rows of a matrix
  Point center{0.0, 0.0};
  double half_width = 0.0;
};

namespace detail {

constexpr double kPlot = 330.0;
constexpr double kLeft = 58.0;
constexpr double kTop = 52.0;
constexpr double kBottom = 74.0;
constexpr double kWidth = kLeft + kPlot + 22.0;
constexpr double kHeight = kTop + kPlot + kBottom;

inline std::string number(double value, int digits = 1) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  std::string result = text;
  if (digits > 0) {
    while (result.back() == '0') result.pop_back();
    if (result.back() == '.') result.pop_back();
  }
  return result == "-0" ? "0" : result;
}

inline std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

/// From the problem's coordinates to the picture's.
struct Window {
  double left = 0.0, right = 1.0, low = 0.0, high = 1.0;
  bool downwards = false;
  double origin = 0.0;  ///< left edge of the panel

  [[nodiscard]] double x(double value) const {
    return origin + kLeft + kPlot * (value - left) / (right - left);
  }
  [[nodiscard]] double y(double value) const {
    const double share = (value - low) / (high - low);
    return kTop + kPlot * (downwards ? share : 1.0 - share);
  }
  [[nodiscard]] bool holds(const Point& p) const {
    return p[0] >= left && p[0] <= right && p[1] >= low && p[1] <= high;
  }
};

inline Window window_of(const Panel& panel, double origin) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Window w{kInfinity, -kInfinity, kInfinity, -kInfinity, panel.downwards, origin};
  for (const Series& series : panel.series) {
    for (const auto& [x, y] : series.points) {
      w.left = std::min(w.left, x);
      w.right = std::max(w.right, x);
      w.low = std::min(w.low, y);
      w.high = std::max(w.high, y);
    }
  }
  if (!(w.left <= w.right)) w.left = w.low = 0.0, w.right = w.high = 1.0;
  const auto widen = [](double& low, double& high, double half) {
    const double middle = 0.5 * (low + high);
    low = middle - half;
    high = middle + half;
  };
  double half_x = std::max(0.53 * (w.right - w.left), 1e-9);
  double half_y = std::max(0.53 * (w.high - w.low), 1e-9);
  if (panel.same_scale) half_x = half_y = std::max(half_x, half_y);
  widen(w.left, w.right, half_x);
  widen(w.low, w.high, half_y);
  if (panel.half_width > 0.0) {
    w.left = panel.center[0] - panel.half_width;
    w.right = panel.center[0] + panel.half_width;
    w.low = panel.center[1] - panel.half_width;
    w.high = panel.center[1] + panel.half_width;
  }
  return w;
}

inline std::string text_at(double x, double y, const std::string& text, const char* anchor,
                           int size = 12) {
  return "<text x='" + number(x) + "' y='" + number(y) + "' text-anchor='" + anchor +
         "' font-size='" + std::to_string(size) + "'>" + escaped(text) + "</text>\n";
}

/// About five round numbers between low and high.
inline std::vector<double> ticks(double low, double high) {
  const double rough = (high - low) / 5.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double share = rough / power;
  const double stride = power * (share < 1.5 ? 1.0 : share < 3.5 ? 2.0 : share < 7.5 ? 5.0 : 10.0);
  std::vector<double> values;
  for (double value = std::ceil(low / stride) * stride; value <= high; value += stride)
    values.push_back(std::abs(value) < 1e-9 * stride ? 0.0 : value);
  return values;
}

inline std::string axes(const Window& w) {
  std::string out = "<g stroke='#dddddd'>\n", labels;
  const auto text = [](double value, double width) {
    const int digits = static_cast<int>(std::clamp(2.0 - std::floor(std::log10(width)), 0.0, 6.0));
    return number(value, digits);
  };
  for (const double value : ticks(w.left, w.right)) {
    const std::string x = number(w.x(value));
    out += "<path d='M" + x + ' ' + number(kTop) + "v" + number(kPlot) + "'/>\n";
    labels += text_at(w.x(value), kTop + kPlot + 16.0, text(value, w.right - w.left), "middle", 11);
  }
  for (const double value : ticks(w.low, w.high)) {
    const std::string y = number(w.y(value));
    out += "<path d='M" + number(w.origin + kLeft) + ' ' + y + "h" + number(kPlot) + "'/>\n";
    labels +=
        text_at(w.origin + kLeft - 6.0, w.y(value) + 4.0, text(value, w.high - w.low), "end", 11);
  }
  return out + "</g>\n" + labels + "<rect x='" + number(w.origin + kLeft) + "' y='" + number(kTop) +
         "' width='" + number(kPlot) + "' height='" + number(kPlot) +
         "' fill='none' stroke='#888888'/>\n";
}

/// Curves are cut off by the panel's clip path, marks outside are left out.
inline std::string drawn(const Series& series, const Window& w, const std::string& clip) {
  std::string out;
  const bool line = series.mark == Mark::Line || series.mark == Mark::LineAndDots;
  if (line && series.points.size() > 1) {
    out += "<path clip-path='url(#" + clip + ")' fill='none' stroke='" + series.color +
           "' stroke-width='1.3' d='";
    char command = 'M';
    for (const Point& p : series.points) {
      // Far outside it is enough to know in which direction.
      const double limit = 20.0 * kPlot;
      out += command + number(std::clamp(w.x(p[0]), -limit, limit)) + ' ' +
             number(std::clamp(w.y(p[1]), -limit, limit));
      command = 'L';
    }
    out += "'/>\n";
  }
  if (series.mark == Mark::Line) return out;
  if (series.mark == Mark::Squares) {
    const std::string s = number(series.size, 2);
    out += "<path fill='" + series.color + "' d='";
    for (const Point& p : series.points) {
      if (!w.holds(p)) continue;
      out += 'M' + number(w.x(p[0]) - 0.5 * series.size) + ' ' +
             number(w.y(p[1]) - 0.5 * series.size) + 'h' + s + 'v' + s + "h-" + s + 'z';
    }
    return out + "'/>\n";
  }
  const bool open = series.mark == Mark::Circles;
  out +=
      "<g fill='" + (open ? std::string("none' stroke='") + series.color : series.color) + "'>\n";
  for (const Point& p : series.points) {
    if (!w.holds(p)) continue;
    out += "<circle cx='" + number(w.x(p[0])) + "' cy='" + number(w.y(p[1])) + "' r='" +
           number(series.size) + "'/>\n";
  }
  return out + "</g>\n";
}

inline std::string legend(const Panel& panel, const Window& w) {
  std::string out;
  double x = w.origin + kLeft;
  for (const Series& series : panel.series) {
    if (series.label.empty()) continue;
    const double y = kTop + kPlot + 40.0;
    out += "<circle cx='" + number(x + 5.0) + "' cy='" + number(y - 4.0) + "' r='4' " +
           (series.mark == Mark::Circles ? "fill='none' stroke='" : "fill='") + series.color +
           "'/>\n" + text_at(x + 14.0, y, series.label, "start");
    x += 28.0 + 6.7 * static_cast<double>(series.label.size());
  }
  return out;
}

}  // namespace detail

/// Throws std::runtime_error when the file cannot be written.
inline void write(const std::vector<Panel>& panels, const std::filesystem::path& file) {
  using namespace detail;
  const double width = kWidth * static_cast<double>(panels.size());
  std::ofstream out(file);
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='" << number(width) << "' height='"
      << number(kHeight) << "' font-family='sans-serif'>\n<rect width='100%' height='100%' "
      << "fill='white'/>\n";
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const Window w = window_of(panels[k], kWidth * static_cast<double>(k));
    const std::string clip = "panel" + std::to_string(k);
    out << "<clipPath id='" << clip << "'><rect x='" << number(w.origin + kLeft) << "' y='"
        << number(kTop) << "' width='" << number(kPlot) << "' height='" << number(kPlot)
        << "'/></clipPath>\n"
        << axes(w);
    const double middle = w.origin + kLeft + 0.5 * kPlot;
    out << text_at(middle, 22.0, panels[k].title, "middle", 14)
        << text_at(middle, 41.0, panels[k].subtitle, "middle");
    for (const Series& series : panels[k].series) out << drawn(series, w, clip);
    out << legend(panels[k], w);
  }
  out << "</svg>\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
  std::printf("wrote %s\n", file.string().c_str());
}

}  // namespace svg
