#include "nl_problem.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <asl_pfgh.h>
#include <getstub.h>
#undef filename

namespace ipminmax {
namespace {

char player_name[] = "player", z_lower_name[] = "ipopt_zL_out", z_upper_name[] = "ipopt_zU_out";
SufDecl suffixes[] = {
    {player_name, nullptr, ASL_Sufkind_var, 0},
    {player_name, nullptr, ASL_Sufkind_con, 0},
    {z_lower_name, nullptr, ASL_Sufkind_var | ASL_Sufkind_real | ASL_Sufkind_outonly, 0},
    {z_upper_name, nullptr, ASL_Sufkind_var | ASL_Sufkind_real | ASL_Sufkind_outonly, 0}};

/// ASL ends the process or crashes on some damaged files: a child process tries first.
template <class Read>
void try_in_child(const std::string& stub, Read read) {
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot start a process to read " + stub);
  if (child == 0) {
    try {
      read();
    } catch (const std::exception&) {
      _exit(0);  // the parent meets and reports the same error
    }
    _exit(0);
  }
  int status = 0;
  if (waitpid(child, &status, 0) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("cannot read " + stub + ": damaged or not an .nl file");
}

}  // namespace

NlProblem::NlProblem(const std::string& stub, int objective) {
  try_in_child(stub, [&] { read(stub); });
  read(stub);
  ASL* asl = asl_;
  refuse_unsupported();
  if (objective > n_obj)
    throw std::runtime_error("objno = " + std::to_string(objective) + ", but the model has " +
                             std::to_string(n_obj) + " objectives");
  objective_ = objective < 0 ? (n_obj > 0 ? 0 : -1) : objective - 1;
  if (objective_ >= 0 && objtype[objective_])
    throw std::runtime_error("maximize is not supported: minimize the negative objective");

  variable_players_.assign(static_cast<std::size_t>(n_var), Player::Min);
  const SufDesc* players = suf_get(player_name, ASL_Sufkind_var);
  for (int i = 0; players->u.i && i < n_var; ++i) {
    if (players->u.i[i] != 0 && players->u.i[i] != 1)
      throw std::runtime_error(std::string("variable ") + var_name(i) + ": suffix player is " +
                               std::to_string(players->u.i[i]) + ", not 0 (Min) or 1 (Max)");
    if (players->u.i[i] == 1) variable_players_[static_cast<std::size_t>(i)] = Player::Max;
  }
  players = suf_get(player_name, ASL_Sufkind_con);
  for (int i = 0; players->u.i && i < n_con; ++i) {
    if (players->u.i[i] != 0 && players->u.i[i] != 1)
      throw std::runtime_error(std::string("constraint ") + con_name(i) + ": suffix player is " +
                               std::to_string(players->u.i[i]) + ", not 0 (Min) or 1 (Max)");
    if (players->u.i[i] == 1) max_constraints_.push_back(i);
  }
  hessian_entries_ =
      static_cast<int>(sphsetup(objective_, objective_ >= 0 ? 1 : 0, n_con > 0 ? 1 : 0, 1));
}

NlProblem::~NlProblem() { ASL_free(&asl_); }

void NlProblem::read(const std::string& stub) {
  asl_ = ASL_alloc(ASL_read_pfgh);
  ASL* asl = asl_;
  return_nofile = 1;
  std::string name = stub;
  FILE* file = jac0dim(name.data(), static_cast<ftnlen>(name.size()));
  if (!file) throw std::runtime_error("cannot open " + stub);
  suf_declare(suffixes, static_cast<int>(std::size(suffixes)));
  want_xpi0 = 3;
  const int error = pfgh_read(file, ASL_return_read_err | ASL_findgroups);
  if (error != ASL_readerr_none)
    throw std::runtime_error("cannot read " + stub +
                             (error == ASL_readerr_unavail ? ": an imported function is missing"
                                                           : ": damaged .nl file"));
}

void NlProblem::refuse_unsupported() {
  ASL* asl = asl_;
  if (n_cc > 0) throw std::runtime_error("complementarity constraints are not supported");
  if (n_lcon > 0) throw std::runtime_error("logical constraints are not supported");
  // Within each group of nonlinear variables, and at the end, the integer ones come last.
  int integer = -1;
  if (nlvbi > 0)
    integer = nlvb - nlvbi;
  else if (nlvci > 0)
    integer = nlvc - nlvci;
  else if (nlvoi > 0)
    integer = nlvo - nlvoi;
  else if (nbv + niv > 0)
    integer = n_var - nbv - niv;
  if (integer >= 0)
    throw std::runtime_error(std::string("variable ") + var_name(integer) +
                             " is integer: only continuous variables are supported");
}

bool NlProblem::get_variable_players(Ipopt::Index, Player* players) {
  std::copy(variable_players_.begin(), variable_players_.end(), players);
  return true;
}

bool NlProblem::get_constraint_players(Ipopt::Index, Player* players) {
  for (const int i : max_constraints_) players[i] = Player::Max;
  return true;
}

bool NlProblem::get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& nnz_jac_g,
                             Ipopt::Index& nnz_h_lag, IndexStyleEnum& index_style) {
  ASL* asl = asl_;
  n = n_var;
  m = n_con;
  nnz_jac_g = static_cast<int>(nzc);
  nnz_h_lag = hessian_entries_;
  index_style = C_STYLE;
  return true;
}

bool NlProblem::get_bounds_info(Ipopt::Index n, double* x_l, double* x_u, Ipopt::Index m,
                                double* g_l, double* g_u) {
  ASL* asl = asl_;
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

bool NlProblem::get_starting_point(Ipopt::Index n, bool init_x, double* x, bool init_z, double* z_L,
                                   double* z_U, Ipopt::Index m, bool init_lambda, double* lambda) {
  ASL* asl = asl_;
  for (int i = 0; init_x && i < n; ++i)
    x[i] = X0 ? X0[i] : std::max(LUv[2 * i], std::min(0.0, LUv[2 * i + 1]));
  for (int i = 0; init_z && i < n; ++i) {
    const double side = variable_players_[static_cast<std::size_t>(i)] == Player::Min ? 1.0 : -1.0;
    z_L[i] = z_U[i] = side;
  }
  // AMPL: grad f = J' pi; ours: sign grad f + J' lambda = 0.
  for (int i = 0; init_lambda && i < m; ++i) lambda[i] = pi0 ? -sign_ * pi0[i] : 0.0;
  return true;
}

bool NlProblem::evaluate(const double* x) {
  ASL* asl = asl_;
  if (!x_.empty() && std::equal(x_.begin(), x_.end(), x)) return defined_;
  x_.assign(x, x + n_var);
  g_.resize(static_cast<std::size_t>(n_con));
  fint error = 0;
  f_ = objective_ >= 0 ? sign_ * objval(objective_, x_.data(), &error) : 0.0;
  fint constraint_error = 0;
  if (n_con > 0) conval(x_.data(), g_.data(), &constraint_error);
  defined_ = error == 0 && constraint_error == 0;
  return defined_;
}

bool NlProblem::eval_f(Ipopt::Index, const double* x, bool, double& value) {
  if (!evaluate(x)) return false;
  value = f_;
  return true;
}

bool NlProblem::eval_grad_f(Ipopt::Index n, const double* x, bool, double* gradient) {
  ASL* asl = asl_;
  if (!evaluate(x)) return false;
  std::fill(gradient, gradient + n, 0.0);
  if (objective_ < 0) return true;
  fint error = 0;
  objgrd(objective_, x_.data(), gradient, &error);
  for (int i = 0; i < n; ++i) gradient[i] *= sign_;
  return error == 0;
}

bool NlProblem::eval_g(Ipopt::Index, const double* x, bool, Ipopt::Index, double* g) {
  if (!evaluate(x)) return false;
  std::copy(g_.begin(), g_.end(), g);
  return true;
}

bool NlProblem::eval_jac_g(Ipopt::Index, const double* x, bool, Ipopt::Index m, Ipopt::Index,
                           Ipopt::Index* rows, Ipopt::Index* columns, double* values) {
  ASL* asl = asl_;
  if (!values) {
    for (int i = 0; i < m; ++i)
      for (const cgrad* entry = Cgrad[i]; entry; entry = entry->next) {
        rows[entry->goff] = i;
        columns[entry->goff] = entry->varno;
      }
    return true;
  }
  if (!evaluate(x)) return false;
  fint error = 0;
  if (m > 0) jacval(x_.data(), values, &error);
  return error == 0;
}

bool NlProblem::eval_h(Ipopt::Index n, const double* x, bool, double sigma, Ipopt::Index m,
                       const double* lambda, bool, Ipopt::Index, Ipopt::Index* rows,
                       Ipopt::Index* columns, double* values) {
  ASL* asl = asl_;
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
  if (!evaluate(x)) return false;
  std::vector<double> weights(static_cast<std::size_t>(n_obj) + 1, 0.0);
  if (objective_ >= 0) weights[static_cast<std::size_t>(objective_)] = sign_ * sigma;
  std::vector<double> multipliers(lambda, lambda + m);
  sphes(values, objective_, objective_ >= 0 ? weights.data() : nullptr,
        m > 0 ? multipliers.data() : nullptr);
  return std::all_of(values, values + hessian_entries_, [](double v) { return std::isfinite(v); });
}

void NlProblem::write_solution(const std::string& message, int solve_result, const Result& result) {
  ASL* asl = asl_;
  std::vector<double> x = result.v, pi = result.lambda, lower = result.z_lower,
                      upper = result.z_upper;
  for (double& value : pi) value *= -sign_;
  for (double& value : lower) value *= sign_;
  for (double& value : upper) value *= -sign_;
  if (!lower.empty()) suf_rput(z_lower_name, ASL_Sufkind_var, lower.data());
  if (!upper.empty()) suf_rput(z_upper_name, ASL_Sufkind_var, upper.data());
  solve_result_num = solve_result;
  std::string text = message;
  write_sol(text.data(), x.empty() ? nullptr : x.data(), pi.empty() ? nullptr : pi.data(), nullptr);
}

}  // namespace ipminmax
