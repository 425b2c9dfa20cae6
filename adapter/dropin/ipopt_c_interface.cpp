// Library ipminmax_ipopt: the functions of Ipopt's IpStdCInterface.h, so that a program made for
// Ipopt's C interface runs on this solver unchanged.
//
// One binary serves Ipopt 3.11, whose Bool is int, and 3.14, whose callbacks and functions use
// bool: of what a callback returns the low byte is read (ipminmax.h), and the int 0 or 1 returned
// here is a bool in its low byte. IpStdCInterface.h itself is not included, because it is one or
// the other.
//
// An IpoptProblem is an IpminmaxProblem: IpminmaxGetCertificate and the others work on it, too.

#include <cstdio>
#include <fstream>
#include <new>
#include <vector>

#include "adapter/c/ipminmax.h"
#include "adapter/ipopt/minmax_tnlp.hpp"

namespace {

/// Files of options, in the order in which they are looked for.
constexpr const char* kOwnOptions = "ipminmax.opt";
constexpr const char* kIpoptOptions = "ipopt.opt";

bool exists(const char* file_name) { return std::ifstream(file_name).is_open(); }

/// Ipopt's functions have no way to say why they fail but the terminal.
int report(IpminmaxProblem problem, int done) {
  if (done == 0) std::fprintf(stderr, "Ipminmax: %s\n", IpminmaxMessage(problem));
  return done;
}

/// Ipopt reads ipopt.opt unless option_file_name says otherwise.
void choose_options_file(IpminmaxProblem problem) {
  const char* file = exists(kOwnOptions) ? kOwnOptions : exists(kIpoptOptions) ? kIpoptOptions : "";
  IpminmaxAddStrOption(problem, "option_file_name", file);
}

}  // namespace

extern "C" {

IpminmaxProblem CreateIpoptProblem(int n, double* x_L, double* x_U, int m, double* g_L, double* g_U,
                                   int nele_jac, int nele_hess, int index_style,
                                   IpminmaxEval_F_CB eval_f, IpminmaxEval_G_CB eval_g,
                                   IpminmaxEval_Grad_F_CB eval_grad_f,
                                   IpminmaxEval_Jac_G_CB eval_jac_g, IpminmaxEval_H_CB eval_h) {
  IpminmaxProblem problem = nullptr;
  try {
    // Options minmax_max_variables and minmax_max_constraints may give some to Max.
    const std::vector<int> players(n > 0 ? static_cast<std::size_t>(n) : 1, IPMINMAX_MIN);
    problem = IpminmaxCreate(n, x_L, x_U, m, g_L, g_U, nele_jac, nele_hess, index_style, eval_f,
                             eval_g, eval_grad_f, eval_jac_g, eval_h, players.data(), nullptr);
    report(nullptr, problem != nullptr);
  } catch (const std::bad_alloc&) {
    std::fputs("Ipminmax: out of memory\n", stderr);
  }
  if (problem != nullptr) choose_options_file(problem);
  return problem;
}

void FreeIpoptProblem(IpminmaxProblem problem) { IpminmaxFree(problem); }

int AddIpoptStrOption(IpminmaxProblem problem, char* keyword, char* val) {
  return report(problem, IpminmaxAddStrOption(problem, keyword, val));
}

int AddIpoptNumOption(IpminmaxProblem problem, char* keyword, double val) {
  return report(problem, IpminmaxAddNumOption(problem, keyword, val));
}

int AddIpoptIntOption(IpminmaxProblem problem, char* keyword, int val) {
  return report(problem, IpminmaxAddIntOption(problem, keyword, val));
}

int OpenIpoptOutputFile(IpminmaxProblem problem, char* file_name, int print_level) {
  return report(problem, IpminmaxOpenOutputFile(problem, file_name, print_level));
}

int SetIpoptProblemScaling(IpminmaxProblem problem, double obj_scaling, double* x_scaling,
                           double* g_scaling) {
  return report(problem, IpminmaxSetScaling(problem, obj_scaling, x_scaling, g_scaling));
}

int SetIntermediateCallback(IpminmaxProblem problem, IpminmaxIntermediate_CB intermediate_cb) {
  return report(problem, IpminmaxSetIntermediateCallback(problem, intermediate_cb));
}

IpminmaxReturnStatus IpoptSolve(IpminmaxProblem problem, double* x, double* g, double* obj_val,
                                double* mult_g, double* mult_x_L, double* mult_x_U,
                                void* user_data) {
  return IpminmaxSolve(problem, x, g, obj_val, mult_g, mult_x_L, mult_x_U, user_data);
}

int GetIpoptCurrentIterate(IpminmaxProblem problem, bool scaled, int n, double* x, double* z_L,
                           double* z_U, int m, double* g, double* lambda) {
  return scaled ? ipminmax::get_current_iterate(true, n, x, z_L, z_U, m, g, lambda)
                : IpminmaxGetCurrentIterate(problem, n, x, z_L, z_U, m, g, lambda);
}

int GetIpoptCurrentViolations(IpminmaxProblem problem, bool scaled, int n, double* x_L_violation,
                              double* x_U_violation, double* compl_x_L, double* compl_x_U,
                              double* grad_lag_x, int m, double* nlp_constraint_violation,
                              double* compl_g) {
  if (scaled) {
    return ipminmax::get_current_violations(true, n, x_L_violation, x_U_violation, compl_x_L,
                                            compl_x_U, grad_lag_x, m, nlp_constraint_violation,
                                            compl_g);
  }
  return IpminmaxGetCurrentViolations(problem, n, x_L_violation, x_U_violation, compl_x_L,
                                      compl_x_U, grad_lag_x, m, nlp_constraint_violation, compl_g);
}

/// Of the interface: it is that of Ipopt 3.14.
void GetIpoptVersion(int* major, int* minor, int* release) {
  if (major != nullptr) *major = 3;
  if (minor != nullptr) *minor = 14;
  if (release != nullptr) *release = 0;
}

}  // extern "C"
