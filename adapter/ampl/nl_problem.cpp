#include "nl_problem.hpp"

#include <setjmp.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/spelling.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "checked_file.hpp"
#include "child_process.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"
#include "linalg/uncopied.hpp"
#include "nl_formulas.hpp"

#include <asl_pfgh.h>
#include <getstub.h>
#undef filename

namespace ipminmax {
namespace {

char player_name[] = "player", robust_name[] = "robust";
char sosno_name[] = "sosno", sos_name[] = "sos";
char scaling_name[] = "scaling_factor";
char lower_name[] = "ipopt_zL_in", upper_name[] = "ipopt_zU_in";
constexpr int kRealOfVariables = ASL_Sufkind_var | ASL_Sufkind_real;
SufDecl suffixes[] = {{player_name, nullptr, ASL_Sufkind_var, 0},
                      {player_name, nullptr, ASL_Sufkind_con, 0},
                      {robust_name, nullptr, ASL_Sufkind_con, 0},
                      {scaling_name, nullptr, kRealOfVariables, 0},
                      {scaling_name, nullptr, ASL_Sufkind_con | ASL_Sufkind_real, 0},
                      {scaling_name, nullptr, ASL_Sufkind_obj | ASL_Sufkind_real, 0},
                      {lower_name, nullptr, kRealOfVariables, 0},
                      {upper_name, nullptr, kRealOfVariables, 0},
                      {sosno_name, nullptr, ASL_Sufkind_var, 0},
                      {sos_name, nullptr, ASL_Sufkind_var, 0}};

constexpr unsigned kReadSeconds = 20, kBytesPerSecond = 1000000;  ///< of a file that is read

/// False when a derivative that ASL computes does not exist, which it answers with a longjmp.
bool hessian_values(ASL* asl, double* values, double* weights, double* multipliers) {
  Jmp_buf jump;
  err_jmp = &jump;  // a failed objgrd leaves it pointing into its ended frame
  const bool defined = setjmp(jump.jb) == 0;
  // Given an objective instead of -1, ASL ignores its weight.
  if (defined) sphes(values, -1, weights, multipliers);
  err_jmp = nullptr;
  return defined;
}

/// The same of one constraint's gradient, where ASL would end the process, and says so each time.
bool row_gradient(ASL* asl, int row, double* x, double* values) {
  static FILE* const nowhere = std::fopen("/dev/null", "w");
  FILE* const told = Stderr;
  if (nowhere != nullptr) Stderr = nowhere;
  Jmp_buf jump;
  err_jmp1 = &jump;
  fint error = 0;
  const bool defined = setjmp(jump.jb) == 0;
  if (defined) congrd(row, x, values, &error);
  err_jmp1 = nullptr;
  Stderr = told;
  return defined && error == 0;
}

/// A copy of a file without variables that has one, for as long as this lives; else the file.
class StandIn : Uncopied {
 public:
  StandIn(const std::string& file, const NlFacts& facts) : file_(file) {
    if (facts.variables > 0) return;
    std::string pattern = (std::filesystem::temp_directory_path() / "ipminmax_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw std::runtime_error("cannot make a folder in " + pattern);
    folder_ = pattern;
    file_ = folder_ + "/model.nl";
    write_file(file_, with_a_fixed_variable(file, facts));
  }
  ~StandIn() {
    std::error_code unknown;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, unknown);
  }
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::string file_, folder_;
};

}  // namespace

NlProblem::NlProblem(const std::string& stub, int objective) {
  file_ = stub;
  if (!std::filesystem::is_regular_file(file_)) file_ += ".nl";
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(file_))
    throw std::runtime_error(
        concat("cannot open ", stub,
               std::filesystem::is_directory(stub, unknown) ? ": it is a folder" : ""));
  facts_ = check_nl_file(file_);
  if (!file_.ends_with(".nl"))
    throw std::runtime_error("cannot read " + file_ + ": its name does not end in .nl");
  const StandIn stand_in(file_, facts_);
  read_from_ = stand_in.file();
  const auto bytes = std::filesystem::file_size(file_);
  try_in_child(file_, kReadSeconds + static_cast<unsigned>(bytes / kBytesPerSecond), [&] {
    load(objective);
    call_everything();
  });
  load(objective);
}

NlProblem::~NlProblem() {
  if (asl) ASL_free(&asl);
}

void NlProblem::load(int objective) {
  try {
    read();
    if (objective > n_obj)
      throw std::runtime_error(
          concat("objno = ", objective, ", but the model has ", n_obj, " objectives"));
    objective_ = objective < 0 ? (n_obj > 0 ? 0 : -1) : objective - 1;
    sign_ = objective_ >= 0 && objtype[objective_] ? -1.0 : 1.0;
    read_players();
    hessian_entries_ = static_cast<int>(sphsetup(-1, n_obj > 0 ? 1 : 0, n_con > 0 ? 1 : 0, 1));
    require_linear();
  } catch (...) {
    ASL_free(&asl);
    throw;
  }
}

void NlProblem::read() {
  asl = ASL_alloc(ASL_read_pfgh);
  return_nofile = 1;
  FILE* file = jac0dim(read_from_.data(), static_cast<ftnlen>(read_from_.size()));
  if (!file) throw std::runtime_error("cannot open " + file_);
  suf_declare(suffixes, static_cast<int>(std::size(suffixes)));
  want_xpi0 = 3;
  const int error = pfgh_read(file, ASL_return_read_err | ASL_findgroups);
  if (error == ASL_readerr_unavail)
    throw std::runtime_error("cannot read " + file_ + ": an imported function is not available");
  if (error != ASL_readerr_none) throw std::runtime_error("cannot read " + file_);
}

std::string NlProblem::integer_variable() const {
  // Within each group of nonlinear variables, and at the end, the integer ones come last.
  const int first = nlvbi > 0       ? nlvb - nlvbi
                    : nlvci > 0     ? nlvc - nlvci
                    : nlvoi > 0     ? nlvo - nlvoi
                    : nbv + niv > 0 ? n_var - nbv - niv
                                    : -1;
  return first < 0 ? "" : variable_name(first);
}

void NlProblem::read_players() {
  for (char* name : {sosno_name, sos_name})
    if (suf_get(name, ASL_Sufkind_var)->u.i)
      throw std::runtime_error("special ordered sets are not supported");
  const auto items_with = [&](char* suffix, int kind, int count) {
    std::vector<int> items;
    const int* values = suf_get(suffix, kind)->u.i;
    for (int i = 0; values && i < count; ++i) {
      if (values[i] == 1) items.push_back(i);
      if (values[i] != 0 && values[i] != 1)
        throw std::runtime_error(
            concat(kind == ASL_Sufkind_var ? "variable " + variable_name(i)
                                           : "constraint " + constraint_name(i),
                   ": suffix ", suffix, " is ", values[i],
                   suffix == player_name ? ", not 0 (Min) or 1 (Max)" : ", not 0 or 1"));
    }
    return items;
  };
  variable_players_.assign(at(variables()), Player::Min);
  has_player_suffix_ = suf_get(player_name, ASL_Sufkind_var)->u.i != nullptr;
  for (const int i : items_with(player_name, ASL_Sufkind_var, n_var))
    variable_players_[at(i)] = Player::Max;
  max_constraints_ = items_with(player_name, ASL_Sufkind_con, n_con);
  robust_constraints_ = facts_.listed_as_min;
  for (const int i : items_with(robust_name, ASL_Sufkind_con, n_con)) {
    if (std::ranges::find(max_constraints_, i) != max_constraints_.end())
      throw std::runtime_error("constraint " + constraint_name(i) +
                               ": suffix robust gives it to player 0, suffix player to player 1");
    robust_constraints_.push_back(i);
  }
}

const BoxFunctions* NlProblem::over_boxes() {
  if (!boxes_) {
    boxes_ = std::make_unique<NlBoxes>(read_nl_formulas(file_), variables(), objective_, sign_);
  }
  return boxes_.get();
}

int NlProblem::variables() const { return facts_.variables > 0 ? n_var : 0; }

int NlProblem::constraints() const { return n_con; }

/// Calls all that a solve calls, at the start and beside it. Whether the results are defined does
/// not matter here: a damaged formula crashes.
void NlProblem::call_everything() {
  AddRef(nullptr);  // the child process holds it to its own end
  TnlpProblem problem(this);
  static_cast<void>(problem.load());
  const ProblemStructure& s = problem.structure();
  std::vector<double> x(s.variable_lower.size()), z_lower(x), z_upper(x), gradient(x),
      g(s.constraint_lower.size()), lambda(g.size(), 1.0), jacobian(s.jacobian.size()),
      hessian(s.hessian.size());
  std::vector<Index> rows(g.size());
  std::iota(rows.begin(), rows.end(), 0);
  StartingPoint start{x, true, g, z_lower, z_upper};
  static_cast<void>(problem.starting_point(start));
  for (const double step : {0.0, 0.1}) {
    for (double& value : x) value += step * std::max(1.0, std::abs(value));
    const auto call = [&](std::span<const Index> some) {
      const bool defined = problem.constraint_rows(some, x, true, g);
      return problem.jacobian_rows(some, x, false, jacobian) && defined;
    };
    if (!call(rows)) {  // what follows an undefined one was not called
      for (const Index& row : rows) static_cast<void>(call({&row, 1}));
    }
    double f = 0.0;
    static_cast<void>(problem.objective(x, true, f));
    static_cast<void>(problem.constraints(x, false, g));
    static_cast<void>(problem.gradient(x, false, gradient));
    static_cast<void>(problem.jacobian(x, false, jacobian));
    static_cast<void>(problem.hessian(x, false, 1.0, lambda, true, hessian));
  }
}

bool NlProblem::is_linear(const std::vector<double>& from, int first, int last) {
  const std::size_t m = at(n_con);
  std::vector<double> step(from.size(), 0.0), to = from, gradient(from.size()),
                                              jacobian(static_cast<std::size_t>(nzc) + 1), g(m + 1),
                                              moved(m + 1), slope(m), size(m);
  for (int i = first; i < last; ++i) {
    step[at(i)] = (1.0 + 0.5 * std::sin(i + 1.0)) * std::max(1.0, std::abs(from[at(i)]));
    to[at(i)] += step[at(i)];
  }
  double f = 0.0, f_moved = 0.0;
  if (!eval_f(n_var, from.data(), true, f) || !eval_g(n_var, from.data(), true, n_con, g.data()) ||
      !eval_grad_f(n_var, from.data(), true, gradient.data()) ||
      !eval_jac_g(n_var, from.data(), true, n_con, static_cast<int>(nzc), nullptr, nullptr,
                  jacobian.data()) ||
      !eval_f(n_var, to.data(), true, f_moved) ||
      !eval_g(n_var, to.data(), true, n_con, moved.data()))
    return true;  // not seen
  constexpr double kRounding = 1e-6;
  const auto same = [](double before, double after, double predicted, double terms) {
    return !(std::abs(after - before - predicted) >
             kRounding * (std::abs(before) + std::abs(after) + terms));
  };
  double predicted = 0.0, terms = 0.0;
  for (const auto i : indices(from)) {
    predicted += gradient[i] * step[i];
    terms += std::abs(gradient[i] * step[i]);
  }
  bool linear = same(f, f_moved, predicted, terms);
  for (std::size_t i = 0; i < m; ++i) {
    for (const cgrad* entry = Cgrad[i]; entry; entry = entry->next) {
      const double term = jacobian[at(entry->goff)] * step[at(entry->varno)];
      slope[i] += term;
      size[i] += std::abs(term);
    }
    linear = linear && same(g[i], moved[i], slope[i], size[i]);
  }
  return linear;
}

void NlProblem::require_linear() {
  const int nonlinear = std::max(nlvc, nlvo);
  if (nonlinear >= n_var) return;
  std::vector<double> start(at(n_var));
  get_starting_point(n_var, true, start.data(), false, nullptr, nullptr, n_con, false, nullptr);
  std::vector<double> off_start = start;  // a factor may be zero at the start
  for (const auto i : indices(start))
    off_start[i] +=
        0.1 * (1.0 + 0.5 * std::cos(static_cast<double>(i))) * std::max(1.0, std::abs(start[i]));
  for (const std::vector<double>& from : {off_start, start}) {
    if (is_linear(from, nonlinear, n_var)) continue;
    int first = nonlinear, last = n_var;
    while (last - first > 1) {
      const int middle = first + (last - first) / 2;
      (is_linear(from, first, middle) ? first : last) = middle;
    }
    throw std::runtime_error(concat("variable ", variable_name(first),
                                    " is nonlinear, but the header of ", file_,
                                    " counts only the first ", nonlinear, " of ", n_var,
                                    " variables as nonlinear: wrong file"));
  }
}

void NlProblem::set_players(const PlayerOptions& options) {
  PlayerOptions own = options;
  own.stated_by = "the file's suffix";
  TnlpProblem loaded(this, own);
  if (const auto error = loaded.load(); !error.empty()) throw std::invalid_argument(error);
  variable_players_ = loaded.structure().variable_players;
  const std::vector<Player>& owners = loaded.structure().constraint_players;
  for (const int i : max_constraints_)
    if (owners[at(i)] == Player::Min)
      throw std::invalid_argument(concat("option minmax_min_constraints gives constraint ", i, " (",
                                         constraint_name(i),
                                         ") to Min, the suffix player gives it to Max"));
  max_constraints_.clear();
  robust_constraints_.clear();
  for (int i = 0; i < constraints(); ++i)
    (owners[at(i)] == Player::Max ? max_constraints_ : robust_constraints_).push_back(i);
}

std::string NlProblem::variable_name(int i) const { return var_name(i); }

std::string NlProblem::constraint_name(int i) const { return con_name(i); }

std::string NlProblem::misspelt_suffix() const {
  constexpr std::size_t kLongest = 20, kNear = 2;
  if (has_player_suffix_) return {};
  for (const std::string& name : facts_.other_suffixes) {
    if (name.size() <= kLongest && edit_distance(lower_case(name), player_name) <= kNear)
      return name;
  }
  return {};
}

bool NlProblem::get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                             IndexStyleEnum& index_style) {
  n = variables();
  m = n_con;
  nnz_jac_g = static_cast<int>(nzc);
  nnz_h_lag = hessian_entries_;
  index_style = C_STYLE;
  return true;
}

bool NlProblem::get_bounds_info(Index n, double* x_l, double* x_u, Index m, double* g_l,
                                double* g_u) {
  for (int i = 0; i < n; ++i) {
    x_l[i] = LUv[2 * i];
    x_u[i] = LUv[2 * i + 1];
  }
  for (int i = 0; i < m; ++i) {
    g_l[i] = LUrhs[2 * i];
    g_u[i] = LUrhs[2 * i + 1];
  }
  return true;
}

bool NlProblem::get_scaling_parameters(double& of_objective, bool& use_x, Index n, double* x,
                                       bool& use_g, Index m, double* g) {
  // As Ipopt's executable: what is not listed, or not positive, is 1.
  const auto read = [&](int kind, Index count, double* to) {
    const double* factors = suf_get(scaling_name, kind)->u.r;
    for (int i = 0; i < count; ++i) to[i] = factors && factors[i] > 0.0 ? factors[i] : 1.0;
    return factors != nullptr;
  };
  const double* factors = suf_get(scaling_name, ASL_Sufkind_obj)->u.r;
  of_objective =
      factors && objective_ >= 0 && factors[objective_] != 0.0 ? factors[objective_] : 1.0;
  use_x = read(ASL_Sufkind_var, n, x);
  use_g = read(ASL_Sufkind_con, m, g);
  return true;
}

bool NlProblem::get_starting_point(Index n, bool init_x, double* x, bool init_z, double* z_L,
                                   double* z_U, Index m, bool init_lambda, double* lambda) {
  for (int i = 0; init_x && i < n; ++i)
    x[i] = X0 ? X0[i] : std::max(LUv[2 * i], std::min(0.0, LUv[2 * i + 1]));
  const double* lower = suf_get(lower_name, ASL_Sufkind_var)->u.r;
  const double* upper = suf_get(upper_name, ASL_Sufkind_var)->u.r;
  for (int i = 0; init_z && i < n; ++i) {
    const double side = variable_players_[at(i)] == Player::Min ? 1.0 : -1.0;
    z_L[i] = lower ? sign_ * lower[i] : side;
    z_U[i] = upper ? -sign_ * upper[i] : side;
  }
  // AMPL: grad f = J' pi; ours: sign grad f + J' lambda = 0.
  for (int i = 0; init_lambda && i < m; ++i) lambda[i] = pi0 ? -sign_ * pi0[i] : 0.0;
  return true;
}

void NlProblem::move_to(const double* x) {
  if (!x_.empty() && (variables() == 0 || std::equal(x_.begin(), x_.end(), x))) return;
  evaluated_ = false;
  if (variables() > 0)
    x_.assign(x, x + variables());
  else
    x_.assign(1, 0.0);
}

bool NlProblem::evaluate(const double* x) {
  move_to(x);
  if (evaluated_) return f_is_defined_ && g_is_defined_;
  evaluated_ = true;
  g_.resize(at(n_con));
  fint error = 0;
  f_ = objective_ >= 0 ? sign_ * objval(objective_, x_.data(), &error) : 0.0;
  fint constraint_error = 0;
  if (n_con > 0) conval(x_.data(), g_.data(), &constraint_error);
  f_is_defined_ = is_defined(error != 0);
  g_is_defined_ = is_defined(constraint_error != 0);
  return f_is_defined_ && g_is_defined_;
}

/// Without a place for its error ASL says on standard error what is undefined.
void NlProblem::halt_where_undefined() {
  if (undefined_at_.empty()) return;
  std::vector<double> gradient(undefined_at_.size()), jacobian(static_cast<std::size_t>(nzc));
  Jmp_buf jump;
  err_jmp = nullptr;  // what has failed leaves it pointing into its ended frame
  err_jmp1 = &jump;   // ASL ends the process else
  if (setjmp(jump.jb) == 0) {
    if (objective_ >= 0) objval(objective_, undefined_at_.data(), nullptr);
    if (n_con > 0) conval(undefined_at_.data(), g_.data(), nullptr);
    if (objective_ >= 0) objgrd(objective_, undefined_at_.data(), gradient.data(), nullptr);
    if (n_con > 0) jacval(undefined_at_.data(), jacobian.data(), nullptr);
  }
  err_jmp1 = nullptr;
  throw std::runtime_error("a function of " + file_ +
                           " is undefined at a point of the solve (halt_on_ampl_error)");
}

bool NlProblem::eval_grad_f(Index n, const double* x, bool, double* gradient) {
  evaluate(x);
  if (!f_is_defined_) return false;
  std::fill(gradient, gradient + n, 0.0);
  if (objective_ < 0 || variables() == 0) return true;
  fint error = 0;
  objgrd(objective_, x_.data(), gradient, &error);
  for (int i = 0; i < n; ++i) gradient[i] *= sign_;
  return is_defined(error != 0);
}

bool NlProblem::eval_jac_g(Index, const double* x, bool, Index m, Index, Index* rows,
                           Index* columns, double* values) {
  if (!values) {
    for (int i = 0; i < m; ++i)
      for (const cgrad* entry = Cgrad[i]; entry; entry = entry->next) {
        rows[entry->goff] = i;
        columns[entry->goff] = entry->varno;
      }
    return true;
  }
  evaluate(x);
  if (!g_is_defined_) return false;
  fint error = 0;
  if (m > 0) jacval(x_.data(), values, &error);
  return is_defined(error != 0);
}

bool NlProblem::eval_rows(Index, const double* x, bool, Index count, const Index* rows, Index,
                          double* g, Index, double* values) {
  move_to(x);
  asl->i.congrd_mode = 2;  // congrd writes where jacval does
  fint error = 0;
  for (Index k = 0; k < count && error == 0; ++k) {
    if (g != nullptr)
      g[rows[k]] = conival(rows[k], x_.data(), &error);
    else
      error = row_gradient(asl, rows[k], x_.data(), values) ? 0 : 1;
  }
  const bool defined = is_defined(error != 0);
  if (!defined) x_.clear();  // ASL's state is unknown
  return defined;
}

bool NlProblem::eval_h(Index n, const double* x, bool, double sigma, Index m, const double* lambda,
                       bool, Index, Index* rows, Index* columns, double* values) {
  if (!values) {
    // ASL stores the upper triangle by columns, which is the lower one by rows.
    int entry = 0;
    for (int j = 0; j < n; ++j)
      for (; entry < sputinfo->hcolstarts[j + 1]; ++entry) {
        rows[entry] = j;
        columns[entry] = static_cast<int>(sputinfo->hrownos[entry]);
      }
    return true;
  }
  move_to(x);
  std::vector<Index> weighted;  // Hessians build on values
  for (Index i = 0; i < m; ++i) {
    if (lambda[i] != 0.0) weighted.push_back(i);
  }
  const bool few = !evaluated_ && sigma == 0.0;
  g_.resize(at(n_con));
  if (!(few ? eval_rows(n, x, false, static_cast<Index>(weighted.size()), weighted.data(), m,
                        g_.data(), 0, nullptr)
            : evaluate(x))) {
    return false;
  }
  std::vector<double> weights(at(n_obj) + 1, 0.0);
  if (objective_ >= 0) weights[at(objective_)] = sign_ * sigma;
  std::vector<double> multipliers(lambda, lambda + m);
  if (!hessian_values(asl, values, n_obj > 0 ? weights.data() : nullptr,
                      m > 0 ? multipliers.data() : nullptr)) {
    x_.clear();  // ASL's state is unknown
    return false;
  }
  return std::all_of(values, values + hessian_entries_, [](double v) { return std::isfinite(v); });
}

SolutionFile NlProblem::solution_file(const Result& result) const {
  SolutionFile file;
  file.options.assign(ampl_options, ampl_options + 1 + std::clamp(ampl_options[0], 0, 9));
  if (file.options.size() == 1) file.options.clear();
  constexpr int kToleranceFollows = 3;
  if (file.options.size() > 2 && file.options[2] == kToleranceFollows)
    file.bound_tolerance = ampl_vbtol;
  file.constraints = n_con;
  file.variables = variables();
  file.has_status = (asl->i.flags & 1) != 0;
  file.objective = std::max(objective_, 0);
  const auto scaled = [](std::vector<double> values, double factor) {
    if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); }))
      return std::vector<double>();
    for (double& value : values) value *= factor;
    return values;
  };
  file.primals = scaled(result.v, 1.0);
  file.duals = scaled(result.lambda, -sign_);
  std::vector<double> lower = scaled(result.z_lower, sign_), upper = scaled(result.z_upper, -sign_);
  if (!upper.empty()) file.variable_suffixes.push_back({"ipopt_zU_out", std::move(upper)});
  if (!lower.empty()) file.variable_suffixes.push_back({"ipopt_zL_out", std::move(lower)});
  return file;
}

bool NlProblem::is_binary() const { return (binary_nl & 1) != 0; }

std::string solution_file_name(const std::string& stub) {
  const bool is_file = std::filesystem::is_regular_file(stub) && stub.ends_with(".nl");
  return (is_file ? stub.substr(0, stub.size() - 3) : stub) + ".sol";
}

}  // namespace ipminmax
