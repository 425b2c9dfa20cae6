#include <ipminmax.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <fuzz/targets.hpp>

namespace ipminmax::testing {
namespace {

constexpr int kMostCalls = 400;  // of callbacks; then they fail

/// Reads numbers from bytes; zeros after the last.
class Bytes {
 public:
  explicit Bytes(const std::string& bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return next_ >= bytes_.size(); }
  [[nodiscard]] int byte() { return empty() ? 0 : static_cast<unsigned char>(bytes_[next_++]); }
  [[nodiscard]] int below(int n) { return byte() % n; }
  [[nodiscard]] double number() {
    static constexpr std::array kSpecial{0.0,
                                         1.0,
                                         -1.0,
                                         1e19,
                                         -1e19,
                                         1e300,
                                         5e-324,
                                         std::numeric_limits<double>::infinity(),
                                         -std::numeric_limits<double>::infinity(),
                                         std::numeric_limits<double>::quiet_NaN()};
    const int b = byte();
    if (b < 10) return kSpecial[static_cast<std::size_t>(b)];
    return (b - 128) / 16.0;
  }
  [[nodiscard]] std::vector<double> numbers(int n) {
    std::vector<double> values(static_cast<std::size_t>(n));
    for (double& value : values) value = number();
    return values;
  }
  [[nodiscard]] std::vector<int> indices(int n, int size) {
    std::vector<int> values(static_cast<std::size_t>(n));
    for (int& value : values) value = below(size + 3) - 1;  // now and then outside
    return values;
  }
  [[nodiscard]] std::string word() {
    std::string text;
    for (int k = below(24); k > 0; --k) text += static_cast<char>(byte());
    return text;
  }

 private:
  const std::string& bytes_;
  std::size_t next_ = 0;
};

/// f, g quadratic with these coefficients; or whatever the bytes say.
struct CModel {
  Bytes bytes;
  int n = 0, m = 0;
  std::vector<int> jacobian_row, jacobian_col, hessian_row, hessian_col;
  IpminmaxProblem problem = nullptr;
  int calls = 0;
  bool wild = false;

  [[nodiscard]] bool goes_on() { return ++calls < kMostCalls; }
  void fill(double* values, int count, const double* x) {
    for (int k = 0; k < count; ++k) {
      const double at = n > 0 ? x[k % n] : 0.0;
      values[k] = wild ? bytes.number() : std::sin(1.0 + k) + (k % 2 == 0 ? at : -at);
    }
  }
};

CModel& model_of(void* data) { return *static_cast<CModel*>(data); }

int eval_f(int, double* x, int, double* f, void* data) {
  CModel& model = model_of(data);
  *f = 0.0;
  for (int i = 0; i < model.n; ++i) *f += (i % 2 == 0 ? 0.5 : -0.5) * x[i] * x[i] + x[i];
  if (model.wild) *f = model.bytes.number();
  return model.goes_on() ? 1 : 0;
}
int eval_grad_f(int n, double* x, int, double* grad, void* data) {
  CModel& model = model_of(data);
  for (int i = 0; i < n; ++i) grad[i] = (i % 2 == 0 ? x[i] : -x[i]) + 1.0;
  if (model.wild) model.fill(grad, n, x);
  return model.goes_on() ? 1 : 0;
}
int eval_g(int, double* x, int, int m, double* g, void* data) {
  model_of(data).fill(g, m, x);
  return model_of(data).goes_on() ? 1 : 0;
}
int eval_jac_g(int, double* x, int, int, int entries, int* row, int* col, double* values,
               void* data) {
  CModel& model = model_of(data);
  if (values != nullptr) {
    model.fill(values, entries, x);
    return model.goes_on() ? 1 : 0;
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(entries); ++k) {
    row[k] = model.jacobian_row[k];
    col[k] = model.jacobian_col[k];
  }
  return 1;
}
int eval_h(int, double* x, int, double, int, double*, int, int entries, int* row, int* col,
           double* values, void* data) {
  CModel& model = model_of(data);
  if (values != nullptr) {
    model.fill(values, entries, x);
    return model.goes_on() ? 1 : 0;
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(entries); ++k) {
    row[k] = model.hessian_row[k];
    col[k] = model.hessian_col[k];
  }
  return 1;
}
int intermediate(int, int, double, double, double, double, double, double, double, double, int,
                 void* data) {
  CModel& model = model_of(data);
  std::vector<double> x(static_cast<std::size_t>(model.n)), g(static_cast<std::size_t>(model.m));
  IpminmaxGetCurrentIterate(model.problem, model.n, x.data(), nullptr, nullptr, model.m, g.data(),
                            nullptr);
  IpminmaxGetCurrentViolations(model.problem, model.n, x.data(), nullptr, nullptr, nullptr, nullptr,
                               model.m, g.data(), nullptr);
  return model.goes_on() ? 1 : 0;
}

/// Whatever may be called between solves.
void call_something(CModel& model, std::vector<double>& x) {
  Bytes& bytes = model.bytes;
  const IpminmaxProblem problem = model.problem;
  switch (bytes.below(9)) {
    case 0:
      IpminmaxAddNumOption(problem, bytes.word().c_str(), bytes.number());
      break;
    case 1:
      IpminmaxAddIntOption(problem, bytes.word().c_str(), bytes.byte() - 3);
      break;
    case 2: {
      const std::string name = bytes.word();
      if (name.find("file") == std::string::npos) {  // nothing is written
        IpminmaxAddStrOption(problem, name.c_str(), bytes.word().c_str());
      }
      break;
    }
    case 3: {
      const std::vector<double> of_x = bytes.numbers(model.n), of_g = bytes.numbers(model.m);
      IpminmaxSetScaling(problem, bytes.number(), of_x.data(), of_g.data());
      break;
    }
    case 4: {
      const std::vector<double> lower = bytes.numbers(model.n), upper = bytes.numbers(model.n);
      IpminmaxSetBounds(problem, lower.data(), upper.data(), nullptr, nullptr);
      break;
    }
    case 5:
      IpminmaxSolveAgain(problem, x.data(), nullptr, nullptr, nullptr, nullptr, nullptr, &model);
      break;
    case 6: {
      IpminmaxCertificate certificate{};
      IpminmaxStatistics statistics{};
      IpminmaxGetCertificate(problem, &certificate);
      IpminmaxGetStatistics(problem, &statistics);
      break;
    }
    case 7:
      IpminmaxUpdateSensitivity(problem);
      break;
    default:
      x = bytes.numbers(model.n);
  }
}

}  // namespace

void fuzz_c(const std::string& data) {
  CModel model{.bytes = Bytes(data),
               .jacobian_row = {},
               .jacobian_col = {},
               .hessian_row = {},
               .hessian_col = {}};
  Bytes& bytes = model.bytes;
  model.n = bytes.below(5);
  model.m = bytes.below(4);
  model.wild = bytes.below(4) == 0;
  const int jacobian = bytes.below(9), hessian = bytes.below(9);
  const std::vector<double> lower = bytes.numbers(model.n), upper = bytes.numbers(model.n);
  const std::vector<double> g_lower = bytes.numbers(model.m), g_upper = bytes.numbers(model.m);
  model.jacobian_row = bytes.indices(jacobian, model.m);
  model.jacobian_col = bytes.indices(jacobian, model.n);
  model.hessian_row = bytes.indices(hessian, model.n);
  model.hessian_col = bytes.indices(hessian, model.n);
  const std::vector<int> owners = bytes.indices(model.n, 1), rows = bytes.indices(model.m, 1);
  model.problem =
      IpminmaxCreate(model.n, lower.data(), upper.data(), model.m, g_lower.data(), g_upper.data(),
                     jacobian, hessian, IPMINMAX_C_STYLE, eval_f, eval_g, eval_grad_f, eval_jac_g,
                     bytes.below(3) == 0 ? nullptr : eval_h, owners.data(),
                     bytes.below(2) == 0 ? nullptr : rows.data());
  if (model.problem == nullptr) return;
  IpminmaxAddIntOption(model.problem, "print_level", 0);
  IpminmaxAddStrOption(model.problem, "option_file_name", "");
  IpminmaxAddIntOption(model.problem, "max_iter", 20);
  IpminmaxAddNumOption(model.problem, "max_wall_time", 2.0);
  IpminmaxSetIntermediateCallback(model.problem, intermediate);
  std::vector<double> x = bytes.numbers(model.n);
  for (int k = bytes.below(4); k > 0; --k) call_something(model, x);
  IpminmaxSolve(model.problem, x.data(), nullptr, nullptr, nullptr, nullptr, nullptr, &model);
  if (IpminmaxMessage(model.problem) == nullptr) std::abort();
  for (int k = bytes.below(6); k > 0; --k) call_something(model, x);
  IpminmaxFree(model.problem);
}

}  // namespace ipminmax::testing
