#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <ipminmax.h>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"

/// The doors of the library besides the core's: Ipopt's interface and C, each in front of a
/// Problem.
namespace ipminmax::testing {

/// Calls set(name, value) for every option that is not at its default, value a double, an int or
/// a string.
template <class Set>
void for_each_option(const SolverOptions& options, Set set) {
  const SolverOptions defaults;
  for (const OptionInfo& info : option_table()) {
    const std::string name(info.name);
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      const double value = options.*number->member;
      if (value != defaults.*number->member) set(name, value);
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      const int value = options.*integer->member;
      if (value != defaults.*integer->member) set(name, value);
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      const bool value = options.*flag->member;
      if (value != defaults.*flag->member) set(name, std::string(value ? "yes" : "no"));
    } else if (const auto* choice = std::get_if<OptionInfo::Choice>(&info.kind)) {
      const std::size_t value = choice->get(options);
      if (value != choice->get(defaults)) set(name, std::string(choice->names[value]));
    }
  }
}

inline bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
inline bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return same(x, y); });
}

// --- Ipopt's interface ---------------------------------------------------------------------------

/// A model that asks a function in every iteration whether to go on.
class DoorTnlp final : public ProblemTnlp {
 public:
  DoorTnlp(Problem& problem, std::function<bool()> goes_on)
      : ProblemTnlp(problem), goes_on_(std::move(goes_on)) {}
  bool intermediate_callback(Ipopt::AlgorithmMode, Ipopt::Index, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    return goes_on_();
  }
  void finalize_solution(Ipopt::SolverReturn status, Ipopt::Index n, const Ipopt::Number* x,
                         const Ipopt::Number* z_L, const Ipopt::Number* z_U, Ipopt::Index m,
                         const Ipopt::Number* g, const Ipopt::Number* lambda,
                         Ipopt::Number obj_value, const Ipopt::IpoptData* ip_data,
                         Ipopt::IpoptCalculatedQuantities* ip_cq) override {
    ++finalized_;
    ProblemTnlp::finalize_solution(status, n, x, z_L, z_U, m, g, lambda, obj_value, ip_data, ip_cq);
  }
  [[nodiscard]] int finalized() const { return finalized_; }

 private:
  std::function<bool()> goes_on_;
  int finalized_ = 0;
};

inline std::vector<Ipopt::Index> indices_of_max(const std::vector<Player>& players) {
  std::vector<Ipopt::Index> indices;
  for (std::size_t i = 0; i < players.size(); ++i) {
    if (players[i] == Player::Max) indices.push_back(static_cast<Ipopt::Index>(i));
  }
  return indices;
}

inline Ipopt::SmartPtr<Ipopt::TNLP> split(const Ipopt::SmartPtr<DoorTnlp>& model,
                                          const ProblemStructure& s) {
  return new SplitTNLP(GetRawPtr(model), indices_of_max(s.variable_players),
                       indices_of_max(s.constraint_players));
}

/// An application without console and options file. Options may contradict each other: what is
/// refused is refused by the solve as well.
inline Ipopt::SmartPtr<MinMaxApplication> application_with(const SolverOptions& options) {
  const Ipopt::SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
  for_each_option(options, [&](const std::string& name, const auto& value) {
    Ipopt::OptionsList& list = *application->Options();
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, double>) {
      EXPECT_TRUE(list.SetNumericValue(name, value)) << name;
    } else if constexpr (std::is_same_v<Value, int>) {
      EXPECT_TRUE(list.SetIntegerValue(name, value)) << name;
    } else {
      EXPECT_TRUE(list.SetStringValue(name, value)) << name;
    }
  });
  static_cast<void>(application->Initialize(""));
  return application;
}

// --- C -------------------------------------------------------------------------------------------

/// A problem in C with what its callbacks are given.
class CDoor {
 public:
  CDoor(Problem& problem, const SolverOptions& options, std::function<bool()> goes_on)
      : problem_(problem), goes_on_(std::move(goes_on)) {
    const ProblemStructure& s = problem.structure();
    const auto n = static_cast<int>(s.variable_players.size());
    const auto m = static_cast<int>(s.constraint_players.size());
    const std::vector<int> variable_players = players(s.variable_players);
    const std::vector<int> constraint_players = players(s.constraint_players);
    c_ = IpminmaxCreate(n, s.variable_lower.data(), s.variable_upper.data(), m,
                        m > 0 ? s.constraint_lower.data() : nullptr,
                        m > 0 ? s.constraint_upper.data() : nullptr,
                        static_cast<int>(s.jacobian.size()), static_cast<int>(s.hessian.size()),
                        IPMINMAX_C_STYLE, eval_f, eval_g, eval_grad_f, eval_jac_g, eval_h,
                        variable_players.data(), m > 0 ? constraint_players.data() : nullptr);
    if (c_ == nullptr) return;
    IpminmaxAddIntOption(c_, "print_level", 0);
    IpminmaxAddStrOption(c_, "option_file_name", "");
    for_each_option(options, [&](const std::string& name, const auto& value) {
      using Value = std::decay_t<decltype(value)>;
      if constexpr (std::is_same_v<Value, double>) {
        EXPECT_EQ(IpminmaxAddNumOption(c_, name.c_str(), value), 1) << name;
      } else if constexpr (std::is_same_v<Value, int>) {
        EXPECT_EQ(IpminmaxAddIntOption(c_, name.c_str(), value), 1) << name;
      } else {
        EXPECT_EQ(IpminmaxAddStrOption(c_, name.c_str(), value.c_str()), 1) << name;
      }
    });
    IpminmaxSetIntermediateCallback(c_, intermediate);
  }
  ~CDoor() {
    if (c_ != nullptr) IpminmaxFree(c_);
  }
  CDoor(const CDoor&) = delete;
  CDoor& operator=(const CDoor&) = delete;

  /// Null when it was refused.
  [[nodiscard]] IpminmaxProblem get() const { return c_; }

  struct Answer {
    IpminmaxReturnStatus status = IPMINMAX_INTERNAL_ERROR;
    std::vector<double> x, g, lambda, z_lower, z_upper;
    double f = 7.0;
  };
  [[nodiscard]] Answer solve(const std::vector<double>& start) {
    Answer a;
    a.x = start;
    a.g.resize(problem_.structure().constraint_players.size());
    a.lambda.resize(a.g.size());
    a.z_lower.resize(a.x.size());
    a.z_upper.resize(a.x.size());
    a.status = IpminmaxSolve(c_, a.x.data(), a.g.data(), &a.f, a.lambda.data(), a.z_lower.data(),
                             a.z_upper.data(), this);
    return a;
  }

 private:
  static std::vector<int> players(const std::vector<Player>& owners) {
    std::vector<int> numbers;
    for (const Player owner : owners) {
      numbers.push_back(owner == Player::Max ? IPMINMAX_MAX : IPMINMAX_MIN);
    }
    return numbers;
  }
  static std::span<double> array(double* values, int size) {
    return {values, static_cast<std::size_t>(size)};
  }
  static CDoor& door(void* data) { return *static_cast<CDoor*>(data); }
  static int structure(const std::vector<Triplet>& entries, int* row, int* col) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      row[k] = static_cast<int>(entries[k].row);
      col[k] = static_cast<int>(entries[k].col);
    }
    return 1;
  }
  static int eval_f(int n, double* x, int new_x, double* f, void* data) {
    return door(data).problem_.objective(array(x, n), new_x != 0, *f) ? 1 : 0;
  }
  static int eval_grad_f(int n, double* x, int new_x, double* grad, void* data) {
    return door(data).problem_.gradient(array(x, n), new_x != 0, array(grad, n)) ? 1 : 0;
  }
  static int eval_g(int n, double* x, int new_x, int m, double* g, void* data) {
    return door(data).problem_.constraints(array(x, n), new_x != 0, array(g, m)) ? 1 : 0;
  }
  static int eval_jac_g(int n, double* x, int new_x, int, int entries, int* row, int* col,
                        double* values, void* data) {
    Problem& problem = door(data).problem_;
    if (values == nullptr) return structure(problem.structure().jacobian, row, col);
    return problem.jacobian(array(x, n), new_x != 0, array(values, entries)) ? 1 : 0;
  }
  static int eval_h(int n, double* x, int new_x, double sigma, int m, double* lambda,
                    int new_lambda, int entries, int* row, int* col, double* values, void* data) {
    Problem& problem = door(data).problem_;
    if (values == nullptr) return structure(problem.structure().hessian, row, col);
    return problem.hessian(array(x, n), new_x != 0, sigma, array(lambda, m), new_lambda != 0,
                           array(values, entries))
               ? 1
               : 0;
  }
  static int intermediate(int, int, double, double, double, double, double, double, double, double,
                          int, void* data) {
    return door(data).goes_on_() ? 1 : 0;
  }

  Problem& problem_;
  std::function<bool()> goes_on_;
  IpminmaxProblem c_ = nullptr;
};

}  // namespace ipminmax::testing
