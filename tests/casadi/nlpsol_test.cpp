// The plugin in a real CasADi: answers, certificates, multipliers, warm starts, callbacks, errors.
#include <gtest/gtest.h>

#include <IpOptionsList.hpp>
#include <casadi/casadi.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/ipopt/minmax_application.hpp"

namespace {

using casadi::Dict;
using casadi::DM;
using casadi::DMDict;
using casadi::Function;
using casadi::MX;
using casadi::MXDict;
using casadi::SX;
using casadi::SXDict;

const Dict kQuiet{{"print_level", 0}, {"sb", true}, {"option_file_name", std::string()}};

Dict options(const std::vector<casadi_int>& players, Dict more = {}) {
  more["players"] = players;
  if (more.count("ipminmax") == 0) more["ipminmax"] = kQuiet;
  more["print_time"] = false;
  return more;
}

/// f = 2 x0^2 + x1^2 + 3 x0 y - y^2, x0 + x1 = p, y <= 1/4: tests/adapter/model.hpp with a bound.
SXDict game() {
  const SX v = SX::sym("v", 3), p = SX::sym("p");
  return {{"x", v},
          {"p", p},
          {"f", 2 * v(0) * v(0) + v(2) * v(2) + 3 * v(0) * v(1) - v(1) * v(1)},
          {"g", v(0) + v(2)}};
}

DMDict arguments(double rhs, double y_upper) {
  return {{"x0", std::vector<double>{1.0, 0.1, 0.0}},
          {"p", rhs},
          {"lbx", std::vector<double>{-10.0, -5.0, -casadi::inf}},
          {"ubx", std::vector<double>{casadi::inf, y_upper, casadi::inf}},
          {"lbg", rhs},
          {"ubg", rhs}};
}

TEST(CasadiPlugin, SolvesAndCertifies) {
  const Function solver = nlpsol("s", "ipminmax", game(), options({0, 1, 0}));
  const DMDict answer = solver(arguments(1.0, 5.0));
  const std::vector<double> x = answer.at("x").get_elements();
  EXPECT_NEAR(x[0], 4.0 / 21.0, 1e-7);
  EXPECT_NEAR(x[1], 2.0 / 7.0, 1e-7);
  EXPECT_NEAR(x[2], 17.0 / 21.0, 1e-7);
  EXPECT_NEAR(double(answer.at("f")), 17.0 / 21.0, 1e-7);
  EXPECT_NEAR(double(answer.at("lam_g")), -34.0 / 21.0, 1e-6);
  const Dict stats = solver.stats();
  EXPECT_TRUE(stats.at("success").to_bool());
  EXPECT_EQ(stats.at("return_status").to_string(), "Solve_Succeeded");
  const Dict certificate = stats.at("certificate");
  EXPECT_TRUE(certificate.at("local_minmax").to_bool());
  EXPECT_EQ(certificate.at("full").to_int_vector(),
            certificate.at("full_expected").to_int_vector());
  EXPECT_GT(certificate.at("margin").to_double(), 0.0);
  const std::vector<std::string> statements = stats.at("statements").to_string_vector();
  ASSERT_EQ(statements.size(), 4U);
  EXPECT_EQ(statements[1], "local minmax");
}

TEST(CasadiPlugin, WorstCasesAndPointsAreInTheStats) {
  // x <= 1 - y for every y in [-1, 1], to be as large as possible: y = 1 is worst, x = 0.
  const SX v = SX::sym("v", 2);
  Dict quiet = kQuiet;
  quiet["minmax_worst_case_starts"] = 4;
  const Function robust = nlpsol(
      "s", "ipminmax", SXDict{{"x", v}, {"f", -v(0)}, {"g", v(0) + v(1)}},
      options({0, 1}, {{"ipminmax", quiet}, {"constraint_players", std::vector<casadi_int>{0}}}));
  const DMDict answer = robust(DMDict{{"x0", std::vector<double>{-1.0, 0.3}},
                                      {"lbx", std::vector<double>{-casadi::inf, -1.0}},
                                      {"ubx", std::vector<double>{casadi::inf, 1.0}},
                                      {"ubg", 1.0}});
  EXPECT_NEAR(answer.at("x").get_elements()[0], 0.0, 1e-6);
  Dict stats = robust.stats();
  const auto worst_cases = stats.at("worst_cases").to_double_vector_vector();
  ASSERT_FALSE(worst_cases.empty());
  EXPECT_NEAR(worst_cases[0][1], 1.0, 1e-6);
  EXPECT_EQ(stats.at("worst_case_constraints").to_int_vector()[0], 0);
  // Four valleys of equal depth: distinct points of a multistart.
  const SX x = SX::sym("x", 3);
  SX f = -x(2) * x(2) + x(0) * x(2) * 0.1;
  for (int i = 0; i < 2; ++i) f += (x(i) * x(i) - 1) * (x(i) * x(i) - 1);
  quiet = kQuiet;
  quiet["minmax_starts"] = 40;
  const Function many = nlpsol("s", "ipminmax", SXDict{{"x", x}, {"f", f}},
                               options({0, 0, 1}, {{"ipminmax", quiet}}));
  static_cast<void>(
      many(DMDict{{"x0", std::vector<double>{0.5, 0.5, 0.0}}, {"lbx", -2.0}, {"ubx", 2.0}}));
  stats = many.stats();
  EXPECT_EQ(stats.at("points").to_double_vector_vector().size(), 4U);
}

TEST(CasadiPlugin, MaxMultipliersBalanceTheGradient) {
  const Function solver = nlpsol("s", "ipminmax", game(), options({0, 1, 0}));
  const DMDict answer = solver(arguments(1.0, 0.1));  // y stops at 0.1
  const std::vector<double> x = answer.at("x").get_elements();
  EXPECT_NEAR(x[1], 0.1, 1e-6);
  const double gradient = 3.0 * x[0] - 2.0 * x[1];  // y would go on
  EXPECT_GT(gradient, 0.05);
  EXPECT_NEAR(answer.at("lam_x").get_elements()[1], -gradient, 1e-6);
}

TEST(CasadiPlugin, WarmStartsTakeMaxMultipliersWithTheirSigns) {
  Dict warm = kQuiet;
  warm["warm_start_init_point"] = true;
  for (const char* push : {"warm_start_bound_push", "warm_start_bound_frac",
                           "warm_start_mult_bound_push", "mu_init"}) {
    warm[push] = 1e-9;
  }
  const Function cold = nlpsol("s", "ipminmax", game(), options({0, 1, 0}));
  const Function solver = nlpsol("s", "ipminmax", game(), options({0, 1, 0}, {{"ipminmax", warm}}));
  DMDict start = arguments(1.0, 0.1);
  const DMDict answer = cold(start);
  const int cold_iterations = static_cast<int>(cold.stats().at("iter_count").to_int());
  start["x0"] = answer.at("x");
  start["lam_x0"] = answer.at("lam_x");
  start["lam_g0"] = answer.at("lam_g");
  static_cast<void>(solver(start));
  EXPECT_TRUE(solver.stats().at("success").to_bool());
  EXPECT_LE(solver.stats().at("iter_count").to_int(), 1);
  EXPECT_GE(cold_iterations, 4);
  // Without a step the multipliers come back as they were given, to either bound of y.
  warm["max_iter"] = 0;
  const Function still = nlpsol("s", "ipminmax", game(), options({0, 1, 0}, {{"ipminmax", warm}}));
  for (const double lam : {-0.4, 0.4}) {
    start["lam_x0"] = std::vector<double>{0.0, lam, 0.0};
    EXPECT_NEAR(still(start).at("lam_x").get_elements()[1], lam, 1e-6);
  }
}

TEST(CasadiPlugin, SolvesAgainWithOtherNumbersWithoutAnAnalysis) {
  const Function solver = nlpsol("s", "ipminmax", game(), options({0, 1, 0}));
  for (const double rhs : {1.0, 2.0, -0.5}) {
    const DMDict answer = solver(arguments(rhs, 5.0));
    EXPECT_NEAR(answer.at("x").get_elements()[0], rhs * 4.0 / 21.0, 1e-6) << rhs;
    EXPECT_EQ(solver.stats().at("analyses").to_int() == 0, rhs != 1.0);
  }
}

TEST(CasadiPlugin, PlayersByMetadataAndPlainMinimization) {
  Dict by_metadata = options({0, 0, 0});
  by_metadata.erase("players");
  by_metadata["var_integer_md"] = Dict{{"player", std::vector<casadi_int>{0, 1, 0}}};
  const Function solver = nlpsol("s", "ipminmax", game(), by_metadata);
  EXPECT_NEAR(double(solver(arguments(1.0, 5.0)).at("f")), 17.0 / 21.0, 1e-7);

  const MX x = MX::sym("x", 2);
  const MX rosenbrock = sumsqr(1.0 - x(0)) + 100.0 * sumsqr(x(1) - x(0) * x(0));
  const Function plain = nlpsol("s", "ipminmax", MXDict{{"x", x}, {"f", rosenbrock}},
                                {{"ipminmax", kQuiet}, {"print_time", false}});
  EXPECT_NEAR(double(plain(DMDict{{"x0", std::vector<double>{-1.2, 1.0}}}).at("x")(1)), 1.0, 1e-6);
}

/// Counts its calls and stops at one of them.
class Stopper : public casadi::Callback {
 public:
  Stopper(casadi_int nx, casadi_int ng, int stop_at) : nx_(nx), ng_(ng), stop_at_(stop_at) {
    construct("stopper", {});
  }
  casadi_int get_n_in() override { return casadi::nlpsol_n_out(); }
  casadi_int get_n_out() override { return 1; }
  std::string get_name_in(casadi_int i) override { return casadi::nlpsol_out(i); }
  casadi::Sparsity get_sparsity_in(casadi_int i) override {
    const std::string name = casadi::nlpsol_out(i);
    const casadi_int rows = name == "f"                      ? 1
                            : name == "x" || name == "lam_x" ? nx_
                            : name == "g" || name == "lam_g" ? ng_
                                                             : 0;
    return casadi::Sparsity::dense(rows, rows == 0 ? 0 : 1);
  }
  std::vector<DM> eval(const std::vector<DM>& arg) const override {
    last_x = arg[casadi::NLPSOL_X];
    return {DM(++calls > stop_at_ ? 1.0 : 0.0)};
  }
  mutable int calls = 0;
  mutable DM last_x;

 private:
  casadi_int nx_, ng_;
  int stop_at_;
};

TEST(CasadiPlugin, CallbackSeesTheIteratesAndStops) {
  SXDict nlp = game();
  nlp["p"] = SX::sym("p");
  const Stopper stopper(3, 1, 2);
  const Function solver =
      nlpsol("s", "ipminmax", nlp, options({0, 1, 0}, {{"iteration_callback", stopper}}));
  const DMDict answer = solver(arguments(1.0, 5.0));
  EXPECT_EQ(stopper.calls, 3);
  EXPECT_EQ(solver.stats().at("return_status").to_string(), "User_Requested_Stop");
  EXPECT_FALSE(solver.stats().at("success").to_bool());
  EXPECT_EQ(answer.at("x").get_elements(), stopper.last_x.get_elements());
}

TEST(CasadiPlugin, SolversAreSerialized) {
  const Function solver = nlpsol("s", "ipminmax", game(), options({0, 1, 0}));
  const Function copy = Function::deserialize(solver.serialize());
  const DMDict answer = solver(arguments(1.0, 5.0)), other = copy(arguments(1.0, 5.0));
  EXPECT_EQ(answer.at("x").get_elements(), other.at("x").get_elements());
  EXPECT_TRUE(copy.stats().at("certificate").to_dict().at("local_minmax").to_bool());
}

TEST(CasadiPlugin, DerivativesMayBeGiven) {
  const SX v = SX::sym("v", 2), p = SX::sym("p", 0), lam_f = SX::sym("lam_f"),
           lam_g = SX::sym("lam_g", 0);
  const SX f = sq(v(0) - 1) + v(0) * v(1) - sq(v(1));
  const SX hessian = triu(lam_f * SX::hessian(f, v));
  const Function hess_lag("lagrangian", {v, p, lam_f, lam_g}, {hessian});
  const Function grad_f("slope", {v, p}, {f, gradient(f, v)});
  const SXDict nlp{{"x", v}, {"f", f}};
  const Function solver =
      nlpsol("s", "ipminmax", nlp, options({0, 1}, {{"hess_lag", hess_lag}, {"grad_f", grad_f}}));
  const DMDict answer = solver(DMDict{{"x0", 0.0}});
  EXPECT_NEAR(answer.at("x").get_elements()[0], 0.8, 1e-7);  // y = x / 2, phi = (x - 1)^2 + x^2 / 4
  const Function full("lagrangian", {v, p, lam_f, lam_g}, {lam_f * SX::hessian(f, v)});
  EXPECT_THROW(nlpsol("s", "ipminmax", nlp, options({0, 1}, {{"hess_lag", full}})),
               casadi::CasadiException);
}

TEST(CasadiPlugin, TheLogGoesToCasadisStream) {
  std::ostringstream seen;
  std::streambuf* const before = casadi::uout().rdbuf(seen.rdbuf());
  const Function solver =
      nlpsol("s", "ipminmax", game(), options({0, 1, 0}, {{"ipminmax", Dict{{"print_level", 5}}}}));
  static_cast<void>(solver(arguments(1.0, 5.0)));
  casadi::uout().rdbuf(before);
  EXPECT_NE(seen.str().find("EXIT"), std::string::npos) << seen.str();
}

TEST(CasadiPlugin, BadInputIsNamed) {
  const auto error = [](const Dict& with) -> std::string {
    try {
      const Function solver = nlpsol("s", "ipminmax", game(), with);
      static_cast<void>(solver(arguments(1.0, 5.0)));
    } catch (const std::exception& caught) {
      return caught.what();
    }
    return "no error";
  };
  EXPECT_NE(error(options({0, 1})).find("players has 2 entries"), std::string::npos);
  EXPECT_NE(error(options({0, 2, 0})).find("0 (Min) or 1 (Max)"), std::string::npos);
  EXPECT_NE(error(options({0, 1, 0}, {{"ipminmax", Dict{{"tolerance", 1.0}}}}))
                .find("No such option of Ipminmax: tolerance"),
            std::string::npos);
  EXPECT_NE(error(options({0, 1, 0}, {{"ipminmax", Dict{{"tol", -1.0}}}})).find("tol"),
            std::string::npos);
}

TEST(CasadiPlugin, PursuitIsThatOfTheCppExample) {
  namespace ch = chauffeur;
  const ch::Parameters q;
  const ch::State now;
  SX v, g, f = 0.0, p = DM(std::vector<double>{now.px, now.py, now.heading}),
           e = DM(std::vector<double>{now.ex, now.ey});
  std::vector<casadi_int> players;
  std::vector<double> lbg, ubg;
  for (int i = 0; i < q.horizon; ++i) {
    const SX u = SX::sym("u"), d = SX::sym("d", 2), p1 = SX::sym("p", 3), e1 = SX::sym("e", 2);
    g = vertcat(std::vector<SX>{
        g, p1 - vertcat(p(0) + q.speed * cos(p(2)), p(1) + q.speed * sin(p(2)), p(2) + u), u * u,
        e1 - e - d, sumsqr(d)});
    lbg.insert(lbg.end(), {0.0, 0.0, 0.0, -casadi::inf, 0.0, 0.0, -casadi::inf});
    ubg.insert(ubg.end(), {0.0, 0.0, 0.0, q.u_max * q.u_max, 0.0, 0.0, q.d_max * q.d_max});
    f += sumsqr(p1(casadi::Slice(0, 2)) - e1) + q.gamma_u * u * u - q.gamma_d * sumsqr(d);
    v = vertcat(std::vector<SX>{v, u, p1, d, e1});
    players.insert(players.end(), {0, 0, 0, 0, 1, 1, 1, 1});
    p = p1;
    e = e1;
  }
  Ipopt::SmartPtr<ch::ChauffeurTNLP> model = new ch::ChauffeurTNLP(q, now, {0.01, 0.002, 0.001});
  std::vector<double> start(static_cast<std::size_t>(8 * q.horizon));
  model->get_starting_point(8 * q.horizon, true, start.data(), false, nullptr, nullptr, 0, false,
                            nullptr);
  Dict solver_options = kQuiet;
  const Function solver = nlpsol("s", "ipminmax", SXDict{{"x", v}, {"f", f * q.scale}, {"g", g}},
                                 options(players, {{"ipminmax", solver_options}}));
  const DMDict answer = solver(DMDict{{"x0", start}, {"lbg", lbg}, {"ubg", ubg}});
  EXPECT_TRUE(Dict(solver.stats().at("certificate")).at("local_minmax").to_bool());

  const Ipopt::SmartPtr<ipminmax::MinMaxApplication> app = new ipminmax::MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->OptimizeTNLP(Ipopt::GetRawPtr(model)), Ipopt::Solve_Succeeded);
  const ipminmax::Result& cpp = app->LastResult();
  const std::vector<double> x = answer.at("x").get_elements();
  const std::vector<double> lambda = answer.at("lam_g").get_elements();
  for (std::size_t i = 0; i < cpp.v.size(); ++i) EXPECT_NEAR(x[i], cpp.v[i], 1e-8) << i;
  for (std::size_t j = 0; j < cpp.lambda.size(); ++j) {
    EXPECT_NEAR(lambda[j], cpp.lambda[j], 1e-6) << j;
  }
  EXPECT_NEAR(double(answer.at("f")), cpp.objective, 1e-10);
  EXPECT_EQ(solver.stats().at("iter_count").to_int(), cpp.iterations);
}

}  // namespace
