// The homicidal chauffeur (examples/chauffeur_tnlp.hpp) in CasADi: a car chases a pedestrian. Run
// with the plugin's folder in the environment variable CASADIPATH.
#include <casadi/casadi.hpp>
#include <cstdio>
#include <vector>
using namespace casadi;

int main() {
  const int T = 20;
  const double speed = 0.1, u_max = 0.5, d_max = 0.06, gamma_u = 80.0, gamma_d = 1000.0;
  SX v, g, f = 0.0, p = DM({0.0, 0.0, 0.0}), e = DM({0.5, 0.5});
  std::vector<casadi_int> players;
  std::vector<double> start, lbg, ubg;
  for (int i = 0; i < T; ++i) {
    const SX u = SX::sym("u"), d = SX::sym("d", 2);               // what they do
    const SX p_next = SX::sym("p", 3), e_next = SX::sym("e", 2);  // where that takes them
    g = vertcat(std::vector<SX>{
        g, p_next - vertcat(p(0) + speed * cos(p(2)), p(1) + speed * sin(p(2)), p(2) + u), u * u,
        e_next - e - d, sumsqr(d)});
    lbg.insert(lbg.end(), {0.0, 0.0, 0.0, -inf, 0.0, 0.0, -inf});
    ubg.insert(ubg.end(), {0.0, 0.0, 0.0, u_max * u_max, 0.0, 0.0, d_max * d_max});
    f += sumsqr(p_next(Slice(0, 2)) - e_next) + gamma_u * u * u - gamma_d * sumsqr(d);
    v = vertcat(std::vector<SX>{v, u, p_next, d, e_next});
    players.insert(players.end(), {0, 0, 0, 0, 1, 1, 1, 1});  // the pedestrian maximizes
    start.insert(start.end(), {0.01, speed * (i + 1), 0.0, 0.0, 0.002, 0.001, 0.5, 0.5});
    p = p_next;
    e = e_next;
  }
  const Function solver =
      nlpsol("solver", "ipminmax", SXDict{{"x", v}, {"f", f / 400.0}, {"g", g}},
             {{"players", players}, {"print_time", false}, {"ipminmax", Dict{{"print_level", 0}}}});
  const DMDict answer = solver(DMDict{{"x0", start}, {"lbg", lbg}, {"ubg", ubg}});
  const Dict stats = solver.stats(), certificate = stats.at("certificate");
  std::printf("f = %.9f, u_0 = %.6f, d_0 = (%.6f, %.6f): %s, %s\n", double(answer.at("f")),
              double(answer.at("x")(0)), double(answer.at("x")(4)), double(answer.at("x")(5)),
              stats.at("status").to_string().c_str(), certificate.at("kind").to_string().c_str());
  return certificate.at("local_minmax").to_bool() ? 0 : 1;
}
