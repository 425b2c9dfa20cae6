// CasADi's plugin nlpsol("solver", "ipminmax", nlp, options):
//
//   f = Function...; nlp = {x, p, f, g};  players = which entries of x are the maximizer's
//   S = nlpsol("S", "ipminmax", nlp, {"players": [0, 0, 1, 1], "ipminmax": {"tol": 1e-9}})
//   S(x0=..., lbx=...);  S.stats()["certificate"]
//
// Derivatives are CasADi's, the Hessian exact. Multipliers have CasADi's convention,
// grad f + J'lam_g + lam_x = 0, for both players, so that those of a Max variable's bounds have the
// opposite signs. The model of a solver object is solved again with its orderings and symbolic
// factorizations kept; with warm_start_init_point the start's lam_x0 and lam_g0 are used.
#include <IpJournalist.hpp>
#include <IpOptionsList.hpp>
#include <IpRegOptions.hpp>
#include <algorithm>
#include <array>
#include <casadi/casadi.hpp>
#include <casadi/core/nlpsol_impl.hpp>
#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/minmax_tnlp.hpp"
#include "adapter/ipopt/optional_players.hpp"
#include "adapter/ipopt/status.hpp"
#include "core/answer.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

using casadi::Dict;
using casadi::Sparsity;
using Ipopt::Index;
using Ipopt::Number;

class OracleTNLP;

/// The console: CasADi's stream, which is sys.stdout in Python and the command window in MATLAB.
class Console final : public Ipopt::Journal {
 public:
  using Journal::Journal;

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    casadi::uout() << text;
  }
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                  va_list arguments) override {
    std::array<char, 4096> text{};  // longer lines are cut
    std::vsnprintf(text.data(), text.size(), format, arguments);
    casadi::uout() << text.data();
  }
  void FlushBufferImpl() override { casadi::uout() << std::flush; }
};

/// What belongs to one evaluation at a time of a solver object.
struct Memory : casadi::NlpsolMemory {
  Ipopt::SmartPtr<OracleTNLP> model;
  Ipopt::SmartPtr<MinMaxApplication> application;
  bool solved_before = false;
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
};

class NlpsolIpminmax final : public casadi::Nlpsol {
 public:
  NlpsolIpminmax(const std::string& name, const casadi::Function& nlp) : Nlpsol(name, nlp) {}
  explicit NlpsolIpminmax(casadi::DeserializingStream& stream);
  ~NlpsolIpminmax() override { clear_mem(); }

  static Nlpsol* creator(const std::string& name, const casadi::Function& nlp) {
    return new NlpsolIpminmax(name, nlp);
  }
  const char* plugin_name() const override { return "ipminmax"; }
  std::string class_name() const override { return "NlpsolIpminmax"; }

  static const casadi::Options options_;
  const casadi::Options& get_options() const override { return options_; }

  void init(const Dict& opts) override {
    Nlpsol::init(opts);
    variable_players_.assign(static_cast<std::size_t>(nx_), Player::Min);
    for (const auto& [name, value] : opts) {
      if (name == "ipminmax") solver_options_ = value;
      if (name == "grad_f") set_function(value.to_function(), "nlp_grad_f");
      if (name == "jac_g") set_function(value.to_function(), "nlp_jac_g");
      if (name == "hess_lag") set_function(value.to_function(), "nlp_hess_l");
      if (name == "players") variable_players_ = players(value, nx_, name);
      if (name == "constraint_players") constraint_players_ = players(value, ng_, name);
      if (name != "var_integer_md" && name != "con_integer_md") continue;
      const Dict metadata = value;
      const auto found = metadata.find("player");
      if (found == metadata.end()) continue;
      const bool of_variables = name == "var_integer_md";
      (of_variables ? variable_players_ : constraint_players_) =
          players(found->second, of_variables ? nx_ : ng_, name + "[\"player\"]");
    }
    create_functions();
  }
  void* alloc_mem() const override { return new Memory; }
  int init_mem(void* mem) const override;
  void free_mem(void* mem) const override { delete static_cast<Memory*>(mem); }
  int solve(void* mem) const override;
  Dict get_stats(void* mem) const override {
    Dict stats = Nlpsol::get_stats(mem);
    auto* m = static_cast<Memory*>(mem);
    const Result& result = m->application->LastResult();
    const Certificate& c = result.certificate;
    const auto inertia = [](const Inertia& i) {
      return std::vector<casadi_int>{i.positive, i.negative, i.zero};
    };
    std::vector<std::string> reasons;
    for (const CertificateReason& reason : c.reasons) reasons.push_back(reason.text);
    stats["certificate"] = Dict{{"kind", std::string(name_of(c.kind))},
                                {"local_minmax", c.kind == PointKind::LocalMinmax},
                                {"second_order", std::string(name_of(c.second_order))},
                                {"inner", inertia(c.inner)},
                                {"inner_expected", inertia(c.inner_expected)},
                                {"full", inertia(c.full)},
                                {"full_expected", inertia(c.full_expected)},
                                {"margin", c.margin},
                                {"licq_min", c.licq_min},
                                {"licq_max", c.licq_max},
                                {"weakly_active_min", c.weakly_active_min},
                                {"weakly_active_max", c.weakly_active_max},
                                {"answer", std::string(name_of(c.answer))},
                                {"reasons", reasons},
                                {"hessian_disagrees", c.hessian_disagrees}};
    stats["return_status"] = std::string(name_of(m->status));
    stats["status"] = std::string(name_of(result.status));
    stats["message"] = result.message;
    const auto said = statements(result);
    stats["statements"] = std::vector<std::string>(said.begin(), said.end());
    std::vector<std::vector<double>> worst_cases, points;
    std::vector<casadi_int> constraints;
    for (const RobustWorstCase& found : result.worst_cases) {
      constraints.push_back(found.constraint);
      worst_cases.push_back(found.v);
    }
    for (const DistinctPoint& point : m->application->LastPoints())
      points.push_back(point.result.v);
    stats["worst_cases"] = worst_cases;
    stats["worst_case_constraints"] = constraints;
    stats["points"] = points;
    stats["iter_count"] = result.iterations;
    stats["factorizations"] = result.factorizations;
    stats["analyses"] = result.counts.analyses;
    return stats;
  }
  void serialize_body(casadi::SerializingStream& stream) const override {
    Nlpsol::serialize_body(stream);
    stream.version("NlpsolIpminmax", 1);
    stream.pack("NlpsolIpminmax::jacobian", jacobian_);
    stream.pack("NlpsolIpminmax::hessian", hessian_);
    stream.pack("NlpsolIpminmax::options", solver_options_);
    for (const auto* owners : {&variable_players_, &constraint_players_}) {
      std::vector<casadi_int> numbers;
      for (const Player player : *owners) numbers.push_back(player == Player::Max ? 1 : 0);
      stream.pack("NlpsolIpminmax::players", numbers);
    }
  }
  static ProtoFunction* deserialize(casadi::DeserializingStream& stream) {
    return new NlpsolIpminmax(stream);
  }

  /// Evaluates a function of (x, p) or (x, p, lam_f, lam_g); false where it fails.
  bool evaluate(Memory* m, const char* function, const std::vector<const double*>& arguments,
                const std::vector<double*>& results) const {
    std::ranges::copy(arguments, m->arg);
    std::ranges::copy(results, m->res);
    return calc_function(m, function) == 0;
  }
  /// False stops the solve.
  bool call_back(Memory* m, const Result& iterate) const {
    m->n_iter = iterate.iterations;
    if (callback_step_ > 1 && iterate.iterations % callback_step_ != 0) return true;
    store(m, iterate);
    return callback(m) == 0;
  }
  /// A point and its multipliers into CasADi's vectors.
  void store(Memory* m, const Result& point) const {
    auto& d = m->d_nlp;
    if (static_cast<casadi_int>(point.v.size()) != nx_) return;  // there was no first iterate
    std::ranges::copy(point.v, d.z);
    std::ranges::copy(point.constraints, d.z + nx_);
    std::ranges::transform(point.z_upper, point.z_lower, d.lam, std::minus<>());
    std::ranges::copy(point.lambda, d.lam + nx_);
    d.objective = point.objective;
  }

  Sparsity jacobian_, hessian_;
  std::vector<Player> variable_players_;
  std::vector<Player> constraint_players_;  ///< empty: as the Jacobian implies
  Dict solver_options_;

 private:
  static std::vector<Player> players(const std::vector<casadi_int>& values, casadi_int count,
                                     const std::string& option) {
    casadi_assert(static_cast<casadi_int>(values.size()) == count,
                  option + " has " + casadi::str(values.size()) + " entries, but there are " +
                      casadi::str(count));
    std::vector<Player> result;
    for (const casadi_int value : values) {
      casadi_assert(value == 0 || value == 1, option + " must be 0 (Min) or 1 (Max)");
      result.push_back(value == 1 ? Player::Max : Player::Min);
    }
    return result;
  }
  /// Those that are not given as options; the first outputs of nlp_grad_f and nlp_jac_g, f and g,
  /// are never asked for.
  void create_functions() {
    create_function("nlp_f", {"x", "p"}, {"f"});
    create_function("nlp_g", {"x", "p"}, {"g"});
    if (!has_function("nlp_grad_f")) create_function("nlp_grad_f", {"x", "p"}, {"f", "grad:f:x"});
    if (!has_function("nlp_jac_g")) create_function("nlp_jac_g", {"x", "p"}, {"g", "jac:g:x"});
    if (!has_function("nlp_hess_l")) {
      create_function("nlp_hess_l", {"x", "p", "lam:f", "lam:g"}, {"triu:hess:gamma:x:x"},
                      {{"gamma", {"f", "g"}}});
    }
    jacobian_ = get_function("nlp_jac_g").sparsity_out(1);
    hessian_ = get_function("nlp_hess_l").sparsity_out(0);
    casadi_assert(jacobian_.size() == std::make_pair(ng_, nx_), "jac_g must be ng by nx");
    casadi_assert(hessian_.size() == std::make_pair(nx_, nx_), "hess_lag must be nx by nx");
    casadi_assert(hessian_.is_triu(), "hess_lag: Hessian must be upper triangular");
  }
};

/// The NLP of a solver object with the numbers of a Memory as an Ipopt model.
class OracleTNLP final : public MinMaxTNLP, public OptionalPlayers {
 public:
  OracleTNLP(const NlpsolIpminmax& owner, Memory* memory) : owner_(owner), m_(memory) {}

  bool get_nlp_info(Index& n, Index& m, Index& jacobian_entries, Index& hessian_entries,
                    IndexStyleEnum& style) override {
    n = static_cast<Index>(owner_.nx_);
    m = static_cast<Index>(owner_.ng_);
    jacobian_entries = static_cast<Index>(owner_.jacobian_.nnz());
    hessian_entries = static_cast<Index>(owner_.hessian_.nnz());
    style = C_STYLE;
    return true;
  }
  bool get_variable_players(Index, Player* players) override {
    std::ranges::copy(owner_.variable_players_, players);
    return true;
  }
  bool get_constraint_players(Index, Player* players) override {
    std::ranges::copy(owner_.constraint_players_, players);
    return true;
  }
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override {
    const auto lower = [](double value) { return std::max(value, -1e20); };
    const auto upper = [](double value) { return std::min(value, 1e20); };
    const double *lbz = m_->d_nlp.lbz, *ubz = m_->d_nlp.ubz;
    std::transform(lbz, lbz + n, x_l, lower);
    std::transform(ubz, ubz + n, x_u, upper);
    std::transform(lbz + n, lbz + n + m, g_l, lower);
    std::transform(ubz + n, ubz + n + m, g_u, upper);
    return true;
  }
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_L, Number* z_U,
                          Index m, bool init_lambda, Number* lambda) override {
    const double *z = m_->d_nlp.z, *lam = m_->d_nlp.lam;
    if (init_x) std::copy_n(z, n, x);
    if (init_lambda) std::copy_n(lam + n, m, lambda);
    for (Index i = 0; init_z && i < n; ++i) {
      // lam = z_U - z_L; Min's multipliers are >= 0, Max's <= 0.
      const bool min = owner_.variable_players_[at(i)] == Player::Min;
      const bool upper = min == (lam[i] >= 0.0);
      z_U[i] = upper ? lam[i] : 0.0;
      z_L[i] = upper ? 0.0 : -lam[i];
    }
    return true;
  }
  bool eval_f(Index, const Number* x, bool, Number& f) override {
    return owner_.evaluate(m_, "nlp_f", {x, m_->d_nlp.p}, {&f});
  }
  bool eval_grad_f(Index, const Number* x, bool, Number* grad) override {
    return owner_.evaluate(m_, "nlp_grad_f", {x, m_->d_nlp.p}, {nullptr, grad});
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    return owner_.evaluate(m_, "nlp_g", {x, m_->d_nlp.p}, {g});
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    if (values == nullptr) return structure(owner_.jacobian_, rows, cols);
    return owner_.evaluate(m_, "nlp_jac_g", {x, m_->d_nlp.p}, {nullptr, values});
  }
  bool eval_h(Index, const Number* x, bool, Number sigma, Index, const Number* lambda, bool, Index,
              Index* rows, Index* cols, Number* values) override {
    if (values == nullptr) return structure(owner_.hessian_, rows, cols);
    return owner_.evaluate(m_, "nlp_hess_l", {x, m_->d_nlp.p, &sigma, lambda}, {values});
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Index, Number, Number, Number, Number, Number,
                             Number, Number, Number, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    if (owner_.fcallback_.is_null()) return true;
    Result iterate;
    return !m_->application->GetCurrentIterate(iterate) || owner_.call_back(m_, iterate);
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}  // solve reads LastResult

 private:
  static bool structure(const Sparsity& sparsity, Index* rows, Index* cols) {
    for (const casadi_int row : sparsity.get_row()) *rows++ = static_cast<Index>(row);
    for (const casadi_int col : sparsity.get_col()) *cols++ = static_cast<Index>(col);
    return true;
  }
  const NlpsolIpminmax& owner_;
  Memory* m_;
};

const casadi::Options NlpsolIpminmax::options_ = {
    {&casadi::Nlpsol::options_},
    {{"ipminmax", {casadi::OT_DICT, "Options of the solver, by their names in docs/options.md"}},
     {"grad_f", {casadi::OT_FUNCTION, "Gradient of the objective: (x, p) -> (f, grad_f_x)"}},
     {"jac_g", {casadi::OT_FUNCTION, "Jacobian of the constraints: (x, p) -> (g, jac_g_x)"}},
     {"hess_lag",
      {casadi::OT_FUNCTION,
       "Hessian of the Lagrangian, upper triangle: (x, p, lam_f, lam_g) -> hess_gamma_x_x"}},
     {"players", {casadi::OT_INTVECTOR, "Per variable: 0 the minimizer's, 1 the maximizer's"}},
     {"constraint_players",
      {casadi::OT_INTVECTOR,
       "Per constraint: 0 Min, 1 Max (default: Max where it depends on a Max variable)"}},
     {"var_integer_md",
      {casadi::OT_DICT, "Metadata of the variables; \"player\" is read, as the option players"}},
     {"con_integer_md",
      {casadi::OT_DICT, "Metadata of the constraints; \"player\" is read likewise"}}}};

NlpsolIpminmax::NlpsolIpminmax(casadi::DeserializingStream& stream) : Nlpsol(stream) {
  stream.version("NlpsolIpminmax", 1);
  stream.unpack("NlpsolIpminmax::jacobian", jacobian_);
  stream.unpack("NlpsolIpminmax::hessian", hessian_);
  stream.unpack("NlpsolIpminmax::options", solver_options_);
  for (auto* owners : {&variable_players_, &constraint_players_}) {
    std::vector<casadi_int> numbers;
    stream.unpack("NlpsolIpminmax::players", numbers);
    *owners = players(numbers, static_cast<casadi_int>(numbers.size()), "players");
  }
}

/// Options of CasADi's kind; a dictionary inside is a prefix: resto.tol.
void set_options(MinMaxApplication& application, const Dict& options, const std::string& prefix) {
  Ipopt::OptionsList& list = *application.Options();
  for (const auto& [last, value] : options) {
    const std::string name = prefix + last;
    if (value.is_dict()) {
      set_options(application, value.to_dict(), name + ".");
      continue;
    }
    const auto option = application.RegOptions()->GetOption(name);
    casadi_assert(Ipopt::IsValid(option), "No such option of Ipminmax: " + name);
    bool set = false;
    if (option->Type() == Ipopt::OT_Number) {
      set = list.SetNumericValue(name, value.to_double());
    } else if (option->Type() == Ipopt::OT_Integer) {
      set = list.SetIntegerValue(name, static_cast<Index>(value.to_int()));
    } else {
      set = list.SetStringValue(
          name, value.is_bool() ? (value.to_bool() ? "yes" : "no") : value.to_string());
    }
    casadi_assert(set, "Bad value of Ipminmax's option " + name + ": " + casadi::str(value));
  }
}

int NlpsolIpminmax::init_mem(void* mem) const {
  if (Nlpsol::init_mem(mem) != 0) return 1;
  auto* m = static_cast<Memory*>(mem);
  m->model = new OracleTNLP(*this, m);
  m->application = new MinMaxApplication;
  m->application->RethrowNonIpoptException(true);  // interrupts, errors inside the callback
  const auto journalist = m->application->Jnlst();
  journalist->DeleteAllJournals();
  journalist->AddJournal(new Console("console", Ipopt::J_ITERSUMMARY));
  set_options(*m->application, solver_options_, "");
  casadi_assert(m->application->Initialize() == Ipopt::Solve_Succeeded,
                m->application->LastResult().message);
  return 0;
}

int NlpsolIpminmax::solve(void* mem) const {
  auto* m = static_cast<Memory*>(mem);
  const Ipopt::SmartPtr<Ipopt::TNLP> model = Ipopt::GetRawPtr(m->model);
  m->status = m->solved_before ? m->application->ReOptimizeTNLP(model)
                               : m->application->OptimizeTNLP(model);
  m->solved_before = true;
  const Result& result = m->application->LastResult();
  store(m, result);
  m->success = m->status == Ipopt::Solve_Succeeded ||
               m->status == Ipopt::Solved_To_Acceptable_Level ||
               m->status == Ipopt::Feasible_Point_Found;
  m->n_iter = result.iterations;
  if (result.status == Status::MaxIterations || result.status == Status::MaxCpuTime ||
      result.status == Status::MaxWallTime) {
    m->unified_return_status = casadi::SOLVER_RET_LIMITED;
  }
  if (result.status == Status::LocallyInfeasible || result.status == Status::InnerInfeasible) {
    m->unified_return_status = casadi::SOLVER_RET_INFEASIBLE;
  }
  return 0;
}

}  // namespace
}  // namespace ipminmax

extern "C" {
/// What CasADi looks for in libcasadi_nlpsol_ipminmax.
__attribute__((visibility("default"))) int casadi_register_nlpsol_ipminmax(
    casadi::Nlpsol::Plugin* plugin) {
  plugin->creator = ipminmax::NlpsolIpminmax::creator;
  plugin->name = "ipminmax";
  plugin->doc = "Constrained nonconvex-nonconcave minmax problems with certificates (Ipminmax)";
  plugin->version = CASADI_VERSION;
  plugin->options = &ipminmax::NlpsolIpminmax::options_;
  plugin->deserialize = &ipminmax::NlpsolIpminmax::deserialize;
  return 0;
}
__attribute__((visibility("default"))) void casadi_load_nlpsol_ipminmax() {
  casadi::Nlpsol::registerPlugin(casadi_register_nlpsol_ipminmax);
}
}
