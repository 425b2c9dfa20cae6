#include <algorithm>
#include <limits>
#include <utility>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

constexpr Index kNotSet = std::numeric_limits<Index>::min();

[[noreturn]] void reject(const auto&... why) {
  THROW_EXCEPTION(Ipopt::TNLP::INVALID_TNLP, concat(why...));
}

/// Looks at owners that a model has written.
void require_players(const char* method, const char* kind, const std::vector<Player>& players) {
  for (const auto i : indices(players)) {
    if (players[i] == Player::Min || players[i] == Player::Max) continue;
    reject(method, " gives ", kind, " ", i, " the owner ", static_cast<int>(players[i]),
           ", which is no player");
  }
}

/// One matrix of the model, as its structure call left it.
struct StructureCall {
  const char* matrix;  ///< "Jacobian" or "Hessian"
  const std::vector<Index>& rows;
  const std::vector<Index>& cols;
  Index row_count = 0;
  Index col_count = 0;
  Index first = 0;  ///< 0 for C_STYLE, 1 for FORTRAN_STYLE

  [[nodiscard]] bool in_range(Index i, Index count) const {
    return i >= first && i - first < count;
  }
  [[nodiscard]] std::string range(Index count) const {
    if (count == 0) return "none exist";
    return concat(first, " to ", count - 1 + first);
  }

  /// 0-based.
  void read(std::vector<Triplet>& triplets) const {
    triplets.resize(rows.size());
    for (const auto k : indices(rows)) {
      if (rows[k] == kNotSet || cols[k] == kNotSet)
        reject(matrix, " entry ", k, " was not set by the model");
      if (!in_range(rows[k], row_count) || !in_range(cols[k], col_count))
        reject(matrix, " entry ", k, " is at row ", rows[k], ", column ", cols[k],
               ", outside the matrix (rows ", range(row_count), ", columns ", range(col_count),
               first == 0 ? ", C style)" : ", Fortran style)");
      triplets[k] = {rows[k] - first, cols[k] - first};
    }
  }
};

std::vector<std::string> names_of(const Ipopt::TNLP::StringMetaDataMapType& strings, Index count) {
  const auto names = strings.find("idx_names");
  if (names == strings.end() || names->second.size() != at(count)) return {};
  return names->second;
}

/// Players from the metadata "player", when there. what: "variable" or "constraint".
void read_metadata(const Ipopt::TNLP::IntegerMetaDataMapType& integers, const char* what,
                   std::vector<Player>& players) {
  const auto found = integers.find("player");
  if (found == integers.end()) return;
  const auto& values = found->second;
  if (values.size() != players.size()) {
    reject(what, " metadata \"player\" has ", values.size(), " values for ", players.size(), " ",
           what, "s");
  }
  for (const auto i : indices(values)) {
    if (values[i] != 0 && values[i] != 1) {
      reject(what, " metadata \"player\" is ", values[i], " at index ", i,
             "; it must be 0 (Min) or 1 (Max)");
    }
    players[i] = values[i] == 1 ? Player::Max : Player::Min;
  }
}

}  // namespace

TnlpProblem::TnlpProblem(const Ipopt::SmartPtr<Ipopt::TNLP>& model, PlayerOptions options,
                         HessianApproximation hessian)
    : model_(model), options_(std::move(options)), hessian_source_(hessian) {}

std::string TnlpProblem::load() {
  started_ = false;
  try {
    load_sizes();
    load_metadata();
    load_bounds();
    load_jacobian_structure();
    load_hessian_structure();
    structure_.variable_players.assign(at(n_), Player::Min);
    read_players(true);
    implied_constraint_players(structure_, structure_.constraint_players);
    read_players(false);
    load_bounds();  // Ipopt asks twice
  } catch (const Ipopt::TNLP::INVALID_TNLP& error) {
    return error.Message();
  }
  return {};
}

void TnlpProblem::load_sizes() {
  if (!model_->get_nlp_info(n_, m_, jacobian_entries_, hessian_entries_, index_style_))
    reject("get_nlp_info returned false");
  for (const auto& [name, size] :
       {std::pair("n", n_), std::pair("m", m_), std::pair("nnz_jac_g", jacobian_entries_),
        std::pair("nnz_h_lag", hessian_entries_)}) {
    if (size < 0) reject("get_nlp_info set ", name, " = ", size);
  }
  if (index_style_ != Ipopt::TNLP::C_STYLE && index_style_ != Ipopt::TNLP::FORTRAN_STYLE)
    reject("get_nlp_info set index_style = ", static_cast<Index>(index_style_));
}

void TnlpProblem::load_metadata() {
  Metadata& v = variable_metadata_;
  Metadata& g = constraint_metadata_;
  v = {};
  g = {};
  if (!model_->get_var_con_metadata(n_, v.strings, v.integers, v.numbers, m_, g.strings, g.integers,
                                    g.numbers)) {
    v = {};
    g = {};
  }
  structure_.variable_names = names_of(v.strings, n_);
  structure_.constraint_names = names_of(g.strings, m_);
}

void TnlpProblem::load_bounds() {
  // NaN marks what the model leaves unset; the core names it.
  structure_.variable_lower.assign(at(n_), kNaN);
  structure_.variable_upper.assign(at(n_), kNaN);
  structure_.constraint_lower.assign(at(m_), kNaN);
  structure_.constraint_upper.assign(at(m_), kNaN);
  if (!model_->get_bounds_info(
          n_, address(structure_.variable_lower), address(structure_.variable_upper), m_,
          address(structure_.constraint_lower), address(structure_.constraint_upper)))
    reject("get_bounds_info returned false");
}

void TnlpProblem::expect_entries(Index entries) {
  rows_.assign(at(entries), kNotSet);
  cols_.assign(at(entries), kNotSet);
}

void TnlpProblem::load_jacobian_structure() {
  expect_entries(jacobian_entries_);
  has_no_jacobian_ = !model_->eval_jac_g(n_, nullptr, false, m_, jacobian_entries_, address(rows_),
                                         address(cols_), nullptr);
  if (has_no_jacobian_)
    reject("eval_jac_g returned false when asked for the structure of the Jacobian");
  StructureCall{"Jacobian", rows_, cols_, m_, n_, first_index()}.read(structure_.jacobian);
}

void TnlpProblem::load_hessian_structure() {
  structure_.has_hessian = true;
  structure_.nonlinear_variables.reset();
  expect_entries(hessian_entries_);
  if (hessian_source_ == HessianApproximation::LimitedMemory ||
      !model_->eval_h(n_, nullptr, false, 0.0, m_, nullptr, false, hessian_entries_, address(rows_),
                      address(cols_), nullptr)) {
    structure_.has_hessian = false;  // what a TNLP without eval_h does
    structure_.hessian.clear();
    hessian_entries_ = 0;
    return load_nonlinear_variables();
  }
  StructureCall{"Hessian", rows_, cols_, n_, n_, first_index()}.read(structure_.hessian);
}

void TnlpProblem::load_nonlinear_variables() {
  const Index count = model_->get_number_of_nonlinear_variables();
  if (count < 0) return;
  if (count > n_)
    reject("get_number_of_nonlinear_variables returned ", count, " of ", n_, " variables");
  std::vector<Index> variables(at(count), kNotSet);
  if (!model_->get_list_of_nonlinear_variables(count, address(variables)))
    reject("get_list_of_nonlinear_variables returned false");
  const Index first = first_index();
  for (Index& i : variables) {
    if (i == kNotSet) reject("get_list_of_nonlinear_variables left an entry unset");
    if (i < first || i - first >= n_)
      reject("get_list_of_nonlinear_variables lists variable ", i, ", but the variables are ",
             first, " to ", n_ - 1 + first);
    i -= first;
  }
  structure_.nonlinear_variables = std::move(variables);
}

void TnlpProblem::read_players(bool of_variables) {
  auto* model = dynamic_cast<MinMaxTNLP*>(GetRawPtr(model_));
  auto& players = of_variables ? structure_.variable_players : structure_.constraint_players;
  const Metadata& metadata = of_variables ? variable_metadata_ : constraint_metadata_;
  const Index count = of_variables ? n_ : m_;
  const char* const kind = of_variables ? "variable" : "constraint";
  const char* const method = of_variables ? "get_variable_players" : "get_constraint_players";
  implied_players_ = players;
  if (model == nullptr) {
    read_metadata(metadata.integers, kind, players);
  } else if (!(of_variables ? model->get_variable_players(count, address(players))
                            : model->get_constraint_players(count, address(players)))) {
    reject(method, " returned false");
  } else {
    require_players(method, kind, players);
  }
  // Names of another number than count are not used.
  const auto given = metadata.strings.find("idx_names");
  const ListedItems items{kind, count,
                          of_variables ? &structure_.variable_names : &structure_.constraint_names,
                          given != metadata.strings.end() ? given->second.size() : 0};
  std::string_view by = options_.stated_by;
  if (by.empty()) by = model != nullptr ? method : "metadata \"player\"";
  const StatedPlayers stated{by, implied_players_};
  std::string error = apply_player_option(
      of_variables ? "minmax_max_variables" : "minmax_max_constraints",
      of_variables ? options_.max_variables : options_.max_constraints, items, stated, players);
  if (!of_variables && error.empty()) error = apply_min_constraints(options_, items, players);
  if (!error.empty()) reject(error);
}

bool TnlpProblem::starting_point(StartingPoint& start) {
  const bool warm = start.needs_multipliers;
  // What is not asked for still gets an array, as from Ipopt.
  const auto room = [&](std::span<double> asked, std::vector<double>& unread, Index size) {
    unread.assign(warm ? 0 : at(size), 0.0);
    return warm ? address(asked) : address(unread);
  };
  if (!model_->get_starting_point(n_, true, address(start.v), warm,
                                  room(start.z_lower, unread_z_lower_, n_),
                                  room(start.z_upper, unread_z_upper_, n_), m_, warm,
                                  room(start.lambda, unread_lambda_, m_))) {
    return false;
  }
  start_.assign(start.v.begin(), start.v.end());
  started_ = true;
  return true;
}

bool TnlpProblem::user_scaling(UserScaling& scaling) {
  bool scale_variables = false;
  bool scale_constraints = false;
  scaling.objective = 1.0;
  scaling.variables.assign(at(n_), 1.0);
  scaling.constraints.assign(at(m_), 1.0);
  const bool ok = model_->get_scaling_parameters(scaling.objective, scale_variables, n_,
                                                 address(scaling.variables), scale_constraints, m_,
                                                 address(scaling.constraints));
  if (!scale_variables) scaling.variables.clear();
  if (!scale_constraints) scaling.constraints.clear();
  return ok;
}

const BoxFunctions* TnlpProblem::over_boxes() const {
  auto* model = dynamic_cast<ModelOverBoxes*>(GetRawPtr(model_));
  return model != nullptr ? model->over_boxes() : nullptr;
}

std::unique_ptr<Problem> TnlpProblem::clone() const {
  const auto model = ClonableModel::clone_of(*model_);
  if (IsNull(model)) return nullptr;
  auto copy = std::make_unique<TnlpProblem>(model, options_, hessian_source_);
  return copy->load().empty() ? std::move(copy) : nullptr;
}

bool TnlpProblem::report(const IterationInfo& info) {
  if (info.over_y) {
    auto* model = dynamic_cast<MinMaxTNLP*>(GetRawPtr(model_));
    return model == nullptr || model->maximization_callback(info.iteration, info.objective);
  }
  return model_->intermediate_callback(
      info.restoration ? Ipopt::RestorationPhaseMode : Ipopt::RegularMode, info.iteration,
      info.objective, info.error.primal, std::max(info.error.dual_min, info.error.dual_max),
      info.mu, info.step_norm, std::max(info.delta_x, info.delta_y), info.alpha_dual,
      info.alpha_primal, info.trials, nullptr, nullptr);
}

void TnlpProblem::finalize(Ipopt::SolverReturn status, const Result& result) {
  const Metadata& v = variable_metadata_;
  const Metadata& g = constraint_metadata_;
  model_->finalize_metadata(n_, v.strings, v.integers, v.numbers, m_, g.strings, g.integers,
                            g.numbers);

  // Without a point: the start, the rest NaN.
  unknown_.assign(at(std::max({n_, m_, 1})), kNaN);
  const auto address_of = [&](const std::vector<double>& values, Index length) {
    return values.size() == at(length) && length > 0 ? values.data() : unknown_.data();
  };
  const bool solved = result.v.size() == at(n_);
  model_->finalize_solution(status, n_, address_of(solved ? result.v : start_, n_),
                            address_of(result.z_lower, n_), address_of(result.z_upper, n_), m_,
                            address_of(result.constraints, m_), address_of(result.lambda, m_),
                            result.objective, nullptr, nullptr);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
